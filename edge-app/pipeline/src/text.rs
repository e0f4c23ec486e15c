//! Text for users: counts, and text from outside that is made safe to show.

use std::borrow::Cow;
use std::fmt::Write as _;

use flexid_wire::words::Count;

/// Formats a count: `1 record`, `2 records`.
pub fn count(number: u64, what: &str) -> String {
    Count(number, what).to_string()
}

/// Replaces the characters of `text` that control a terminal or change the order of writing by, for example, `\u001b`. These
/// are the control characters other than line end and tabulator, and the marks of the bidirectional algorithm. JSON stays JSON,
/// since only its strings can hold these characters.
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(drives_terminals) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for character in text.chars() {
        if drives_terminals(character) {
            // Writing to a string does not fail.
            let _ = write!(shown, "\\u{:04x}", u32::from(character));
        } else {
            shown.push(character);
        }
    }
    Cow::Owned(shown)
}

fn drives_terminals(character: char) -> bool {
    match character {
        '\n' | '\t' => false,
        '\u{061C}'
        | '\u{200E}'
        | '\u{200F}'
        | '\u{202A}'..='\u{202E}'
        | '\u{2066}'..='\u{2069}' => true,
        _ => character.is_control(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_is_printed_drives_a_terminal() {
        let cases = [
            ("χ²/dof 1.000\n\t±0.1 %", "χ²/dof 1.000\n\t±0.1 %"),
            ("\x1b]0;owned\x07", "\\u001b]0;owned\\u0007"),
            ("a\rb\x08c\x7f", "a\\u000db\\u0008c\\u007f"),
            // The one-character CSI of C1, and a right-to-left override.
            ("\u{9b}31m", "\\u009b31m"),
            ("gnp\u{202e}.log", "gnp\\u202e.log"),
        ];
        for (text, shown) in cases {
            assert_eq!(printable(text), shown);
        }
    }

    #[test]
    fn json_stays_json() {
        let value = "a\u{9b}b\x1bc";
        let json = format!("\"{}\"", printable(&value.replace('\x1b', "\\u001b")));
        assert_eq!(json, "\"a\\u009bb\\u001bc\"");
    }
}
