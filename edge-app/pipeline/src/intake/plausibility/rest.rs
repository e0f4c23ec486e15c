//! Checks the reading of an accelerometer at rest: its mean over a record, in which the robot stays where it is.

use flexid_core::sensors::Accelerometer;
use flexid_wire::implausible::{AccelerationUnit, GravityDenial, Implausible};

use crate::config::Config;
use crate::{Record, SAMPLES};

/// Standard gravity, m/s².
const GRAVITY: f64 = 9.806_65;
/// Relative tolerance for a reading of gravity. Accelerometers are adjusted to some hundredths of g.
const OFF: f64 = 0.05;
/// Shortest record whose mean is the reading at rest, s. A tool that vibrates at 0.02 m/s changes the mean over T by
/// 0.04 m/s / T. This is less than `OFF` of the smallest reading of gravity that is recognised, 1.
const SHORTEST_S: f64 = 1.0;
/// Readings of gravity in other units than m/s².
const UNITS: [(f64, AccelerationUnit); 3] = [
    (1.0, AccelerationUnit::G),
    (1000.0, AccelerationUnit::MilliG),
    (1000.0 * GRAVITY, AccelerationUnit::MillimetrePerS2),
];

/// Reading of a strapdown accelerometer at rest, where gravity acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AtRest {
    /// Gravity, to 5 %.
    Gravity,
    /// Hardly anything, less than 5 % of gravity: the sensor removes its reading at rest, or does not measure it.
    Nothing(f64),
    /// Another acceleration of this size, m/s², which is gravity in no known unit.
    Other(f64),
}

/// Returns what the accelerometer reads at rest. Returns `None` if the configuration has no gravity or an accelerometer that does not
/// feel it, or if [`warning`] names the unit.
pub(crate) fn at_rest(mean: [f64; 3], config: &Config) -> Option<AtRest> {
    let size = |vector: [f64; 3]| vector.iter().map(|value| value * value).sum::<f64>().sqrt();
    let [reading, gravity] = [mean, config.gravity].map(size);
    let feels = config.accelerometer == Accelerometer::Strapdown && gravity > 0.0;
    if !feels || warning(mean, config).is_some() {
        None
    } else if (reading / gravity - 1.0).abs() <= OFF {
        Some(AtRest::Gravity)
    } else if reading <= OFF * gravity {
        Some(AtRest::Nothing(reading))
    } else {
        Some(AtRest::Other(reading))
    }
}

/// Returns the mean acceleration along each axis, m/s². Returns `None` for a record that is too short.
pub(super) fn mean(record: &Record) -> Option<[f64; 3]> {
    let samples = record.acceleration[0].len() as f64;
    let long = samples >= SHORTEST_S * record.rate_hz;
    let mean = |signal: &heapless::Vec<f32, SAMPLES>| -> f64 {
        signal.iter().map(|value| f64::from(*value)).sum::<f64>() / samples
    };
    long.then(|| record.acceleration.each_ref().map(mean))
}

/// Returns a warning if the reading at rest contradicts the unit of the acceleration, or the configuration of gravity and
/// accelerometer. A sensor that does not feel gravity, or whose reading at rest is removed, gives no warning.
pub(super) fn warning(mean: [f64; 3], config: &Config) -> Option<Implausible> {
    let reading = mean.iter().map(|value| value * value).sum::<f64>().sqrt();
    let reads = |gravity: f64| (reading / gravity - 1.0).abs() <= OFF;
    let weightless = config.gravity == [0.0; 3];
    if reads(GRAVITY) && (weightless || config.accelerometer == Accelerometer::Inertial) {
        let by = if weightless { GravityDenial::NoGravity } else { GravityDenial::Inertial };
        return Some(Implausible::GravityDenied { reading, by, file: config.file_name() });
    }
    let (_, unit) = UNITS.into_iter().find(|(gravity, _)| reads(*gravity))?;
    Some(Implausible::GravityInUnit { reading, unit })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn config() -> Config {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-tools/scenario/mill3-edge.toml");
        let mut config = Config::load(&file).unwrap();
        config.gravity = [0.0, 0.0, -GRAVITY];
        config.accelerometer = Accelerometer::Strapdown;
        config
    }

    #[test]
    fn gravity_in_another_unit_is_asked_for_and_none_is_nothing() {
        let config = config();
        for mean in [[0.0; 3], [0.02, -0.3, 0.4], [0.0, -5.0, 8.4], [3.0, 4.0, 0.0]] {
            assert_eq!(warning(mean, &config), None, "{mean:?}");
        }
        for (mean, unit) in [
            ([0.6, -0.6, 0.54], "in g?"),
            ([0.0, 0.0, 990.0], "in mg or cm/s^2?"),
            ([0.0, 9700.0, 0.0], "in mm/s^2?"),
        ] {
            let line = warning(mean, &config).unwrap().to_string();
            assert!(line.contains(unit), "{line}");
        }
    }

    #[test]
    fn what_is_read_at_rest_is_told_apart() {
        let mut config = config();
        let read = |config: &Config, size: f64| at_rest([0.6 * size, 0.0, -0.8 * size], config);
        assert_eq!(read(&config, 9.6), Some(AtRest::Gravity));
        assert!(matches!(read(&config, 0.3), Some(AtRest::Nothing(_))));
        assert!(matches!(read(&config, 5.0), Some(AtRest::Other(_))));
        assert_eq!(read(&config, 1.0), None, "the unit has a warning");
        config.accelerometer = Accelerometer::Inertial;
        assert_eq!(read(&config, 0.3), None);
    }

    #[test]
    fn gravity_that_the_config_denies_is_named() {
        let mut config = config();
        config.accelerometer = Accelerometer::Inertial;
        let felt = [0.0, 9.7, 1.0];
        let line = warning(felt, &config).unwrap().to_string();
        assert!(
            line.ends_with("accelerometer is \"inertial\" in mill3-edge.toml: delete that line"),
            "{line}"
        );
        config.gravity = [0.0; 3];
        let line = warning(felt, &config).unwrap().to_string();
        assert!(line.contains("but gravity_m_per_s2 is zero in mill3-edge.toml"), "{line}");
        assert_eq!(warning([0.0; 3], &config), None);
    }
}
