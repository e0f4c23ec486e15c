//! Conversion of verdicts for the wire.

use flexid_core::verdict;
use flexid_wire::report::Verdict;

/// Converts a verdict for the wire.
pub(super) fn verdict(verdict: verdict::Verdict) -> Verdict {
    match verdict {
        verdict::Verdict::Identified => Verdict::Identified,
        verdict::Verdict::Weak => Verdict::Weak,
        verdict::Verdict::NotObservable => Verdict::NotObservable,
    }
}
