//! Sections `[bus]`, `[signals]`, `[recording]` and `[measurement]`: how records come. A file for tables has no `[bus]`. A file of static tests
//! alone has none of them.

use std::path::{Path, PathBuf};

use flexid_core::sensors::Accelerometer;

use super::sections::{BusSection, ForceAxes, MeasurementSection, SignalsSection, TopicsSection};
use crate::columns;
use crate::input::BadInput;
use crate::model::Model;
use crate::poses::{self, DIRECTIONS, Poses};
use crate::record::{BINS, SAMPLES};
use crate::signals::SignalTable;
use crate::source::Topics;
use crate::text::count;

/// Shortest and longest record, samples.
const RECORD_SAMPLES: [usize; 2] = [256, SAMPLES];
/// Fewest and most bins that a fit takes.
const BAND_BINS: [usize; 2] = [8, BINS];
/// Highest sampling rate that is accepted, Hz. No force sensor is read faster.
const HIGHEST_RATE_HZ: f64 = 1e6;
/// Default duration of a record, s. The number of samples is rounded to a power of two.
const RECORD_SECONDS: f64 = 4.096;

/// The sections, as far as the file has them.
pub(super) struct Sections {
    pub(super) bus: Option<BusSection>,
    pub(super) signals: Option<SignalsSection>,
    pub(super) topics: Option<TopicsSection>,
    pub(super) measurement: Option<MeasurementSection>,
    /// File of the poses of tables.
    pub(super) poses: Option<PathBuf>,
    /// Whether there are modal tests, which need no signals.
    pub(super) has_receptances: bool,
}

/// Where the records of a config come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Use {
    /// From a bus: the daemon and the simulator need one.
    Bus,
    /// From recordings. Tables need no bus.
    Recordings,
    /// From recordings, or from nowhere: static tests suffice.
    Statics,
}

/// How records come. The fields are those of [`Config`](super::Config).
pub(super) struct Recording {
    pub(super) interface: String,
    pub(super) signals: SignalTable,
    pub(super) poses: Option<Poses>,
    pub(super) topics: Option<Topics>,
    pub(super) force_axes: ForceAxes,
    pub(super) rate_hz: f64,
    pub(super) states_rate: bool,
    pub(super) band_hz: [f64; 2],
    pub(super) accelerometer: Accelerometer,
    pub(super) record_samples: usize,
    pub(super) states_record_samples: bool,
}

impl Recording {
    /// Checks the sections of the file `file`. Returns `None` if it has none of them.
    pub(super) fn new(
        file: &Path,
        sections: Sections,
        model: &Model,
        model_file: &Path,
        purpose: Use,
    ) -> Result<Option<Self>, BadInput> {
        let bad = |message: String| BadInput::new(file, message);
        let Sections { bus, signals, topics, measurement, poses, has_receptances } = sections;
        let signals = signals.or_else(|| topics.as_ref().map(|_| SignalsSection::default()));
        let (signals, measurement) = match (signals, measurement) {
            (Some(signals), Some(measurement)) if bus.is_some() || purpose != Use::Bus => {
                (signals, measurement)
            }
            (None, None) if bus.is_none() => return Ok(None),
            (None, Some(measurement))
                if has_receptances && bus.is_none() && purpose != Use::Bus =>
            {
                let MeasurementSection { band_hz, accelerometer, .. } = measurement;
                check_band(band_hz).map_err(bad)?;
                return Ok(Some(Self { band_hz, accelerometer, ..Self::none() }));
            }
            (signals, measurement) => {
                let is_there = [bus.is_some(), signals.is_some(), measurement.is_some()];
                return Err(bad(missing(is_there, purpose)));
            }
        };
        let stated = measurement.record_samples;
        check_band(measurement.band_hz).map_err(bad)?;
        let (rate_hz, record_samples) = match measurement.rate_hz {
            Some(rate_hz) => (rate_hz, at_rate(rate_hz, measurement.band_hz, stated).map_err(bad)?),
            None if bus.is_some() => {
                return Err(bad("[measurement] key `rate_hz` (in Hz) is missing".into()));
            }
            // The table states the rate: no number here has an effect.
            None => (10.0 * measurement.band_hz[1], RECORD_SAMPLES[0]),
        };
        let base = file.parent().unwrap_or(Path::new(""));
        let poses = poses.map(|poses| poses::load(&base.join(poses), model)).transpose()?;
        let force_axes = signals.force_axes;
        if bus.is_some() && force_axes == ForceAxes::Base {
            return Err(bad("[signals] force_axes is \"base\": frames of [bus] have the force along the axes of the TCP".into()));
        }
        let topics = topics.map(|TopicsSection { wrench, acceleration, joints }| Topics {
            wrench,
            acceleration,
            joints,
        });
        let angles =
            Angles { has_bus: bus.is_some(), has_poses: poses.is_some(), topics: topics.as_ref() };
        check_joints(&signals, &angles, model, model_file).map_err(bad)?;
        let by_topic = topics.is_some() && bus.is_none();
        check_axes(&signals, bus.is_some(), by_topic, poses.as_ref()).map_err(bad)?;
        if bus.is_none() && signals.clocks.is_some() {
            return Err(bad(
                "[signals] clocks is for a [bus]: a row of a table is one instant of both sensors, and the stamps of a bag show its clocks: \
                 leave it out"
                    .to_owned(),
            ));
        }
        let (interface, signals) = match bus {
            Some(bus) => (
                interface(&bus.interface).map_err(bad)?,
                SignalTable::load(file, &base.join(&bus.dbc), &signals, model)?,
            ),
            None => (String::new(), of_columns(&signals, topics.as_ref(), model)),
        };
        Ok(Some(Self {
            interface,
            signals,
            poses,
            topics,
            force_axes,
            rate_hz,
            states_rate: measurement.rate_hz.is_some(),
            band_hz: measurement.band_hz,
            accelerometer: measurement.accelerometer,
            record_samples,
            states_record_samples: stated.is_some(),
        }))
    }

