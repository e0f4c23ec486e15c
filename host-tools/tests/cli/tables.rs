//! Tables in place of logs: what is said of them, and what comes of them.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::setup::{FLEXID, edit, flexid, folder, stderr};

const NAMES: &str = "time [s],Fx [N],Fy [N],Fz [N],ax [g],ay [g],az [g]\n";
const BUS: &str = "[bus]\ninterface = \"vcan0\"\ndbc = \"mill3.dbc\"                   # where the signals lie in the frames\n";

/// A folder whose configuration is for tables, with the poses of `a.csv` and `b.csv`.
fn for_tables() -> tempfile::TempDir {
    let folder = folder();
    let edge = folder.path().join("edge.toml");
    edit(&edge, BUS, "");
    edit(&edge, "force_counter = \"ForceCounter\"", "");
    edit(&edge, "acceleration_counter = \"AccelerationCounter\"", "");
    edit(&edge, "rate_hz = 2000.0\n", "");
    edit(&edge, "joints = [\"q1\", \"q2\", \"q3\"]", "[recording]\nposes = \"poses.csv\"");
    let poses = "file,q1 [deg],q2,q3\na.csv,0,-0.45,0.95\nb.csv,10,-0.4,0.9\n-,0,-0.45,0.95\n";
    fs::write(folder.path().join("poses.csv"), poses).unwrap();
    folder
}

/// Rows of a sweep with rest before it, at this rate.
fn rows(rate_hz: f64) -> String {
    let row = |row: u32| {
        let time = f64::from(row) / rate_hz;
        let noise = f64::from(row.wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24) - 0.5;
        let cut = if time < 1.0 { 0.0 } else { 100.0 * ((60.0 + 40.0 * time) * time).sin() };
        let (force, acceleration) = (cut + noise, 0.01 * cut + 0.001 * noise);
        format!(
            "{time:.6},{force:.3},{:.3},{:.3},{acceleration:.6},{acceleration:.6},{:.6}\n",
            0.5 * force,
            noise,
            0.5 * acceleration
        )
    };
    (0..(6.0 * rate_hz) as u32).map(row).collect()
}

/// The findings of `check --json`, a line each.
fn findings(json: &[u8]) -> String {
    let json: Value = serde_json::from_slice(json).unwrap();
    let all = json["findings"].as_array().unwrap().iter();
    all.map(|own| format!("{}\n", own["finding"].as_str().unwrap())).collect()
}

fn refused(folder: &Path, arguments: &str) -> String {
    let output = flexid(folder, arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments}: {}", stderr(&output));
    stderr(&output)
}

#[test]
fn what_is_wrong_with_a_table_is_one_line() {
    let folder = for_tables();
    let path = folder.path();
    let table = |name: &str, text: String| fs::write(path.join(name), text).unwrap();
    table("a.csv", NAMES.to_owned() + &rows(2000.0));
    table("b.csv", NAMES.to_owned() + &rows(1000.0));
    table("other.csv", NAMES.to_owned() + &rows(2000.0));
    table("cut.log", "(1767000000.000060) can0 101#03000000FEFFFE0E\n".repeat(4));
    table("letter.txt", "Dear reader,\n\nyours\n".to_owned());
    for (logs, said) in [
        (
            "other.csv",
            "other.csv: has no line in [recording] poses, which names a.csv, b.csv, -: add its pose there",
        ),
        (
            "a.csv b.csv",
            "b.csv: comes at 1000.0 Hz, and the tables before at 2000.0 Hz: identify from those of one rate",
        ),
        (
            "cut.log",
            "cut.log: is a candump log, and edge.toml has no [bus]: name interface and DBC file there",
        ),
        (
            "letter.txt",
            "letter.txt: is no table: no line names the columns Fx, Fy, Fz, ax, ay, az of [signals]",
        ),
        (
            "edge.toml",
            "edge.toml: is a configuration, and neither a log of candump -L nor a table: name one",
        ),
    ] {
        for command in ["check", "identify"] {
            let line = refused(path, &format!("{command} --config edge.toml {logs}"));
            assert!(line.contains(said) && line.trim_end().lines().count() == 1, "{line}");
        }
    }
    table("a.csv", NAMES.replace("time [s]", "number") + &rows(2000.0));
    let line = refused(path, "check --config edge.toml a.csv");
    assert!(
        line.contains("[measurement] rate_hz is missing, and no column of the table tells it"),
        "{line}"
    );
    let line = refused(path, "plan --config edge.toml");
    assert!(line.contains("[measurement] rate_hz is missing: a plan is made for a rate"), "{line}");
    let line = refused(path, "simulate --config edge.toml --candump o.log");
    assert!(line.contains("[bus] is missing: "), "{line}");
    edit(&path.join("edge.toml"), "band_hz", "rate_hz = 2000.0\nband_hz");
    edit(&path.join("edge.toml"), "[signals]", &format!("{BUS}\n[signals]"));
    let line = refused(path, "check --config edge.toml a.csv cut.log");
    assert!(line.contains("[signals] joints is missing: name the signal"), "{line}");
}

