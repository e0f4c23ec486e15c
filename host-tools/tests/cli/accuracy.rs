//! A plant that is not quite the one that the configuration describes, with and without `[accuracy]`.

use std::fs;

use serde_json::Value;

use crate::setup::{edit, flexid, folder, found, identified, json, stderr, stdout};

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
    assert_eq!(perfect["warning_kinds"][0], "assumed_perfect");
    let first = perfect["warnings"][0].as_str().unwrap();
    assert!(first.contains("leave assume = \"perfect\" out"), "{first}");
    let page = stdout(folder.path(), "report o.json --out -");
    let steps = &page[page.find("What to do next").unwrap()..];
    assert!(steps[..200].contains("<li>Leave <code>assume"), "{}", &steps[..200]);

    edit(&folder.path().join("edge.toml"), "assume = \"perfect\"", "");
    let command = "identify --config edge.toml o.log --json o.json --truth t.json";
    let output = flexid(folder.path(), command);
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
    // The program counts alike. No model is exactly the plant: of the answer it counts the drives alone.
    let counted = &found["truth"];
    let sum = |key: &str| ["stiffness", "damping"].map(|kind| counted[kind][key].as_u64().unwrap());
    assert_eq!(
        [sum("intervals"), sum("hold")].map(|own| own.iter().sum::<u64>() as u32),
        [identified, covered]
    );
    assert_eq!(counted["tool_is_known"], false);
    assert_eq!(counted["answer"]["intervals"], 3);
    assert!(counted["answer"]["hold"].as_u64().unwrap() >= 2, "{counted}");
    let said = String::from_utf8_lossy(&output.stdout);
    let line = format!("\ntruth: {covered} of {identified} intervals hold (of those identified): ");
    assert!(said.contains(&line), "{said}");
    // The delay is known far better than beforehand.
    let nuisances = found["confidence"]["nuisances"].as_array().unwrap();
    let delay = nuisances.iter().find(|nuisance| nuisance["name"] == "delay").unwrap();
    assert_eq!(delay["accuracy"], 20e-6);
    let table = String::from_utf8(output.stdout).unwrap();
    // Typical errors are as expected: they are counted.
    let counted = " as expected by their accuracies (JSON: confidence.nuisances)";
    assert!(table.contains(counted) && !table.contains("\ncalibration "), "{table}");
    let [value, std] = ["value", "std"].map(|key| delay[key].as_f64().unwrap());
    assert!((value - 15e-6).abs() < 4.0 * std && std < 1e-5, "{delay}");
}

/// Hum and lines of the spindle are read from the residuals of the first fit. The second needs no search: its minimum is that of the first.
#[test]
fn noise_that_is_read_again_needs_no_new_search() {
    let folder = folder();
    let typical = || edit(&folder.path().join("edge.toml"), "assume = \"perfect\"", "");
    let (table, found) = identified(folder.path(), "--plant mill3-plant.toml", typical);
    assert!(table.contains("lines that no force causes"), "{table}");
    assert_eq!(found["fit"]["acceptance"], "consistent");
    // As often as a minimum must be reached whose residuals the first noise does not explain.
    assert_eq!(found["fit"]["starts"], 4);
}

/// A TCP that is 20 mm off, and a delay of 120 µs: twenty and six times the typical accuracies.
const WRONG: &str = "
[tool]
tcp_m = [0.0, 0.0, 0.02]
[accelerometer.clock]
late_s = 120e-6
";

