//! The confidence of a report.

use flexid_core::identify::{Estimate, PlantEstimate};
use flexid_core::refine::LeftOver;
use flexid_core::sought::Sought;
use flexid_core::verdict::Covariance;
use flexid_wire::confidence::{Confidence, Correlations, HeldOut, JointIntervals, MAX_NUISANCES};
use flexid_wire::left_over;
use flexid_wire::report::Report;
use flexid_wire::text::Label;

use super::directions::weak_direction;
use super::explanations::explanations;
use super::imperfections::{conspicuous, nuisance};
use super::interval::log_normal;
use super::residuals::{Residuals, distortion};
use crate::config::Config;
use crate::names::names;
use crate::record::Pose;

/// Parts of a confidence beside its estimate.
pub(crate) struct Details<'a> {
    /// The estimate, if it is one that holds whatever the imperfections are.
    pub(crate) of_plant: Option<&'a PlantEstimate>,
    /// Places where its residuals are larger than elsewhere.
    pub(crate) left_over: &'a [LeftOver],
    /// Poses of the experiments that it rests on.
    pub(crate) poses: &'a [Pose],
    /// Number of records that it does not rest on.
    pub(crate) left_out: u64,
}

/// Makes the confidence of `report`.
pub(crate) fn confidence(
    config: &Config,
    sought: &Sought,
    estimate: &Estimate,
    report: &Report,
    details: &Details<'_>,
) -> Confidence {
    let &Details { of_plant, left_over, poses, left_out } = details;
    let residuals = Residuals::of(estimate, distortion(left_over));
    let allowed = residuals.allow_intervals();
    let intervals = |values: &[f64; 6], deviations: &[Option<f64>; 6]| {
        std::array::from_fn(|dof| {
            deviations[dof].filter(|_| allowed).map(|std| log_normal(values[dof], std))
        })
    };
    let joints = report.joints.iter().map(|joint| JointIntervals {
        name: joint.name.clone(),
        stiffness_interval: intervals(&joint.stiffness, &joint.stiffness_std),
        damping_interval: intervals(&joint.damping, &joint.damping_std),
    });
    let trust = estimate.trust();
    let own = estimate.imperfections.iter();
    let nuisances = own.map(|found| nuisance(found, &config.model, trust, residuals));
    let imperfections = of_plant.map_or(&[][..], |of_plant| &of_plant.imperfections);
    let imperfections = conspicuous(imperfections, &config.model, trust, residuals);
    let names = names(&config.model, sought);
    let direction = |direction| weak_direction(direction, sought, &names, residuals);
    let held_out = poses.iter().zip(&estimate.held_out).map(|(pose, agreement)| HeldOut {
        pose: pose.clone(),
        frac: agreement.frac,
        vaf: agreement.vaf,
    });
    Confidence {
        joints: joints.collect(),
        nuisances: nuisances.chain(imperfections).take(MAX_NUISANCES).collect(),
        explanations: explanations(of_plant, &config.model).collect(),
        correlations: correlations(&estimate.covariance, &names),
        weak_directions: estimate.weak_directions.iter().map(direction).collect(),
        residuals: residuals.message(),
        left_over: left_over.iter().map(|one| self::left_over(one, poses)).collect(),
        held_out: held_out.collect(),
        retired: estimate.retired,
        left_out,
        robust_widening: of_plant.and_then(|of_plant| of_plant.robust_widening),
    }
}

fn left_over(found: &LeftOver, poses: &[Pose]) -> left_over::LeftOver {
    use left_over::LeftOver as Message;
    match *found {
        LeftOver::Frequency { from_hz, to_hz, times } => {
            Message::Frequency { from_hz, to_hz, times }
        }
        // Axes and records are few.
        LeftOver::Direction { axis, times } => Message::Direction { axis: axis as u8, times },
        LeftOver::Record { record, times } => Message::Record {
            record: record as u8 + 1,
            pose: poses.get(record).cloned().unwrap_or_default(),
            times,
        },
        LeftOver::Time { from, to, times } => Message::Time { from, to, times },
        LeftOver::Force { exponent, deviation } => Message::Force { exponent, std: deviation },
        LeftOver::Stiffness { growth, deviation } => Message::Stiffness { growth, std: deviation },
        LeftOver::Distortion { part } => Message::Distortion { part },
    }
}

fn correlations(covariance: &Covariance, names: &[Label]) -> Correlations {
    let count = names.len().min(covariance.unknowns());
    let pairs = (1..count).flat_map(|row| (0..row).map(move |column| (row, column)));
    Correlations {
        unknowns: names[..count].iter().cloned().collect(),
        // The conversion saturates. NaN becomes 0.
        percent: pairs.map(|(i, j)| (100.0 * covariance.correlation(i, j)).round() as i8).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::interval::normal;

    #[test]
    fn an_interval_is_as_wide_as_its_deviation_says() {
        let [lower, upper] = log_normal(2e7, 2e6);
        // exp(±0.1959964)
        assert!((lower - 1.644_033e7).abs() < 1e2 && (upper - 2.433_041e7).abs() < 1e2);
        assert_eq!(normal(1.0, 0.0), [1.0, 1.0]);
    }
}
