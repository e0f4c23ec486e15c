//! Reads `EDGE.toml`, checks it, and converts it into the form that the other modules use.

mod accuracy;
mod bounds;
mod fingerprint;
mod history;
mod listen;
mod mounting;
mod parameter;
mod receptance;
mod recording;
mod sections;
mod sought;
mod stated;

use std::path::{Path, PathBuf};

use flexid_core::MAX_JOINTS;
use flexid_core::imperfection::{Accuracies, Imperfection};
use flexid_core::mounting::Mounting;
use flexid_core::parameters::Bounds;
use flexid_core::sought::{Coordinate, Sought};
use flexid_core::spectrum::Measurement;
use flexid_core::stream::{AngleSignal, StreamConfig};
use flexid_wire::text::{FileName, clipped};

use crate::clocks::{self, FoundClocks};
use crate::input::{self, BadInput};
use crate::model::{Kind, Model};
use crate::poses::Poses;
use crate::receptance::{self as receptances, Receptance};
use crate::signals::{Clocks, FINEST, SignalTable};
use crate::source::{Layout, Shown, Topics};
use crate::statics::{self, StaticTests};
use crate::text::printable;

pub use flexid_core::sensors::Accelerometer;

pub use accuracy::loose;
pub use bounds::BoundsSection;
pub use fingerprint::{Fingerprint, Validity};
pub use history::{Epoch, History};
pub use listen::{Listen, ListenError, SocketAccess};
use recording::{Recording, Sections, Use};
pub use sections::{Axes, ChannelsSection, ClocksKey, ForceAxes, SignalsSection};
use stated::Assumed;

/// Checked configuration of the daemon, the simulator and the offline tool.
#[derive(Clone, Debug)]
pub struct Config {
    /// File from which the config was read.
    pub file: PathBuf,
    /// Files that it names and that were read with it: model, DBC file, poses, static tests, modal tests.
    pub named_files: Vec<PathBuf>,
    /// Model of the robot.
    pub model: Model,
    /// Gravity in base axes, m/s².
    pub gravity: [f64; 3],
    /// Bounds of the parameters.
    pub bounds: Bounds,
    /// Quantities that are sought: parameters that are not fixed, and imperfections.
    pub sought: Sought,
    /// Standard deviations of what may be off.
    pub accuracies: Accuracies,
    /// True if those that the file does not state are taken as perfect, not as typical.
    pub assumes_perfect: bool,
    /// True if an estimate adopts what explains the records. The file does not say.
    pub adopts_explanations: bool,
    /// Name of the CAN interface. Empty if the file has no `[bus]`: records come from tables.
    pub interface: String,
    /// Table that converts frames to readings and back, or the names of the columns of tables.
    pub signals: SignalTable,
    /// Joint angles of each table. `None` if they are columns of it.
    pub poses: Option<Poses>,
    /// Topics of bags. `None` if the file names none.
    pub topics: Option<Topics>,
    /// Axes along which tables have the force.
    pub force_axes: ForceAxes,
    /// Sampling rate of force and acceleration, Hz.
    pub rate_hz: f64,
    /// True if the file states the rate. If it does not, the column of time of a table does, and [`Config::of_tables`] takes it.
    pub knows_rate: bool,
    /// Lower and upper edge of the band that is fitted, Hz.
    pub band_hz: [f64; 2],
    /// Kind of accelerometer.
    pub accelerometer: Accelerometer,
    /// Mounting of the sensors.
    pub mounting: Mounting,
    /// Number of samples of a record, a power of two.
    pub record_samples: usize,
    /// True if the file states that number. If it does not, it follows from the rate.
    pub states_record_samples: bool,
    /// Static tests that the fit uses beside the records. Empty without static tests.
    pub statics: StaticTests,
    /// Measured receptances that the fit uses beside the records. Empty without modal tests.
    pub receptances: Vec<Receptance>,
    /// Addresses on which clients are served.
    pub listen: Vec<Listen>,
    /// Access to the Unix sockets among these addresses.
    pub socket_access: SocketAccess,
    /// File in which the daemon keeps its state. `None` if `[state]` is left out.
    pub state: Option<PathBuf>,
    /// Epochs of the daemon. `None` if `[history]` is left out: all of life is one.
    pub history: Option<History>,
    /// Seed of the random search. The same seed and the same frames give the same report.
    pub seed: u64,
    /// File with truth, forces and noise of the simulated robot. The daemon does not read it.
    pub scenario: Option<PathBuf>,
}

