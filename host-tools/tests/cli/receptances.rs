//! Modal tests: written by pyuff and as a table, from a model that is not ours, and read here; and the other way round.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;

use crate::python::{run, with};
use crate::setup::{edit, flexid, folder, found, json, refused, stderr, stdout};

const LIST: &str =
    "file,q1,q2,q3\npose1.uff,0,-0.45,0.95\npose2.uff,0.7,-1.1,1.9\npose3.csv,-0.6,-0.2,0.35\n";
/// The scenario's truth: stiffnesses, then dampings of each joint.
const TRUTH: [[[f64; 6]; 2]; 3] = [
    [[6.0e7, 6.6e7, 4.5e7, 3.2e7, 2.9e7, 2.3e6], [2.1e4, 2.4e4, 1.7e4, 1.1e4, 0.9e4, 1.9e3]],
    [[7.0e7, 5.2e7, 6.1e7, 4.1e7, 8.6e6, 3.7e7], [2.6e4, 1.9e4, 2.2e4, 1.3e4, 3.4e3, 1.2e4]],
    [[4.8e7, 5.5e7, 6.4e7, 2.6e7, 2.8e6, 2.2e7], [1.5e4, 1.8e4, 2.3e4, 0.8e4, 1.2e3, 0.7e4]],
];

/// The configuration of modal tests alone.
fn alone(folder: &Path, section: &str) {
    let edge = fs::read_to_string(folder.join("edge.toml")).unwrap();
    let mut kept = true;
    let lines = edge.lines().filter(|line| {
        if line.starts_with('[') {
            kept = !line.starts_with("[bus]") && !line.starts_with("[signals]");
        }
        kept && !line.starts_with("rate_hz")
    });
    let edge: Vec<&str> = lines.collect();
    fs::write(folder.join("modal.toml"), edge.join("\n") + "\n" + section).unwrap();
}

/// A folder with modal tests in three poses.
fn tested() -> TempDir {
    let folder = folder();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cli/receptances.py");
    run(Command::new(with("pyuff")).arg(script).arg(folder.path())).unwrap();
    fs::write(folder.path().join("tests.csv"), LIST).unwrap();
    alone(folder.path(), "[receptance]\nfile = \"tests.csv\"\naverages = 5\n");
    folder
}

/// Numbers that are identified, and those of them whose 95 % interval holds the truth.
fn counts(found: &Value) -> [usize; 2] {
    let mut counts = [0; 2];
    for (joint, truth) in found["joints"].as_array().unwrap().iter().zip(TRUTH) {
        for (kind, truth) in ["stiffness", "damping"].into_iter().zip(truth) {
            for (dof, truth) in truth.into_iter().enumerate() {
                let of = |name: &str| &joint[format!("{kind}{name}")][dof];
                if of("_verdict") == "identified" {
                    let away = of("").as_f64().unwrap() - truth;
                    counts[0] += 1;
                    counts[1] += usize::from(away.abs() < 1.96 * of("_std").as_f64().unwrap());
                }
            }
        }
    }
    counts
}

/// By responses of three poses, in ASCII, binary and as a table, in three units, all of the robot is identified; `check` and `report` know them.
#[test]
fn modal_tests_alone_identify_the_robot() {
    let folder = tested();
    let folder = folder.path();
    let text = stdout(folder, "check --config modal.toml");
    assert!(text.contains("ready to identify: 9 force directions in 3 poses"), "{text}");
    let output = flexid(folder, "identify --config modal.toml --json o.json --report o.html");
    assert!(output.status.success(), "{}", stderr(&output));
    let found = json(folder, "o.json");
    assert_eq!(found["fit"]["acceptance"], "consistent");
    assert_eq!(found["fit"]["records"], 9);
    let [identified, held] = counts(&found);
    assert!(identified >= 34 && held + 5 >= identified, "{held} of {identified}");
    let record = &found["records"][3];
    assert_eq!(record["is_of_test"], true);
    let measured = &found["measured_receptance"][1];
    let point = &measured["points"][100];
    for row in 0..3 {
        for column in 0..3 {
            let size = |kind: &str| {
                let part = |index: usize| point[kind][row][column][index].as_f64().unwrap();
                part(0).hypot(part(1))
            };
            let ratio = size("measured") / size("modelled");
            assert!((0.9..1.1).contains(&ratio), "{row} {column}: {ratio}");
        }
    }
    let page = fs::read_to_string(folder.join("o.html")).unwrap();
    assert!(page.contains("Frequency responses of a modal test") && page.contains("(m/s²)/N"));
    let text = flexid(folder, "predict o.json --pose 0.1,-0.5,0.4");
    assert!(text.status.success(), "{}", stderr(&text));
    // The files may be named, too: then these alone are taken.
    let one = flexid(folder, "identify --config modal.toml pose1.uff --json one.json");
    assert!(one.status.success(), "{}", stderr(&one));
    assert_eq!(json(folder, "one.json")["fit"]["records"], 3);
}

