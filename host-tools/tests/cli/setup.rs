//! A folder with the scenario, the program to run in it, and what comes of it.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;
use tempfile::TempDir;

pub const FLEXID: &str = env!("CARGO_BIN_EXE_flexid");
pub const DEMO: &str = env!("CARGO_BIN_EXE_flexid-demo");
const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenario");

/// A folder with the scenario in it.
pub fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(SCENARIO).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), folder.path().join(entry.file_name())).unwrap();
    }
    folder
}

pub fn flexid(folder: &Path, arguments: &str) -> Output {
    Command::new(FLEXID).args(arguments.split_whitespace()).current_dir(folder).output().unwrap()
}

/// As in `flexid ... | true`.
pub fn unheard(folder: &Path, program: &str, arguments: &str) -> Output {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    Command::new(program)
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .stdout(writer)
        .stderr(Stdio::piped())
        .output()
        .unwrap()
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// Replaces `from`, which must be there, in a file.
pub fn edit(file: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(file).unwrap();
    assert!(text.contains(from), "{} has no {from}", file.display());
    fs::write(file, text.replacen(from, to, 1)).unwrap();
}

/// The JSON in a file.
pub fn json(folder: &Path, file: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.join(file)).unwrap()).unwrap()
}

/// Simulates and identifies; the table and the result file.
pub fn identified(
    folder: &Path,
    simulation: &str,
    before_identifying: impl FnOnce(),
) -> (String, Value) {
    let simulated =
        flexid(folder, &format!("simulate --config edge.toml --candump o.log {simulation}"));
    assert!(simulated.status.success(), "{}", stderr(&simulated));
    before_identifying();
    let output = flexid(folder, "identify --config edge.toml o.log --json o.json");
    assert!(output.status.success(), "{}", stderr(&output));
    (String::from_utf8(output.stdout).unwrap(), json(folder, "o.json"))
}
