//! Encodings of text.

/// Returns the text of bytes in UTF-8, or in UTF-16 as PowerShell and Excel write it, without a byte order mark. UTF-16 without the mark
/// shows by its first character, which is ASCII in all files that are read here.
///
/// # Errors
/// The bytes, if they are in neither encoding.
pub(crate) fn decode(bytes: Vec<u8>) -> Result<String, Vec<u8>> {
    let unit: fn([u8; 2]) -> u16 = match bytes[..] {
        [0xFF, 0xFE, ..] | [1..=0x7F, 0, ..] => u16::from_le_bytes,
        [0xFE, 0xFF, ..] | [0, 1..=0x7F, ..] => u16::from_be_bytes,
        _ => return String::from_utf8(bytes).map(unmarked).map_err(|error| error.into_bytes()),
    };
    let (units, rest) = bytes.as_chunks::<2>();
    let units: Vec<u16> = units.iter().map(|&two| unit(two)).collect();
    match String::from_utf16(&units) {
        Ok(text) if rest.is_empty() => Ok(unmarked(text)),
        _ => Err(bytes),
    }
}

/// Returns the text without its byte order mark.
fn unmarked(mut text: String) -> String {
    if text.starts_with('\u{feff}') {
        text.remove(0);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_and_utf_16_are_read() {
        let wanted = "name = \"Fräse\"\n";
        let units = |mark: &str| format!("{mark}{wanted}").encode_utf16().collect::<Vec<u16>>();
        let little = |mark| units(mark).into_iter().flat_map(u16::to_le_bytes).collect();
        let big = |mark| units(mark).into_iter().flat_map(u16::to_be_bytes).collect();
        let marked = format!("\u{feff}{wanted}").into_bytes();
        let mark = "\u{feff}";
        for bytes in [wanted.into(), marked, little(mark), little(""), big(mark), big("")] {
            assert_eq!(decode(bytes.clone()), Ok(wanted.to_owned()), "{bytes:x?}");
        }
        for bytes in [b"\xFF\xFEa".to_vec(), b"\xFF\xFE\0\xD8".to_vec(), b"Fr\xE4se".to_vec()] {
            assert_eq!(decode(bytes.clone()), Err(bytes));
        }
        assert_eq!(decode(Vec::new()), Ok(String::new()));
    }
}
