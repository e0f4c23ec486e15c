//! Errors of sensors and robot in words, the same on the terminal and on the page.
//!
//! Value and interval have one prefix of engineering notation, that of the largest of the three numbers, and the interval has two digits
//! that count.

use std::f64::consts::TAU;

use flexid_wire::accuracy::Accuracy;
use flexid_wire::confidence::Nuisance;
use flexid_wire::report::Verdict;
use flexid_wire::words::prefixed;
use serde::Deserialize;

/// Standard deviations beyond which an error is not zero: a normal distribution exceeds them once in twenty.
const SIGNIFICANT: f64 = 2.0;
/// Times its accuracy beyond which an error is not as expected: an accuracy is one standard deviation, and a normal distribution exceeds
/// two of them once in twenty.
const CONSPICUOUS: f64 = 2.0;
/// Share of the misfit that is most of it.
const MOST: f64 = 0.5;
/// Most decimal places.
const MOST_PLACES: i32 = 6;

/// For example `delay 300 µs (290 to 310 µs)`. A filter has its frequency: `accelerometer resonance 1.62 kHz (1.55 to 1.70 kHz)`.
pub fn words(own: &Nuisance) -> String {
    let Nuisance { name, entry, unit, value, interval, .. } = own;
    let (value, interval) = (*value, *interval);
    let scaled = |scale: f64| (scale * value, interval.map(|ends| ends.map(|end| scale * end)));
    match (entry, unit.as_str()) {
        (Some(Accuracy::ForceResonanceHz), _) => resonance("force sensor", value, interval),
        (Some(Accuracy::AccelerometerResonanceHz), _) => {
            resonance("accelerometer", value, interval)
        }
        // A filter that the records do not contradict has no least corner.
        (_, "rad/s") => match scaled(1.0 / TAU) {
            (_, Some([lower, upper])) if lower <= 0.0 => {
                format!("{name} below {}", number(upper.max(0.0), "Hz"))
            }
            (value, interval) => format!("{name} {}", estimate(value, interval, "Hz")),
        },
        // As its entry of [accuracy].
        (_, "1/Nm") => {
            let (value, interval) = scaled(1e5);
            format!("{name} {}", estimate(value, interval, "%/kNm"))
        }
        (_, unit) => format!("{name} {}", estimate(value, interval, unit)),
    }
}

/// Tells whether the interval holds the value that is stated: the error does not show, however narrow the interval is.
fn may_be_as_stated(own: &Nuisance) -> bool {
    let stated = if is_factor(own) { 1.0 } else { 0.0 };
    own.interval.is_some_and(|[lower, upper]| (lower..=upper).contains(&stated))
}

/// How an error stands to its accuracy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// The records contradict the accuracy: the error is more than twice as large, and its interval does not hold the value that is stated.
    Contradicted,
    /// The error asks for nothing.
    Expected,
    /// The fit allows no interval, so that a large value says nothing, and a small one neither.
    Unknown,
}

/// Compares an error with its accuracy.
pub fn standing(own: &Nuisance) -> Standing {
    let size = if is_factor(own) { own.value.ln() } else { own.value };
    let exceeds = own.accuracy.is_some_and(|accuracy| size.abs() > CONSPICUOUS * accuracy);
    match own.interval {
        None => Standing::Unknown,
        Some(_) if exceeds && !may_be_as_stated(own) => Standing::Contradicted,
        Some(_) => Standing::Expected,
    }
}

/// Says if the error shows. What `[calibration]` seeks has its verdict, which compares what is left with what was known before.
pub fn judgement(own: &Nuisance) -> &'static str {
    match (may_be_as_stated(own), is_factor(own), own.entry, own.interval) {
        (true, true, ..) => "compatible with 1",
        (true, false, ..) => "compatible with zero",
        (false, _, None, _) => match own.verdict {
            Verdict::Identified => "identified",
            Verdict::Weak => "weak",
            Verdict::NotObservable => "not observable",
            Verdict::Fixed => "fixed",
        },
        (false, _, Some(_), None) => "no interval",
        (false, _, Some(entry), Some(_)) if entry.is_filter() => "the records show it",
        (false, true, ..) => "differs from 1",
        (false, false, ..) => "differs from zero",
    }
}

