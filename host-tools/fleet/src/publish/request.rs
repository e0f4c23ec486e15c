//! Requests to send findings again.

use std::ops::RangeInclusive;

/// Longest part of a request that an error repeats, letters.
const REPEATED: usize = 40;

/// Parses a request: a sequence, `17`, or the first and the last, `17-20`.
///
/// # Errors
/// The text is neither. The error repeats its beginning and names both forms.
pub fn parse(text: &[u8]) -> Result<RangeInclusive<u64>, String> {
    let text = String::from_utf8_lossy(text);
    let (first, last) = text.trim().split_once('-').unwrap_or((text.trim(), text.trim()));
    match (first.parse(), last.parse()) {
        (Ok(first), Ok(last)) if first <= last => Ok(first..=last),
        _ => {
            let text: String = text.chars().take(REPEATED).collect();
            Err(format!(
                "{text:?} is no request: send a sequence, 17, or the first and last, 17-20"
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_is_one_sequence_or_a_range() {
        assert_eq!(parse(b"17"), Ok(17..=17));
        assert_eq!(parse(b" 17-20\n"), Ok(17..=20));
        assert_eq!(parse(b"0-18446744073709551615"), Ok(0..=u64::MAX));
        for wrong in
            [&b""[..], b"-", b"20-17", b"17-20-30", b"1e3", b"all", b"\xff\n", &[b'9'; 300]]
        {
            let error = parse(wrong).unwrap_err();
            assert!(error.len() < 250 && !error.contains('\n'), "{error}");
        }
    }
}
