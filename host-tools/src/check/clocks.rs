//! Judges the clocks of sensors that share no counter.

use flexid_pipeline::check::Survey;

use super::Finding;
use super::Severity::{Doubtful, Right, Wrong};

const ABOUT: &str = "clocks";

/// Judges the clocks of a survey.
pub(super) fn judge(survey: &Survey) -> Option<Finding> {
    Some(match survey.clocks.as_ref()? {
        Err(untold) => Finding::new(Wrong, ABOUT, &untold.reason, untold.mend),
        Ok(found) if found.has_wrong_rate() => {
            let mend = "state the rate of the slower sensor as [measurement] rate_hz; a faster one is filtered";
            Finding::new(Doubtful, ABOUT, found.to_string(), mend)
        }
        Ok(found) => Finding::new(Right, ABOUT, found.to_string(), ""),
    })
}
