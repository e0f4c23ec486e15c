//! A plant that is not quite the one that the configuration describes, with and without `[accuracy]`.

use std::fs;

use crate::setup::{edit, flexid, folder, identified, json};

/// Everything is off by about one standard deviation of the typical accuracies.
const PLANT: &str = "
[force_sensor]
angle_rad = [0.0015, -0.001, 0.002]
gain = [1.004, 0.997, 1.005]
[accelerometer]
angle_rad = [-0.004, 0.006, 0.003]
offset_m = [0.002, -0.001, 0.0025]
gain = [0.992, 1.008, 1.011]
[accelerometer.clock]
late_s = 15e-6
[tool]
angle_rad = [0.001, 0.002, -0.001]
tcp_m = [0.001, -0.0005, 0.001]
[robot]
mass = [1.02, 0.985, 1.015]
centre_of_mass_m = [[0.004, 0.005, -0.003], [0.005, -0.004, 0.002], [-0.003, 0.006, -0.005]]
joint_angle_rad = [0.001, -0.0012, 0.0008]
elastic_centre_m = [[0.005, -0.008, 0.01], [-0.01, 0.01, 0.004], [0.008, -0.005, -0.009]]
";

#[test]
fn stated_accuracies_make_an_imperfect_plant_useful() {
    let folder = folder();
    fs::write(folder.path().join("plant.toml"), PLANT).unwrap();
    let (_, perfect) = identified(folder.path(), "--plant plant.toml --truth-json t.json", || ());
    // Nothing can be said of a plant that the model excludes.
    assert_eq!(perfect["fit"]["acceptance"], "model_suspect");

    edit(&folder.path().join("edge.toml"), "assume = \"perfect\"", "");
    let output = flexid(folder.path(), "identify --config edge.toml o.log --json o.json");
    assert!(output.status.success());
    let (found, truth) = (json(folder.path(), "o.json"), json(folder.path(), "t.json"));
    assert_eq!(found["fit"]["acceptance"], "consistent");
    // The first minimum is judged by the residuals that the imperfections leave: no other search is needed.
    assert_eq!(found["fit"]["starts"], 1);
    let (mut identified, mut covered) = (0, 0);
    for (joint, of) in found["joints"]
        .as_array()
        .unwrap()
        .iter()
        .zip(found["confidence"]["joints"].as_array().unwrap())
    {
        let truth = &truth["truth"][joint["name"].as_str().unwrap()];
        for kind in ["stiffness", "damping"] {
            for dof in 0..6 {
                if joint[format!("{kind}_verdict")][dof] != "identified" {
                    continue;
                }
                let interval = &of[format!("{kind}_interval")][dof];
                let [lower, upper] = [0, 1].map(|end| interval[end].as_f64().unwrap());
                assert!(upper / lower < 1.3, "{joint}");
                identified += 1;
                let truth = truth[kind][dof].as_f64().unwrap();
                covered += u32::from((lower..=upper).contains(&truth));
            }
        }
    }
    assert!(identified >= 33, "{identified} of 36 are identified");
    // Of 36 intervals of 95 % fewer cover once in a thousand plants, if their errors are correlated as they are.
    assert!(covered >= 28, "{covered} of {identified} intervals cover the truth");
    // The delay is known far better than beforehand.
    let nuisances = found["confidence"]["nuisances"].as_array().unwrap();
    let delay = nuisances.iter().find(|nuisance| nuisance["name"] == "delay").unwrap();
    let [value, std] = ["value", "std"].map(|key| delay[key].as_f64().unwrap());
    assert!((value - 15e-6).abs() < 4.0 * std && std < 1e-5, "{delay}");
}
