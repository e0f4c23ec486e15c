//! The findings of `flexid check` on configurations and logs, and its exit status.

use std::fs;
use std::path::Path;
use std::process::Output;
use std::sync::OnceLock;

use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::Value;
use tempfile::TempDir;

use crate::setup::{FLEXID, edit, flexid, folder, stderr, unheard};

/// A folder with the scenario and a log of its three experiments, `cut.log`.
pub(crate) fn recorded() -> TempDir {
    static LOG: OnceLock<Vec<u8>> = OnceLock::new();
    let folder = folder();
    let file = folder.path().join("cut.log");
    let log = LOG.get_or_init(|| {
        let output = flexid(folder.path(), "simulate --config edge.toml --candump cut.log");
        assert!(output.status.success(), "{}", stderr(&output));
        fs::read(&file).unwrap()
    });
    fs::write(&file, log).unwrap();
    typical(folder.path());
    folder
}

/// The reference robot may be off, as is typical.
pub(crate) fn typical(folder: &Path) {
    edit(&folder.join("edge.toml"), "assume = \"perfect\"", "assume = \"typical\"");
}

/// Exit status, the lines of the report, and what stderr says.
fn checked(folder: &Path, arguments: &str) -> (Option<i32>, Vec<String>, String) {
    let output = flexid(folder, &format!("check --config edge.toml {arguments}"));
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    (output.status.code(), text.lines().map(str::to_owned).collect(), stderr(&output))
}

/// The findings of a state, as JSON, and the exit status.
fn findings(folder: &Path, arguments: &str, state: &str) -> (Option<i32>, Vec<String>) {
    let Output { status, stdout, .. } =
        flexid(folder, &format!("check --config edge.toml --json {arguments}"));
    let json: Value = serde_json::from_slice(&stdout).unwrap();
    assert_eq!(json["ready"], status.success(), "{json}");
    let all = json["findings"].as_array().unwrap().iter();
    let of_state = all.filter(|finding| finding["severity"] == state);
    let texts = of_state.map(|finding| {
        assert!(state == "right" || finding["mend"] != "", "{finding} has no mend");
        finding["finding"].as_str().unwrap().to_owned()
    });
    (status.code(), texts.collect())
}

/// Asserts that only this prevents identification, and that it is in the first line.
fn assert_wrong(folder: &Path, arguments: &str, said: &str) {
    let (status, wrong) = findings(folder, arguments, "wrong");
    assert_eq!(status, Some(1), "{wrong:?}");
    assert!(wrong[0].contains(said), "{wrong:?} does not say {said:?}");
    let (status, report, errors) = checked(folder, arguments);
    assert_eq!((status, errors.as_str()), (Some(1), ""));
    assert!(report[0].starts_with(&format!("not ready: {}", wrong[0])), "{report:?}");
    assert!(report[4].starts_with(" wrong "), "{report:?}");
}

#[test]
fn a_good_log_is_ready() {
    let folder = recorded();
    let (status, report, errors) = checked(folder.path(), "cut.log");
    assert_eq!((status, errors.as_str()), (Some(0), ""));
    assert_eq!(report[0], "ready to identify: 3 records in 3 poses");
    let text = report.join("\n");
    for part in [
        "all 5 expected identifiers",
        "no frame of 49152 lost",
        "least 0.19 s of rest",
        " 0x101        Fx, Fy, Fz    24576   2000.0     2000.0 ",
        " 0x113        q3              123     10.0        any ",
        ": joints at -0.600 -0.200 0.350 rad (m), base first",
        "100 %",
    ] {
        assert!(text.contains(part), "{part:?} is not in\n{text}");
    }
    for state in ["wrong", "doubtful"] {
        assert_eq!(findings(folder.path(), "cut.log", state), (Some(0), Vec::new()));
    }
    let closed = unheard(folder.path(), FLEXID, "check --config edge.toml cut.log");
    assert_eq!((closed.status.code(), stderr(&closed).as_str()), (Some(0), ""));
}

#[test]
fn without_a_log_configuration_and_dbc_file_are_checked() {
    let folder = folder();
    let (status, report, errors) = checked(folder.path(), "");
    assert_eq!((status, errors.as_str()), (Some(0), ""));
    assert_eq!(report[0], "ready to record: 3 joints and 5 identifiers; 1 doubt");
    let more =
        "\nBO_ 276 JOINT_4: 4 ROBOT\n SG_ q4 : 0|32@1- (1e-06,0) [-2147|2147] \"rad\" EDGE\n";
    edit(&folder.path().join("mill3.dbc"), "\nCM_ BO_ 257", &format!("{more}\nCM_ BO_ 257"));
    let (_, notes) = findings(folder.path(), "", "note");
    let note = "[bus] dbc has 1 further angle that [signals] joints does not name: q4";
    assert!(notes.iter().any(|finding| finding == note), "{notes:?}");
}

