//! The program to run in a folder with the scenario, and what comes of it.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

pub(crate) use crate::common::{edit, folder};

pub(crate) const FLEXID: &str = env!("CARGO_BIN_EXE_flexid");
pub(crate) const DEMO: &str = env!("CARGO_BIN_EXE_flexid-demo");

pub(crate) fn flexid(folder: &Path, arguments: &str) -> Output {
    Command::new(FLEXID).args(arguments.split_whitespace()).current_dir(folder).output().unwrap()
}

/// As in `flexid ... | true`.
pub(crate) fn unheard(folder: &Path, program: &str, arguments: &str) -> Output {
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

pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// The JSON in a file.
pub(crate) fn json(folder: &Path, file: &str) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.join(file)).unwrap()).unwrap()
}

/// A dial gauge above the tool, and a hundred kilograms hung on it.
pub(crate) fn add_static_test(folder: &Path) {
    let test = "q1,q2,q3,fx,fy,fz,mx,my,mz,dx,dy,dz,sx,sy,sz\n\
                0,-0.45,0.95,0,0,-981,0,0,0,,,-1.12e-4,,,5e-6\n";
    fs::write(folder.join("static.csv"), test).unwrap();
    edit(&folder.join("edge.toml"), "[search]", "[static]\nfile = \"static.csv\"\n\n[search]");
}

/// Simulates and identifies; the table and the result file.
pub(crate) fn identified(
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
