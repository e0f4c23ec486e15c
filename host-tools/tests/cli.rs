//! The command line as its users meet it: what it says, where it says it, and its exit status.

use std::fs;
use std::io::{Read as _, Write as _};
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::{Command, Output};
use std::thread;

use tempfile::TempDir;

const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenario");
const URDF: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/urdf");

/// A folder with the scenario in it.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(SCENARIO).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), folder.path().join(entry.file_name())).unwrap();
    }
    folder
}

fn flexid(folder: &Path, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flexid"))
        .args(arguments.split(' '))
        .current_dir(folder)
        .output()
        .unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// Replaces `from`, which must be there, in a file.
fn edit(file: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(file).unwrap();
    assert!(text.contains(from), "{} has no {from}", file.display());
    fs::write(file, text.replacen(from, to, 1)).unwrap();
}

#[test]
fn bad_input_ends_with_status_2_and_one_line_that_names_place_and_mend() {
    // Arguments; file, text and its replacement; what stderr says.
    type Case = (&'static str, Option<[&'static str; 3]>, &'static [&'static str]);
    let cases: [Case; 16] = [
        ("model import gone.urdf --tcp tcp -o m.toml", None, &["gone.urdf: cannot be read"]),
        (
            "model import mill3.urdf --tcp hand -o m.toml",
            None,
            &["mill3.urdf: --tcp hand: no such link; the file has base_link, link_1, link_2"],
        ),
        ("model import mill3.toml --tcp tcp -o m.toml", None, &["mill3.toml: not a URDF: "]),
        (
            "model import mill3.urdf --tcp tcp -o m.toml",
            Some(["mill3.urdf", "<mass value=\"485\"/>", "<mass value=\"0\"/>"]),
            &["mill3.urdf: no mass on link 'link_2' (moved by 'joint_2')", "<mass value=\"kg\"/>"],
        ),
        ("simulate --config gone.toml --candump o.log", None, &["gone.toml: cannot be read"]),
        (
            "simulate --config edge.toml --candump o.log",
            Some(["edge.toml", "rate_hz = 2000.0", "rate_hz = -5"]),
            &["edge.toml: [measurement] rate_hz is -5: must be positive"],
        ),
        (
            "simulate --config edge.toml --candump o.log",
            Some(["edge.toml", "[simulation] ", "[simulations] "]),
            &["edge.toml:", "simulations"],
        ),
        (
            "simulate --config edge.toml --candump o.log",
            Some(["edge.toml", "[0.0, 0.0, 0.0]", "[0.0, 0.0, -9.8]"]),
            &["edge.toml: [model] gravity_m_per_s2", "write [0.0, 0.0, 0.0]"],
        ),
        (
            "simulate --config edge.toml --candump o.log",
            Some(["edge.toml", "rate_hz = 2000.0", "rate_hz = 1000.0"]),
            &["edge.toml: [measurement] rate_hz is 1000, but mill3.toml has 2000: make them equal"],
        ),
        (
            "simulate --config edge.toml --candump o.log",
            Some(["mill3.toml", "teeth = 2", "teeth = 0"]),
            &["mill3.toml: [force] teeth is 0: must be at least 1"],
        ),
        ("simulate --config edge.toml --candump o.log --drop 1", None, &["--drop 1: must be"]),
        ("simulate --config edge.toml --candump o.log --truth me", None, &["drawn:SEED"]),
        ("simulate --config edge.toml --can nocan9", None, &["--can nocan9: interface \"nocan9\""]),
        ("identify --config edge.toml gone.log", None, &["gone.log: cannot be read"]),
        (
            "identify --config edge.toml mill3.urdf",
            None,
            &["mill3.urdf: no record to identify from: waiting for frames"],
        ),
        ("watch flexid.sock", None, &["ADDRESS: \"flexid.sock\" is no address", "unix:PATH"]),
    ];
    for (arguments, change, said) in cases {
        let folder = folder();
        if let Some([file, from, to]) = change {
            edit(&folder.path().join(file), from, to);
        }
        let output = flexid(folder.path(), arguments);
        let errors = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments}: {errors}");
        for part in said {
            assert!(errors.contains(part), "{arguments}: {errors:?} does not say {part:?}");
        }
        let complaint = errors.lines().filter(|line| !line.starts_with("warning: ")).count();
        // clap shows the usage below its line.
        assert!(complaint == 1 || errors.contains("--help"), "{arguments}: {errors}");
        for left in ["m.toml", "o.log"] {
            assert!(!folder.path().join(left).exists(), "{arguments} left {left} behind");
        }
    }
}

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
    let truth = fs::read_to_string(folder.path().join("t.json")).unwrap();
    let truth: serde_json::Value = serde_json::from_str(&truth).unwrap();
    let experiments = truth["experiments"].as_array().unwrap();
    assert_eq!(experiments.len(), 4);
    let sum = |key: &str| experiments.iter().map(|one| one[key].as_u64().unwrap()).sum::<u64>();
    let lost = sum("dropped_force") + sum("dropped_acc");
    assert!((500..800).contains(&lost), "1 % of 65536 is not {lost}");
    let log = fs::read_to_string(folder.path().join("o.log")).unwrap();
    assert_eq!(log.lines().count() as u64, 4 * (2 * 8192 + 41 * 3) - lost);
    assert_eq!(truth["truth"]["joint_1"]["stiffness"][5], 2.3e6);
}

#[test]
fn watch_says_why_it_cannot_listen() {
    let folder = folder();
    let output = flexid(folder.path(), "watch unix:flexid.sock");
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("unix:flexid.sock: nobody listens there"),
        "{}",
        stderr(&output)
    );

    // Somebody who hangs up, and somebody who talks of something else.
    for (answer, said) in [
        (&b""[..], "hung up"),
        (b"HTTP/1.1 400 Bad Request\r\n\r\n", "does not speak flexid's protocol"),
    ] {
        let socket = folder.path().join("other.sock");
        let listener = UnixListener::bind(&socket).unwrap();
        let stranger = thread::spawn(move || {
            let (mut client, _) = listener.accept().unwrap();
            let _ = client.read(&mut [0; 64]);
            client.write_all(answer).unwrap();
        });
        let output = flexid(folder.path(), "watch unix:other.sock --until identified --timeout 5");
        stranger.join().unwrap();
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).contains(said), "{:?} is not {said:?}", stderr(&output));
        assert_eq!(stderr(&output).lines().count(), 1);
        fs::remove_file(&socket).unwrap();
    }
}
