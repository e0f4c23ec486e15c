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

/// Numbers of parameters of the robot's three joints that are identified, and of their intervals that hold the truth.
fn held(found: &Value, truth: &Value) -> [usize; 2] {
    let joints = found["joints"].as_array().unwrap().iter();
    let intervals = found["confidence"]["joints"].as_array().unwrap();
    let (mut identified, mut held) = (0, 0);
    for (joint, of) in joints.zip(intervals) {
        let Some(truth) = truth["truth"].get(joint["name"].as_str().unwrap()) else { continue };
        for kind in ["stiffness", "damping"] {
            for dof in 0..6 {
                if joint[format!("{kind}_verdict")][dof] == "identified" {
                    let interval = &of[format!("{kind}_interval")][dof];
                    let [lower, upper] = [0, 1].map(|end| interval[end].as_f64().unwrap());
                    identified += 1;
                    held +=
                        usize::from((lower..=upper).contains(&truth[kind][dof].as_f64().unwrap()));
                }
            }
        }
    }
    [identified, held]
}

#[test]
fn a_pedestal_in_the_model_takes_what_gives_way_under_the_robot() {
    let folder = folder();
    let folder = folder.path();
    fs::write(folder.join("plant.toml"), PLANT).unwrap();
    let edge = folder.join("edge.toml");
    let typical = || {
        edit(&edge, "assume = \"perfect\"", "");
        let text = fs::read_to_string(&edge).unwrap();
        let (before, bounds) = text.split_once("[bounds]").unwrap();
        let (_, after) = bounds.split_once("[bus]").unwrap();
        fs::write(&edge, format!("{before}[bus]{after}")).unwrap();
    };
    let simulation = "--plant plant.toml --truth-json t.json";
    let (_, without) = identified(folder, simulation, typical);
    let truth = json(folder, "t.json");
    println!("without {:?} {}", held(&without, &truth), without["fit"]["acceptance"]);

    let import = "model import mill3.urdf --tcp tcp --pedestal -o mill3-model.toml";
    let imported = flexid(folder, import);
    assert!(imported.status.success(), "{}", stderr(&imported));
    assert!(stderr(&imported).contains("the pedestal is taken as 298.8 kg"));
    let said = String::from_utf8(imported.stdout).unwrap();
    assert!(said.contains("mill3 with 3 joints on a pedestal and 1494.0 kg"), "{said}");
    let output = flexid(folder, "identify --config edge.toml o.log --json o.json");
    assert!(output.status.success(), "{}", stderr(&output));
    let with = json(folder, "o.json");
    println!("with {:?} {}", held(&with, &truth), with["fit"]["acceptance"]);
    println!("{}", String::from_utf8(output.stdout).unwrap());
    let names: Vec<_> = with["joints"].as_array().unwrap().iter().map(|j| &j["name"]).collect();
    assert_eq!(names, ["pedestal", "joint_1", "joint_2", "joint_3"]);
}
