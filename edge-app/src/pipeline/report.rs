//! The one report that the daemon sends and the offline tool writes.

use std::fmt::Display;

use flexid_core::DOF;
use flexid_core::identify::{Acceptance, Estimate};
use flexid_core::spectrum::SpectrumError;
use flexid_wire::messages::Progress;
use flexid_wire::report::{self, Fit, JointReport, Report, Verdict};
use flexid_wire::text::clipped;

use super::obstacle::wrong_rate;
use super::verdict::Trust;
use super::{Counts, MAX_EXPERIMENTS, MisfitKind};
use crate::config::Config;
use crate::summary::count;

/// What a report rests on beside the estimate.
pub(super) struct Basis<'a> {
    pub(super) progress: Progress,
    /// Records that were taken in when the estimate settled.
    pub(super) records: u64,
    pub(super) counts: Counts,
    /// Computing time, s.
    pub(super) seconds: f64,
    /// Which records had no spectrum, and why.
    pub(super) refusal: Option<String>,
    /// Which records came too late to be in the numbers.
    pub(super) left_out: Option<String>,
    /// Poses that had to make room.
    pub(super) forgotten: u64,
    /// What went wrong at the source; empty when nothing did.
    pub(super) trouble: &'a str,
}

pub(super) fn report(config: &Config, estimate: &Estimate, basis: &Basis) -> Report {
    let trust = Trust::new(estimate);
    let bushings = estimate.bushings.iter().zip(&estimate.standard_deviations);
    let joints = config.model.joints.iter().zip(bushings).map(|(joint, (value, deviation))| {
        let stiffness = judge(trust, &value.stiffness, &deviation.stiffness);
        let damping = judge(trust, &value.damping, &deviation.damping);
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
            records: basis.records,
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
        warnings: warnings(config, estimate, basis)
            .iter()
            .take(report::MAX_WARNINGS)
            .map(clipped)
            .collect(),
    }
}

fn judge(
    trust: Trust,
    values: &[f64; DOF],
    deviations: &[f64; DOF],
) -> [(Verdict, Option<f64>); DOF] {
    std::array::from_fn(|dof| trust.verdict(values[dof], deviations[dof]))
}

/// What people should know before they trust the numbers, the gravest first.
fn warnings(config: &Config, estimate: &Estimate, basis: &Basis) -> Vec<String> {
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
    for reason in [&basis.left_out, &basis.refusal].into_iter().flatten() {
        warn(reason);
    }
    let Counts { wrong_length, bus_errors, misfit, at_limit, .. } = &basis.counts;
    if let Some(wrong_rate) = wrong_rate(&basis.counts, config) {
        let records = basis.counts.stream.wrong_rate;
        warn(&format_args!("{}: {wrong_rate}", count(records, "record")));
    }
    let clipped = config.signals.axes.iter().zip(at_limit).filter(|(_, frames)| **frames > 0);
    let clipped: Vec<_> = clipped.map(|(name, frames)| format!("{name} in {frames}")).collect();
    if !clipped.is_empty() {
        warn(&format_args!(
            "at the limit: {} frames: widen the range of the sensor or the signal",
            clipped.join(", ")
        ));
    }
    if basis.forgotten > 0 {
        warn(&format_args!(
            "{} poses forgotten to keep the newest {MAX_EXPERIMENTS} records",
            basis.forgotten
        ));
    }
    match misfit {
        Some(misfit) if matches!(misfit.kind, MisfitKind::Length { .. }) => {
            let frames = count(*wrong_length, "frame");
            warn(&format_args!("{frames} of another length than [bus] dbc says: {misfit}"));
        }
        // Others ask for data, too.
        Some(misfit) if misfit.kind != MisfitKind::Remote => warn(misfit),
        _ => {}
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
        SpectrumError::NotFinite => "it has values that are not finite".into(),
        SpectrumError::NoForce => "in the band it has hardly more force than noise".into(),
    }
}
