//! Poses to cut in: within the joints' limits, the tool in front of the robot and above the floor, and each far from the others.

use flexid_core::chain::Chain;
use flexid_pipeline::model::Model;

use crate::place::Place;

/// Number of poses. The shipped scenario of six joints has as many; the first three are far enough apart to identify the drives.
const POSES: usize = 8;
/// Number of poses to choose from. Chosen: with more, the farthest are hardly farther apart.
const CANDIDATES: usize = 1 << 10;

/// Chooses the poses, and warns if the tool cannot be in front of the robot and above the floor in each.
pub(super) fn choose(model: &Model, chain: &Chain) -> (Vec<Vec<f64>>, Option<String>) {
    let place = Place::in_front(model, chain);
    let is_good = |pose: &Vec<f64>| place.holds(pose);
    let good = place.poses(CANDIDATES).poses.into_iter().map(tidy).filter(is_good);
    let mut chosen = Vec::new();
    add_far_apart(&mut chosen, &good.collect::<Vec<_>>(), place.ranges());
    let found = chosen.len();
    if found == POSES {
        return (chosen, None);
    }
    let within = |pose: &Vec<f64>| {
        pose.iter().zip(place.ranges()).all(|(q, [lower, upper])| (lower..=upper).contains(&q))
    };
    let any: Vec<Vec<f64>> = place.drawn().take(CANDIDATES).map(tidy).filter(within).collect();
    add_far_apart(&mut chosen, &any, place.ranges());
    let warning = format!(
        "the tool is in front of the robot (x > 0) and above the floor (z > 0) of its base in {found} of the scenario's poses: the others \
         are any within the joints' limits"
    );
    (chosen, Some(warning))
}

/// A pose as a file has it.
fn tidy(pose: Vec<f64>) -> Vec<f64> {
    pose.into_iter().map(|angle| (1e3 * angle).round() / 1e3).collect()
}

/// Adds to those `chosen` one of `poses` after the other, each the farthest from those before. The first is the one nearest to the middle of
/// `ranges`.
fn add_far_apart(chosen: &mut Vec<Vec<f64>>, poses: &[Vec<f64>], ranges: &[[f64; 2]]) {
    let distance = |a: &[f64], b: &[f64]| -> f64 {
        let own = a.iter().zip(b).zip(ranges);
        own.map(|((a, b), [lower, upper])| ((a - b) / (upper - lower)).powi(2)).sum()
    };
    let middle: Vec<f64> = ranges.iter().map(|[lower, upper]| 0.5 * (lower + upper)).collect();
    let most = POSES.min(chosen.len() + poses.len());
    while chosen.len() < most {
        let apart = |pose: &Vec<f64>| match chosen.as_slice() {
            [] => -distance(pose, &middle),
            all => all.iter().map(|own| distance(pose, own)).fold(f64::INFINITY, f64::min),
        };
        let next = poses.iter().max_by(|a, b| apart(a).total_cmp(&apart(b))).cloned();
        chosen.extend(next);
    }
}
