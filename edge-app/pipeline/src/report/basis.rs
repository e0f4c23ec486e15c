//! Parts of a report beside the estimate.

use flexid_core::identify::Effort;
use flexid_wire::trouble::Trouble;
use flexid_wire::unused::Unused;
use flexid_wire::warning::Warning;

use crate::intake::Counts;

/// Parts of a report beside the estimate.
pub(crate) struct Basis<'a> {
    /// Effort of all work so far.
    pub(crate) effort: Effort,
    /// Number of records that the estimate rests on.
    pub(crate) records: u64,
    pub(crate) counts: Counts,
    /// Computing time, s.
    pub(crate) seconds: f64,
    /// Records that were refused.
    pub(crate) refused: Option<Unused>,
    /// Warning about the records that had been taken before.
    pub(crate) repeated: Option<Warning>,
    /// Records that came too late to be in the numbers.
    pub(crate) unfinished: Option<Unused>,
    /// Number of records that made room in a fit that could not be believed.
    pub(crate) dropped: u64,
    /// Number of poses that were lost with these records.
    pub(crate) dropped_poses: u64,
    /// Number of records that were too short to take the place of others.
    pub(crate) too_short: u64,
    /// True if the estimate rests on records of a doubtful rate.
    pub(crate) doubtful_rate: bool,
    /// Warning that force and acceleration do not agree with the model's masses.
    pub(crate) scale: Option<Warning>,
    /// Warning that axes of a sensor are swapped or have the wrong sign.
    pub(crate) axes: Option<Warning>,
    /// Warning about an accuracy that the records contradict.
    pub(crate) contradicted: Option<Warning>,
    /// Warning about the lines of noise that were subtracted.
    pub(crate) lines: Option<Warning>,
    /// Warning about noise that only the cut has.
    pub(crate) louder_cut: Option<Warning>,
    /// Part of what the fit leaves that is no response to the force, if no linear model leaves so much.
    pub(crate) distortion: Option<f64>,
    /// Troubles of the source.
    pub(crate) troubles: &'a [Trouble],
}
