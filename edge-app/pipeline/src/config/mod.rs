//! Reads `EDGE.toml`, checks it, and converts it into the form that the other modules use.

mod accuracy;
mod bounds;
mod fingerprint;
mod listen;
mod mounting;
mod sections;
mod sought;

use std::path::{Path, PathBuf};

use flexid_core::imperfection::Accuracies;
use flexid_core::mounting::Mounting;
use flexid_core::parameters::Bounds;
use flexid_core::sought::Sought;
use flexid_core::spectrum::Measurement;
use flexid_core::statics::StaticTest;
use flexid_core::stream::StreamConfig;
use flexid_wire::text::{FileName, clipped};

use crate::input::{self, BadInput};
use crate::model::Model;
use crate::record::{BINS, SAMPLES};
use crate::signals::SignalTable;
use crate::statics;
use crate::text::count;
use crate::text::printable;

pub use flexid_core::sensors::Accelerometer;

pub use bounds::BoundsSection;
use bounds::CONCEIVABLE;
pub use fingerprint::{Fingerprint, Validity};
pub use listen::{Listen, ListenError, SocketAccess};
pub use sections::SignalsSection;

/// Shortest and longest record, samples.
const RECORD_SAMPLES: [usize; 2] = [256, SAMPLES];
/// Fewest and most bins that a fit takes.
const BAND_BINS: [usize; 2] = [8, BINS];
/// Highest sampling rate that is accepted, Hz. No force sensor is read faster.
const HIGHEST_RATE_HZ: f64 = 1e6;
/// Default duration of a record, s. The number of samples is rounded to a power of two.
const RECORD_SECONDS: f64 = 4.096;

/// Checked configuration of the daemon, the simulator and the offline tool.
#[derive(Clone, Debug)]
pub struct Config {
    /// File from which the config was read.
    pub file: PathBuf,
    /// Model of the robot.
    pub model: Model,
    /// Gravity in base axes, m/s².
    pub gravity: [f64; 3],
    /// Bounds of the parameters.
    pub bounds: Bounds,
    /// What is sought: parameters that are not fixed, and nuisances.
    pub sought: Sought,
    /// Standard deviations of what may be off.
    pub accuracies: Accuracies,
    /// Name of the CAN interface.
    pub interface: String,
    /// Table that converts frames to readings and back.
    pub signals: SignalTable,
    /// Sampling rate of force and acceleration, Hz.
    pub rate_hz: f64,
    /// Lower and upper edge of the band that is fitted, Hz.
    pub band_hz: [f64; 2],
    /// Kind of accelerometer.
    pub accelerometer: Accelerometer,
    /// Mounting of the sensors.
    pub mounting: Mounting,
    /// Number of samples of a record, a power of two.
    pub record_samples: usize,
    /// Static tests that the fit uses beside the records. Empty without static tests.
    pub statics: Vec<StaticTest>,
    /// Addresses on which clients are served.
    pub listen: Vec<Listen>,
    /// Access to the Unix sockets among these addresses.
    pub socket_access: SocketAccess,
    /// File in which the daemon keeps its state. `None` if `[state]` is left out.
    pub state: Option<PathBuf>,
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
        Self::parse(file, &input::read(file)?)
    }

    /// Parses `text`, the content of the config file `file`. The files that it names are read from disk.
    ///
    /// # Errors
    /// The errors are those of [`Config::load`].
    pub fn parse(file: &Path, text: &str) -> Result<Self, BadInput> {
        let raw: sections::File = input::parse_toml(file, text)?;
        let base = file.parent().unwrap_or(Path::new(""));
        let bad = |message: String| BadInput::new(file, message);

        let measurement = &raw.measurement;
        positive("[measurement] rate_hz", measurement.rate_hz).map_err(bad)?;
        if measurement.rate_hz > HIGHEST_RATE_HZ {
            let rate = measurement.rate_hz;
            let message =
                format!("[measurement] rate_hz is {rate:e}: must be at most {HIGHEST_RATE_HZ}");
            return Err(bad(message));
        }
        check_band(measurement).map_err(bad)?;
        let gravity = raw.model.gravity_m_per_s2;
        if !gravity.iter().all(|g| g.is_finite()) {
            return Err(bad("[model] gravity_m_per_s2 has a number that is not finite".into()));
        }
        let interface = interface(&raw.bus.interface).map_err(bad)?;
        let listen = listen(&raw.server.listen, base).map_err(bad)?;
        let socket_access =
            SocketAccess::new(raw.server.socket_mode, raw.server.socket_group).map_err(bad)?;
        let record_samples = record_samples(measurement).map_err(bad)?;

        let model_file = base.join(&raw.model.file);
        let model = Model::load(&model_file)?;
        if raw.signals.joints.len() != model.joints.len() {
            return Err(bad(format!(
                "[signals] joints names {}, but {} has {}: name one signal per joint, base first",
                count(raw.signals.joints.len() as u64, "signal"),
                model_file.display(),
                count(model.joints.len() as u64, "joint"),
            )));
        }
        let bounds = raw.bounds.check(&model).map_err(bad)?;
        let sought = sought::sought(&raw.calibration, &raw.parameters, &model).map_err(bad)?;
        let accuracies = accuracy::accuracies(&raw.accuracy, &raw.calibration, measurement.band_hz)
            .map_err(bad)?;
        let mounting = mounting::mounting(&raw.mounting, &model).map_err(bad)?;
        let signals = SignalTable::load(file, &base.join(&raw.bus.dbc), &raw.signals, &model)?;

        let statics = match &raw.statics {
            Some(section) => statics::load(&base.join(&section.file), &model)?,
            None => Vec::new(),
        };

        Ok(Self {
            file: file.to_path_buf(),
            model,
            gravity,
            bounds,
            sought,
            accuracies,
            interface,
            signals,
            rate_hz: measurement.rate_hz,
            band_hz: measurement.band_hz,
            accelerometer: measurement.accelerometer,
            mounting,
            record_samples,
            statics,
            listen,
            socket_access,
            state: raw.state.map(|state| base.join(state.file)),
            seed: raw.search.seed,
            scenario: raw.simulation.map(|simulation| base.join(simulation.scenario)),
        })
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
        StreamConfig {
            rate_hz: self.rate_hz,
            record_samples: self.record_samples,
            joints: self.model.joints.len(),
            counter_bits: self.signals.counter_bits,
            force_resolution: self.signals.force_resolution,
            acceleration_resolution: self.signals.acceleration_resolution,
        }
    }
}

