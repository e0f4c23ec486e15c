//! A report, its confidence, and its answer.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::answer::Answer;
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
    /// The robot as a whole. `None` if the robot does not stand by these parameters.
    pub answer: Option<Answer>,
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
        (
            Warning::Misfit(warned) | Warning::WrongLength { worst: warned, .. },
            State::Obstacle(Obstacle::Misfit(misfit)),
        ) => warned == misfit,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use core::slice;

    use heapless::Vec;

    use super::*;
    use crate::confidence::Correlations;
    use crate::misfits::{FrameId, Misfit, MisfitKind};
    use crate::report::{Acceptance, Fit, FoundBy, MAX_WARNINGS};
    use crate::residuals::{Meaning, Residuals};
    use crate::unused::{RecordFault, Unused};

    fn finding(records: u64, warnings: &[Warning]) -> Finding {
        let fit = Fit {
            records,
            frames: 0,
            frames_lost: 0,
            ssp: 0.0,
            ssp_max: 0.0,
            consistency: 1.0,
            search_evaluations: 0,
            refine_iterations: 0,
            starts: 1,
            bridged: 0,
            seconds: 1.0,
            acceptance: Acceptance::Consistent,
            found_by: FoundBy::Descent,
            random_searches: 0,
            branches: 1,
        };
        let residuals = Residuals {
            consistency: 1.0,
            whiteness: 0.0,
            structure: 0.0,
            size_objects: false,
            whiteness_objects: false,
            structure_objects: false,
            meaning: Meaning::Noise,
        };
        let warnings = warnings.iter().cloned().collect();
        Finding {
            report: Report { joints: Default::default(), fit, warnings },
            confidence: Confidence {
                joints: Default::default(),
                nuisances: Default::default(),
                correlations: Correlations { unknowns: Vec::new(), percent: Vec::new() },
                explanations: Default::default(),
                weak_directions: Default::default(),
                residuals,
                left_over: Default::default(),
                held_out: Default::default(),
                retired: 0,
                left_out: 0,
                robust_widening: None,
            },
            answer: None,
        }
    }

    fn explained(records: u64, warnings: &[Warning], state: &State) -> Vec<Warning, MAX_WARNINGS> {
        let mut finding = finding(records, warnings);
        finding.explain(state);
        finding.report.warnings
    }

    #[test]
    fn a_missing_record_is_explained_once() {
        let misfit =
            |kind| Misfit { id: FrameId::Standard(257), kind, frames: 3, others_fit: false };
        let long = misfit(MisfitKind::Length { got: 7, expected: 8 });
        let refused = Unused::Refused { records: 2, first: RecordFault::NoForce };
        let pairs = [
            (Warning::Unused(refused.clone()), State::Unused(refused)),
            (
                Warning::Misfit(misfit(MisfitKind::Incomplete)),
                State::Obstacle(Obstacle::Misfit(misfit(MisfitKind::Incomplete))),
            ),
            (
                Warning::WrongLength { frames: 4, worst: long },
                State::Obstacle(Obstacle::Misfit(long)),
            ),
        ];
        for (warning, state) in pairs {
            let given = slice::from_ref(&warning);
            assert_eq!(explained(0, given, &state), given);
            let added = Warning::NoRecord(state.clone());
            assert_eq!(explained(0, &[], &state), [added]);
            assert_eq!(explained(1, &[], &state), []);
            let other = Warning::NoRecord(State::NoForce);
            assert_eq!(explained(0, given, &State::NoForce), [warning.clone(), other]);
        }
    }
}
