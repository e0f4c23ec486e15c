//! Numbers on the command line.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_between_commas() {
        assert_eq!(numbers("1,-2.5, 3e2"), Ok(Numbers(vec![1.0, -2.5, 300.0])));
        for wrong in ["", "1,,2", "1;2", "nan", "1,inf"] {
            assert!(numbers(wrong).is_err(), "{wrong}");
        }
    }
}
