//! Parts of lines: counts with their noun, and enumerations.

use core::fmt;

/// A count with its noun: `1 record`, `2 records`.
#[derive(Clone, Copy, Debug)]
pub struct Count<'a>(pub u64, pub &'a str);

impl fmt::Display for Count<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(number, noun) = self;
        write!(f, "{number} {noun}{}", if *number == 1 { "" } else { "s" })
    }
}

/// An enumeration, `a`, `a and b` or `a, b and c`. Items that are counted but not named make the last part: `a, b and 3 more`.
pub(crate) struct Enumeration<'a, T> {
    /// Items that are named.
    pub(crate) named: &'a [T],
    /// Number of the other items.
    pub(crate) more: u64,
}

impl<T: fmt::Display> fmt::Display for Enumeration<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { named, more } = self;
        let parts = named.len() + usize::from(*more > 0);
        for (index, item) in named.iter().enumerate() {
            separate(f, index, parts)?;
            item.fmt(f)?;
        }
        if *more > 0 {
            separate(f, named.len(), parts)?;
            write!(f, "{more} more")?;
        }
        Ok(())
    }
}

/// A value with its standard deviation and unit: `3.12 ± 0.05 mm`. Without a unit it is a part, `2.1 ± 0.2 %`. The unit has the prefix that
/// suits the larger of the two. The last digit is the one in which the standard deviation is 1.5 to 15.
pub(crate) struct Measured<'a> {
    pub(crate) value: f64,
    /// `None` if there is none: the value then has three digits.
    pub(crate) std: Option<f64>,
    pub(crate) unit: &'a str,
}

/// Prefixes of units, the largest first.
const PREFIXES: [(f64, &str); 8] = [
    (1e9, "G"),
    (1e6, "M"),
    (1e3, "k"),
    (1.0, ""),
    (1e-3, "m"),
    (1e-6, "µ"),
    (1e-9, "n"),
    (1e-12, "p"),
];
/// Prefix of what is smaller.
const LEAST: (f64, &str) = (1e-15, "f");
/// Part of a prefix from which on three digits show all of it: 999.9 µm is 1.00 mm.
const FULL: f64 = 0.9995;
/// Least standard deviation in units of the last digit.
const LAST: f64 = 1.5;
/// Value of three digits in that of the last digit that is shown.
const OF_THREE_DIGITS: f64 = 66.0;
/// Most digits behind the decimal point.
const DIGITS: usize = 6;

impl fmt::Display for Measured<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { value, std, unit } = *self;
        let (scale, prefix, unit) = match unit {
            "" => (0.01, "", "%"),
            // As its entry of [accuracy].
            "1/kNm" => (0.01, "", "%/kNm"),
            unit => {
                let size = value.abs().max(std.unwrap_or(0.0));
                if size == 0.0 {
                    return write!(f, "0 {unit}");
                }
                let (scale, prefix) = prefixed(size);
                (scale, prefix, unit)
            }
        };
        let (value, std) = (value / scale, std.map(|std| std / scale));
        let (mut last, mut digits) = (std.unwrap_or(value.abs() / OF_THREE_DIGITS), 0);
        // Value of the last digit.
        let mut unit_of_last = 1.0;
        while last < LAST && digits < DIGITS {
            last *= 10.0;
            digits += 1;
            unit_of_last /= 10.0;
        }
        // Zero has no sign.
        let value = if value.abs() < 0.5 * unit_of_last { 0.0 } else { value };
        write!(f, "{value:.digits$}")?;
        if let Some(std) = std {
            write!(f, " ± {std:.digits$}")?;
        }
        write!(f, " {prefix}{unit}")
    }
}

/// A number of which three digits count.
pub struct ThreeDigits(pub f64);

impl fmt::Display for ThreeDigits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (mut limit, mut digits) = (100.0 * FULL, 0);
        while self.0.abs() < limit && digits < DIGITS {
            limit /= 10.0;
            digits += 1;
        }
        write!(f, "{:.digits$}", self.0)
    }
}

/// A value with three digits that count, and its unit with the prefix that suits it.
pub struct InUnit<'a> {
    /// The value, in the unit.
    pub value: f64,
    /// The unit without a prefix.
    pub unit: &'a str,
}

impl fmt::Display for InUnit<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (scale, prefix) = prefixed(self.value.abs());
        write!(f, "{} {prefix}{}", ThreeDigits(self.value / scale), self.unit)
    }
}

/// A part in per cent, with two digits, three from 100 on, and no more than two decimal places: `0.05 %`, `2.3 %`, `180 %`.
pub struct Percent(pub f64);

impl fmt::Display for Percent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = 100.0 * self.0;
        match percent.abs() {
            0.0 => f.write_str("0 %"),
            ..0.01 => f.write_str("<0.01 %"),
            0.01..0.095 => write!(f, "{percent:.2} %"),
            0.095..9.95 => write!(f, "{percent:.1} %"),
            _ => write!(f, "{percent:.0} %"),
        }
    }
}

/// An interval in parts of its value: one number where both sides are about equal.
pub struct Within {
    /// Most likely value, above 0.
    pub value: f64,
    /// Its interval, in the same unit.
    pub interval: [f64; 2],
}

/// Part of the larger side by which both sides of an interval may differ and are shown as one number: one in its second digit.
const ALIKE: f64 = 0.1;

