//! `flexid compare`: the verdict, the exit status, and what cannot be compared.

use std::fs;
use std::path::Path;

use serde_json::{Value, json as value};

use crate::setup::{
    FLEXID, edit, flexid, folder, found, identified, json, refused, refuses_bad_results, stderr,
    unheard,
};

/// Writes the result as `name`, changed.
fn write(folder: &Path, name: &str, change: impl FnOnce(&mut Value)) {
    let mut found = json(folder, "o.json");
    change(&mut found);
    fs::write(folder.join(name), found.to_string()).unwrap();
}

/// Exit status, and what is printed.
fn compared(folder: &Path, arguments: &str) -> (Option<i32>, String) {
    let output = flexid(folder, arguments);
    assert_eq!(stderr(&output), "", "{arguments}");
    (output.status.code(), String::from_utf8(output.stdout).unwrap())
}

fn scale(parameter: &mut Value, factor: f64) {
    *parameter = value!(parameter.as_f64().unwrap() * factor);
}

#[test]
fn the_exit_status_and_the_first_line_say_whether_fits_agree() {
    let folder = found();
    let folder = folder.path();
    let (status, text) = compared(folder, "compare o.json o.json");
    let first = text.lines().next().unwrap();
    assert!(
        status == Some(0) && first.starts_with("agree: ") && first.contains(" of 36 parameters"),
        "{text}"
    );
    assert!(text.contains("\n squared distance: ") && text.contains("\n chance: "), "{text}");
    let changed = |text: &str| text.lines().filter(|line| line.trim_end().ends_with(" *")).count();
    assert!(text.contains(" joint_1 tx stiffness ") && changed(&text) == 0, "{text}");

    write(folder, "worn.json", |found| scale(&mut found["joints"][1]["stiffness"][4], 0.85));
    let (status, text) = compared(folder, "compare o.json worn.json");
    assert_eq!(status, Some(1), "{text}");
    let first = text.lines().next().unwrap();
    assert!(first.starts_with("differ: joint_2 ry stiffness fell by 15.0 % ("), "{text}");
    assert_eq!(changed(&text), 1, "{text}");

    // Back again.
    let (status, text) = compared(folder, "compare worn.json o.json --json");
    let json: Value = serde_json::from_str(&text).unwrap();
    assert_eq!((status, &json["agree"]), (Some(1), &value!(false)));
    let changed = json["parameters"].as_array().unwrap();
    let changed: Vec<&Value> = changed.iter().filter(|own| own["has_changed"] == true).collect();
    let [own] = changed.as_slice() else { panic!("{json}") };
    assert_eq!(
        (&own["joint"], &own["dof"], &own["quantity"]),
        (&value!("joint_2"), &value!(4), &value!("stiffness"))
    );
    let [low, high] = [0, 1].map(|end| own["ratio"]["interval"][end].as_f64().unwrap());
    assert!(low > 1.0 && (low..high).contains(&(1.0 / 0.85)), "{own}");
    assert!(
        json["chance"].as_f64().unwrap() < 0.025
            && json["verdict"].as_str().unwrap().starts_with("differ: ")
    );

    // A reader that closes the pipe does not make them agree.
    assert_eq!(unheard(folder, FLEXID, "compare o.json worn.json").status.code(), Some(1));
    assert_eq!(unheard(folder, FLEXID, "compare o.json o.json").status.code(), Some(0));
}

#[test]
fn notes_name_doubts_and_models_that_differ() {
    let folder = found();
    let folder = folder.path();
    write(folder, "heavy.json", |found| {
        scale(&mut found["robot"]["model"]["joint"][1]["mass_kg"], 1.1);
        found["robot"]["band_hz"] = value!([2.0, 150.0]);
        found["fit"]["acceptance"] = value!("model_suspect");
    });
    let (_, text) = compared(folder, "compare o.json heavy.json");
    let first = "different models of a robot, by joint_2 mass_kg of the model files; their joints have the same names, and the parameters agree: ";
    assert!(text.starts_with(first), "{text}");
    for part in [
        "note: heavy.json: MODEL SUSPECT",
        "note: the models differ in joint_2 mass_kg:",
        "note: the bands differ, [2.0, 200.0] and [2.0, 150.0] Hz",
    ] {
        assert!(text.contains(part), "{part:?} is not in\n{text}");
    }
}

