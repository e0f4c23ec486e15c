//! Numbers and names as text.

use nalgebra::Matrix3;

/// Returns `text` in one line: a space replaces each control character.
pub(crate) fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// Returns the shortest decimal number that is read as the same number. XML, MATLAB and Python read it.
pub(crate) fn number(value: f64) -> String {
    format!("{value:?}")
}

/// Returns the numbers with `separator` between them.
pub(crate) fn numbers(values: impl IntoIterator<Item = f64>, separator: &str) -> String {
    values.into_iter().map(number).collect::<Vec<_>>().join(separator)
}

/// Returns the elements of a symmetric matrix as `[xx, yy, zz, xy, xz, yz]`.
pub(crate) fn symmetric(matrix: &Matrix3<f64>) -> [f64; 6] {
    [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|place| matrix[place])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_again() {
        for value in [2.6e8, 3.5491e-7, -0.1, 1.0 / 3.0, 0.0, 1e300] {
            assert_eq!(number(value).parse(), Ok(value));
        }
        assert_eq!(numbers([1.0, -2.5], ", "), "1.0, -2.5");
    }

    #[test]
    fn no_text_begins_a_new_line() {
        assert_eq!(one_line("a\nb\r\u{85}c"), "a b  c");
    }
}