/// The entry of `[accuracy]` that speaks of it, with its size: `delay_s 20.0 µs`. `None` of what `[calibration]` seeks.
pub fn accuracy(own: &Nuisance) -> Option<String> {
    let (entry, size) = own.entry.zip(own.accuracy)?;
    let size = match own.unit.as_str() {
        "s^2" => number(1.0 / (TAU * size.sqrt()), "Hz"),
        "rad/s" => number(size / TAU, "Hz"),
        "1/Nm" => number(1e5 * size, "%/kNm"),
        unit => number(size, unit),
    };
    Some(format!("{} {size}", entry.key()))
}

/// Tells whether 1 is as stated, not 0. Among what `[calibration]` seeks, gains and masses have no unit.
fn is_factor(own: &Nuisance) -> bool {
    own.entry.map_or(own.unit.is_empty(), Accuracy::is_factor)
}

/// Sum of these shares of the misfit, if there are any and most of it has another cause.
pub fn sum_if_minor(shares: impl Iterator<Item = f64>) -> Option<f64> {
    let sum = shares.reduce(|sum, share| sum + share)?;
    (sum < MOST).then_some(sum)
}

/// The size of an error, as an explanation states it.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Size {
    /// Most likely value.
    pub value: f64,
    /// Its standard deviation, in the same unit. `None` if the fit gives no finite number.
    pub std: Option<f64>,
}

impl Size {
    /// Tells whether an explanation of this size and of this share of the misfit is shown. One that may be zero by two standard deviations
    /// explains nothing, unless the records contradict its accuracy and its kind explains most: then it is open which axis is off.
    pub fn is_shown(self, share: f64, is_contradicted: bool) -> bool {
        is_contradicted && share > MOST
            || self.std.is_some_and(|std| SIGNIFICANT * std < self.value.abs())
    }
}

/// The filter that this 1/ω² of a sensor is. Below zero it is no natural frequency, but −1/(2ω²) of a low-pass of first order.
fn resonance(sensor: &str, value: f64, interval: Option<[f64; 2]>) -> String {
    let hz = |squared_period: f64| 1.0 / (TAU * squared_period.sqrt());
    match interval {
        Some([lower, upper]) if upper < 0.0 => {
            let ends = [hz(-2.0 * lower), hz(-2.0 * upper)];
            format!("{sensor} low-pass {}", estimate(hz(-2.0 * value), Some(ends), "Hz"))
        }
        // At zero there is no filter.
        Some([lower, upper]) if lower < 0.0 && upper <= 0.0 => {
            format!("{sensor} low-pass {} or higher", number(hz(-2.0 * lower), "Hz"))
        }
        Some([_, upper]) if upper <= 0.0 => format!("{sensor} without a filter"),
        Some([lower, upper]) if lower <= 0.0 => {
            format!("{sensor} resonance {} or higher", number(hz(upper), "Hz"))
        }
        Some([lower, upper]) => {
            let ends = [hz(upper), hz(lower)];
            format!("{sensor} resonance {}", estimate(hz(value), Some(ends), "Hz"))
        }
        None if value < 0.0 => format!("{sensor} low-pass {}", number(hz(-2.0 * value), "Hz")),
        None => format!("{sensor} resonance {}", number(hz(value), "Hz")),
    }
}

/// A number with its unit, in engineering notation, to three digits.
pub(crate) fn number(value: f64, unit: &str) -> String {
    estimate(value, None, unit)
}

/// A value, its interval if there is one, and their unit.
fn estimate(value: f64, interval: Option<[f64; 2]>, unit: &str) -> String {
    let size = interval.into_iter().flatten().fold(value.abs(), |size, end| size.max(end.abs()));
    let (scale, unit) = match unit {
        "" => (1.0, String::new()),
        "%/kNm" | "kg" => (1.0, format!(" {unit}")),
        unit => {
            let (scale, prefix) = if size > 0.0 { prefixed(size) } else { (1.0, "") };
            (scale, format!(" {prefix}{unit}"))
        }
    };
    let (resolved, digits) = match interval {
        Some([low, high]) if low < high => ((high - low) / 2.0, 2),
        _ => (value.abs(), 3),
    };
    let places = places(resolved / scale, digits);
    let shown = |value: f64| {
        let text = format!("{:.places$}", value / scale);
        // What rounds to zero has no sign.
        let is_zero = text.trim_start_matches(['-', '0', '.']).is_empty();
        if is_zero { text.trim_start_matches('-').to_owned() } else { text }
    };
    match interval {
        None => format!("{}{unit}", shown(value)),
        Some([low, high]) => {
            format!("{}{unit} ({} to {}{unit})", shown(value), shown(low), shown(high))
        }
    }
}

