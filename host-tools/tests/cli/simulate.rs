//! `flexid model import` and `flexid simulate`.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use crate::setup::{FLEXID, edit, flexid, folder, json, stderr};

const URDF: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/urdf");

#[test]
fn import_writes_the_model_of_the_scenario_and_warns_of_placeholders() {
    let folder = folder();
    let output = flexid(folder.path(), "model import mill3.urdf --tcp tcp -o new.toml");
    assert!(output.status.success() && output.stderr.is_empty(), "{}", stderr(&output));
    let read = |name| fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(read("new.toml"), read("mill3-model.toml"));

    let arm = format!("model import {URDF}/kuka_kr16_2.urdf --tcp tool0 -o arm.toml");
    let output = flexid(folder.path(), &arm);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stderr(&output).contains("every moving link weighs 2 kg: are these placeholders?"));

    let flange = format!("model import {URDF}/kuka_kr210l150.urdf --tcp tool0 -o arm.toml");
    let said = stderr(&flexid(folder.path(), &flange));
    let no_tool =
        "the TCP 'tool0' is by its name the flange, without a tool (add a link for spindle";
    assert!(said.contains(no_tool), "{said}");
}

#[test]
fn the_same_seed_gives_the_same_log() {
    let folder = folder();
    let log = |arguments: &str| {
        let command =
            format!("simulate --config edge.toml --experiments 1 --candump o.log {arguments}");
        let output = flexid(folder.path(), &command);
        assert!(output.status.success(), "{}", stderr(&output));
        fs::read_to_string(folder.path().join("o.log")).unwrap()
    };
    let first = log("--seed 3");
    // 8192 samples of force and acceleration, and 41 poses of three joints.
    assert_eq!(first.lines().count(), 2 * 8192 + 41 * 3);
    assert!(first.starts_with("(1767000000.000060) vcan0 101#"));
    assert_eq!(first, log("--seed 3"));
    assert_ne!(first, log("--seed 4"));
    assert_ne!(first, log("--seed 3 --truth drawn:1"));
}

#[test]
fn lost_frames_are_in_the_truth_and_not_in_the_log() {
    let folder = folder();
    let command = "simulate --config edge.toml --drop 0.01 --experiments 4 --candump o.log --truth-json t.json";
    let output = flexid(folder.path(), command);
    assert!(output.status.success(), "{}", stderr(&output));
    let truth = json(folder.path(), "t.json");
    let experiments = truth["experiments"].as_array().unwrap();
    assert_eq!(experiments.len(), 4);
    let sum = |key: &str| experiments.iter().map(|one| one[key].as_u64().unwrap()).sum::<u64>();
    let lost = sum("dropped_force") + sum("dropped_acc");
    assert!((500..800).contains(&lost), "1 % of 65536 is not {lost}");
    let log = fs::read_to_string(folder.path().join("o.log")).unwrap();
    assert_eq!(log.lines().count() as u64, 4 * (2 * 8192 + 41 * 3) - lost);
    assert_eq!(truth["truth"]["joint_1"]["stiffness"][5], 2.3e6);
}

/// The session without a bus: tables of blows, from which the robot is identified.
#[test]
fn blows_of_a_hammer_are_tables_that_identify_takes() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenario");
    for file in
        ["mill6-blows.toml", "mill6-blows.csv", "mill6-model.toml", "mill6.toml", "mill6.urdf"]
    {
        fs::copy(scenario.join(file), folder.path().join(file)).unwrap();
    }
    let command = "simulate --config mill6-blows.toml --tables blows --truth-json t.json";
    let output = flexid(folder.path(), command);
    assert!(output.status.success(), "{}", stderr(&output));
    let tables = (1..10).map(|number| format!("blows/blow{number}.csv")).collect::<Vec<_>>();
    let first = fs::read_to_string(folder.path().join(&tables[0])).unwrap();
    assert!(first.starts_with("time [s],Hammer [N],ax [m/s^2],ay [m/s^2],az [m/s^2]\n0.000000,"));
    assert_eq!(first.lines().count(), 1 + 8192);
    let again = flexid(folder.path(), command);
    assert_eq!(again.status.code(), Some(2));
    assert!(stderr(&again).contains("blows/blow1.csv: is there already"), "{}", stderr(&again));
    let command = format!(
        "identify --config mill6-blows.toml --truth t.json --json f.json {}",
        tables.join(" ")
    );
    let output = flexid(folder.path(), &command);
    assert!(output.status.success(), "{}", stderr(&output));
    let warned = "warning: blows may not break the joints loose: ";
    assert!(stderr(&output).contains(warned), "{}", stderr(&output));
    let said = String::from_utf8(output.stdout).unwrap();
    let held = said.lines().find_map(|line| line.strip_prefix("truth: ")).unwrap();
    let numbers: Vec<f64> =
        held.split_whitespace().filter_map(|word| word.parse().ok()).take(2).collect();
    assert!(numbers[1] >= 60.0 && numbers[0] > 0.85 * numbers[1], "{held}");
}

