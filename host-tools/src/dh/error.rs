//! Why a table is refused.

use std::path::Path;

use flexid_pipeline::input::BadInput;

/// Why a table is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct DhError {
    /// Line of the table, from 1, if it is known.
    pub line: Option<usize>,
    /// The fault and its mend.
    pub message: String,
}

impl DhError {
    /// The error as that of a file.
    pub(crate) fn of(self, file: &Path) -> BadInput {
        BadInput { line: self.line, ..BadInput::new(file, self.message) }
    }
}
