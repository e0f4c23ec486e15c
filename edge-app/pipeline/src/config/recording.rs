//! Sections `[bus]`, `[signals]` and `[measurement]`: how records come. A file of static tests alone has none of them.

use std::path::Path;

use super::Accelerometer;
use super::sections::{BusSection, MeasurementSection, SignalsSection};
use crate::input::BadInput;
use crate::model::Model;
use crate::record::{BINS, SAMPLES};
use crate::signals::SignalTable;
use crate::text::count;

/// Shortest and longest record, samples.
const RECORD_SAMPLES: [usize; 2] = [256, SAMPLES];
/// Fewest and most bins that a fit takes.
const BAND_BINS: [usize; 2] = [8, BINS];
/// Highest sampling rate that is accepted, Hz. No force sensor is read faster.
const HIGHEST_RATE_HZ: f64 = 1e6;
/// Default duration of a record, s. The number of samples is rounded to a power of two.
const RECORD_SECONDS: f64 = 4.096;

/// The three sections, as far as the file has them.
pub(super) struct Sections {
    pub(super) bus: Option<BusSection>,
    pub(super) signals: Option<SignalsSection>,
    pub(super) measurement: Option<MeasurementSection>,
}

/// How records come. The fields are those of [`Config`](super::Config).
pub(super) struct Recording {
    pub(super) interface: String,
    pub(super) signals: SignalTable,
    pub(super) rate_hz: f64,
    pub(super) band_hz: [f64; 2],
    pub(super) accelerometer: Accelerometer,
    pub(super) record_samples: usize,
}

impl Recording {
    /// Checks the sections of the file `file`. Returns `None` if it has none of them.
    pub(super) fn new(
        file: &Path,
        sections: Sections,
        model: &Model,
        model_file: &Path,
    ) -> Result<Option<Self>, BadInput> {
        let bad = |message: String| BadInput::new(file, message);
        let Sections { bus, signals, measurement } = sections;
        let (bus, signals, measurement) = match (bus, signals, measurement) {
            (Some(bus), Some(signals), Some(measurement)) => (bus, signals, measurement),
            (None, None, None) => return Ok(None),
            (bus, signals, measurement) => {
                let is_there = [bus.is_some(), signals.is_some(), measurement.is_some()];
                return Err(bad(missing(is_there)));
            }
        };
        check_rate(measurement.rate_hz).map_err(bad)?;
        check_band(&measurement).map_err(bad)?;
        let interface = interface(&bus.interface).map_err(bad)?;
        let record_samples = record_samples(&measurement).map_err(bad)?;
        let driven = model.driven().count();
        if signals.joints.len() != driven {
            return Err(bad(format!(
                "[signals] joints names {}, but {} has {}: name one signal per driven joint, base first",
                count(signals.joints.len() as u64, "signal"),
                model_file.display(),
                count(driven as u64, "driven joint"),
            )));
        }
        let base = file.parent().unwrap_or(Path::new(""));
        Ok(Some(Self {
            interface,
            signals: SignalTable::load(file, &base.join(&bus.dbc), &signals, model)?,
            rate_hz: measurement.rate_hz,
            band_hz: measurement.band_hz,
            accelerometer: measurement.accelerometer,
            record_samples,
        }))
    }

    /// The values of a file of static tests alone: no record comes, and no number here has an effect.
    pub(super) fn none() -> Self {
        Self {
            interface: String::new(),
            signals: SignalTable::none(),
            rate_hz: 2000.0,
            band_hz: [2.0, 200.0],
            accelerometer: Accelerometer::Strapdown,
            record_samples: RECORD_SAMPLES[0],
        }
    }
}

/// Names the sections that are not there.
pub(super) fn missing(is_there: [bool; 3]) -> String {
    let names = ["[bus]", "[signals]", "[measurement]"].iter().zip(is_there);
    let missing: Vec<&str> = names.filter(|(_, there)| !there).map(|(name, _)| *name).collect();
    let is = if missing.len() == 1 { "is" } else { "are" };
    format!(
        "{} {is} missing: add what host-tools/scenario/edge.toml has there; a file of static tests alone has none of the three, and is \
         for `flexid identify` without a log",
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

fn check_band(measurement: &MeasurementSection) -> Result<(), String> {
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

fn record_samples(measurement: &MeasurementSection) -> Result<usize, String> {
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