fn positive(place: &str, value: f64) -> Result<(), String> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(format!("{place} is {value}: must be positive"))
    }
}

fn check_band(measurement: &sections::MeasurementSection) -> Result<(), String> {
    let [lower, upper] = measurement.band_hz;
    positive("[measurement] band_hz[0]", lower)?;
    positive("[measurement] band_hz[1]", upper)?;
    let nyquist = measurement.rate_hz / 2.0;
    if lower >= upper {
        return Err(format!(
            "[measurement] band_hz is [{lower}, {upper}]: the lower edge must be below the upper"
        ));
    }
    if upper >= nyquist {
        return Err(format!(
            "[measurement] band_hz ends at {upper} Hz: must stay below {nyquist} Hz, half of rate_hz"
        ));
    }
    Ok(())
}

fn interface(name: &str) -> Result<String, String> {
    // The kernel limits the name to IFNAMSIZ, which is 16 with the closing zero.
    let fits = (1..=15).contains(&name.len())
        && !name.contains(|c: char| c == '/' || c.is_whitespace() || c.is_control());
    if fits {
        Ok(name.to_string())
    } else {
        Err(format!("[bus] interface is {name:?}: no interface has such a name; try \"can0\""))
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

fn record_samples(measurement: &sections::MeasurementSection) -> Result<usize, String> {
    let [least, most] = RECORD_SAMPLES;
    let samples = measurement.record_samples.unwrap_or_else(|| {
        let exponent = (RECORD_SECONDS * measurement.rate_hz).log2().round();
        (exponent.exp2() as usize).clamp(least, most)
    });
    if !samples.is_power_of_two() || !(least..=most).contains(&samples) {
        return Err(format!(
            "[measurement] record_samples is {samples}: must be a power of two from {least} to {most}"
        ));
    }
    let per_hz = samples as f64 / measurement.rate_hz;
    let [lower, upper] = measurement.band_hz.map(|edge| edge * per_hz);
    let bins = (upper.floor() - lower.ceil() + 1.0).max(0.0) as usize;
    let [fewest, most] = BAND_BINS;
    if !(fewest..=most).contains(&bins) {
        let mend =
            if bins < fewest { "widen the band or raise" } else { "narrow the band or lower" };
        return Err(format!(
            "[measurement] band_hz holds {bins} bins of a record of {samples} samples, {fewest} to {most} \
             can be fitted: {mend} record_samples"
        ));
    }
    Ok(samples)
}