/// The sensor sends g, and the DBC file says m/s².
#[test]
fn an_acceleration_in_g_is_wrong() {
    let folder = recorded();
    let dbc = folder.path().join("mill3.dbc");
    let text = fs::read_to_string(&dbc).unwrap();
    fs::write(&dbc, text.replace("(0.002,0)", "(0.000203943,0)")).unwrap();
    assert_wrong(folder.path(), "cut.log", "is the acceleration in g?");
    let closed = unheard(folder.path(), FLEXID, "check --config edge.toml cut.log");
    assert_eq!((closed.status.code(), stderr(&closed).as_str()), (Some(1), ""));
}

/// The tool's weight is in the reading of an accelerometer that turns with the tool.
#[test]
fn gravity_in_g_is_wrong() {
    let folder = recorded();
    let edge = folder.path().join("edge.toml");
    edit(&edge, "[0.0, 0.0, 0.0]", "[0.0, 0.0, -9.80665]");
    edit(&edge, "\"inertial\"", "\"strapdown\"");
    let dbc = folder.path().join("mill3.dbc");
    let text = fs::read_to_string(&dbc).unwrap();
    fs::write(&dbc, text.replace("32|16@1- (0.002,0)", "32|16@1- (0.002,1)")).unwrap();
    assert_wrong(folder.path(), "cut.log", "is it in g?");
    fs::write(&dbc, text.replace("32|16@1- (0.002,0)", "32|16@1- (0.002,9.8)")).unwrap();
    let (_, right) = findings(folder.path(), "cut.log", "right");
    assert!(right.iter().any(|finding| finding.contains("reads gravity at rest")), "{right:?}");
}

#[test]
fn angles_in_degrees_are_wrong() {
    let folder = recorded();
    let dbc = folder.path().join("mill3.dbc");
    let text = fs::read_to_string(&dbc).unwrap();
    fs::write(&dbc, text.replace("(1e-06,0)", "(5.729578e-05,0)")).unwrap();
    assert_wrong(folder.path(), "cut.log", "is it in degrees?");
}

#[test]
fn swapped_axes_are_wrong() {
    let folder = recorded();
    edit(&folder.path().join("edge.toml"), "[\"ax\", \"ay\", \"az\"]", "[\"ay\", \"ax\", \"az\"]");
    assert_wrong(folder.path(), "cut.log", "the robot gives off energy");
}

#[test]
fn an_identifier_that_is_missing_is_wrong() {
    let folder = recorded();
    let log = folder.path().join("cut.log");
    let text = fs::read_to_string(&log).unwrap();
    fs::write(&log, text.replace(" 113#", " 213#")).unwrap();
    assert_wrong(folder.path(), "cut.log", "0x113 (q3) is not in the log");
    // The sample of the manual, whose middle is left out.
    let manual = include_str!("../../docs/check.md");
    let (_, sample) = manual.split_once("```text\n").unwrap();
    let (sample, _) = sample.split_once("\n```").unwrap();
    let (begins, ends) = sample.split_once("\n ...\n\n").unwrap();
    let (_, report, _) = checked(folder.path(), "cut.log");
    let text = report.iter().map(|line| line.trim_end()).collect::<Vec<_>>().join("\n");
    assert!(text.starts_with(begins) && text.ends_with(ends), "{text}");
    assert!(report.iter().any(|line| line.starts_with(" 0x213        none ")), "{report:?}");
}

/// A robot of six joints, whose first three have the identifiers of this one's. Its DBC file may be named, too.
#[test]
fn the_log_of_a_robot_of_more_joints_is_doubtful() {
    let folder = folder();
    let path = folder.path();
    typical(path);
    let simulated =
        flexid(path, "simulate --config mill6-edge.toml --experiments 1 --candump six.log");
    assert!(simulated.status.success(), "{}", stderr(&simulated));
    let (_, doubtful) = findings(path, "six.log", "doubtful");
    let unknown = "next to the identifiers of the joint angles, and at their rate, [bus] dbc lacks 0x114, 0x115 and 0x116: \
        is the log of a robot of more than 3 joints?";
    assert!(doubtful.iter().any(|finding| finding == unknown), "{doubtful:?}");
    edit(&path.join("edge.toml"), "mill3.dbc", "mill6.dbc");
    let (_, doubtful) = findings(path, "six.log", "doubtful");
    let named = "q4, q5 and q6 are in the log, and [signals] joints does not name q4, q5 and q6: \
        is the log of a robot of more than 3 joints?";
    assert!(doubtful.iter().any(|finding| finding == named), "{doubtful:?}");
    let (_, doubtful) = findings(path, "", "doubtful");
    assert_eq!(doubtful, Vec::<String>::new());
}

