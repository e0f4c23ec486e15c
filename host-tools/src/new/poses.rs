//! Poses to cut in: within the joints' limits, the tool in front of the robot and above the floor, and each far from the others.

use std::f64::consts::FRAC_PI_2;

use flexid_core::chain::Chain;
use flexid_pipeline::model::{Kind, Model, ModelJoint};
use flexid_simulation::scenario::reach;
use nalgebra::{Isometry3, Point3};

/// Number of poses. The shipped scenario of six joints has as many; the first three are far enough apart to identify the drives.
const POSES: usize = 8;
/// Number of poses to choose from.
const CANDIDATES: u32 = 1 << 14;
/// Seed of the poses.
const SEED: u32 = 1;
/// Largest turn of a joint from its zero: what hoses and cables bear without a guide.
const TURN: f64 = FRAC_PI_2;
/// Least distance in front of the base, over the length of the arm: nearer, the tool is above the robot's foot.
const NEAREST: f64 = 0.25;
/// Greatest height of the tool over the length of the arm: workpieces lie below the elbow.
const HIGHEST: f64 = 0.5;

/// Chooses the poses, and warns if the tool cannot be in front of the robot and above the floor.
pub(super) fn choose(model: &Model, chain: &Chain) -> (Vec<Vec<f64>>, Option<String>) {
    let ranges: Vec<[f64; 2]> = model.driven().map(range).collect();
    let pose = |index: u32| -> Vec<f64> {
        let angle = |(&[lower, upper], dimension): (&[f64; 2], u32)| {
            lower + (upper - lower) * f64::from(sobol_burley::sample(index, dimension, SEED))
        };
        ranges.iter().zip(0..).map(angle).map(|angle| (1e3 * angle).round() / 1e3).collect()
    };
    let within = |pose: &Vec<f64>| {
        pose.iter().zip(&ranges).all(|(q, [lower, upper])| (lower..=upper).contains(&q))
    };
    let all: Vec<Vec<f64>> = (0..CANDIDATES).map(pose).filter(within).collect();
    let good: Vec<Vec<f64>> = all.iter().filter(|pose| is_at_work(chain, pose)).cloned().collect();
    if good.len() < POSES {
        let warning = "the tool is nowhere in front of the robot (x > 0) and above the floor (z > 0) of its base: the poses of the scenario are \
                       any within the joints' limits";
        return (far_apart(&all, &ranges), Some(warning.to_owned()));
    }
    (far_apart(&good, &ranges), None)
}

/// Place of the TCP in the base, m.
pub(super) fn tool(chain: &Chain, pose: &[f64]) -> Point3<f64> {
    places(chain, pose).last().copied().unwrap_or_default()
}

/// Limits of a joint, of a turning joint within [`TURN`] of its zero, rad (m).
fn range(joint: &ModelJoint) -> [f64; 2] {
    let [lower, upper] = reach(joint);
    if joint.kind == Kind::Prismatic {
        return [lower, upper];
    }
    let zero = 0.0_f64.clamp(lower, upper);
    [lower.max(zero - TURN), upper.min(zero + TURN)]
}

/// Tells whether the tool is in front of the robot, at the height of a workpiece, and all of the arm above the floor.
fn is_at_work(chain: &Chain, pose: &[f64]) -> bool {
    let places = places(chain, pose);
    let arm: f64 = places.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    let in_front = |tool: &Point3<f64>| {
        tool.x > tool.y.abs().max(NEAREST * arm) && (0.0..HIGHEST * arm).contains(&tool.z)
    };
    places.last().is_some_and(in_front) && places.iter().all(|place| place.z >= 0.0)
}

/// Origins of the joints, and the TCP last, in the base, m.
fn places(chain: &Chain, pose: &[f64]) -> Vec<Point3<f64>> {
    let mut frame = Isometry3::identity();
    let mut places = Vec::new();
    for (joint, angle) in chain.joints().iter().zip(chain.angles(pose)) {
        frame *= joint.frame(angle);
        places.push(frame * Point3::origin());
    }
    places.push(frame * chain.tcp() * Point3::origin());
    places
}

/// Of `poses` the one nearest to the middle of `ranges`, then one after the other the farthest from those chosen.
fn far_apart(poses: &[Vec<f64>], ranges: &[[f64; 2]]) -> Vec<Vec<f64>> {
    let distance = |a: &[f64], b: &[f64]| -> f64 {
        let own = a.iter().zip(b).zip(ranges);
        own.map(|((a, b), [lower, upper])| ((a - b) / (upper - lower)).powi(2)).sum()
    };
    let middle: Vec<f64> = ranges.iter().map(|[lower, upper]| 0.5 * (lower + upper)).collect();
    let from_middle = |pose: &&Vec<f64>| distance(pose, &middle);
    let first = poses.iter().min_by(|a, b| from_middle(a).total_cmp(&from_middle(b)));
    let mut chosen: Vec<Vec<f64>> = first.into_iter().cloned().collect();
    while chosen.len() < POSES.min(poses.len()) {
        let apart = |pose: &Vec<f64>| {
            chosen.iter().map(|own| distance(pose, own)).fold(f64::INFINITY, f64::min)
        };
        let next = poses.iter().max_by(|a, b| apart(a).total_cmp(&apart(b))).cloned();
        chosen.extend(next);
    }
    chosen
}