    /// The values of a file of static or modal tests alone: no record comes, and no number here has an effect but the band of the latter.
    pub(super) fn none() -> Self {
        Self {
            interface: String::new(),
            signals: SignalTable::none(),
            poses: None,
            topics: None,
            force_axes: ForceAxes::Tcp,
            rate_hz: 2000.0,
            states_rate: false,
            band_hz: [2.0, 200.0],
            accelerometer: Accelerometer::Strapdown,
            record_samples: RECORD_SAMPLES[0],
            states_record_samples: false,
        }
    }
}

/// Where the angles of the joints may stand.
struct Angles<'a> {
    has_bus: bool,
    has_poses: bool,
    topics: Option<&'a Topics>,
}

/// Checks that the joints have a signal, a column or a topic, or that their angles stand in a file of poses.
fn check_joints(
    signals: &SignalsSection,
    angles: &Angles,
    model: &Model,
    model_file: &Path,
) -> Result<(), String> {
    let (driven, of_model) = (model.driven().count(), model_file.display());
    let Angles { has_bus, has_poses, topics } = *angles;
    let topic = topics.and_then(|topics| topics.joints.as_ref());
    if topic.is_some() && has_poses {
        return Err(
            "[topics] joints and [recording] poses state the same angles: leave one out".to_owned()
        );
    }
    if topics.is_some() && topic.is_none() && !has_poses && !has_bus && signals.joints.is_none() {
        return Err("[topics] joints is missing: name the topic of the joints, or a file of poses in [recording] poses".to_owned());
    }
    match &signals.joints {
        Some(_) if has_poses && !has_bus => {
            Err("[signals] joints and [recording] poses state the same angles: leave one out"
                .to_owned())
        }
        Some(joints) if joints.len() != driven => Err(format!(
            "[signals] joints names {}, but {of_model} has {}: name one signal per driven joint, base first",
            count(joints.len() as u64, "signal"),
            count(driven as u64, "driven joint"),
        )),
        None if has_bus || !(has_poses || topic.is_some()) => Err(format!(
            "[signals] joints is missing: name the {} of the angle of each driven joint, base first{}",
            if has_bus { "signal" } else { "column" },
            if has_bus { "" } else { ", or a file of poses in [recording] poses" },
        )),
        _ => Ok(()),
    }
}

/// Checks which axes of force and acceleration have a name, and which of them a direction. Where topics name them, none needs a name.
fn check_axes(
    signals: &SignalsSection,
    has_bus: bool,
    by_topic: bool,
    poses: Option<&Poses>,
) -> Result<(), String> {
    for (sensor, axes) in [&signals.force, &signals.acceleration].into_iter().enumerate() {
        let (key, names) = (DIRECTIONS[sensor], &axes.names);
        if axes.channels.is_some() {
            if !has_bus {
                return Err(format!(
                    "[signals] {key} has channels with a matrix, which frames of a [bus] have: name the columns of three axes"
                ));
            }
            continue;
        }
        let named = names.iter().filter(|name| !name.is_empty());
        let is_single = named.clone().count() == 3 && names.iter().all(|name| *name == names[0]);
        let has_directions = poses.is_some_and(|poses| poses.have_directions[sensor]);
        let is_whole = named.clone().count() == 3 && !is_single;
        if by_topic && (has_directions || (named.clone().count() > 0 && !is_whole)) {
            return Err(format!(
                "[topics] names a sensor of three axes, and {key} is that of one channel: write the bag as a table, or leave one out"
            ));
        }
        if by_topic && named.clone().count() == 0 {
            continue;
        }
        let is_twice = |own: &&String| names.iter().filter(|other| other == own).count() > 1;
        if let Some(twice) = named.clone().find(is_twice).filter(|_| !is_single) {
            return Err(format!("[signals] {key} names {twice:?} twice: name each axis once"));
        }
        if named.count() == 0 {
            return Err(format!("[signals] {key} names nothing: name an axis that is measured"));
        }
        if has_bus && !is_whole {
            return Err(format!(
                "[signals] {key} must name three signals of [bus] dbc: only a table may have fewer axes"
            ));
        }
        if signals.force_axes == ForceAxes::Base && sensor == 0 && !is_whole {
            return Err("[signals] force_axes is \"base\", and force has fewer than three axes: leave one out".into());
        }
        if is_single && !has_directions {
            return Err(format!(
                "[signals] {key} is the channel {:?} alone: name the file in [recording] poses whose column {key} states its direction (x, -z) in each cut, \
                 or write [\"\", \"\", {:?}] where it is always along z",
                names[0], names[0]
            ));
        }
        if has_directions && !is_single {
            return Err(format!(
                "[recording] poses has a column {key}, and [signals] {key} names axes: leave one out"
            ));
        }
    }
    Ok(())
}

