//! The program: the same bytes again, and bad input.

#[path = "../../tests/common/mod.rs"]
mod common;

use std::path::Path;
use std::process::Command;

/// Two processes, one with a single thread: the same bytes, times left out.
#[test]
fn the_same_seed_gives_the_same_bytes() {
    let run = |threads: &str| {
        let folder = tempfile::tempdir().unwrap();
        let done = Command::new(env!("CARGO_BIN_EXE_flexid-reproduce"))
            .args(["--quick", "--robots", "2", "--iterations", "2", "--out"])
            .arg(folder.path())
            .env("RAYON_NUM_THREADS", threads)
            .output()
            .unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let expected_line = String::from_utf8(done.stdout).unwrap();
        assert!(
            expected_line.contains(" are written, ") && expected_line.ends_with(" s\n"),
            "{expected_line}"
        );
        let json = std::fs::read_to_string(folder.path().join("tables.json")).unwrap();
        let html = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
        let lines = json.lines().filter(|line| !line.contains("\"seconds\""));
        (lines.collect::<Vec<_>>().join("\n"), without_seconds(&html))
    };
    let (first, second) = std::thread::scope(|scope| {
        let first = scope.spawn(|| run("1"));
        let second = run("2");
        (first.join().unwrap(), second)
    });
    assert!(first.0.len() > 1000 && first.1.len() > 1000);
    assert!(first == second, "two runs differ");
}

/// Elements of the class `seconds` emptied.
fn without_seconds(html: &str) -> String {
    let mut parts = html.split("class=\"seconds\"");
    let mut kept = parts.next().unwrap().to_owned();
    for part in parts {
        let (_, after) = part.split_once('>').unwrap();
        kept += &after[after.find('<').unwrap()..];
    }
    kept
}

#[test]
fn bad_input_is_reported_in_one_line_with_status_2() {
    let model = std::fs::read_to_string(
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenario/mill3-model.toml"),
    )
    .unwrap();
    let joints = &model[model.find("[[joint").unwrap()..model.find("[tcp]").unwrap_or(model.len())];
    // Arguments; file, text and its replacement; what stderr says.
    type Case<'a> = (&'a str, Option<[&'a str; 3]>, &'a str);
    let cases: [Case<'_>; 7] = [
        ("--out /proc/here", None, "/proc/here: cannot be made: "),
        ("--out edge.toml", None, "edge.toml: cannot be made: a file is in its place"),
        ("--out . --iterations 0", None, "--iterations"),
        ("--out . --robots 1", None, "--robots"),
        (
            "--out . --config edge.toml",
            Some(["mill3.toml", "6.0e7, 6.6e7", "6.0e9, 6.6e7"]),
            "mill3.toml: [[truth]] joint_1 stiffness tx is 6e9: must lie within [bounds], 1e7 to 2e8",
        ),
        (
            "--out . --config edge.toml",
            Some(["edge.toml", "scenario = \"mill3.toml\"", ""]),
            "[simulation] key `scenario` is missing",
        ),
        (
            "--out . --config edge.toml",
            Some(["mill3-model.toml", joints, ""]),
            "mill3-model.toml:1: key `joint` is missing",
        ),
    ];
    for (arguments, change, expected_line) in cases {
        let folder = common::folder();
        if let Some([file, from, to]) = change {
            common::edit(&folder.path().join(file), from, to);
        }
        let done = Command::new(env!("CARGO_BIN_EXE_flexid-reproduce"))
            .args(arguments.split_whitespace())
            .current_dir(folder.path())
            .output()
            .unwrap();
        let error = String::from_utf8(done.stderr).unwrap();
        assert_eq!(done.status.code(), Some(2), "{arguments}: {error}");
        assert!(error.contains(expected_line) && error.trim_end().lines().count() == 1, "{error}");
        assert!(!folder.path().join("tables.json").exists());
    }
}