/// Decimal places at which so many digits of a number count.
fn places(size: f64, digits: i32) -> usize {
    // What rounding has put below a power of ten belongs to it.
    let size = size * (1.0 + 1e-9);
    let leading = if size > 0.0 && size.is_finite() { size.log10().floor() as i32 } else { 0 };
    (digits - 1 - leading).clamp(0, MOST_PLACES) as usize
}

#[cfg(test)]
mod tests {
    use flexid_wire::text::clipped;

    use super::*;

    fn nuisance(
        (name, entry, unit): (&str, Option<Accuracy>, &str),
        value: f64,
        interval: Option<[f64; 2]>,
    ) -> Nuisance {
        let (name, unit, verdict) = (clipped(name), clipped(unit), Verdict::Identified);
        Nuisance { name, entry, accuracy: None, unit, value, std: None, interval, verdict }
    }

    #[test]
    fn value_and_interval_have_one_prefix() {
        let period = |hz: f64| 1.0 / (TAU * hz * TAU * hz);
        let filter = ("1/omega^2", Some(Accuracy::AccelerometerResonanceHz), "s^2");
        let place = ("TCP z", Some(Accuracy::TcpM), "m");
        let growth = ("drives", Some(Accuracy::DriveGrowthPerKnm), "1/Nm");
        let corner = ("high-pass", Some(Accuracy::ForceHighPassHz), "rad/s");
        for (named, value, interval, expected) in [
            (("delay", None, "s"), 3e-4, Some([2.9e-4, 3.1e-4]), "delay 300 µs (290 to 310 µs)"),
            (place, 2.44e-4, Some([-1.8e-4, 3.1e-3]), "TCP z 0.2 mm (-0.2 to 3.1 mm)"),
            (place, -1e-9, Some([-2.1e-5, 2.0e-5]), "TCP z 0 µm (-21 to 20 µm)"),
            (("gain", None, ""), 1.1, None, "gain 1.10"),
            (("gain", None, ""), 1.10214, Some([1.1, 1.104]), "gain 1.1021 (1.1000 to 1.1040)"),
            (("ground", None, "m/N"), 1e-9, None, "ground 1.00 nm/N"),
            (("hose", None, "Ns/m"), 9.81, Some([8.0, 11.6]), "hose 9.8 Ns/m (8.0 to 11.6 Ns/m)"),
            (
                growth,
                3.9e-7,
                Some([-1.73e-7, 9.4e-7]),
                "drives 0.039 %/kNm (-0.017 to 0.094 %/kNm)",
            ),
            (corner, TAU * 0.5, Some([TAU * 0.4, TAU * 0.6]), "high-pass 500 mHz (400 to 600 mHz)"),
            (corner, TAU * 0.1, Some([-TAU * 0.4, TAU * 0.6]), "high-pass below 600 mHz"),
            (
                filter,
                period(1600.0),
                Some([period(1700.0), period(1500.0)]),
                "accelerometer resonance 1.60 kHz (1.50 to 1.70 kHz)",
            ),
            (
                filter,
                period(1600.0),
                Some([-1e-9, period(1500.0)]),
                "accelerometer resonance 1.50 kHz or higher",
            ),
            (
                filter,
                -0.5 * period(300.0),
                Some([-0.5 * period(280.0), -0.5 * period(320.0)]),
                "accelerometer low-pass 300 Hz (280 to 320 Hz)",
            ),
            (
                filter,
                -1e-9,
                Some([-0.5 * period(280.0), 0.0]),
                "accelerometer low-pass 280 Hz or higher",
            ),
            (filter, 0.0, Some([0.0, 0.0]), "accelerometer without a filter"),
            (filter, -0.5 * period(300.0), None, "accelerometer low-pass 300 Hz"),
        ] {
            assert_eq!(words(&nuisance(named, value, interval)), expected);
        }
    }

