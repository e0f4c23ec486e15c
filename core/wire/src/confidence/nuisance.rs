//! A nuisance in words.

use core::f64::consts::TAU;
use core::fmt;

use super::{Interval, Nuisance};
use crate::accuracy::Accuracy;
use crate::words::Measured;

/// For example `delay 300 µs (290 µs to 310 µs)`. A filter has its frequency: `accelerometer resonance 1.62 kHz (1.55 kHz to 1.70 kHz)`.
impl fmt::Display for Nuisance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, entry, unit, value, interval, .. } = self;
        match (entry, unit.as_str()) {
            (Some(Accuracy::ForceResonanceHz), _) => {
                resonance(f, "force sensor", *value, *interval)
            }
            (Some(Accuracy::AccelerometerResonanceHz), _) => {
                resonance(f, "accelerometer", *value, *interval)
            }
            (_, "rad/s") => {
                let interval = interval.map(|ends| ends.map(|end| end / TAU));
                line(f, name, &Quantity(value / TAU, "Hz"), interval.map(|of| Ends(of, "Hz")))
            }
            (_, unit) => line(f, name, &Quantity(*value, unit), interval.map(|of| Ends(of, unit))),
        }
    }
}

/// The filter that this 1/ω² of a sensor is. Below zero it is no natural frequency, but −1/(2ω²) of a low-pass of first order.
fn resonance(
    f: &mut fmt::Formatter<'_>,
    sensor: &str,
    value: f64,
    interval: Option<Interval>,
) -> fmt::Result {
    let hz = |squared_period: f64| 1.0 / (TAU * libm::sqrt(squared_period));
    let quantity = |squared_period: f64| Quantity(hz(squared_period), "Hz");
    match interval {
        Some([lower, upper]) if upper < 0.0 => {
            let ends = [hz(-2.0 * lower), hz(-2.0 * upper)];
            write!(f, "{sensor} ")?;
            line(f, "low-pass", &quantity(-2.0 * value), Some(Ends(ends, "Hz")))
        }
        // At zero there is no filter.
        Some([lower, upper]) if lower < 0.0 && upper <= 0.0 => {
            write!(f, "{sensor} low-pass {} or higher", quantity(-2.0 * lower))
        }
        Some([_, upper]) if upper <= 0.0 => write!(f, "{sensor} without a filter"),
        Some([lower, upper]) if lower <= 0.0 => {
            write!(f, "{sensor} resonance {} or higher", quantity(upper))
        }
        Some([lower, upper]) => {
            write!(f, "{sensor} ")?;
            line(f, "resonance", &quantity(value), Some(Ends([hz(upper), hz(lower)], "Hz")))
        }
        None if value < 0.0 => write!(f, "{sensor} low-pass {}", quantity(-2.0 * value)),
        None => write!(f, "{sensor} resonance {}", quantity(value)),
    }
}

fn line(
    f: &mut fmt::Formatter<'_>,
    name: &str,
    value: &Quantity<'_>,
    interval: Option<Ends<'_>>,
) -> fmt::Result {
    write!(f, "{name} {value}")?;
    match interval {
        Some(Ends([lower, upper], unit)) => {
            write!(f, " ({} to {})", Quantity(lower, unit), Quantity(upper, unit))
        }
        None => Ok(()),
    }
}

/// A value and its unit.
struct Quantity<'a>(f64, &'a str);

/// The ends of an interval, and their unit.
struct Ends<'a>(Interval, &'a str);

impl fmt::Display for Quantity<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(value, unit) = *self;
        match unit {
            "" => write!(f, "{value:.4}"),
            "s" | "m" | "rad" | "Hz" => Measured { value, std: None, unit }.fmt(f),
            _ => write!(f, "{value:.2e} {unit}"),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;
    use crate::report::Verdict;
    use crate::text::clipped;

    #[test]
    fn a_filter_has_its_frequency() {
        let period = |hz: f64| 1.0 / (TAU * hz * TAU * hz);
        for (name, unit, value, interval, expected) in [
            ("delay", "s", 3e-4, Some([2.9e-4, 3.1e-4]), "delay 300 µs (290 µs to 310 µs)"),
            ("force gain x", "", 1.1, None, "force gain x 1.1000"),
            ("ground tx", "m/N", 1e-9, None, "ground tx 1.00e-9 m/N"),
            ("a high-pass", "rad/s", TAU * 0.5, None, "a high-pass 500 mHz"),
            (
                "accelerometer 1/omega^2",
                "s^2",
                period(1600.0),
                Some([period(1700.0), period(1500.0)]),
                "accelerometer resonance 1.60 kHz (1.50 kHz to 1.70 kHz)",
            ),
            (
                "accelerometer 1/omega^2",
                "s^2",
                period(1600.0),
                Some([-1e-9, period(1500.0)]),
                "accelerometer resonance 1.50 kHz or higher",
            ),
            (
                "accelerometer 1/omega^2",
                "s^2",
                -0.5 * period(300.0),
                Some([-0.5 * period(280.0), -0.5 * period(320.0)]),
                "accelerometer low-pass 300 Hz (280 Hz to 320 Hz)",
            ),
            (
                "accelerometer 1/omega^2",
                "s^2",
                -0.5 * period(300.0),
                Some([-0.5 * period(280.0), 0.0]),
                "accelerometer low-pass 280 Hz or higher",
            ),
            (
                "accelerometer 1/omega^2",
                "s^2",
                0.0,
                Some([0.0, 0.0]),
                "accelerometer without a filter",
            ),
            (
                "accelerometer 1/omega^2",
                "s^2",
                -0.5 * period(300.0),
                None,
                "accelerometer low-pass 300 Hz",
            ),
            (
                "accelerometer 1/omega^2",
                "s^2",
                period(1600.0),
                None,
                "accelerometer resonance 1.60 kHz",
            ),
        ] {
            let (name, unit) = (clipped(name), clipped(unit));
            let verdict = Verdict::Identified;
            let entry = (unit == "s^2").then_some(Accuracy::AccelerometerResonanceHz);
            let nuisance = Nuisance { name, entry, unit, value, std: None, interval, verdict };
            assert_eq!(nuisance.to_string(), expected);
        }
    }
}
