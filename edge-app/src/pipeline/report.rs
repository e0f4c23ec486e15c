//! The one report that the daemon sends and the offline tool writes.

use flexid_core::chain::linearise::LinearisationError;
use flexid_core::identify::{Acceptance, Effort, Estimate, FoundBy};
use flexid_core::spectrum::SpectrumError;
use flexid_core::unknowns::{Coordinate, Sought};
use flexid_core::verdict;
use flexid_wire::messages::Name;
use flexid_wire::report::{self, Fit, JointReport, Report, Verdict};
use flexid_wire::text::clipped;

use super::Counts;
use super::warnings::warnings;
use crate::config::Config;
use crate::model::Model;

/// What a report rests on beside the estimate.
pub(super) struct Basis<'a> {
    /// Of all work so far.
    pub(super) effort: Effort,
    /// Records that the estimate rests on.
    pub(super) records: u64,
    pub(super) counts: Counts,
    /// Computing time, s.
    pub(super) seconds: f64,
    /// Which records had no spectrum, and why.
    pub(super) refusal: Option<String>,
    /// Which records had been taken before.
    pub(super) repeats: Option<String>,
    /// Which records came too late to be in the numbers.
    pub(super) left_out: Option<String>,
    /// Records that had to make room in a fit that could not be believed, and poses that went with them.
    pub(super) dropped: u64,
    pub(super) dropped_poses: u64,
    /// Records that were too short to take the place of others.
    pub(super) too_short: u64,
    /// Whether records lie at the bottom of it whose rate is not known.
    pub(super) doubtful_rate: bool,
    /// That force and acceleration do not go with the model's masses.
    pub(super) scale: Option<String>,
    /// What went wrong at the source; empty when nothing did.
    pub(super) trouble: &'a str,
}

pub(super) fn report(
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
        let (told, deviation) = trust.verdict(value, deviation);
        (verdict(told), deviation)
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
            .iter()
            .take(report::MAX_WARNINGS)
            .map(clipped)
            .collect(),
    }
}

/// As it goes onto the wire.
pub(super) fn verdict(verdict: verdict::Verdict) -> Verdict {
    match verdict {
        verdict::Verdict::Identified => Verdict::Identified,
        verdict::Verdict::Weak => Verdict::Weak,
        verdict::Verdict::NotObservable => Verdict::NotObservable,
    }
}

/// Why a robot as stiff as the bounds allow has no equilibrium at a pose, in words.
pub(super) fn no_equilibrium(error: LinearisationError, model: &Model, pose: &[f64]) -> String {
    let name = |joint: usize| -> Name {
        model.joints.get(joint).map_or_else(Name::new, |joint| clipped(&joint.name))
    };
    let angles: Vec<String> = pose.iter().map(|angle| format!("{angle:.2}")).collect();
    let angles = angles.join(", ");
    match error {
        LinearisationError::Angles(_) | LinearisationError::Bushings(_) => error.to_string(),
        LinearisationError::NoEquilibrium(joint) | LinearisationError::QuarterTurn(joint) => {
            let name = name(joint);
            format!("{name} gives way under gravity at ({angles}): raise [bounds] or check masses")
        }
    }
}

/// Why a record has no spectrum, in words.
pub(super) fn reason(error: SpectrumError) -> String {
    match error {
        SpectrumError::Length(samples) => format!("{samples} samples are too few"),
        SpectrumError::Bins(bins) => format!("its band holds {bins} bins"),
        SpectrumError::Pose(angles) => format!("its pose has {angles} angles"),
        SpectrumError::NotFinite => "it has values that are not finite".into(),
        SpectrumError::NoForce => "in the band it has hardly more force than noise".into(),
    }
}