impl fmt::Display for Within {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = self.interval;
        let (down, up) = (100.0 * (1.0 - low / self.value), 100.0 * (high / self.value - 1.0));
        if (up - down).abs() > ALIKE * up.max(down) {
            write!(f, "-{} to +{} %", TwoDigits(down), TwoDigits(up))
        } else {
            write!(f, "±{} %", TwoDigits(0.5 * (down + up)))
        }
    }
}

/// A part in per cent of which two digits count, and no more than hundredths.
struct TwoDigits(f64);

impl fmt::Display for TwoDigits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            ..=0.0 => f.write_str("0"),
            ..0.01 => f.write_str("<0.01"),
            ..0.095 => write!(f, "{:.2}", self.0),
            ..9.95 => write!(f, "{:.1}", self.0),
            _ => write!(f, "{:.0}", self.0),
        }
    }
}

/// Size and sign of the prefix for numbers of this size.
pub fn prefixed(size: f64) -> (f64, &'static str) {
    PREFIXES.into_iter().find(|(scale, _)| size >= FULL * scale).unwrap_or(LEAST)
}

/// Writes the separator before the part `index` of `parts`.
fn separate(f: &mut fmt::Formatter<'_>, index: usize, parts: usize) -> fmt::Result {
    f.write_str(match index {
        0 => "",
        _ if index + 1 == parts => " and ",
        _ => ", ",
    })
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;

    #[test]
    fn parts_have_two_digits() {
        for (part, expected) in [
            (0.0, "0 %"),
            (2e-5, "<0.01 %"),
            (5e-4, "0.05 %"),
            (0.0042, "0.4 %"),
            (-0.0167, "-1.7 %"),
            (0.0996, "10 %"),
            (1.8, "180 %"),
        ] {
            assert_eq!(Percent(part).to_string(), expected);
        }
    }

    #[test]
    fn one_is_singular() {
        assert_eq!(
            [0, 1, 2].map(|number| Count(number, "record").to_string()),
            ["0 records", "1 record", "2 records"]
        );
    }

    #[test]
    fn measured_values_have_the_digits_of_their_deviation() {
        for (value, std, unit, expected) in [
            (3.124e-4, Some(2.1e-5), "s", "312 ± 21 µs"),
            (3.124e-3, Some(1.2e-5), "m", "3.124 ± 0.012 mm"),
            (-1.2e-9, Some(2e-3), "rad", "0 ± 2 mrad"),
            (0.0213, Some(0.002), "", "2.1 ± 0.2 %"),
            (-0.898, Some(0.04), "", "-90 ± 4 %"),
            (1600.0, Some(f64::INFINITY), "Hz", "0 ± inf GHz"),
            (3000.0, None, "Hz", "3.00 kHz"),
            (5e-6, None, "s", "5.00 µs"),
            (8.8e-3, Some(2.8e-3), "1/kNm", "0.9 ± 0.3 %/kNm"),
            (1e-3 * (1.0 - 1e-15), None, "m", "1.00 mm"),
            (4e-8, None, "1/s", "40.0 n1/s"),
            (1e-13, None, "rad s/Nm", "100 frad s/Nm"),
            (2.5e-12, Some(4e-13), "rad s/Nm", "2.5 ± 0.4 prad s/Nm"),
            (0.0, None, "m", "0 m"),
        ] {
            assert_eq!(Measured { value, std, unit }.to_string(), expected);
        }
    }

    #[test]
    fn three_digits_count() {
        for (value, expected) in [
            (0.381, "0.381"),
            (0.999_6, "1.00"),
            (6.3302, "6.33"),
            (99.96, "100"),
            (1234.0, "1234"),
            (0.0, "0.000000"),
        ] {
            assert_eq!(ThreeDigits(value).to_string(), expected);
        }
        let in_unit = |value| InUnit { value, unit: "Nm/rad" }.to_string();
        assert_eq!([2.31e6, 4.5e4].map(in_unit), ["2.31 MNm/rad", "45.0 kNm/rad"]);
    }

    #[test]
    fn a_lopsided_interval_has_both_its_sides() {
        let within = |low, high| Within { value: 100.0, interval: [low, high] }.to_string();
        assert_eq!(within(98.0, 102.0), "±2.0 %");
        assert_eq!(within(99.95, 100.05), "±0.05 %");
        assert_eq!(within(99.999, 100.001), "±<0.01 %");
        assert_eq!(within(88.0, 112.5), "±12 %");
        assert_eq!(within(56.0, 180.0), "-44 to +80 %");
        assert_eq!(within(40.0, 110.0), "-60 to +10 %");
        assert_eq!(within(99.9, 100.2), "-0.1 to +0.2 %");
        assert_eq!(within(99.995, 103.0), "-<0.01 to +3.0 %");
    }

    #[test]
    fn the_last_part_follows_an_and() {
        let enumerate = |names, more| {
            let all = ["aaaa", "bbbb", "cccc"];
            Enumeration { named: &all[..names], more }.to_string()
        };
        assert_eq!(enumerate(0, 0), "");
        assert_eq!(enumerate(1, 0), "aaaa");
        assert_eq!(enumerate(2, 0), "aaaa and bbbb");
        assert_eq!(enumerate(3, 0), "aaaa, bbbb and cccc");
        assert_eq!(enumerate(2, 2), "aaaa, bbbb and 2 more");
        assert_eq!(enumerate(1, 3), "aaaa and 3 more");
    }
}