impl Config {
    /// Reads `EDGE.toml` and the model, DBC and static test files that it names, and checks everything.
    ///
    /// # Errors
    /// The error is one line that names the file, the place and the correction.
    pub fn load(file: &Path) -> Result<Self, BadInput> {
        Self::parse(file, &input::read_regular(file)?)
    }

    /// [`Config::load`], to read a bus as it speaks.
    ///
    /// # Errors
    /// The errors are those of [`Config::load`], and that force and acceleration share no counter: their clocks are told at the end of a recording.
    pub fn load_live(file: &Path) -> Result<Self, BadInput> {
        let config = Self::load(file)?;
        match config.own_clocks() {
            None => Ok(config),
            Some(_) => Err(BadInput::new(
                file,
                "[signals] names no counter that counts the instants of both sensors, and a daemon needs one: record the bus with `candump -L`, and identify from the log",
            )),
        }
    }

    /// [`Config::load`], to read recordings. A file for tables may leave out `[bus]`, and the rate where they have a column of time.
    ///
    /// # Errors
    /// The errors are those of [`Config::load`].
    pub fn load_recorded(file: &Path) -> Result<Self, BadInput> {
        Self::read(file, &input::read_regular(file)?, Use::Recordings)
    }

    /// [`Config::load_recorded`], to fit the static or modal tests that the file names. If it names some, it may leave out `[bus]`, `[signals]`
    /// and, with static tests alone, `[measurement]`: then the config has no signals, and no record can be taken with it.
    ///
    /// # Errors
    /// The errors are those of [`Config::load`].
    pub fn load_statics(file: &Path) -> Result<Self, BadInput> {
        Self::read(file, &input::read_regular(file)?, Use::Statics)
    }

