//! Output to standard output and standard error, either of which may be closed while the program runs. Printed text may come
//! from a log, a model, a file's name or another machine. It must not control the terminal and is therefore escaped.

use std::io::{self, ErrorKind, Write as _, stderr, stdout};

use flexid_pipeline::text::printable;

/// Why text cannot be printed.
#[derive(Debug, thiserror::Error)]
pub enum PrintError {
    /// Standard output has no reader any more, as in `flexid identify ... | head -1`.
    #[error("standard output is closed")]
    Closed,
    /// Another error occurred.
    #[error("standard output cannot be written: {0}")]
    Io(io::Error),
}

/// Prints `text` at once, escaped by [`printable`].
///
/// # Errors
/// Standard output is closed, or cannot be written.
pub fn print(text: &str) -> Result<(), PrintError> {
    draw(&printable(text))
}

/// Prints `text` at once, with the escape sequences that it holds. Text that does not come from this program must be escaped by
/// [`printable`] before.
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

/// Prints one line on standard error.
pub fn complain(line: &str) {
    // There is no other place to report the failure.
    let _ = writeln!(stderr(), "{}", printable(line).replace('\n', "\\n"));
}