/// It says what `model import` warns of.
#[test]
fn placeholders_for_masses_are_doubtful() {
    let folder = folder();
    let model = folder.path().join("mill3-model.toml");
    let text = fs::read_to_string(&model).unwrap();
    let lines =
        text.lines().map(|line| if line.starts_with("mass_kg") { "mass_kg = 1.0" } else { line });
    fs::write(&model, lines.collect::<Vec<_>>().join("\n")).unwrap();
    let (status, doubtful) = findings(folder.path(), "", "doubtful");
    assert_eq!(status, Some(0));
    let placeholders = "every moving link weighs 1 kg: are these placeholders?";
    assert!(doubtful.iter().any(|finding| finding == placeholders), "{doubtful:?}");
}

#[test]
fn a_log_that_is_given_twice_counts_once() {
    let folder = recorded();
    let (status, report, _) = checked(folder.path(), "cut.log cut.log");
    assert_eq!(status, Some(0));
    assert_eq!(report[0], "ready to identify: 3 records in 3 poses; 1 doubt");
    let (_, doubtful) = findings(folder.path(), "cut.log cut.log", "doubtful");
    assert_eq!(doubtful, ["records 4, 5 and 6 repeat records 1, 2 and 3: left out"]);
}

#[test]
fn a_log_without_a_cut_is_wrong() {
    let folder = recorded();
    let log = folder.path().join("cut.log");
    let text = fs::read_to_string(&log).unwrap();
    // 0.15 s: the tool enters after 0.2 s.
    let rest: String = text.lines().take(600).map(|line| format!("{line}\n")).collect();
    fs::write(&log, rest).unwrap();
    assert_wrong(folder.path(), "cut.log", "no");
    let (_, wrong) = findings(folder.path(), "cut.log", "wrong");
    assert!(wrong.iter().any(|finding| finding.starts_with("no record")), "{wrong:?}");
}

/// The part that was read is reported all the same.
#[test]
fn a_log_that_is_cut_off_is_bad_input() {
    let folder = recorded();
    let log = fs::read(folder.path().join("cut.log")).unwrap();
    fs::write(folder.path().join("short.log"), &log[..log.len() - 7]).unwrap();
    let lines = log.iter().filter(|byte| **byte == b'\n').count();
    let (status, report, errors) = checked(folder.path(), "short.log");
    assert_eq!((status, errors.lines().count()), (Some(2), 1), "{errors}");
    let said = format!("flexid: short.log:{lines}: cannot be read: the last line is cut off");
    assert!(errors.starts_with(&said) && errors.contains("copy or record it again"), "{errors}");
    assert!(report[0].starts_with("not ready: short.log:"), "{report:?}");

    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    std::io::Write::write_all(&mut encoder, &log).unwrap();
    let packed = encoder.finish().unwrap();
    fs::write(folder.path().join("short.gz"), &packed[..packed.len() * 4 / 5]).unwrap();
    let (status, report, errors) = checked(folder.path(), "short.gz");
    assert_eq!((status, errors.lines().count()), (Some(2), 1), "{errors}");
    assert!(errors.starts_with("flexid: short.gz:"), "{errors}");
    assert!(errors.contains("the gzip data are damaged or cut off"), "{errors}");
    assert!(report[0].starts_with("not ready: short.gz:"), "{report:?}");
    assert!(report.iter().any(|line| line.contains("4 records in 3 poses")), "{report:?}");
}

#[test]
fn bad_input_is_one_line_that_names_file_and_mend() {
    let folder = folder();
    fs::write(folder.path().join("empty.log"), "").unwrap();
    fs::write(folder.path().join("letter.log"), "Dear reader,\n").unwrap();
    fs::write(folder.path().join("short.log"), "Dear\nSir").unwrap();
    edit(&folder.path().join("mill6-edge.toml"), "rate_hz = 2000.0", "rate_hz = -1.0");
    let mend = "record it with `candump -L can0 > cut.log`, or name another log";
    for (arguments, said) in [
        ("--config gone.toml", "gone.toml: cannot be read"),
        ("--config gone.toml empty.log", "gone.toml: cannot be read"),
        ("--config mill6-edge.toml", "mill6-edge.toml: [measurement] rate_hz is -1"),
        ("--config edge.toml gone.log", "gone.log: cannot be read"),
        ("--config edge.toml empty.log", &format!("empty.log: is empty: {mend}")),
        ("--config edge.toml letter.log", "letter.log: is not a candump log: line 1 is no line"),
        ("--config edge.toml short.log", "short.log: is not a candump log: line 1 is no line"),
        ("--config edge.toml letter.log", mend),
        ("", "--config <EDGE.toml>"),
    ] {
        let output = flexid(folder.path(), &format!("check {arguments}"));
        let errors = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments}: {errors}");
        assert!(output.stdout.is_empty() && errors.lines().count() == 1, "{arguments}: {errors}");
        assert!(errors.contains(said), "{arguments}: {errors}");
    }
}

#[test]
fn the_help_has_a_sample_and_the_exit_status() {
    let folder = folder();
    let output = flexid(folder.path(), "check --help");
    let help = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success());
    for part in ["flexid check --config edge.toml cut.log", "not ready: ", "Exit status: 0 when"] {
        assert!(help.contains(part), "{help}");
    }
}
