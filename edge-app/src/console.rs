//! Standard output and standard error, either of which may be closed under the program. What is printed may come from a
//! log, a model, a file's name or another machine: it is shown, and drives no terminal.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::{self, ErrorKind, Write as _, stderr, stdout};

/// Why nothing can be printed.
#[derive(Debug, thiserror::Error)]
pub enum PrintError {
    /// Nobody reads standard output any more, as in `flexid identify ... | head -1`.
    #[error("standard output is closed")]
    Closed,
    /// Anything else.
    #[error("standard output cannot be written: {0}")]
    Io(io::Error),
}

/// Prints `text` at once, as [`printable`] shows it.
///
/// # Errors
/// Standard output is closed, or cannot be written.
pub fn print(text: &str) -> Result<(), PrintError> {
    draw(&printable(text))
}

/// Prints `text` at once, with the escape sequences that it holds: what did not come from this program must have gone
/// through [`printable`].
///
/// # Errors
/// Standard output is closed, or cannot be written.
pub fn draw(text: &str) -> Result<(), PrintError> {
    let mut out = stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(|error| match error.kind() {
        ErrorKind::BrokenPipe => PrintError::Closed,
        _ => PrintError::Io(error),
    })
}

/// Says one line on standard error.
pub fn complain(line: &str) {
    // There is nobody else to tell.
    let _ = writeln!(stderr(), "{}", printable(line).replace('\n', "\\n"));
}

/// `text` with what drives a terminal or changes the order of writing as `\u001b`: control characters other than line end
/// and tabulator, and the marks of the bidirectional algorithm. JSON stays JSON: only its strings can hold them.
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
