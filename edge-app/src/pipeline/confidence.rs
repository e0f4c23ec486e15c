//! What the daemon sends beside a report: how far to trust it.

use flexid_core::identify::{Acceptance, Estimate};
use flexid_core::unknowns::{self, Coordinate, Sought};
use flexid_core::verdict::{Covariance, Direction, Trust};
use flexid_wire::confidence::{
    Confidence, Correlations, HeldOut, Interval, JointIntervals, Nuisance, Share, WeakDirection,
};
use flexid_wire::report::Report;
use flexid_wire::text::clipped;

use super::Pose;
use super::names::{enumerate, name, names};
use super::report::verdict;
use super::residuals::Residuals;
use crate::config::Config;

/// 95 % of a normal distribution lie within so many standard deviations.
const WITHIN: f64 = 1.959_964;
/// Who takes part in a direction is named in words with this much of the one that takes part most.
const NAMED: f32 = 1.0 / 3.0;
/// Bytes for their names: the line has 160.
const ROOM: usize = 110;

/// `poses` are those of the experiments that the estimate rests on.
pub(super) fn confidence(
    config: &Config,
    sought: &Sought,
    estimate: &Estimate,
    report: &Report,
    poses: &[Pose],
) -> Confidence {
    let residuals = Residuals::of(estimate);
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
    let trust = Trust::new(estimate.consistency, estimate.acceptance != Acceptance::Unsettled);
    let nuisances = estimate.nuisances.iter().map(|found| Nuisance {
        name: clipped(name(&config.model, found.coordinate)),
        ..nuisance(found, sought.width(found.coordinate), trust, allowed)
    });
    let names = names(&config.model, sought);
    let direction = |direction| weak_direction(direction, &names, residuals.inflation());
    let held_out = poses.iter().zip(&estimate.held_out).map(|(pose, agreement)| HeldOut {
        pose: pose.clone(),
        frac: agreement.frac,
        vaf: agreement.vaf,
    });
    Confidence {
        joints: joints.collect(),
        nuisances: nuisances.collect(),
        correlations: correlations(&estimate.covariance, &names),
        weak_directions: estimate.weak_directions.iter().map(direction).collect(),
        residuals: residuals.message(),
        held_out: held_out.collect(),
        retired: estimate.retired,
    }
}

/// Of a value whose logarithm has an error.
fn log_normal(value: f64, standard_deviation: f64) -> Interval {
    let factor = (WITHIN * standard_deviation / value).exp();
    [value / factor, value * factor]
}

/// A nuisance without its name. The data tell it as well as its standard deviation is small against what was known beforehand,
/// `width`.
fn nuisance(found: &unknowns::Nuisance, width: f64, trust: Trust, allowed: bool) -> Nuisance {
    let value = found.value;
    let (told, relative) = trust.verdict(1.0, found.deviation / width);
    let deviation = relative.map(|relative| relative * width);
    let (unit, std, interval): (_, _, fn(f64, f64) -> Interval) = match found.coordinate {
        Coordinate::Delay => ("s", deviation, normal),
        Coordinate::Misalignment(_) => ("rad", deviation, normal),
        // The deviation of a factor is relative.
        _ => ("", deviation.map(|deviation| deviation * value), log_normal),
    };
    Nuisance {
        name: Default::default(),
        unit: clipped(unit),
        value,
        std,
        interval: std.filter(|_| allowed).map(|std| interval(value, std)),
        verdict: verdict(told),
    }
}

fn normal(value: f64, standard_deviation: f64) -> Interval {
    [value - WITHIN * standard_deviation, value + WITHIN * standard_deviation]
}

fn correlations(covariance: &Covariance, names: &[String]) -> Correlations {
    let count = names.len().min(covariance.unknowns());
    let pairs = (1..count).flat_map(|row| (0..row).map(move |column| (row, column)));
    Correlations {
        unknowns: names[..count].iter().map(clipped).collect(),
        // The conversion saturates; what is no number becomes 0.
        percent: pairs.map(|(i, j)| (100.0 * covariance.correlation(i, j)).round() as i8).collect(),
    }
}

fn weak_direction(direction: &Direction, names: &[String], inflation: f64) -> WeakDirection {
    let named = |&(unknown, weight): &(u8, f32)| {
        names.get(usize::from(unknown)).map(|name| (name.as_str(), weight))
    };
    let shares: Vec<(&str, f32)> = direction.shares.iter().filter_map(named).collect();
    let deviation = inflation * direction.deviation;
    WeakDirection {
        relative_std: Some(deviation).filter(|deviation| deviation.is_finite()),
        text: clipped(words(&shares, deviation)),
        shares: shares
            .into_iter()
            .map(|(name, weight)| Share { name: clipped(name), weight })
            .collect(),
    }
}

