//! A report and its confidence.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::confidence::Confidence;
use crate::report::Report;
use crate::state::{Obstacle, State};
use crate::warning::Warning;

/// A report, and how far it can be trusted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Finding {
    /// Report with the parameters.
    pub report: Report,
    /// Confidence of the report.
    pub confidence: Confidence,
}

impl Finding {
    /// Adds a warning why there is no record, if the finding rests on static tests alone. `state` is the reason.
    pub fn explain(&mut self, state: &State) {
        let Report { fit, warnings, .. } = &mut self.report;
        if fit.records == 0 && !warnings.iter().any(|warning| warns_of(warning, state)) {
            // There is room: without records there are few warnings.
            let _ = warnings.push(Warning::NoRecord(state.clone()));
        }
    }
}

/// Returns whether a warning says the same as a state.
fn warns_of(warning: &Warning, state: &State) -> bool {
    match (warning, state) {
        (Warning::Unused(warned), State::Unused(records)) => warned == records,
        (Warning::Misfit(warned), State::Obstacle(Obstacle::Misfit(misfit))) => warned == misfit,
        _ => false,
    }
}
