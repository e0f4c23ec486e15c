//! Makes a report of an estimate and of the counts of what came in.

use flexid_core::identify::{Acceptance, Estimate, FoundBy};
use flexid_core::sought::{Coordinate, Sought};
use flexid_wire::report::{self, Fit, JointReport, Report, Verdict};
use flexid_wire::text::clipped;

use super::basis::Basis;
use super::verdict::verdict;
use super::warnings::warnings;
use crate::config::Config;

/// Makes the report that the daemon sends and the offline tool writes.
pub(crate) fn report(
    config: &Config,
    sought: &Sought,
    estimate: &Estimate,
    basis: &Basis,
) -> Report {
    let trust = estimate.trust();
    let judge = |coordinate, value, deviation| {
        if sought.unknown(coordinate).is_none() {
            return (Verdict::Fixed, None);
        }
        let (own, deviation) = trust.verdict(value, deviation);
        (verdict(own), deviation)
    };
    let bushings = estimate.bushings.iter().zip(&estimate.standard_deviations);
    let joints = config.model.joints.iter().zip(bushings).enumerate();
    let joints = joints.map(|(joint, (model, (value, deviation)))| {
        let stiffness: [_; 6] = std::array::from_fn(|dof| {
            let coordinate = Coordinate::Stiffness { joint, dof };
            judge(coordinate, value.stiffness[dof], deviation.stiffness[dof])
        });
        let damping: [_; 6] = std::array::from_fn(|dof| {
            let coordinate = Coordinate::Damping { joint, dof };
            judge(coordinate, value.damping[dof], deviation.damping[dof])
        });
        JointReport {
            name: clipped(&model.name),
            stiffness: value.stiffness,
            stiffness_std: stiffness.map(|(_, deviation)| deviation),
            stiffness_verdict: stiffness.map(|(verdict, _)| verdict),
            damping: value.damping,
            damping_std: damping.map(|(_, deviation)| deviation),
            damping_verdict: damping.map(|(verdict, _)| verdict),
        }
    });
    let stream = &basis.counts.stream;
    Report {
        joints: joints.take(report::MAX_JOINTS).collect(),
        fit: Fit {
            records: basis.records,
            frames: stream.frames,
            frames_lost: stream.frames_lost,
            ssp: estimate.ssp_median,
            ssp_max: estimate.ssp_max,
            consistency: estimate.consistency,
            search_evaluations: basis.effort.search_evaluations,
            refine_iterations: basis.effort.refine_iterations,
            starts: basis.effort.starts,
            bridged: stream.bridged,
            seconds: basis.seconds,
            acceptance: match estimate.acceptance {
                Acceptance::Consistent => report::Acceptance::Consistent,
                Acceptance::ModelSuspect => report::Acceptance::ModelSuspect,
                Acceptance::Unsettled => report::Acceptance::Unsettled,
            },
            found_by: match estimate.found_by {
                FoundBy::Refinement => report::FoundBy::Refinement,
                FoundBy::Descent => report::FoundBy::Descent,
                FoundBy::RandomSearch => report::FoundBy::RandomSearch,
                FoundBy::Branch => report::FoundBy::Branch,
            },
            random_searches: basis.effort.random_searches,
            branches: basis.effort.branches,
        },
        warnings: warnings(config, sought, estimate, basis)
            .into_iter()
            .take(report::MAX_WARNINGS)
            .collect(),
    }
}
