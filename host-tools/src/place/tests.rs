//! Poses in front of the robots of the scenarios.

use std::f64::consts::PI;
use std::path::Path;

use flexid_pipeline::config::Config;
use flexid_simulation::scenario::Scenario;

use super::*;

/// A robot of the scenarios, and the poses of its experiments.
fn robot(name: &str) -> (Model, Chain, Vec<Vec<f64>>) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenario");
    let config = Config::load(&folder.join(format!("{name}-edge.toml"))).unwrap();
    let scenario = Scenario::of(&config).unwrap();
    let poses = scenario.experiments.iter().map(|own| own.pose.clone()).collect();
    let chain = config.model.chain().unwrap();
    (config.model, chain, poses)
}

/// The place of a robot on the ground.
fn about<'a>(
    model: &Model,
    chain: &'a Chain,
    references: &[Vec<f64>],
    tool_box: Option<ToolBox>,
    is_near: bool,
) -> Place<'a> {
    Place::about(model, chain, [0.0, 0.0, -9.81], references, tool_box, is_near)
}

#[test]
fn poses_are_in_front_above_the_floor_and_below_the_ceiling() {
    for name in ["mill3", "mill6"] {
        let (model, chain, references) = robot(name);
        let place = about(&model, &chain, &references[..1], None, false);
        let Poses { poses, .. } = place.poses(200);
        assert_eq!(poses.len(), 200);
        let nowhere =
            Place { floor: -9.0, ceiling: 9.0, front: None, ..place.clone() }.poses(200).poses;
        // The references mill along x, and the shoulders of both robots are below 1.2 m.
        let highest = tool(&chain, &references[0]).z.max(1.2);
        let behind = |pose: &Vec<f64>| tool(&chain, pose).x < -0.3;
        let above = |pose: &Vec<f64>| tool(&chain, pose).z > highest;
        let below =
            |pose: &Vec<f64>| Stance::of(&chain, &Vector3::z_axis(), pose).lowest < place.floor;
        type Wrong<'a> = &'a dyn Fn(&Vec<f64>) -> bool;
        let cases: [(&str, Wrong<'_>); 3] =
            [("behind", &behind), ("above", &above), ("below", &below)];
        for (place_of, wrong) in cases {
            assert_eq!(poses.iter().filter(|own| wrong(own)).count(), 0, "{name} {place_of}");
            let others = nowhere.iter().filter(|own| wrong(own)).count();
            assert!(others > 10, "{name}: {others} {place_of}");
        }
    }
}

/// A pose that is reached with a whole turn less has its hoses not wound up.
#[test]
fn no_joint_is_more_than_half_a_turn_from_the_references() {
    let (model, chain, references) = robot("mill6");
    let place = about(&model, &chain, &references[..1], None, false);
    assert!(model.driven().any(|joint| joint.limits[1] - joint.limits[0] > 3.0 * PI));
    for pose in place.poses(100).poses {
        for (angle, reference) in pose.iter().zip(&references[0]) {
            assert!((angle - reference).abs() <= PI, "{pose:?}");
        }
    }
}

#[test]
fn a_box_holds_all_tools_and_one_beyond_reach_none() {
    let (model, chain, references) = robot("mill6");
    let tool_box = [[0.5, 0.9], [-0.3, 0.3], [0.2, 0.6]];
    let place = about(&model, &chain, &references, Some(tool_box), false);
    let Poses { poses, .. } = place.poses(20);
    assert_eq!(poses.len(), 20);
    let kept = place.keep(poses.iter().chain(&references).cloned().collect());
    assert!(kept.len() >= 20 && kept[..20] == poses, "{}", kept.len());
    for pose in &poses {
        let at = tool(&chain, pose);
        for ([least, most], at) in tool_box.iter().zip(at.iter()) {
            assert!((*least..=*most).contains(at), "{at}");
        }
    }
    let far = Some([[9.0, 10.0], [-0.3, 0.3], [0.2, 0.6]]);
    let Poses { poses, reached } = about(&model, &chain, &references, far, false).poses(4);
    let [[_, most], ..] = reached.unwrap();
    assert!(poses.is_empty() && (0.5..9.0).contains(&most), "{most}");
}

#[test]
fn the_nearest_are_nearer_than_the_others() {
    let (model, chain, references) = robot("mill6");
    let of = |is_near| {
        let place = about(&model, &chain, &references[..1], None, is_near);
        let there = tool(&chain, &references[0]);
        let mut far: Vec<f64> =
            place.poses(64).poses.iter().map(|pose| (tool(&chain, pose) - there).norm()).collect();
        far.sort_by(f64::total_cmp);
        far
    };
    let (near, all) = (of(true), of(false));
    assert!(near.len() == 64 && near[63] < 0.7 * all[32], "{} {}", near[63], all[32]);
}

/// A robot that has milled higher than its shoulder, and below its base, may do so again.
#[test]
fn the_references_widen_floor_and_ceiling() {
    let (model, chain, references) = robot("mill6");
    let of = |references: &[Vec<f64>]| about(&model, &chain, references, None, false);
    let stances: Vec<_> =
        references.iter().map(|pose| Stance::of(&chain, &Vector3::z_axis(), pose)).collect();
    let highest = stances.iter().map(|own| own.height).fold(0.0, f64::max);
    let shoulder = stances[0].shoulder;
    assert!(highest > shoulder, "{highest} {shoulder}");
    assert_eq!(of(&references).ceiling, highest);
    let own = of(&references[..1]);
    assert_eq!(own.ceiling, shoulder.max(stances[0].height));
    assert_eq!(own.floor, stances[0].lowest.min(0.0));
    let tool_box = [[0.0, 1.0]; 3];
    let boxed = about(&model, &chain, &references, Some(tool_box), false);
    assert!(boxed.front.is_none() && boxed.ceiling == f64::INFINITY);
}

/// A robot on a ceiling mills below its base, and its tool is below its shoulder against gravity, not along the base's z.
#[test]
fn heights_are_against_gravity() {
    let (model, chain, references) = robot("mill6");
    let of = |gravity| Place::about(&model, &chain, gravity, &references[..1], None, false);
    let ceiling = of([0.0, 0.0, 9.81]);
    let own = Stance::of(&chain, &-Vector3::z_axis(), &references[0]);
    assert_eq!((ceiling.floor, ceiling.ceiling), (own.lowest, own.shoulder.max(own.height)));
    assert!(own.lowest < -0.3, "{}", own.lowest);
    for pose in ceiling.poses(50).poses {
        // Along the base's z, nothing is above the highest part of the reference.
        let own = Stance::of(&chain, &Vector3::z_axis(), &pose);
        assert!(own.tool.z <= -ceiling.floor && own.tool.z >= -ceiling.ceiling, "{pose:?}");
    }
    let [none, ground] = [[0.0; 3], [0.0, 0.0, -9.81]].map(of);
    assert_eq!(none.poses(20), ground.poses(20));
}

/// A box in a pit is reached by an arm that reaches down there.
#[test]
fn a_box_below_the_base_lowers_the_floor() {
    let (model, chain, references) = robot("mill6");
    let pit = Some([[0.3, 1.5], [-0.8, 0.8], [-0.5, -0.05]]);
    let Poses { poses, .. } = about(&model, &chain, &references, pit, false).poses(8);
    assert_eq!(poses.len(), 8);
    for pose in &poses {
        assert!((-0.5..=-0.05).contains(&tool(&chain, pose).z), "{pose:?}");
    }
}
