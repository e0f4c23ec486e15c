use std::path::Path;

use flexid_core::chain::Chain;
use flexid_pipeline::model::{Kind, Model};
use flexid_simulation::plant::Plant;
use flexid_simulation::scenario::{Scenario, reach};

use super::*;
use crate::urdf::{Base, Imported, Masses, import_with_masses};

pub(super) fn mill3() -> (Model, Chain) {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/scenario/mill3-model.toml");
    let model = Model::load(Path::new(file)).unwrap();
    let chain = model.chain().unwrap();
    (model, chain)
}

/// Published robots of six and seven joints, one without masses.
fn published() -> [(Model, Chain); 3] {
    let robot = |text: &str, tcp: &str, kg: Option<f64>| {
        let masses = Masses { total: kg.map(|kg| (kg, "--mass")), ..Masses::default() };
        let model = import_with_masses(text, tcp, Base::Rigid, &masses).unwrap().model;
        let chain = model.chain().unwrap();
        (model, chain)
    };
    [
        robot(include_str!("../../tests/urdf/universal_ur10e.urdf"), "tool0", None),
        robot(include_str!("../../tests/urdf/kuka_iiwa14.urdf"), "iiwa_link_ee", None),
        robot(include_str!("../../tests/urdf/abb_irb6640_185_280.urdf"), "tool0", Some(1310.0)),
    ]
}

/// Far apart: the farthest joint differs by an eighth of its range at least.
#[test]
fn poses_are_in_front_above_the_floor_and_far_apart() {
    for (model, chain) in published().into_iter().chain([mill3()]) {
        let (poses, warning) = poses::choose(&model, &chain);
        assert_eq!((poses.len(), warning), (8, None), "{}", model.name);
        for (index, pose) in poses.iter().enumerate() {
            let tool = crate::place::tool(&chain, pose);
            assert!(tool.x > tool.y.abs() && tool.z > 0.0, "{}: {tool}", model.name);
            for (angle, joint) in pose.iter().zip(model.driven()) {
                let [lower, upper] = reach(joint);
                assert!((lower..=upper).contains(angle) && angle.abs() < 1.6, "{pose:?}");
            }
            for other in &poses[..index] {
                let apart = pose.iter().zip(other).map(|(a, b)| (a - b).abs());
                assert!(apart.fold(0.0, f64::max) > 0.4, "{pose:?} {other:?}");
            }
        }
    }
}

#[test]
fn a_robot_that_reaches_nowhere_in_front_cuts_where_it_can() {
    let (mut model, _) = mill3();
    model.joints[0].origin_xyz_m = [-9.0, 0.0, -9.0];
    let (poses, warning) = poses::choose(&model, &model.chain().unwrap());
    assert_eq!(poses.len(), 8);
    assert!(warning.unwrap().contains("in 0 of the scenario's poses"));
}

/// Names that are no keys, a sliding joint, a turned axis.
#[test]
fn the_scenario_of_any_robot_is_read() {
    let (mut model, _) = mill3();
    model.joints[0].name = "a \"b\"\\".into();
    model.joints[1].kind = Kind::Prismatic;
    model.joints[1].limits = [0.0, 2.0];
    model.joints[2].axis = [0.5, 0.5, 0.0];
    let chain = model.chain().unwrap();
    let imported = Imported { model: model.clone(), warnings: Vec::new(), origins: Vec::new() };
    let files = files(&imported, &chain, "my \"robot\".urdf").unwrap();
    let [_, (_, dbc), _, (_, scenario), (_, plant), (_, path)] = &files.files;
    let scenario = Scenario::parse(Path::new("scenario.toml"), scenario, &model).unwrap();
    assert_eq!(scenario.experiments.len(), 8);
    Plant::parse(Path::new("plant.toml"), plant, &model).unwrap();
    let path = flexid_pipeline::path::parse(Path::new("path.csv"), path, &model).unwrap();
    assert_eq!(path.len(), 5);
    assert!(dbc.contains("SG_ q2 : 0|32@1- (1e-06,0) [-2147|2147] \"m\" EDGE"), "{dbc}");
}
