//! Verdicts on parameters, of so many joints.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Largest number of joints of a report.
pub const MAX_JOINTS: usize = 7;

/// How far a parameter can be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The data determine the parameter.
    Identified,
    /// The data determine the parameter roughly.
    Weak,
    /// The data do not determine the parameter.
    NotObservable,
    /// The parameter was not sought, but fixed at the value that the user gave.
    Fixed,
}