/// The joints have the same names. What the parameters say comes after that.
#[test]
fn another_robot_is_named_before_its_parameters() {
    let folder = found();
    let folder = folder.path();
    write(folder, "longer.json", |found| {
        for joint in 1..3 {
            for axis in 0..3 {
                scale(&mut found["robot"]["model"]["joint"][joint]["origin_xyz_m"][axis], 1.1);
            }
            scale(&mut found["robot"]["model"]["joint"][joint]["mass_kg"], 1.1);
        }
        scale(&mut found["joints"][1]["stiffness"][4], 0.85);
    });
    let (status, text) = compared(folder, "compare o.json longer.json");
    let first = "different robots, by joint_2 origin_xyz_m, joint_2 mass_kg, joint_3 origin_xyz_m and 1 more of the model files; \
        their joints have the same names, and the parameters differ: joint_2 ry stiffness fell by 15.0 % (";
    assert!(status == Some(1) && text.starts_with(first), "{text}");
    let (_, text) = compared(folder, "compare o.json longer.json --json");
    let json: Value = serde_json::from_str(&text).unwrap();
    assert!(json["verdict"].as_str().unwrap().starts_with("different robots, by "), "{json}");
}

#[test]
fn two_results_of_the_same_records_have_a_note() {
    let folder = found();
    let folder = folder.path();
    let log = json(folder, "o.json")["origin"]["logs"][0].clone();
    assert!(log["sha256"].is_string(), "{log}");
    write(folder, "again.json", |found| scale(&mut found["joints"][1]["stiffness"][4], 1.01));
    write(folder, "more.json", |found| {
        found["origin"]["logs"] = value!([log, {"name": "b.log", "sha256": "00"}]);
    });
    write(folder, "other.json", |found| found["origin"]["logs"][0]["sha256"] = value!("00"));
    write(folder, "static.json", |found| {
        found.as_object_mut().unwrap().remove("origin").unwrap();
    });
    write(folder, "other-static.json", |found| {
        found.as_object_mut().unwrap().remove("origin").unwrap();
        scale(&mut found["joints"][1]["stiffness"][4], 1.01);
    });
    let mend = ": agreement proves nothing: compare results of separate cuts\n";
    for (files, what) in [
        ("o.json o.json", "both are of the same logs"),
        ("o.json again.json", "both are of the same logs"),
        ("o.json more.json", "both are of 1 common log, among others"),
        ("static.json static.json", "both are the same result"),
    ] {
        let (_, text) = compared(folder, &format!("compare {files}"));
        assert!(text.contains(&format!(" note: {what}{mend}")), "{files}: {text}");
    }
    write(folder, "own.json", |found| scale(&mut found["joints"][1]["stiffness"][4], 1.01));
    for files in ["own.json other.json", "static.json other-static.json"] {
        let (_, text) = compared(folder, &format!("compare {files}"));
        assert!(!text.contains("agreement"), "{files}: {text}");
    }
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let folder = found();
    let folder = folder.path();
    refuses_bad_results(folder, "compare FOUND o.json");
    refuses_bad_results(folder, "compare o.json FOUND");
    write(folder, "other.json", |found| {
        found["robot"]["model"]["joint"][2]["name"] = value!("wrist");
        found["joints"][2]["name"] = value!("wrist");
    });
    let message = refused(folder, "compare o.json other.json");
    assert!(
        message.contains("other.json: is of another robot than the first, and nothing can be compared: it has the joints ")
            && message.contains("wrist (revolute), the first the joints joint_1 (revolute), "),
        "{message}"
    );
    write(folder, "shorter.json", |found| {
        found["robot"]["model"]["joint"].as_array_mut().unwrap().pop().unwrap();
        found["joints"].as_array_mut().unwrap().pop().unwrap();
        let covariance = found["robot"]["covariance"].as_array_mut().unwrap();
        covariance.truncate(24 * 25 / 2);
        let factor = found["shared"]["factor"].as_array_mut().unwrap();
        factor.truncate(24 * 25 / 2);
        for pose in found["robot"]["poses"].as_array_mut().unwrap() {
            pose.as_array_mut().unwrap().pop().unwrap();
        }
    });
    let message = refused(folder, "compare o.json shorter.json");
    let expected = "shorter.json: is of another robot than the first, and nothing can be compared: it has 2 joints, the first 3 joints: \
        name two results of one robot\n";
    assert!(message.ends_with(expected), "{message}");
    write(folder, "fixed.json", |found| {
        for joint in found["joints"].as_array_mut().unwrap() {
            joint["stiffness_verdict"] =
                value!(["fixed", "fixed", "fixed", "fixed", "fixed", "fixed"]);
            joint["damping_verdict"] = joint["stiffness_verdict"].clone();
        }
    });
    let message = refused(folder, "compare o.json fixed.json");
    assert!(message.contains("fixed.json: has no parameter in common"), "{message}");
    assert!(refused(folder, "compare o.json").contains("<AFTER.json>"));
}