/// A direction in words.
fn words(shares: &[(&str, f32)], deviation: f64) -> String {
    let largest = shares.iter().map(|(_, weight)| weight.abs()).fold(0.0, f32::max);
    let takes_part = |(_, weight): &&(&str, f32)| weight.abs() >= NAMED * largest;
    let names: Vec<&str> = shares.iter().filter(takes_part).map(|(name, _)| *name).collect();
    let how_badly = match deviation {
        deviation if !deviation.is_finite() => "not told at all".to_owned(),
        deviation if deviation > 10.0 => "over 1000 %".to_owned(),
        deviation => format!("{:.0} %", 100.0 * deviation),
    };
    let what = if names.len() > 1 { "trade off in" } else { "is hardly told by" };
    format!("{} {what} these poses ({how_badly})", enumerate(&names, ROOM))
}

#[cfg(test)]
mod tests {
    use flexid_wire::report::Verdict;

    use super::*;

    #[test]
    fn an_interval_is_as_wide_as_its_deviation_says() {
        let [lower, upper] = log_normal(2e7, 2e6);
        // exp(±0.1959964)
        assert!((lower - 1.644_033e7).abs() < 1e2 && (upper - 2.433_041e7).abs() < 1e2);
        assert_eq!(normal(1.0, 0.0), [1.0, 1.0]);
    }

    #[test]
    fn a_direction_is_told_by_those_who_matter() {
        let (a, b, c) = ("joint_1 tx stiffness", "joint_2 tx stiffness", "joint_2 rz damping");
        let cases = [
            (
                vec![(a, 0.8), (b, -0.55), (c, 0.2)],
                0.312,
                "joint_1 tx stiffness and joint_2 tx stiffness trade off in these poses (31 %)",
            ),
            (
                vec![(c, 0.99), (a, 0.1)],
                0.42,
                "joint_2 rz damping is hardly told by these poses (42 %)",
            ),
            (
                vec![(a, 0.6), (b, 0.6), (c, 0.5)],
                f64::INFINITY,
                "joint_1 tx stiffness, joint_2 tx stiffness and joint_2 rz damping trade off in \
                 these poses (not told at all)",
            ),
            (
                vec![(a, 1.0)],
                50.0,
                "joint_1 tx stiffness is hardly told by these poses (over 1000 %)",
            ),
        ];
        for (shares, deviation, expected) in cases {
            assert_eq!(words(&shares, deviation), expected);
        }
        let long = "j".repeat(45);
        let shares = [(long.as_str(), 0.4); 6];
        let text = words(&shares, 3.0);
        assert!(text.ends_with("and 4 more trade off in these poses (300 %)"), "{text}");
        assert!(text.len() <= 160, "{text}");
    }

    #[test]
    fn a_nuisance_is_judged_by_what_was_known_beforehand() {
        let trust = Trust::new(4.0, true);
        let found = |coordinate, value, deviation| {
            let found = unknowns::Nuisance { coordinate, value, deviation };
            nuisance(&found, 1e-2, trust, true)
        };
        // Deviations are doubled, since the residuals are twice as large as the noise.
        let delay = found(Coordinate::Delay, 3e-4, 1e-4);
        assert_eq!((delay.unit.as_str(), delay.verdict), ("s", Verdict::Identified));
        assert!((delay.std.unwrap() - 2e-4).abs() < 1e-12);
        assert!((delay.interval.unwrap()[0] - (3e-4 - WITHIN * 2e-4)).abs() < 1e-12);
        let gain = found(Coordinate::ForceGain(0), 1.1, 1e-3);
        assert_eq!((gain.unit.as_str(), gain.verdict), ("", Verdict::Weak));
        assert!((gain.std.unwrap() - 1.1 * 2e-3).abs() < 1e-12);
        assert!((gain.interval.unwrap()[1] - 1.1 * (WITHIN * 2e-3).exp()).abs() < 1e-12);
        let mass = found(Coordinate::Mass(0), 1.0, 9e-3);
        assert_eq!((mass.verdict, mass.std, mass.interval), (Verdict::NotObservable, None, None));
    }
}