#[test]
fn a_log_and_a_table_are_not_of_one_kind() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("cut.log"), "(1767000000.000060) can0 101#03000000FEFFFE0E\n".repeat(4))
        .unwrap();
    // The names of the configuration's signals are columns just as well.
    let table =
        format!("{},q1,q2,q3\n{}", NAMES.trim_end(), rows(2000.0).replace('\n', ",0,-0.45,0.95\n"));
    fs::write(path.join("cut.csv"), table).unwrap();
    let line = refused(path, "check --config edge.toml cut.log cut.csv");
    assert!(line.contains("cut.csv: is of another kind than the recordings before: name candump logs or tables, not both"), "{line}");
    let checked = flexid(path, "check --config edge.toml cut.csv --json");
    assert!(findings(&checked.stdout).contains("all columns are in the table"));
}

#[test]
fn a_table_is_checked_as_a_log_is() {
    let folder = for_tables();
    let path = folder.path();
    fs::write(path.join("a.csv"), NAMES.to_owned() + &rows(2000.0)).unwrap();
    let checked = flexid(path, "check --config edge.toml a.csv --json");
    let said = findings(&checked.stdout);
    for expected in [
        "all columns are in the table",
        "force and acceleration come at 2000.0 Hz, and rate_hz is 2000",
        "3 driven joints, each with an angle in [recording] poses: q1, q2 and q3",
        "3 records in 1 pose",
    ] {
        assert!(said.contains(expected), "{expected}: {said}");
    }
    // The same by a pipe, packed.
    let piped = Command::new("sh")
        .args(["-c", "gzip -c a.csv | \"$0\" check --config edge.toml - --json", FLEXID])
        .current_dir(path)
        .output()
        .unwrap();
    let json: Value = serde_json::from_slice(&piped.stdout).unwrap();
    assert_eq!(json["identifiers"][0]["signals"][2], "Fz");
    assert_eq!(json["records"].as_array().unwrap().len(), 3, "{json}");
    let alone = flexid(path, "check --config edge.toml");
    let text = String::from_utf8_lossy(&alone.stdout).into_owned();
    assert!(text.contains("ready to read tables: 3 joints"), "{text}");
}

/// A hammer's channel and three accelerations: the blows of a file stand in its poses, an axis a line.
#[test]
fn blows_of_a_hammer_are_checked() {
    let folder = for_tables();
    let path = folder.path();
    edit(&path.join("edge.toml"), "force = [\"Fx\", \"Fy\", \"Fz\"]", "force = \"Hammer\"");
    let poses = "file,q1,q2,q3,force,px\na.csv,0,-0.45,0.95,x,0\na.csv,0,-0.45,0.95,y,0.1\na.csv,0,-0.45,0.95,-z,0\n";
    fs::write(path.join("poses.csv"), poses).unwrap();
    let blow = |limit: f64, second: f64| -> String {
        let row = |row: u32| {
            let time = f64::from(row) / 5000.0;
            let noise = f64::from(row.wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24) - 0.5;
            let arch = |begin: f64, peak: f64| {
                let part = (time - begin) / 2e-3;
                if (0.0..1.0).contains(&part) {
                    peak * (std::f64::consts::PI * part).sin()
                } else {
                    0.0
                }
            };
            let force = (arch(1.5, 500.0) + arch(1.54, second)).min(limit)
                + 0.1 * noise * f64::from(u8::from(!(1.49..=1.6).contains(&time)));
            let ring = if time > 1.5 { (-(time - 1.5)).exp() * (40.0 * time).sin() } else { 0.0 };
            let value = |size: f64| size * ring + 0.01 * noise;
            format!("{time:.6},{force:.3},{:.6},{:.6},{:.6}\n", value(0.3), value(-0.2), value(0.4))
        };
        (0..30_000).map(row).collect()
    };
    let text = ["time [s],Hammer [N],ax [g],ay [g],az [g]\n"].repeat(3);
    let blows = [blow(1e3, 0.0), blow(1e3, 100.0), blow(400.0, 0.0)];
    let table: String =
        text.iter().zip(&blows).map(|(names, blow)| format!("{names}{blow}")).collect();
    fs::write(path.join("a.csv"), table).unwrap();
    let checked = flexid(path, "check --config edge.toml a.csv --json");
    let said = findings(&checked.stdout);
    for expected in [
        "all columns are in the table",
        "3 records in 1 pose",
        "a double hit in record 2, 40 ms apart",
        "overload: a blow in record 3 cut off at 400 N",
        "blows may not break the joints loose",
    ] {
        assert!(said.contains(expected), "{expected}: {said}");
    }
    assert!(said.contains("no axis is stuck"), "{said}");
}