/// Hysteresis makes a damping another one at each frequency. Fits in other bands state it at the same one, and files that do not name it are
/// converted.
#[test]
fn bands_do_not_change_what_a_damping_is() {
    let folder = folder();
    let folder = folder.path();
    edit(&folder.join("edge.toml"), "assume = \"perfect\"", "");
    fs::write(folder.join("plant.toml"), "[joints]\nhysteretic = 0.3\n").unwrap();
    identified(folder, "--experiments 3 --plant plant.toml --truth-json t.json", || ());
    edit(&folder.join("edge.toml"), "band_hz = [2.0, 200.0]", "band_hz = [6.0, 200.0]");
    let output = flexid(folder, "identify --config edge.toml o.log --json narrow.json");
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(
        String::from_utf8(output.stdout)
            .unwrap()
            .contains("\n with hysteresis these are the values at 20 Hz\n")
    );
    let (status, text) = compared(folder, "compare o.json narrow.json");
    assert!(status == Some(0) && text.starts_with("agree: "), "{text}");

    let (narrow, truth) = (json(folder, "narrow.json"), json(folder, "t.json"));
    assert_eq!(narrow["robot"]["reference_hz"], 20.0);
    let (mut identified, mut covered) = (0, 0);
    let intervals = narrow["confidence"]["joints"].as_array().unwrap();
    for (joint, of) in narrow["joints"].as_array().unwrap().iter().zip(intervals) {
        for dof in (0..6).filter(|dof| joint["damping_verdict"][dof] == "identified") {
            let truth = truth["truth"][joint["name"].as_str().unwrap()]["damping"][dof].as_f64();
            let [low, high] = [0, 1].map(|end| of["damping_interval"][dof][end].as_f64().unwrap());
            identified += 1;
            covered += u32::from((low..=high).contains(&truth.unwrap()));
        }
    }
    assert!(identified >= 9 && 10 * covered >= 8 * identified, "{covered} of {identified}");

    // As a program would have stated it in the middle of its band, without naming the frequency.
    let (hz, mut old) = ((6.0_f64 * 200.0).sqrt(), narrow);
    let imperfections = old["robot"]["imperfections"].as_array().unwrap().iter();
    let place = imperfections.clone().position(|own| own["imperfection"] == "hysteresis").unwrap();
    let h = &mut old["robot"]["imperfections"][place]["value"];
    let part = h.as_f64().unwrap();
    let loss = 1.0 - part + part * 20.0 / hz;
    *h = value!(part * 20.0 / hz / loss);
    for joint in old["joints"].as_array_mut().unwrap() {
        for dof in 0..6 {
            let damping = joint["damping"][dof].as_f64().unwrap();
            let stiffness = joint["stiffness"][dof].as_f64().unwrap();
            joint["stiffness"][dof] = value!(stiffness + 80.0 * part * damping * (hz / 20.0).ln());
            joint["damping"][dof] = value!(damping * loss);
        }
    }
    old["robot"].as_object_mut().unwrap().remove("reference_hz");
    old["schema"] = value!(1);
    fs::write(folder.join("old.json"), old.to_string()).unwrap();
    let (_, table) = compared(folder, "compare old.json narrow.json");
    assert!(table.contains(" with hysteresis these are the values at 20.0 Hz\n"), "{table}");
    let (_, text) = compared(folder, "compare old.json narrow.json --json");
    let found: Value = serde_json::from_str(&text).unwrap();
    for own in found["parameters"].as_array().unwrap() {
        let ratio = own["ratio"]["value"].as_f64().unwrap();
        assert!((ratio - 1.0).abs() < 1e-6, "{own}");
    }
}
