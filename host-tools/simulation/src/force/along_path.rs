//! The force along a path: by as much as is engaged, and towards where the tool is fed.

use std::path::Path;

use flexid_pipeline::model::Model;
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::course::REST_S;
use crate::scenario::{Engagement, Scenario};

/// mm/s, and the length of a ramp of the feed, s.
const FEED: f64 = 20.0;
const RAMP_S: f64 = 0.4;

fn pocket() -> (Scenario, Model) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenario");
    let model = Model::load(&folder.join("mill6-model.toml")).unwrap();
    (Scenario::load(&folder.join("mill6-pocket.toml"), &model).unwrap(), model)
}

fn milled(scenario: &Scenario, experiment: &Experiment) -> Vec<Vector3<f64>> {
    let sampling = experiment.sampling(&scenario.measurement);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    milling(&scenario.cutting, experiment, &sampling, &mut rng)
}

/// Mean force while the tool is `from` to `to` mm along a line, N. The line begins after `before` s of the path.
fn mean(force: &[Vector3<f64>], before: f64, [from, to]: [f64; 2]) -> Vector3<f64> {
    // At full feed a line of s mm has taken s/v + T/2.
    let step = |mm: f64| ((REST_S + before + 0.5 * RAMP_S + mm / FEED) * 50_000.0) as usize;
    let part = &force[step(from)..step(to)];
    part.iter().sum::<Vector3<f64>>() / part.len() as f64
}

/// Where a part of the tool is in the work, the force is that part of the force of the whole tool. The first line is 100 mm long.
#[test]
fn the_force_is_that_of_the_part_in_the_work() {
    let (scenario, _) = pocket();
    let part = &scenario.experiments[0];
    let whole = Experiment { engagement: Engagement::default(), ..part.clone() };
    let [part, whole] = [part, &whole].map(|one| milled(&scenario, one));
    let ratio = |before, range| {
        let (part, whole) = (mean(&part, before, range), mean(&whole, before, range));
        assert!(whole.norm() > 10.0);
        part.norm() / whole.norm()
    };
    // From nothing to all of it in 8 mm, of which the ramp takes 4.
    assert!((ratio(0.0, [4.5, 7.5]) - 0.75).abs() < 0.02);
    assert!((ratio(0.0, [10.0, 95.0]) - 1.0).abs() < 1e-4);
    // The third line comes after 113 mm, and is cut with 0.6 from 8 mm on.
    let third = 113.0 / FEED + 2.0 * RAMP_S;
    assert!((ratio(third, [9.0, 95.0]) - 0.6).abs() < 1e-4);
}

/// The mean of the force over a turn of the spindle, by integrals over the immersion of 90°, lies as the path does, seen from the tool.
#[test]
fn the_force_turns_with_the_path() {
    let (scenario, model) = pocket();
    let chain = model.chain().unwrap();
    let cutting = &scenario.cutting;
    let size = f64::from(cutting.teeth) * cutting.peak_tangential_n / (2.0 * PI);
    let ratio = cutting.radial_ratio;
    let along = -size * (0.5 + ratio * 0.25 * PI);
    let across = size * (0.25 * PI - ratio * 0.5);
    let axial = size * cutting.axial_ratio;
    // First line and third line of the pockets in the plates along x and -y, and of the one in the wall along y, in the base.
    let directions = [Vector3::x(), -Vector3::y(), Vector3::y()];
    for (experiment, direction) in scenario.experiments.iter().zip(directions) {
        let whole = Experiment { engagement: Engagement::default(), ..experiment.clone() };
        let force = milled(&scenario, &whole);
        let tool = chain.tool(&experiment.pose).rotation;
        for (sign, before) in [(1.0, 0.0), (-1.0, 113.0 / FEED + 2.0 * RAMP_S)] {
            let found: Vector3<f64> = tool * mean(&force, before, [10.0, 90.0]);
            let (heading, axis) = (sign * direction, tool * Vector3::<f64>::z());
            let expected: Vector3<f64> =
                along * heading + across * axis.cross(&heading) + axial * axis;
            let apart = (found - expected).norm() / expected.norm();
            assert!(apart < 0.01, "{apart}: {found} is not {expected}");
        }
    }
}

/// A force that follows the path cannot follow it along the axis of the tool.
#[test]
fn a_way_along_the_axis_of_the_tool_is_refused() {
    let (_, model) = pocket();
    let text = include_str!("../../../scenario/mill6-pocket.toml");
    let drilled = text.replacen("[100.0, 13.0, 0.0]", "[100.0, 0.0, -13.0]", 1);
    let error = Scenario::parse(Path::new("s.toml"), &drilled, &model).unwrap_err().to_string();
    let message = " path_mm: line 2 goes along the axis of the tool, z of the TCP";
    assert!(error.contains(message) && !error.contains('\n'), "{error}");
}
