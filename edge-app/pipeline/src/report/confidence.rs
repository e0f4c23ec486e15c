//! The confidence of a report.

use flexid_core::identify::{Estimate, PlantEstimate};
use flexid_core::refine::LeftOver;
use flexid_core::sought::{self, Coordinate, Sought};
use flexid_core::verdict::{Covariance, Trust};
use flexid_wire::confidence::{
    Confidence, Correlations, HeldOut, Interval, JointIntervals, MAX_NUISANCES, Nuisance,
};
use flexid_wire::left_over;
use flexid_wire::report::Report;
use flexid_wire::text::{Label, clipped};

use super::directions::weak_direction;
use super::explanations::explanations;
use super::imperfections::conspicuous;
use super::interval::{log_normal, normal};
use super::residuals::{Residuals, distortion};
use super::verdict::verdict;
use crate::config::Config;
use crate::names::{name, names};
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
    let nuisances = estimate.nuisances.iter().map(|found| Nuisance {
        name: name(&config.model, found.coordinate),
        ..nuisance(found, sought.width(found.coordinate), trust, residuals)
    });
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

/// Makes a nuisance without its name. The verdict compares its deviation with that of its prior, `width`. The interval does not
/// depend on the verdict, since the prior is known in any case.
fn nuisance(found: &sought::Nuisance, width: f64, trust: Trust, residuals: Residuals) -> Nuisance {
    let value = found.value;
    let (own, _) = trust.verdict(1.0, found.deviation / width);
    let deviation = residuals.inflate(found.deviation);
    let (unit, std, interval): (_, _, fn(f64, f64) -> Interval) = match found.coordinate {
        Coordinate::Delay => ("s", deviation, normal),
        Coordinate::Misalignment(_) => ("rad", deviation, normal),
        // The deviation of a factor is relative.
        _ => ("", deviation.map(|deviation| deviation * value), log_normal),
    };
    Nuisance {
        name: Default::default(),
        entry: None,
        accuracy: None,
        unit: clipped(unit),
        value,
        std,
        interval: std.filter(|_| residuals.allow_intervals()).map(|std| interval(value, std)),
        verdict: verdict(own),
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
    use flexid_wire::report::Verdict;

    use super::*;
    use crate::report::interval::WITHIN;

    #[test]
    fn an_interval_is_as_wide_as_its_deviation_says() {
        let [lower, upper] = log_normal(2e7, 2e6);
        // exp(±0.1959964)
        assert!((lower - 1.644_033e7).abs() < 1e2 && (upper - 2.433_041e7).abs() < 1e2);
        assert_eq!(normal(1.0, 0.0), [1.0, 1.0]);
    }

    #[test]
    fn a_nuisance_is_judged_by_what_was_known_beforehand() {
        let found_in = |consistency, coordinate, value, deviation| {
            let found = sought::Nuisance { coordinate, value, deviation };
            let (trust, residuals) = (Trust::new(consistency, true), Residuals::noise(consistency));
            nuisance(&found, 1e-2, trust, residuals)
        };
        let found = |coordinate, value, deviation| found_in(1.96, coordinate, value, deviation);
        // The deviations are 1.4 times as large, since the residuals are 1.4 times as large as the noise explains.
        let delay = found(Coordinate::Delay, 3e-4, 1e-4);
        assert_eq!((delay.unit.as_str(), delay.verdict), ("s", Verdict::Identified));
        assert!((delay.std.unwrap() - 1.4e-4).abs() < 1e-12);
        assert!((delay.interval.unwrap()[0] - (3e-4 - WITHIN * 1.4e-4)).abs() < 1e-12);
        let gain = found(Coordinate::ForceGain(0), 1.1, 1e-3);
        assert_eq!((gain.unit.as_str(), gain.verdict), ("", Verdict::Weak));
        assert!((gain.std.unwrap() - 1.1 * 1.4e-3).abs() < 1e-12);
        assert!((gain.interval.unwrap()[1] - 1.1 * (WITHIN * 1.4e-3).exp()).abs() < 1e-12);
        // The data add next to nothing, but the prior remains.
        let late = found(Coordinate::Delay, 1e-3, 5e-3);
        assert_eq!(late.verdict, Verdict::NotObservable);
        assert!((late.interval.unwrap()[1] - (1e-3 + WITHIN * 7e-3)).abs() < 1e-12);
        let huge = found_in(100.0, Coordinate::Delay, 1e-3, 5e-4);
        assert_eq!((huge.std, huge.interval), (Some(5e-3), None));
        let broken = found_in(f64::NAN, Coordinate::Delay, 1e-3, 5e-4);
        assert_eq!((broken.verdict, broken.std), (Verdict::NotObservable, None));
    }
}
