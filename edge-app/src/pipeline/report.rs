//! The one report that the daemon sends and the offline tool writes.

use std::fmt::Display;

use flexid_core::DOF;
use flexid_core::identify::{Acceptance, Estimate};
use flexid_core::spectrum::SpectrumError;
use flexid_wire::messages::Progress;
use flexid_wire::report::{self, Fit, JointReport, Report, Verdict};
use flexid_wire::text::clipped;

use super::verdict::verdict;
use super::{Counts, MAX_EXPERIMENTS};
use crate::model::Model;

/// What a report rests on beside the estimate.
pub(super) struct Basis<'a> {
    pub(super) progress: Progress,
    pub(super) counts: Counts,
    /// Computing time, s.
    pub(super) seconds: f64,
    /// Which records had no spectrum, and why.
    pub(super) refusal: Option<String>,
    /// Poses that had to make room.
    pub(super) forgotten: u64,
    /// What went wrong at the source; empty when nothing did.
    pub(super) trouble: &'a str,
}

pub(super) fn report(model: &Model, estimate: &Estimate, basis: &Basis) -> Report {
    let bushings = estimate.bushings.iter().zip(&estimate.standard_deviations);
    let joints = model.joints.iter().zip(bushings).map(|(joint, (value, deviation))| {
        let stiffness = judge(&value.stiffness, &deviation.stiffness);
        let damping = judge(&value.damping, &deviation.damping);
        JointReport {
            name: clipped(&joint.name),
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
            records: basis.progress.records,
            frames: stream.frames,
            frames_lost: stream.frames_lost,
            ssp: estimate.ssp_median,
            ssp_max: estimate.ssp_max,
            consistency: estimate.consistency,
            search_evaluations: basis.progress.search_evaluations,
            refine_iterations: basis.progress.refine_iterations,
            starts: basis.progress.starts,
            bridged: stream.bridged,
            seconds: basis.seconds,
            acceptance: match estimate.acceptance {
                Acceptance::Consistent => report::Acceptance::Consistent,
                Acceptance::ModelSuspect => report::Acceptance::ModelSuspect,
                Acceptance::Unsettled => report::Acceptance::Unsettled,
            },
        },
        warnings: warnings(estimate, basis)
            .iter()
            .take(report::MAX_WARNINGS)
            .map(clipped)
            .collect(),
    }
}

fn judge(values: &[f64; DOF], deviations: &[f64; DOF]) -> [(Verdict, Option<f64>); DOF] {
    std::array::from_fn(|dof| verdict(values[dof], deviations[dof]))
}

/// What people should know before they trust the numbers, the gravest first.
fn warnings(estimate: &Estimate, basis: &Basis) -> Vec<String> {
    let mut warnings = Vec::new();
    let mut warn = |warning: &dyn Display| warnings.push(warning.to_string());
    match estimate.acceptance {
        Acceptance::Consistent => {}
        Acceptance::ModelSuspect => warn(&format_args!(
            "residuals are larger than the noise explains (chi^2/dof {:.2}): check masses, TCP, gravity and sensors",
            estimate.consistency
        )),
        Acceptance::Unsettled => {
            warn(&"the search ended before it was sure of the minimum: record more poses");
        }
    }
    if !basis.trouble.is_empty() {
        warn(&basis.trouble);
    }
    if let Some(refusal) = &basis.refusal {
        warn(refusal);
    }
    if basis.forgotten > 0 {
        warn(&format_args!(
            "{} poses forgotten to keep the newest {MAX_EXPERIMENTS}",
            basis.forgotten
        ));
    }
    let Counts { wrong_length, bus_errors, .. } = &basis.counts;
    if *wrong_length > 0 {
        warn(&format_args!(
            "{wrong_length} frames of another length than the DBC file says, left out"
        ));
    }
    if *bus_errors > 0 {
        warn(&format_args!("the bus reported {bus_errors} errors"));
    }
    warnings
}

/// Why a record has no spectrum, in words.
pub(super) fn reason(error: SpectrumError) -> String {
    match error {
        SpectrumError::Length(samples) => format!("{samples} samples are too few"),
        SpectrumError::Bins(bins) => format!("its band holds {bins} bins"),
        SpectrumError::Pose(angles) => format!("its pose has {angles} angles"),
        SpectrumError::Signal => "it has no force, or values that are not finite".into(),
    }
}