    #[test]
    fn what_may_be_as_stated_does_not_differ() {
        let tcp = ("TCP z", Some(Accuracy::TcpM), "m");
        let mass = ("mass", Some(Accuracy::LinkMass), "");
        let crosstalk = ("crosstalk", Some(Accuracy::ForceCrosstalk), "");
        let resonance = ("1/omega^2", Some(Accuracy::ForceResonanceHz), "s^2");
        for (named, interval, expected) in [
            (tcp, Some([-1e-5, 1e-4]), "compatible with zero"),
            (tcp, Some([1e-5, 1e-4]), "differs from zero"),
            (tcp, None, "no interval"),
            (mass, Some([0.98, 1.01]), "compatible with 1"),
            (mass, Some([1.01, 1.02]), "differs from 1"),
            (resonance, Some([1e-9, 2e-9]), "the records show it"),
            (resonance, Some([-1e-9, 2e-9]), "compatible with zero"),
            (("force gain x", None, ""), Some([0.98, 1.01]), "compatible with 1"),
            (("force gain x", None, ""), Some([1.01, 1.02]), "identified"),
            (("force gain x", None, ""), None, "identified"),
            (crosstalk, Some([-0.01, 0.01]), "compatible with zero"),
        ] {
            assert_eq!(judgement(&nuisance(named, 0.0, interval)), expected, "{named:?}");
        }
    }

    /// Ten accuracies are no contradiction where the fit allows no interval, and not as expected either.
    #[test]
    fn an_error_without_an_interval_is_not_known() {
        for (value, interval, expected) in [
            (1e-2, Some([9e-3, 1.1e-2]), Standing::Contradicted),
            (1e-2, Some([-1e-3, 2.1e-2]), Standing::Expected),
            (1e-3, Some([9e-4, 1.1e-3]), Standing::Expected),
            (1e-2, None, Standing::Unknown),
            (1e-3, None, Standing::Unknown),
        ] {
            let own = nuisance(("TCP z", Some(Accuracy::TcpM), "m"), value, interval);
            let own = Nuisance { accuracy: Some(1e-3), ..own };
            assert_eq!(standing(&own), expected, "{value} {interval:?}");
        }
    }

    #[test]
    fn an_accuracy_has_the_unit_of_its_entry() {
        for (entry, unit, size, expected) in [
            (Accuracy::DelayS, "s", 2e-5, "delay_s 20.0 µs"),
            (Accuracy::LinkMass, "", 0.02, "link_mass 0.0200"),
            (
                Accuracy::ForceResonanceHz,
                "s^2",
                (TAU * 3000.0).powi(-2),
                "force_resonance_hz 3.00 kHz",
            ),
            (Accuracy::ForceHighPassHz, "rad/s", TAU * 0.1, "force_high_pass_hz 100 mHz"),
            (Accuracy::DriveGrowthPerKnm, "1/Nm", 1e-5, "drive_growth_per_knm 1.00 %/kNm"),
        ] {
            let own = nuisance(("it", Some(entry), unit), 0.0, None);
            assert_eq!(accuracy(&own), None);
            let own = Nuisance { accuracy: Some(size), ..own };
            assert_eq!(accuracy(&own).unwrap(), expected);
        }
    }

    #[test]
    fn an_error_that_may_be_zero_explains_most_or_nothing() {
        for (value, std, share, is_contradicted, expected) in [
            (-2.0, Some(0.9), 0.1, false, true),
            (2.0, Some(1.0), 0.4, true, false),
            (2.0, Some(1.0), 0.6, true, true),
            (2.0, Some(1.0), 0.6, false, false),
            (2.0, None, 0.4, true, false),
        ] {
            let is_shown = Size { value, std }.is_shown(share, is_contradicted);
            assert_eq!(is_shown, expected, "{value} {std:?} {share}");
        }
    }
}
