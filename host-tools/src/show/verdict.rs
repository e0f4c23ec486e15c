//! Verdicts in words.

use flexid_wire::report::Verdict;

/// The verdict in words.
pub(crate) fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Identified => "identified",
        Verdict::Weak => "weak",
        Verdict::NotObservable => "not observable",
        Verdict::Fixed => "fixed",
    }
}
