//! Standard output and standard error, either of which may be closed under the program.

use std::io::{ErrorKind, Write as _, stderr, stdout};

use anyhow::{Context as _, Result};

/// Nobody reads standard output any more, and nobody wants to hear of it.
#[derive(Debug, thiserror::Error)]
#[error("standard output is closed")]
pub(crate) struct Closed;

/// Prints `text` as it is, at once.
///
/// # Errors
/// [`Closed`], or standard output cannot be written.
pub(crate) fn print(text: &str) -> Result<()> {
    let mut out = stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Err(Closed.into()),
        printed => printed.context("standard output cannot be written"),
    }
}

/// Says `line` on standard error.
pub(crate) fn complain(line: &str) {
    // There is nobody else to tell.
    let _ = writeln!(stderr(), "{line}");
}
