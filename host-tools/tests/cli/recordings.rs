//! Recordings as people have them: packed, piped, cut off, of other tools, and of other robots.

use std::fs::{self, File};
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output};

use flate2::Compression;
use flate2::write::GzEncoder;
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use serde_json::Value;

use crate::common::example;
use crate::setup::{self, FLEXID, besides, flexid, folder, json, stderr};

/// A folder with a log of three experiments, and the log.
fn simulated() -> (tempfile::TempDir, Vec<u8>) {
    let folder = setup::found();
    let log = fs::read(folder.path().join("o.log")).unwrap();
    (folder, log)
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// The result file without the times that the work took, and without the names and hashes of its files.
fn found(folder: &Path) -> Value {
    let mut found = json(folder, "o.json");
    found["fit"]["seconds"] = Value::Null;
    found["origin"] = Value::Null;
    found
}

fn identify_from(folder: &Path, stdin: &str, arguments: &str) -> Output {
    Command::new(FLEXID)
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .stdin(File::open(folder.join(stdin)).unwrap())
        .output()
        .unwrap()
}

#[test]
fn packed_and_piped_logs_give_the_same_numbers() {
    let (folder, log) = simulated();
    let path = folder.path();
    fs::write(path.join("gzip"), gzip(&log)).unwrap();
    fs::write(path.join("zstd"), compress_to_vec(&log[..], CompressionLevel::Fastest)).unwrap();
    let numbers = |output: Output| {
        assert!(output.status.success() && besides(&output).is_empty(), "{}", stderr(&output));
        found(path)
    };
    let plain = numbers(flexid(path, "identify --config edge.toml o.log --json o.json"));
    for packed in ["gzip", "zstd"] {
        let command = format!("identify --config edge.toml {packed} --json o.json");
        assert_eq!(numbers(flexid(path, &command)), plain, "{packed}");
    }
    let piped = identify_from(path, "gzip", "identify --config edge.toml - --json o.json");
    assert!(
        stderr(&piped).starts_with("warning: [accuracy] takes as perfect what it does not state")
    );
    assert_eq!(numbers(piped), plain);
    let twice = identify_from(path, "o.log", "identify --config edge.toml - -");
    assert_eq!(twice.status.code(), Some(2));
    assert!(stderr(&twice).contains("-: is standard input, which can be read only once"));
}

#[test]
fn a_packed_log_that_is_cut_off_keeps_what_was_there() {
    let (folder, log) = simulated();
    let packed = gzip(&log);
    fs::write(folder.path().join("cut.log.gz"), &packed[..packed.len() * 4 / 5]).unwrap();
    let command = "identify --config edge.toml cut.log.gz --json o.json";
    let output = flexid(folder.path(), command);
    let errors = stderr(&output);
    // The other is that of perfect accuracies.
    assert_eq!((output.status.code(), errors.lines().count()), (Some(1), 2), "{errors}");
    assert!(errors.contains("the gzip data are damaged or cut off"), "{errors}");
    assert!(errors.ends_with(": copy or record it again\n"), "{errors}");
    let found = json(folder.path(), "o.json");
    assert!(found["warning_kinds"][0]["trouble"]["recording_broken"].is_string(), "{found}");
    // 49,521 frames, of which four fifths were there: two experiments and a part of the third.
    let frames = json(folder.path(), "o.json")["fit"]["frames"].as_u64().unwrap();
    assert!((38_000..40_000).contains(&frames), "{frames} frames");
}

/// Packed or not, through a pipe or not: the same numbers, error and warning.
#[test]
fn a_last_line_that_is_cut_off_ends_any_log_alike() {
    let (folder, log) = simulated();
    let path = folder.path();
    let cut = &log[..log.len() - 5];
    fs::write(path.join("cut.log"), cut).unwrap();
    fs::write(path.join("cut.log.gz"), gzip(cut)).unwrap();
    let ended = |output: Output, name: &str| {
        let errors = stderr(&output);
        let said = "cannot be read: the last line is cut off: copy or record it again";
        assert!(errors.contains(&format!("breaks off: {name}:49521: {said}")), "{errors}");
        let found = json(path, "o.json");
        assert!(found["warnings"][0].as_str().unwrap().ends_with(said), "{found}");
        (output.status.code(), found["joints"].clone())
    };
    let plain = ended(flexid(path, "identify --config edge.toml cut.log --json o.json"), "cut.log");
    assert_eq!(plain.0, Some(1));
    let command = "identify --config edge.toml cut.log.gz --json o.json";
    assert_eq!(ended(flexid(path, command), "cut.log.gz"), plain);
    let command = "identify --config edge.toml - --json o.json";
    assert_eq!(ended(identify_from(path, "cut.log", command), "standard input"), plain);
}

/// Packed or not, through a pipe or not.
#[test]
fn logs_of_other_tools_are_named_with_their_conversion() {
    let folder = folder();
    let path = folder.path();
    let asc = b"date Mon Dec 29 09:20:00.000 am 2025\nbase hex  timestamps absolute\n";
    fs::write(path.join("a.log"), asc).unwrap();
    fs::write(path.join("b.log"), gzip(asc)).unwrap();
    fs::write(path.join("c.log"), b"LOGG\x90\0\0\0").unwrap();
    let cases = [
        ("identify --config edge.toml a.log", "a.log: is an ASC log: convert it with `pip"),
        ("identify --config edge.toml b.log", "b.log: is an ASC log: convert it with `pip"),
        ("identify --config edge.toml -", "standard input: is an ASC log: convert it with `pip"),
        ("identify --config edge.toml c.log", "c.log: is a BLF log: convert it with `pip"),
    ];
    for (command, said) in cases {
        let output = identify_from(path, "a.log", command);
        let errors = stderr(&output);
        assert_eq!((output.status.code(), errors.lines().count()), (Some(2), 1), "{errors}");
        assert!(errors.contains(said), "{errors}");
    }
}

#[test]
fn identifiers_that_nobody_knows_are_listed() {
    let (folder, log) = simulated();
    let other = String::from_utf8(log).unwrap().replace(" 101#", " 201#").replace(" 102#", " 202#");
    let other = other.replace(" 11", " 7F");
    fs::write(folder.path().join("other.log"), other).unwrap();
    let output = flexid(folder.path(), "identify --config edge.toml other.log");
    let errors = stderr(&output);
    assert_eq!((output.status.code(), errors.lines().count()), (Some(2), 1), "{errors}");
    let said = "holds no frame of any identifier of edge.toml: expected 0x101, 0x102, 0x111 and 2 more; \
                came 0x201 (24576 frames), 0x202 (24576), 0x7F1 (123) and 2 more";
    assert!(errors.contains(said), "{errors}");
}

/// A robot in gravity with an accelerometer that turns with the tool, simulated by another engine: who takes the example
/// as it stands finds it.
#[test]
fn the_example_finds_a_real_robot_without_a_line_deleted() {
    let folder = example();
    let recording = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/recordings/gravity_drops");
    let command = format!("identify --config edge.toml {recording}/all.log.gz --json o.json");
    let output = flexid(folder.path(), &command);
    assert!(output.status.success(), "{}", stderr(&output));
    let found = json(folder.path(), "o.json");
    assert_eq!(found["fit"]["acceptance"], "consistent");
    let truth: Value =
        serde_json::from_reader(File::open(format!("{recording}/truth.json")).unwrap()).unwrap();
    let mut covered = 0;
    for joint in found["confidence"]["joints"].as_array().unwrap() {
        let truth = &truth["truth"][joint["name"].as_str().unwrap()];
        for kind in ["stiffness", "damping"] {
            let intervals = joint[format!("{kind}_interval")].as_array().unwrap();
            for (interval, truth) in intervals.iter().zip(truth[kind].as_array().unwrap()) {
                let [lower, upper] = [0, 1].map(|end| interval[end].as_f64().unwrap());
                covered += u32::from((lower..=upper).contains(&truth.as_f64().unwrap()));
            }
        }
    }
    // Of 36 intervals of 95 % fewer cover once in a thousand robots, if their errors are correlated as they are.
    assert!(covered >= 28, "{covered} of 36 intervals cover the truth");
}