/// What `export` writes is read: the responses of the robot that was found are those of the same robot.
#[test]
fn the_exported_receptance_is_read() {
    let folder = found();
    let folder = folder.path();
    let poses = ["0,-0.45,0.95", "0.7,-1.1,1.9", "-0.6,-0.2,0.35"];
    let mut list = "file,q1,q2,q3\n".to_owned();
    for (number, pose) in poses.into_iter().enumerate() {
        let output = flexid(
            folder,
            &format!("export o.json --format uff --pose {pose} --out own{number}.uff --points 793"),
        );
        assert!(output.status.success(), "{}", stderr(&output));
        list += &format!("own{number}.uff,{pose}\n");
    }
    fs::write(folder.join("tests.csv"), list).unwrap();
    alone(folder, "[receptance]\nfile = \"tests.csv\"\nrelative_floor = 0.001\n");
    let output = flexid(folder, "identify --config modal.toml --json again.json");
    assert!(output.status.success(), "{}", stderr(&output));
    let [before, after] = ["o.json", "again.json"].map(|file| json(folder, file));
    for joint in 0..3 {
        for kind in ["stiffness", "damping"] {
            for dof in 0..6 {
                let [one, other] =
                    [&before, &after].map(|own| own["joints"][joint][kind][dof].as_f64().unwrap());
                assert!((one / other - 1.0).abs() < 0.01, "{joint} {kind} {dof}: {one} {other}");
            }
        }
    }
}

/// Modal tests stand beside cuts.
#[test]
fn modal_tests_join_cuts() {
    let folder = tested();
    let folder = folder.path();
    let log = "simulate --config edge.toml --candump o.log --experiments 1";
    assert!(flexid(folder, log).status.success());
    edit(
        &folder.join("edge.toml"),
        "[search]",
        "[receptance]\nfile = \"tests.csv\"\naverages = 5\n\n[search]",
    );
    let output = flexid(folder, "identify --config edge.toml o.log --json o.json");
    assert!(output.status.success(), "{}", stderr(&output));
    let found = json(folder, "o.json");
    assert_eq!(found["fit"]["records"], 10);
    assert_eq!(found["fit"]["acceptance"], "consistent");
    let [identified, held] = counts(&found);
    assert!(identified >= 35 && held + 5 >= identified, "{held} of {identified}");
}

/// A table that somebody has typed.
fn table(folder: &Path, section: &str) {
    let mut text = "f,Hxx re [m/s^2/N],Hxx im [m/s^2/N],Hxy re [m/s^2/N],Hxy im [m/s^2/N],Hyx re [m/s^2/N],Hyx im [m/s^2/N]\n".to_owned();
    for bin in 2..=200 {
        text += &format!("{bin},0.001,-0.002,0.001,0.001,-0.001,-0.001\n");
    }
    fs::write(folder.join("a.csv"), text).unwrap();
    fs::write(folder.join("tests.csv"), "file,q1,q2,q3\na.csv,0,-0.45,0.95\n").unwrap();
    alone(folder, section);
}

/// Signs that no robot has, responses that contradict each other, and what is not there.
#[test]
fn check_names_what_is_wrong_and_what_is_missing() {
    let folder = folder();
    let folder = folder.path();
    table(folder, "[receptance]\nfile = \"tests.csv\"\nrelative_floor = 0.01\n");
    let output = flexid(folder, "check --config modal.toml --json");
    let findings: Value = serde_json::from_slice(&output.stdout).unwrap();
    let findings = findings["findings"].as_array().unwrap();
    let has = |severity: &str, text: &str| {
        findings.iter().any(|own| {
            own["severity"] == severity && own["finding"].as_str().unwrap().contains(text)
        })
    };
    assert!(has("wrong", "the robot gives off power where a force along x acts"), "{findings:?}");
    assert!(has("doubtful", "differ, and should be the same"), "{findings:?}");
    assert!(has("note", "not measured are Hxz, Hyy, Hyz and 3 more"), "{findings:?}");
    assert!(has("doubtful", "2 force directions in 1 pose"), "{findings:?}");
}

#[test]
fn mistakes_are_named_with_their_place_and_mend() {
    let folder = folder();
    let folder = folder.path();
    for (section, expected) in [
        ("averages = 5", "a.csv: the column \"Hxx re [m/s^2/N]\" has no coherence"),
        ("averages = 1", "modal.toml: [receptance] averages is 1: the coherence of fewer than 2"),
        ("unit = \"m\"", "modal.toml: [receptance] unit is \"m\": write a motion per force"),
        (
            "axes = [\"x\", \"x\", \"z\"]",
            "modal.toml: [receptance] axes names an axis of the TCP twice",
        ),
        (
            "axes = [\"x\", \"w\", \"z\"]",
            "modal.toml: [receptance] axes has \"w\": write x, y or z",
        ),
        (
            "points_m = { a = [0.0, 0.0, 0.0] }",
            "modal.toml: [receptance.points_m] a: must be the number",
        ),
    ] {
        table(folder, &format!("[receptance]\nfile = \"tests.csv\"\n{section}\n"));
        let error = refused(folder, "identify --config modal.toml");
        assert!(error.contains(expected), "{error}");
    }
    let floor = "[receptance]\nfile = \"tests.csv\"\nrelative_floor = 0.01\n";
    table(folder, floor);
    fs::write(folder.join("tests.csv"), "file,q1,q2,q3\nb.csv,0,-0.45,0.95\n").unwrap();
    assert!(
        refused(folder, "identify --config modal.toml")
            .contains("b.csv: cannot be read: it does not exist")
    );
    table(folder, floor);
    let error = refused(folder, "identify --config modal.toml tests.csv");
    assert!(error.contains("tests.csv: is no modal test that [receptance] file names"), "{error}");
    edit(&folder.join("modal.toml"), "band_hz", "# band_hz");
    assert!(refused(folder, "identify --config modal.toml").contains("band_hz"));
}