#[test]
fn tables_are_those_of_blows() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenario");
    let poses = fs::read_to_string(scenario.join("mill6-blows.csv")).unwrap();
    for file in ["mill6-blows.toml", "mill6-model.toml", "mill6.toml", "mill6.urdf"] {
        fs::copy(scenario.join(file), folder.path().join(file)).unwrap();
    }
    let refusal = |poses: &str, arguments: &str| {
        fs::write(folder.path().join("mill6-blows.csv"), poses).unwrap();
        let command = format!("simulate --config mill6-blows.toml --tables . {arguments}");
        let output = flexid(folder.path(), &command);
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        stderr(&output)
    };
    let at_a_point = poses.replace(",force\n", ",force,px\n").replace(",x\n", ",x,0.1\n");
    let at_a_point = at_a_point.replace(",y\n", ",y,0\n").replace(",z\n", ",z,0\n");
    for (poses, arguments, expected) in [
        (at_a_point.as_str(), "", "strikes at the TCP"),
        (&poses.replace("blow9", "more/blow9"), "", "name them by their names alone"),
        (&poses, "--experiments 2", "cannot be used with"),
    ] {
        let said = refusal(poses, arguments);
        assert!(said.contains(expected), "{said}");
    }
    let made = fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(made, 5, "a table was written");
}

/// The eighth experiment has a pose beyond the limits.
#[test]
fn only_the_experiments_that_are_simulated_are_checked() {
    let folder = folder();
    let scenario = folder.path().join("mill3.toml");
    let faulty = "\n[[experiment]]\nname = \"faulty\"\npose = [99.0, 0.0, 0.0]\nspindle_rpm = [600.0, 3000.0]\nfeed = \"x\"\n";
    let text = fs::read_to_string(&scenario).unwrap();
    let experiments = text.matches("[[experiment]]").count();
    fs::write(&scenario, text + faulty).unwrap();
    for (number, is_right) in [(1, true), (experiments + 1, false)] {
        let command = format!("simulate --config edge.toml --experiments {number} --candump o.log");
        let output = flexid(folder.path(), &command);
        assert_eq!(output.status.success(), is_right, "{number}: {}", stderr(&output));
        assert_eq!(stderr(&output).contains("\"faulty\" pose: 99"), !is_right);
    }
}

/// The log of an earlier run stays whole where a run is ended.
#[test]
fn a_simulation_that_is_ended_leaves_no_part_of_a_log() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("o.log"), "before").unwrap();
    let entries = || fs::read_dir(path).unwrap().count();
    let before = entries();
    let mut running = Command::new(FLEXID)
        .args("simulate --config edge.toml --experiments 10000 --candump o.log".split(' '))
        .current_dir(path)
        .spawn()
        .unwrap();
    let descriptors = format!("/proc/{}/fd", running.id());
    // A file without a name has a number in its folder, and is deleted.
    let is_of_folder = |target: &Path| {
        target.starts_with(path) && target.to_string_lossy().ends_with(" (deleted)")
    };
    let is_begun = || {
        let all = fs::read_dir(&descriptors).unwrap().flatten();
        all.filter_map(|entry| fs::read_link(entry.path()).ok()).any(|target| is_of_folder(&target))
    };
    let start = Instant::now();
    while !is_begun() {
        assert!(start.elapsed() < Duration::from_secs(60), "no file is begun");
        thread::sleep(Duration::from_millis(10));
    }
    running.kill().unwrap();
    assert!(!running.wait().unwrap().success());
    assert_eq!(fs::read_to_string(path.join("o.log")).unwrap(), "before");
    assert_eq!(entries(), before);
}

#[test]
fn a_plant_is_not_to_be_identified_as_perfect() {
    let folder = folder();
    let said = || {
        let command =
            "simulate --config edge.toml --plant mill3-plant.toml --experiments 1 --candump o.log";
        let output = flexid(folder.path(), command);
        assert!(output.status.success());
        stderr(&output)
    };
    let warning = said();
    assert!(
        warning
            .starts_with("warning: edge.toml: [accuracy] takes as perfect what it does not state")
    );
    assert!(warning.contains("leave assume = \"perfect\" out before you identify it"), "{warning}");
    edit(&folder.path().join("edge.toml"), "assume = \"perfect\"", "");
    assert_eq!(said(), "");
}