    /// The file itself, and those that it names and that were read with it: model, DBC file, poses, static tests, modal tests.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        std::iter::once(&self.file).chain(&self.named_files).map(PathBuf::as_path)
    }

    /// Parses `text`, the content of the config file `file`. The files that it names are read from disk.
    ///
    /// # Errors
    /// The errors are those of [`Config::load`].
    pub fn parse(file: &Path, text: &str) -> Result<Self, BadInput> {
        Self::read(file, text, Use::Bus)
    }

    /// [`Config::parse`] for a purpose.
    fn read(file: &Path, text: &str, purpose: Use) -> Result<Self, BadInput> {
        let raw: sections::File = input::parse_toml(file, text)?;
        let base = file.parent().unwrap_or(Path::new(""));
        let bad = |message: String| BadInput::new(file, message);

        let gravity = raw.model.gravity_m_per_s2;
        if !gravity.iter().all(|g| g.is_finite()) {
            return Err(bad("[model] gravity_m_per_s2 has a number that is not finite".into()));
        }
        let listen = listen(&raw.server.listen, base).map_err(bad)?;
        let socket_access =
            SocketAccess::new(raw.server.socket_mode, raw.server.socket_group).map_err(bad)?;

        let history = raw.history.as_ref().map(|section| history::history(section, base));
        let history = history.transpose().map_err(bad)?;

        let model_file = base.join(&raw.model.file);
        let dbc_file = raw.bus.as_ref().map(|bus| base.join(&bus.dbc));
        let poses_file = raw.recording.poses.as_ref().map(|poses| base.join(poses));
        let statics_file = raw.statics.as_ref().map(|section| base.join(&section.file));
        let list = raw.receptance.as_ref().map(|section| base.join(&section.file));
        let named_files = [
            ("[model] file", Some(model_file.clone())),
            ("[bus] dbc", dbc_file),
            ("[recording] poses", poses_file),
            ("[static] file", statics_file),
            ("[receptance] file", list.clone()),
        ];
        let named_files = named_files.into_iter().filter_map(|(key, named)| Some((key, named?)));
        let is_missing = |named: &PathBuf| matches!(named.try_exists(), Ok(false));
        if let Some((key, missing)) = named_files.clone().find(|(_, named)| is_missing(named)) {
            let missing = missing.display();
            return Err(bad(format!(
                "{key}: {missing} cannot be read: it does not exist; a path begins where this file lies, or with /"
            )));
        }
        let model = Model::load(&model_file)?;
        let sections = Sections {
            bus: raw.bus,
            signals: raw.signals,
            topics: raw.topics,
            measurement: raw.measurement,
            poses: raw.recording.poses,
            has_receptances: raw.receptance.is_some(),
        };
        let recording = match Recording::new(file, sections, &model, &model_file, purpose)? {
            Some(recording) => recording,
            None if raw.receptance.is_some() && purpose != Use::Bus => {
                return Err(bad("[measurement] band_hz is missing: state the band of the modal tests that is fitted, in Hz".into()));
            }
            None if purpose == Use::Statics && raw.statics.is_some() => Recording::none(),
            None => return Err(bad(recording::missing([false; 3], purpose))),
        };
        let bounds = raw.bounds.check(&model).map_err(bad)?;
        let sought = sought::sought(&raw.calibration, &raw.parameters, &model).map_err(bad)?;
        let angle_steps =
            (0..model.driven().count()).map(|joint| recording.signals.angle_step(joint));
        let angle_step = angle_steps.fold(0.0, f64::max);
        let accuracies = accuracy::accuracies(
            &raw.accuracy,
            &sought,
            model.accuracy.as_ref(),
            recording.band_hz,
            angle_step,
        )
        .map_err(bad)?;
        if recording.force_axes == ForceAxes::Base && raw.mounting.force_rpy_rad != [0.0; 3] {
            let message = "[signals] force_axes is \"base\", and [mounting] force_rpy_rad turns a sensor: leave one out";
            return Err(bad(message.into()));
        }
        let mounting = mounting::mounting(&raw.mounting, &model).map_err(bad)?;
        if recording.signals.has_part_of_force() && raw.mounting.force_rpy_rad != [0.0; 3] {
            let message = "[mounting] force_rpy_rad turns a dynamometer, and [signals] force is that of a hammer or a shaker, along axes of the TCP: leave it out";
            return Err(bad(message.into()));
        }
        if recording.signals.has_part_of_force() && mounting.tool_mass > 0.0 {
            let message = "[mounting] tool_mass_kg lies beyond a dynamometer, and [signals] force is that of a hammer or a shaker: leave it out";
            return Err(bad(message.into()));
        }
        let statics = match &raw.statics {
            Some(section) => statics::load(&base.join(&section.file), &model)?,
            None => StaticTests::default(),
        };

        let receptances = match (&raw.receptance, &list) {
            (Some(section), Some(list)) => {
                let settings = receptance::settings(section).map_err(bad)?;
                receptances::load(list, &model, &settings, recording.band_hz)?
            }
            _ => Vec::new(),
        };
        let mut named_files: Vec<PathBuf> = named_files.map(|(_, named)| named).collect();
        for own in &receptances {
            if !named_files.contains(&own.file) {
                named_files.push(own.file.clone());
            }
        }

        Ok(Self {
            file: file.to_path_buf(),
            named_files,
            model,
            gravity,
            bounds,
            sought,
            accuracies,
            assumes_perfect: raw.accuracy.assume == Assumed::Perfect,
            adopts_explanations: false,
            interface: recording.interface,
            signals: recording.signals,
            poses: recording.poses,
            topics: recording.topics,
            force_axes: recording.force_axes,
            rate_hz: recording.rate_hz,
            knows_rate: recording.states_rate,
            band_hz: recording.band_hz,
            accelerometer: recording.accelerometer,
            mounting,
            record_samples: recording.record_samples,
            states_record_samples: recording.states_record_samples,
            statics,
            receptances,
            listen,
            socket_access,
            state: raw.state.map(|state| base.join(state.file)),
            history,
            seed: raw.search.seed,
            scenario: raw.simulation.map(|simulation| base.join(simulation.scenario)),
        })
    }

    /// Returns what the columns of tables are called, and what their force is along.
    ///
    /// # Errors
    /// A checked config gives no error.
    pub fn layout(&self) -> Result<Layout, BadInput> {
        let base = (self.force_axes == ForceAxes::Base).then(|| self.model.chain());
        let base = base.transpose().map_err(|error| BadInput::new(&self.file, error))?;
        let joints = self.signals.joints.iter().zip(self.model.driven());
        let joints = joints.map(|(name, joint)| (name.clone(), joint.kind == Kind::Prismatic));
        Ok(Layout {
            axes: self.signals.axes.clone(),
            joints: if self.poses.is_some() { Vec::new() } else { joints.collect() },
            rate_hz: self.knows_rate.then_some(self.rate_hz),
            base,
            topics: self.topics.clone(),
        })
    }

    /// Returns the config with which tables are read: their columns take the place of frames, and the rate is theirs if the file states none.
    ///
    /// # Errors
    /// The rate does not fit the band, or neither a table nor the file states one.
    pub fn of_tables(&self, tables: &Shown) -> Result<Self, BadInput> {
        let bad = |message: String| BadInput::new(&self.file, message);
        let mut config = self.clone();
        let mut signals =
            SignalTable::of_columns(self.signals.axes.clone(), self.signals.joints.clone());
        let coarsest = |steps: &[f32]| steps.iter().copied().fold(FINEST, f32::max);
        signals.force_resolution = coarsest(&tables.steps[..3]);
        signals.acceleration_resolution = coarsest(&tables.steps[3..]);
        if tables.own_clocks {
            signals.clocks = Clocks::Own([None; 2]);
        }
        config.signals = signals;
        if !self.knows_rate {
            config.rate_hz = tables.rate_hz.ok_or_else(|| {
                bad("[measurement] rate_hz is missing, and no column of the table tells it: state it, or give the time of each row in a column \"time [s]\"".into())
            })?;
            let stated = self.states_record_samples.then_some(self.record_samples);
            config.record_samples =
                recording::at_rate(config.rate_hz, self.band_hz, stated).map_err(bad)?;
            config.knows_rate = true;
        }
        Ok(config)
    }

    /// Returns what is known beforehand of clocks that the sensors have of their own. `None` if one counter counts the instants of both.
    pub(crate) fn own_clocks(&self) -> Option<clocks::Expected> {
        let Clocks::Own(counter_bits) = self.signals.clocks else { return None };
        Some(clocks::Expected {
            counter_bits,
            rate_hz: self.rate_hz,
            highest_hz: self.band_hz[1],
            record_samples: self.record_samples,
            steps: [self.signals.force_resolution, self.signals.acceleration_resolution],
            axes: [self.mounting.force_axes, self.mounting.accelerometer_axes],
            seeks_delay: self.seeks_delay(),
        })
    }

    /// Returns the config whose accuracies are wide enough for what was told of the clocks.
    pub fn with_clocks(&self, found: &FoundClocks) -> Self {
        let typical =
            if self.assumes_perfect { Accuracies::default() } else { Accuracies::typical() };
        let accuracies = found.widen(&self.accuracies, &typical, self.seeks_delay());
        Self { accuracies, ..self.clone() }
    }

    fn seeks_delay(&self) -> bool {
        self.sought.unknown(Coordinate::Imperfection(Imperfection::Delay)).is_some()
    }

    /// Returns band, gravity, accelerometer and mounting, from which core makes experiments of records.
    pub fn measurement(&self) -> Measurement {
        Measurement {
            band_hz: self.band_hz,
            gravity: self.gravity,
            accelerometer: self.accelerometer,
            mounting: self.mounting,
        }
    }

    /// Returns the file's name without its folder.
    pub(crate) fn file_name(&self) -> FileName {
        let name = self.file.file_name().map_or(&*self.file, Path::new);
        clipped(printable(&name.display().to_string()))
    }

    /// Returns the settings of the stream.
    pub fn stream(&self) -> StreamConfig {
        let mut angles = [AngleSignal::FINE; MAX_JOINTS];
        for (index, (joint, angle)) in self.model.driven().zip(&mut angles).enumerate() {
            let resolution = self.signals.angle_step(index);
            *angle = AngleSignal { resolution, turns: joint.kind == Kind::Revolute };
        }
        StreamConfig {
            rate_hz: self.rate_hz,
            record_samples: self.record_samples,
            joints: self.model.driven().count(),
            // Readings of sensors with clocks of their own get common counters of 32 bits.
            counter_bits: if self.own_clocks().is_some() { 32 } else { self.signals.counter_bits },
            force_resolution: self.signals.force_resolution,
            acceleration_resolution: self.signals.acceleration_resolution,
            angles,
        }
    }
}

fn listen(addresses: &[String], base: &Path) -> Result<Vec<Listen>, String> {
    let mut listen = Vec::new();
    for text in addresses {
        let address =
            Listen::parse(text, base).map_err(|error| format!("[server] listen: {error}"))?;
        if listen.contains(&address) {
            return Err(format!("[server] listen has {text:?} twice: name each address once"));
        }
        listen.push(address);
    }
    Ok(listen)
}
