//! A robot on a pedestal that gives way: identified with and without the pedestal in its model.

use std::fs;

use serde_json::Value;

use crate::setup::{edit, flexid, folder, identified, json, stderr};

/// A steel frame. The simulation has it under its own chain.
const PLANT: &str = "
[pedestal]
mass_kg = 300.0
stiffness = [1e9, 1e9, 1e9, 1e9, 1e9, 1e9]
damping = [1e5, 1e5, 1e5, 1e5, 1e5, 1e5]
";

/// Bounds as of the joints, but stiffer.
const BOUNDS: &str = "
[bounds.joints.pedestal]
stiffness_translation_n_per_m = [1.0e8, 1.0e10]
stiffness_rotation_nm_per_rad = [1.0e8, 1.0e10]
damping_translation_ns_per_m = [1.0e4, 1.0e6]
damping_rotation_nms_per_rad = [1.0e4, 1.0e6]

[bus]";

/// Numbers of the identified parameters of the robot's three joints, and of those whose intervals do not hold the truth.
fn identified_and_missed(found: &Value, truth: &Value) -> [usize; 2] {
    let joints = found["joints"].as_array().unwrap().iter();
    let intervals = found["confidence"]["joints"].as_array().unwrap();
    let (mut identified, mut missed) = (0, 0);
    for (joint, of) in joints.zip(intervals) {
        let Some(truth) = truth["truth"].get(joint["name"].as_str().unwrap()) else { continue };
        for kind in ["stiffness", "damping"] {
            for dof in 0..6 {
                if joint[format!("{kind}_verdict")][dof] == "identified" {
                    let interval = &of[format!("{kind}_interval")][dof];
                    let [lower, upper] = [0, 1].map(|end| interval[end].as_f64().unwrap());
                    let truth = truth[kind][dof].as_f64().unwrap();
                    identified += 1;
                    missed += usize::from(!(lower..=upper).contains(&truth));
                }
            }
        }
    }
    [identified, missed]
}

/// The cuts turn joint 1 by up to 1.3 rad. The ground gives way by twice its typical accuracy along the axes of the base, and by that about
/// them. Found: without the pedestal 33 parameters identified, and 2 intervals too narrow, of joint 1 along its axes; with it 34, and 1. Of
/// 36 intervals of 95 % more than 5 miss once in 100 times, if they are independent.
#[test]
fn a_pedestal_in_the_model_takes_what_gives_way_under_the_robot() {
    let folder = folder();
    let folder = folder.path();
    fs::write(folder.join("plant.toml"), PLANT).unwrap();
    let edge = folder.join("edge.toml");
    let typical = || edit(&edge, "assume = \"perfect\"", "");
    let simulation = "--plant plant.toml --truth-json t.json";
    let (_, without) = identified(folder, simulation, typical);
    let truth = json(folder, "t.json");
    let [found, missed] = identified_and_missed(&without, &truth);
    assert_eq!(without["fit"]["acceptance"], "consistent");
    assert!(found >= 33 && missed <= 5, "{missed} of {found} intervals miss the truth");
    let explanation = &without["confidence"]["explanations"][0]["deviation"];
    assert!(explanation["name"].as_str().unwrap().starts_with("ground r"), "{explanation}");
    let [value, std] = ["value", "std"].map(|key| explanation[key].as_f64().unwrap());
    assert!((value - 1e-9).abs() < 2.0 * std && std < 3e-10, "{explanation}");

    let import = "model import mill3.urdf --tcp tcp --pedestal -o mill3-model.toml";
    let imported = flexid(folder, import);
    assert!(imported.status.success(), "{}", stderr(&imported));
    assert!(stderr(&imported).contains("the pedestal is taken as 298.8 kg"));
    let said = String::from_utf8(imported.stdout).unwrap();
    assert!(said.contains("mill3 with 3 joints on a pedestal and 1494.0 kg"), "{said}");
    edit(&edge, "\n[bus]", BOUNDS);
    let output = flexid(folder, "identify --config edge.toml o.log --json o.json --truth t.json");
    assert!(output.status.success(), "{}", stderr(&output));
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("not compared: pedestal, which only the model has\n"), "{said}");
    let with = json(folder, "o.json");
    assert_eq!(with["fit"]["acceptance"], "consistent");
    let [found, missed] = identified_and_missed(&with, &truth);
    assert!(found >= 30 && missed <= 5, "{missed} of {found} intervals miss the truth");
    let names: Vec<_> = with["joints"].as_array().unwrap().iter().map(|j| &j["name"]).collect();
    assert_eq!(names, ["pedestal", "joint_1", "joint_2", "joint_3"]);
    // Along and about the axis of joint 1 no pose tells it from that joint; across the axis they do, roughly.
    let pedestal = &with["joints"][0];
    for dof in [2, 5] {
        assert_eq!(pedestal["stiffness_verdict"][dof], "not_observable", "{pedestal}");
    }
    for dof in [0, 1] {
        let [lower, upper] = [0, 1].map(|end| {
            with["confidence"]["joints"][0]["stiffness_interval"][dof][end].as_f64().unwrap()
        });
        assert!((lower..=upper).contains(&1e9) && upper < 3.0 * lower, "{lower} to {upper}");
    }
}
