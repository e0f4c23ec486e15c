//! The program to run in a folder with the scenario, and what comes of it.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

use serde_json::Value;
use tempfile::TempDir;

pub(crate) use crate::common::{edit, folder};

pub(crate) const FLEXID: &str = env!("CARGO_BIN_EXE_flexid");
pub(crate) const DEMO: &str = env!("CARGO_BIN_EXE_flexid-demo");

pub(crate) fn flexid(folder: &Path, arguments: &str) -> Output {
    Command::new(FLEXID).args(arguments.split_whitespace()).current_dir(folder).output().unwrap()
}

/// Runs a command as in `flexid ... | true`.
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

/// The text on stderr, but for the progress, which is there where the machine is slow.
pub(crate) fn stderr(output: &Output) -> String {
    let text = String::from_utf8(output.stderr.clone()).unwrap();
    text.split_inclusive('\n').filter(|line| !line.starts_with("progress: ")).collect()
}

/// The text on stderr of a scenario beside the first line, that its accuracies are perfect.
pub(crate) fn besides(output: &Output) -> String {
    let text = stderr(output);
    let perfect = "warning: [accuracy] takes as perfect what it does not state";
    match text.split_once('\n') {
        Some((first, rest)) if first.starts_with(perfect) => rest.to_owned(),
        _ => text,
    }
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
    fitted(folder)
}

/// Identifies from `o.log`; the table and the result file.
pub(crate) fn fitted(folder: &Path) -> (String, Value) {
    let table = stdout(folder, "identify --config edge.toml o.log --json o.json");
    (table, json(folder, "o.json"))
}

/// A folder with the log of the scenario as `o.log` and its result as `o.json`, which are made once.
pub(crate) fn found() -> TempDir {
    static FOUND: OnceLock<[Vec<u8>; 2]> = OnceLock::new();
    const FILES: [&str; 2] = ["o.log", "o.json"];
    let folder = folder();
    let made = FOUND.get_or_init(|| {
        let (_, found) = identified(folder.path(), "", || ());
        [fs::read(folder.path().join(FILES[0])).unwrap(), found.to_string().into_bytes()]
    });
    for (file, content) in FILES.iter().zip(made) {
        fs::write(folder.path().join(file), content).unwrap();
    }
    folder
}

/// The output of a command that succeeds.
pub(crate) fn stdout(folder: &Path, arguments: &str) -> String {
    let output = flexid(folder, arguments);
    assert!(output.status.success(), "{arguments}: {}", stderr(&output));
    String::from_utf8(output.stdout).unwrap()
}

/// The line on stderr of a command that refuses its input.
pub(crate) fn refused(folder: &Path, arguments: &str) -> String {
    let output = flexid(folder, arguments);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{arguments}: {message}");
    assert_eq!(message.lines().count(), 1, "{arguments}: {message}");
    message
}

/// Checks that a command refuses each result that is none: missing, empty, cut off, of another kind, too large. `FOUND` stands for its name
/// in the arguments.
pub(crate) fn refuses_bad_results(folder: &Path, arguments: &str) {
    let whole = fs::read_to_string(folder.join("o.json")).unwrap();
    fs::write(folder.join("empty.json"), "").unwrap();
    fs::write(folder.join("cut.json"), &whole[..whole.len() / 2]).unwrap();
    fs::File::create(folder.join("huge.json")).unwrap().set_len(17 << 20).unwrap();
    fs::write(folder.join("cut.log"), "(1767000000.000060) can0 101#03000000FEFFFE0E\n").unwrap();
    fs::write(folder.join("other.json"), "{\"truth\": {}}\n").unwrap();
    for (file, expected) in [
        ("gone.json", "cannot be read"),
        ("empty.json", "is empty: give a file as `flexid identify --json` writes it"),
        ("cut.json", "is cut off at line 1: copy it again, or give a file as `flexid identify"),
        ("edge.toml", "is a configuration: give a file as `flexid identify --json` writes it"),
        ("cut.log", "is a candump log: give a file as `flexid identify --json` writes it"),
        (
            "other.json",
            "is a file of `flexid simulate --truth-json`: key `joints` is missing: give a file as `flexid identify --json` writes it",
        ),
        (".", "cannot be read"),
        ("huge.json", "is larger than 16 MiB"),
    ] {
        let message = refused(folder, &arguments.replace("FOUND", file));
        assert!(message.contains(&format!("{file}: ")) && message.contains(expected), "{message}");
    }
}