/// Both errors are named before all else with their size, in JSON, text and a warning; `--explain` adopts them.
#[test]
fn what_is_off_is_explained_and_adopted() {
    let folder = folder();
    fs::write(folder.path().join("plant.toml"), WRONG).unwrap();
    let edge = folder.path().join("edge.toml");
    let typical = || edit(&edge, "assume = \"perfect\"", "");
    let (table, found) = identified(folder.path(), "--plant plant.toml", typical);
    check_explanations(&found, false);
    assert!(table.contains("explained    delay 1"), "{table}");
    assert!(
        table.contains("or seek delay_s in [calibration], or state delay_s as it is"),
        "{table}"
    );
    let kinds = found["warning_kinds"].as_array().unwrap();
    assert_eq!(kinds[0]["contradicted"]["deviation"]["entry"], "delay_s", "{kinds:?}");

    let output = flexid(folder.path(), "identify --config edge.toml o.log --json o.json --explain");
    assert!(output.status.success(), "{}", stderr(&output));
    check_explanations(&json(folder.path(), "o.json"), true);
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(!table.contains("is adopted"), "{table}");
    assert!(
        table.contains("adopted, ") && table.contains("33 of 36 parameters identified"),
        "{table}"
    );
}

fn check_explanations(found: &Value, adopted: bool) {
    let explanations = found["confidence"]["explanations"].as_array().unwrap();
    for (explanation, (entry, value)) in
        explanations.iter().zip([("delay_s", 120e-6), ("tcp_m", 20e-3)])
    {
        let deviation = &explanation["deviation"];
        assert_eq!(
            (&deviation["entry"], &explanation["adopted"]),
            (&entry.into(), &adopted.into())
        );
        let [found, std] = ["value", "std"].map(|key| deviation[key].as_f64().unwrap());
        assert!((found - value).abs() < 3.0 * std && std < 0.1 * value, "{explanation}");
        assert!(explanation["evidence"].as_f64().unwrap() > 10.0, "{explanation}");
    }
    assert_eq!(explanations.len(), 2, "{explanations:?}");
    // The delay comes first: it explains nearly all.
    assert!(explanations[0]["share"].as_f64().unwrap() > 0.9, "{explanations:?}");
}

#[test]
fn nothing_to_explain_is_a_mistake() {
    let folder = found();
    let refused = |logs: &str, message: &str| {
        let command = format!("identify --config edge.toml {logs} --explain");
        let output = flexid(folder.path(), &command);
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains(message), "{}", stderr(&output));
    };
    refused(
        "o.log",
        "edge.toml: --explain needs an accuracy that may be wrong, and [accuracy] is perfect",
    );
    edit(&folder.path().join("edge.toml"), "assume = \"perfect\"", "");
    refused("", "edge.toml: --explain explains records: name a LOG of candump -L");
    let table = stdout(folder.path(), "identify --config edge.toml o.log --explain");
    assert_eq!(table.matches(" as expected by their accuracies").count(), 1, "{table}");
    let said = "--explain adopts nothing: noise explains what the fit leaves, and the records contradict no accuracy: \
                no larger one makes them more probable by a factor e\n";
    assert!(table.ends_with(said), "{table}");
}

/// Pink noise and a robot that warms up are the same relative error in every cut: the more cuts, the surer it is there, and the smaller are
/// the intervals. The verdict stays.
#[test]
fn more_cuts_do_not_turn_the_verdict() {
    let folder = folder();
    edit(&folder.path().join("edge.toml"), "assume = \"perfect\"", "");
    let plant = "[accelerometer.noise]\npink_below_hz = 6.0\n[joints]\nwarm_up_per_cut = 0.0008\n";
    fs::write(folder.path().join("plant.toml"), plant).unwrap();
    for experiments in [3, 8] {
        let options = format!("--experiments {experiments} --plant plant.toml");
        let (table, found) = identified(folder.path(), &options, || ());
        let residuals = &found["confidence"]["residuals"];
        assert_eq!(found["fit"]["acceptance"], "consistent", "{experiments}: {residuals}");
        assert_eq!(residuals["structure_objects"], true, "{experiments}: {residuals}");
        let structure = residuals["structure"].as_f64().unwrap();
        assert!((0.1..0.3).contains(&structure), "{experiments}: {structure}");
        assert!(!table.contains("explains 0 %"), "{table}");
    }
}
