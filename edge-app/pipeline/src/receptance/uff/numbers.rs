//! Numbers as Fortran writes them, and binary ones.

/// The numbers of a line: `-1.5E-02`, `1.0D+00`, one directly behind the other if they fill their columns. `None` if one is no number.
pub(super) fn numbers(line: &[u8]) -> Option<Vec<f64>> {
    let mut numbers = Vec::new();
    for word in line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()) {
        let mut start = 0;
        for end in 1..=word.len() {
            let is_end = end == word.len()
                || (matches!(word[end], b'+' | b'-')
                    && !matches!(word[end - 1], b'e' | b'E' | b'd' | b'D'));
            if is_end {
                let text = str::from_utf8(&word[start..end]).ok()?;
                numbers.push(text.replace(['d', 'D'], "e").parse().ok()?);
                start = end;
            }
        }
    }
    Some(numbers)
}

/// Binary numbers, of single or double precision.
pub(super) fn floats(bytes: &[u8], is_double: bool, is_big: bool) -> Vec<f64> {
    let double =
        |own: &[u8; 8]| if is_big { f64::from_be_bytes(*own) } else { f64::from_le_bytes(*own) };
    let single =
        |own: &[u8; 4]| if is_big { f32::from_be_bytes(*own) } else { f32::from_le_bytes(*own) };
    if is_double {
        bytes.as_chunks::<8>().0.iter().map(double).collect()
    } else {
        bytes.as_chunks::<4>().0.iter().map(|own| f64::from(single(own))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_may_touch_each_other() {
        for (line, expected) in [
            (" 1.5E+00-2.0D-01", Some(vec![1.5, -0.2])),
            ("-1e3 +4 .5", Some(vec![-1e3, 4.0, 0.5])),
            ("1.0E-02-1.0E+02+3", Some(vec![0.01, -100.0, 3.0])),
            ("", Some(vec![])),
            ("1.0 x", None),
            ("1.0 -", None),
            ("NaN", Some(vec![f64::NAN])),
        ] {
            let own = numbers(line.as_bytes());
            assert_eq!(format!("{own:?}"), format!("{expected:?}"), "{line}");
        }
    }
}
