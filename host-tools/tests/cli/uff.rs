//! The universal file as pyuff reads it.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::python::{run, with};
use crate::setup::{flexid, found, stderr};

/// Largest deviation of a receptance from the one that is printed, relative: the file has thirteen digits.
const DIGITS: f64 = 1e-11;
/// Largest deviation of a frequency, relative: rounding.
const FREQUENCY_DIGITS: f64 = 1e-12;

/// A program that is not ours reads from the file what `predict --json` prints, in each direction at each frequency.
#[test]
fn pyuff_reads_the_receptance() {
    let folder = found();
    let folder = folder.path();
    let pose = "--pose 0.4,-0.7,1.1";
    for arguments in [
        format!("predict o.json {pose} --receptance predicted.uff --json"),
        format!("export o.json {pose} --format uff --out exported.uff"),
    ] {
        let output = flexid(folder, &arguments);
        assert!(output.status.success(), "{arguments}: {}", stderr(&output));
        if arguments.starts_with("predict") {
            check(folder, &output.stdout);
        }
    }
    let [predicted, exported] =
        ["predicted.uff", "exported.uff"].map(|file| fs::read(folder.join(file)).unwrap());
    assert!(predicted == exported);
}

fn check(folder: &Path, printed: &[u8]) {
    let printed: Value = serde_json::from_slice(printed).unwrap();
    let points = printed[0]["receptance"].as_array().unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cli/uff.py");
    let mut python = Command::new(with("pyuff"));
    let read = run(python.arg(script).arg(folder.join("predicted.uff"))).unwrap();
    let sets: Vec<Value> = serde_json::from_str(&read).unwrap();
    assert_eq!(sets.len(), 9);
    for set in &sets {
        let [response, reference] = ["rsp_dir", "ref_dir"].map(|name| set[name].as_u64().unwrap());
        let [row, column] = [response as usize - 1, reference as usize - 1];
        assert_eq!(set["type"], 58);
        assert_eq!(set["func_type"], 4);
        assert_eq!(set["real"].as_array().unwrap().len(), points.len());
        for (index, point) in points.iter().enumerate() {
            let number = |name: &str| set[name][index].as_f64().unwrap();
            let hz = point["frequency_hz"].as_f64().unwrap();
            assert!((number("hz") / hz - 1.0).abs() < FREQUENCY_DIGITS, "{hz}");
            let entry = |kind: &str| point[kind][row][column]["value"].as_f64().unwrap();
            let (magnitude, phase) = (entry("magnitude"), entry("phase"));
            let (sin, cos) = phase.sin_cos();
            let away = (number("real") - magnitude * cos).hypot(number("imag") - magnitude * sin);
            assert!(away < DIGITS * magnitude, "{row} {column} at {hz} Hz: {away} of {magnitude}");
        }
    }
}