/// Makes the table of columns. Those of a bag are called by their topics, its joints as those of the model, and the angles of a file of poses as its
/// columns.
fn of_columns(names: &SignalsSection, topics: Option<&Topics>, model: &Model) -> SignalTable {
    let own = |names: &[String; 3], topic: Option<&String>| match topic {
        Some(topic) if names.iter().all(String::is_empty) => {
            ["x", "y", "z"].map(|axis| format!("{topic} {axis}"))
        }
        _ => names.clone(),
    };
    let force = own(&names.force.names, topics.map(|topics| &topics.wrench));
    let acceleration = own(&names.acceleration.names, topics.map(|topics| &topics.acceleration));
    let mut axes = force.into_iter().chain(acceleration);
    let axes = std::array::from_fn(|_| axes.next().unwrap_or_default());
    let joints = names.joints.clone().unwrap_or_else(|| {
        match topics.and_then(|topics| topics.joints.as_ref()) {
            Some(_) => model.driven().map(|joint| joint.name.clone()).collect(),
            None => columns::angle_names(model).collect(),
        }
    });
    SignalTable::of_columns(axes, joints)
}

/// Checks rate and band of a record, and returns its length, samples: the one that is stated, or the power of two that is nearest to the
/// default duration.
pub(super) fn at_rate(
    rate_hz: f64,
    band_hz: [f64; 2],
    stated: Option<usize>,
) -> Result<usize, String> {
    check_rate(rate_hz)?;
    let [_, upper] = band_hz;
    let nyquist = rate_hz / 2.0;
    if upper >= nyquist {
        return Err(format!(
            "[measurement] band_hz ends at {upper} Hz: must stay below {nyquist} Hz, half of rate_hz"
        ));
    }
    record_samples(rate_hz, band_hz, stated)
}

/// Names the sections that are not there.
pub(super) fn missing(is_there: [bool; 3], purpose: Use) -> String {
    let names = ["[bus]", "[signals]", "[measurement]"].iter().zip(is_there);
    let missing: Vec<&str> = names
        .filter(|(name, there)| !there && (purpose == Use::Bus || **name != "[bus]"))
        .map(|(name, _)| *name)
        .collect();
    let is = if missing.len() == 1 { "is" } else { "are" };
    format!(
        "{} {is} missing: add what host-tools/scenario/edge.toml has there; a file for tables (CSV, LVM) has no [bus], and is for \
         `flexid identify`, `check` and `plan`; a file of static tests alone has none of the three, and is for `flexid identify` without a log",
        missing.join(", ")
    )
}

fn check_rate(rate_hz: f64) -> Result<(), String> {
    positive("[measurement] rate_hz", rate_hz)?;
    if rate_hz > HIGHEST_RATE_HZ {
        return Err(format!(
            "[measurement] rate_hz is {rate_hz:e}: must be at most {HIGHEST_RATE_HZ}"
        ));
    }
    Ok(())
}

fn positive(place: &str, value: f64) -> Result<(), String> {
    if value > 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(format!("{place} is {value}: must be positive"))
    }
}

fn check_band([lower, upper]: [f64; 2]) -> Result<(), String> {
    positive("[measurement] band_hz[0]", lower)?;
    positive("[measurement] band_hz[1]", upper)?;
    if lower >= upper {
        return Err(format!(
            "[measurement] band_hz is [{lower}, {upper}]: the lower edge must be below the upper"
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

fn record_samples(rate_hz: f64, band_hz: [f64; 2], stated: Option<usize>) -> Result<usize, String> {
    let [least, most] = RECORD_SAMPLES;
    let samples = stated.unwrap_or_else(|| {
        let exponent = (RECORD_SECONDS * rate_hz).log2().round();
        (exponent.exp2() as usize).clamp(least, most)
    });
    if !samples.is_power_of_two() || !(least..=most).contains(&samples) {
        return Err(format!(
            "[measurement] record_samples is {samples}: must be a power of two from {least} to {most}"
        ));
    }
    let per_hz = samples as f64 / rate_hz;
    let [lower, upper] = band_hz.map(|edge| edge * per_hz);
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
