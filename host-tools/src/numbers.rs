//! Numbers on the command line, and estimates in words.

use flexid_console::exit::BadArgument;
use flexid_pipeline::text::count;

/// Numbers with commas between, all finite.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Numbers(pub(crate) Vec<f64>);

/// Parses numbers with commas between.
///
/// # Errors
/// The part that is no number.
pub(crate) fn numbers(text: &str) -> Result<Numbers, String> {
    let number = |part: &str| match part.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("{part:?} is no number: give numbers with commas between")),
    };
    text.split(',').map(number).collect::<Result<_, _>>().map(Numbers)
}

impl Numbers {
    /// So many numbers, of the argument `name`.
    ///
    /// # Errors
    /// There are more or fewer.
    pub(crate) fn exactly<const N: usize>(&self, name: &str) -> Result<[f64; N], BadArgument> {
        let Self(all) = self;
        all.as_slice().try_into().map_err(|_| {
            let words = ["none", "one", "two", "three", "four", "five", "six"];
            let wanted = words.get(N).copied().unwrap_or("as many");
            let given = count(all.len() as u64, "number");
            BadArgument(format!("{name} has {given}: give {wanted}"))
        })
    }
}

/// An estimate with its 95 % interval: `12.3 (11.9 to 12.8)`. The interval has two digits that count; a number without one has four.
pub(crate) fn with_interval(value: f64, interval: [f64; 2]) -> String {
    let [low, high] = interval;
    let half = (high - low) / 2.0;
    let places =
        if half > 0.0 && half.is_finite() { places(half, 2) } else { places(value.abs(), 4) };
    format!("{value:.places$} ({low:.places$} to {high:.places$})")
}

/// Decimal places of a number of which so many digits count. Of zero, one less than there are digits.
pub(crate) fn places(size: f64, digits: i32) -> usize {
    let leading = if size > 0.0 && size.is_finite() { size.log10().floor() as i32 } else { 0 };
    // Chosen: no more digits than a double has.
    (digits - 1 - leading).clamp(0, 15) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_between_commas() {
        assert_eq!(numbers("1,-2.5, 3e2"), Ok(Numbers(vec![1.0, -2.5, 300.0])));
        for wrong in ["", "1,,2", "1;2", "nan", "1,inf"] {
            assert!(numbers(wrong).is_err(), "{wrong}");
        }
        let three = numbers("1,2,3").unwrap();
        assert_eq!(three.exactly::<3>("--force").unwrap(), [1.0, 2.0, 3.0]);
        let error = three.exactly::<2>("--rpm").unwrap_err().to_string();
        assert_eq!(error, "--rpm has 3 numbers: give two");
    }

    #[test]
    fn intervals_have_two_digits_that_count() {
        assert_eq!(with_interval(0.42134, [0.4087, 0.4339]), "0.421 (0.409 to 0.434)");
        assert_eq!(with_interval(1234.6, [1100.0, 1400.0]), "1235 (1100 to 1400)");
        assert_eq!(with_interval(-2.0, [-2.0, -2.0]), "-2.000 (-2.000 to -2.000)");
        assert_eq!(with_interval(1.5, [0.0, f64::INFINITY]), "1.500 (0.000 to inf)");
        assert_eq!(with_interval(0.0, [0.0, 0.0]), "0.000 (0.000 to 0.000)");
    }
}
