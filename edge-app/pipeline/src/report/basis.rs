//! What a report contains beside the estimate.

use flexid_core::identify::Effort;

use crate::intake::Counts;

/// What a report contains beside the estimate.
pub(crate) struct Basis<'a> {
    /// Effort of all work so far.
    pub(crate) effort: Effort,
    /// Number of records that the estimate rests on.
    pub(crate) records: u64,
    pub(crate) counts: Counts,
    /// Computing time, s.
    pub(crate) seconds: f64,
    /// Line about the records that were refused, with the reason.
    pub(crate) refusal: Option<String>,
    /// Line about the records that had been taken before.
    pub(crate) repeats: Option<String>,
    /// Line about the records that came too late to be in the numbers.
    pub(crate) left_out: Option<String>,
    /// Number of records that made room in a fit that could not be believed.
    pub(crate) dropped: u64,
    /// Number of poses that were lost with these records.
    pub(crate) dropped_poses: u64,
    /// Number of records that were too short to take the place of others.
    pub(crate) too_short: u64,
    /// Whether the estimate rests on records of a doubtful rate.
    pub(crate) doubtful_rate: bool,
    /// Warning that force and acceleration do not agree with the model's masses.
    pub(crate) scale: Option<String>,
    /// Troubles of the source. Empty if there was none.
    pub(crate) trouble: &'a str,
}
