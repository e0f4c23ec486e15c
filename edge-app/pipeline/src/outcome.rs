//! Result of a run.

use std::io;

use crate::intake::Counts;
use crate::report::Finding;

/// Results of a run at the end of its frames.
#[derive(Debug)]
pub struct Outcome {
    /// Report and confidence. `None` if there is no estimate.
    pub finding: Option<Finding>,
    /// Counts of what has come in.
    pub counts: Counts,
    /// What the run still waited for, the obstacle to records, or the reason why records were not used, in words.
    pub state: String,
    /// Troubles of the source in words, with the reason why it broke. Empty if there was none.
    pub trouble: String,
    /// Error with which the source broke. `None` if it ended. The frames before the error have been used.
    pub broken: Option<io::Error>,
}
