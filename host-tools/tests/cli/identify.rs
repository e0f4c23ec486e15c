//! The words of `flexid identify` on its numbers.

use std::fs;

use serde_json::Value;

use crate::setup::{
    add_static_test, besides, edit, fitted, flexid, folder, found, identified, json, refused,
    stderr, stdout,
};

#[test]
fn the_result_says_how_far_to_trust_it() {
    let folder = folder();
    let (table, report) = identified(folder.path(), "--truth-json t.json", || ());
    let truth = json(folder.path(), "t.json");
    let confidence = &report["confidence"];

    let mut covered = 0;
    for joint in confidence["joints"].as_array().unwrap() {
        let truth = &truth["truth"][joint["name"].as_str().unwrap()];
        for kind in ["stiffness", "damping"] {
            let intervals = joint[format!("{kind}_interval")].as_array().unwrap();
            assert_eq!(intervals.len(), 6);
            for (interval, truth) in intervals.iter().zip(truth[kind].as_array().unwrap()) {
                let [lower, upper] = [0, 1].map(|end| interval[end].as_f64().unwrap());
                let truth = truth.as_f64().unwrap();
                // Neither is wide enough to cover all that there could be.
                assert!(upper / lower < 1.1, "{joint}");
                covered += u32::from((lower..=upper).contains(&truth));
            }
        }
    }
    // A truth that is not this robot's is missed, in the table and in the file.
    edit(&folder.path().join("t.json"), "8600000.0", "8800000.0");
    let said =
        stdout(folder.path(), "identify --config edge.toml o.log --truth t.json --json m.json");
    assert!(said.contains("\n missed: joint_2 ry stiffness 8.60 MNm/rad ("), "{said}");
    assert!(said.contains("), truth 8.80 MNm/rad: +"), "{said}");
    assert!(said.contains("\n missed: drive of joint_2 8.60 MNm/rad ("), "{said}");
    let misses = json(folder.path(), "m.json")["truth"]["stiffness"]["misses"].clone();
    let is_it = |own: &Value| own["name"] == "joint_2 ry stiffness" && own["truth"] == 8.8e6;
    assert!(misses.as_array().unwrap().iter().any(is_it), "{misses}");
    // Of 36 intervals of 95 % fewer cover once in a thousand robots, if their errors are correlated as they are.
    assert!(covered >= 28, "{covered} of 36 intervals cover the truth");
    assert_eq!(confidence["correlations"]["unknowns"].as_array().unwrap().len(), 36);
    assert_eq!(confidence["correlations"]["percent"].as_array().unwrap().len(), 630);
    assert_eq!(confidence["weak_directions"].as_array().unwrap().len(), 0);
    assert_eq!(confidence["residuals"]["size_objects"], false);
    assert_eq!(confidence["residuals"]["structure_objects"], false);
    let held_out = confidence["held_out"].as_array().unwrap();
    assert_eq!(held_out.len(), 3);
    for record in held_out {
        assert_eq!(record["pose"].as_array().unwrap().len(), 3);
        for axis in 0..3 {
            let [frac, vaf] = ["frac", "vaf"].map(|key| record[key][axis].as_f64().unwrap());
            assert!(frac > 0.99 && frac <= 1.0 && vaf > 0.99 && vaf <= 1.0, "{record}");
        }
    }
    for part in [
        " 95 % ",
        "±0.0",
        "residuals    noise explains them (",
        "held out     each of 3 records predicted from the others: FRAC (shape) ",
        "\n SSP, the surface similarity parameter, is 0 where model and measurement agree, and 2 where they are opposite; \
         the first is the median of all directions of all records\n\ntool         softest ",
        "\nconsistent: ",
    ] {
        assert!(table.contains(part), "{part:?} is not in\n{table}");
    }
    for part in ["warning: ", "weak  ", "no intervals", "intervals are"] {
        assert!(!table.contains(part), "{part:?} is in\n{table}");
    }
}

/// In gravity, and without bounds.
#[test]
fn a_robot_of_six_joints_is_found_without_bounds() {
    let folder = folder();
    fs::copy(folder.path().join("mill6-edge.toml"), folder.path().join("edge.toml")).unwrap();
    let (_, report) = identified(folder.path(), "--experiments 3 --truth-json t.json", || ());
    let truth = json(folder.path(), "t.json");
    assert_eq!(report["fit"]["acceptance"], "consistent");
    let mut identified = 0;
    for joint in report["joints"].as_array().unwrap() {
        let truth = &truth["truth"][joint["name"].as_str().unwrap()];
        for kind in ["stiffness", "damping"] {
            for dof in 0..6 {
                if joint[format!("{kind}_verdict")][dof] != "identified" {
                    continue;
                }
                let deviation = joint[format!("{kind}_std")][dof].as_f64().unwrap();
                let [found, truth] =
                    [&joint[kind], &truth[kind]].map(|of| of[dof].as_f64().unwrap());
                assert!((found - truth).abs() < 4.0 * deviation, "{kind} {dof} of {joint}");
                identified += 1;
            }
        }
    }
    assert!(identified >= 60, "{identified} of 72 parameters are identified");
}

/// With static tests no log is needed; where one is given and brings no record, the table says why.
#[test]
fn static_tests_need_no_log() {
    let folder = folder();
    let path = folder.path();
    add_static_test(path);
    let table = |arguments: &str| {
        let output = flexid(path, arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let alone = table("identify --config edge.toml --json o.json");
    assert!(alone.contains("joint_3") && !alone.contains("no record"), "{alone}");
    assert!(!alone.contains("SSP"), "{alone}");
    assert!(path.join("o.json").exists());
    fs::write(path.join("force.log"), "(1767000000.000060) can0 101#03000000FEFFFE0E\n").unwrap();
    let wrong = table("identify --config edge.toml force.log");
    assert!(wrong.contains("warning: no record: waiting for acceleration frames"), "{wrong}");
}

/// Logs that are none, that break off, or that are of another robot. Each is refused in one line with what to do.
#[test]
fn a_log_without_a_record_is_refused_with_what_to_do() {
    let folder = folder();
    let log = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    let force = "(1767000000.000060) can0 101#03000000FEFFFE0E\n";
    log("empty.log", "");
    log("letter.log", "Dear reader,\n\n");
    log("short.log", "Dear\nSir");
    log("table.log", "time;id;data\n0.1;101;00");
    log("line.log", &"x".repeat(1 << 20));
    log("other.log", &force.replace(" 101#", " 7F1#").repeat(3));
    log("cut.log", &format!("{force}{}", &force[..30]));
    log("force.log", force);
    let record = "record it with `candump -L can0 > cut.log`, or name another log";
    for (arguments, said) in [
        ("empty.log", &["empty.log: is empty: ", record][..]),
        ("force.log empty.log", &["empty.log: is empty: ", record]),
        ("letter.log", &["letter.log: is not a candump log: line 1 is no line of", record]),
        ("short.log", &["short.log: is not a candump log: line 1 is no line of", record]),
        (
            "table.log",
            &["table.log:1: has no column \"Fx\", \"Fy\"", "it has \"time\", \"id\", \"data\": "],
        ),
        (
            "line.log",
            &[
                "line.log: is neither a candump log nor a table: line 1 is longer than 64 KiB",
                record,
            ],
        ),
        (
            "other.log",
            &[
                "other.log: holds no frame of any identifier of edge.toml: expected 0x101, 0x102, 0x111",
                "came 0x7F1 (3 frames)",
                "name a log of this robot, or correct [bus] dbc",
            ],
        ),
        ("other.log other.log", &["of any identifier of edge.toml, nor do the others: expected"]),
        (
            "cut.log",
            &["cut.log: no record to identify from (waiting for acceleration frames: none seen; \
                 the recording breaks off: cut.log:2: cannot be read: the last line is cut off: copy or record it again): \
                 see `flexid check` of the same logs"],
        ),
        // What breaks off is not the first.
        (
            "force.log cut.log",
            &["cut.log:2: cannot be read: the last line is cut off: copy or record it again"],
        ),
    ] {
        let message = refused(folder.path(), &format!("identify --config edge.toml {arguments}"));
        for part in said {
            assert!(message.contains(part), "{arguments}: {message:?} does not say {part:?}");
        }
    }
}

/// The rest of the last line looks like a frame of another length, and is none.
#[test]
fn of_a_log_that_is_cut_off_only_that_is_said() {
    let folder = folder();
    let path = folder.path();
    stdout(path, "simulate --config edge.toml --experiments 1 --candump o.log");
    let log = fs::read_to_string(path.join("o.log")).unwrap();
    let last = log.trim_end().rfind('#').unwrap();
    fs::write(path.join("cut.log"), &log[..last + 5]).unwrap();
    let output = flexid(path, "identify --config edge.toml cut.log");
    let table = String::from_utf8(output.stdout.clone()).unwrap();
    assert!(table.contains("1 record,") && !table.contains("bytes"), "{table}");
    let said = besides(&output);
    assert!(said.contains(": cannot be read: the last line is cut off: copy or record it again"));
    assert_eq!(said.lines().count(), 1, "{said}");
}

/// A doubt of `check` about the model stands on stderr, in the result and in its page.
#[test]
fn doubts_about_the_model_stay_with_the_result() {
    let folder = folder();
    let path = folder.path();
    stdout(path, "simulate --config edge.toml --experiments 1 --candump o.log");
    edit(&path.join("mill3-model.toml"), "[tcp]\nname = \"tcp\"", "[tcp]\nname = \"tool0\"");
    let output = flexid(path, "identify --config edge.toml o.log --json o.json --report o.html");
    let doubt = "the TCP 'tool0' is by its name the flange, without a tool (";
    assert!(besides(&output).starts_with(&format!("warning: {doubt}")), "{}", stderr(&output));
    let warnings = &json(path, "o.json")["model_warnings"];
    assert!(warnings[0].as_str().unwrap().starts_with(doubt), "{warnings}");
    let page = fs::read_to_string(path.join("o.html")).unwrap();
    assert!(page.contains("<li>model: the TCP 'tool0' is by its name the flange"));
}

/// It is said before the table, which may be long.
#[test]
fn one_pose_of_a_robot_of_six_joints_is_warned_of() {
    let folder = folder();
    fs::copy(folder.path().join("mill6-edge.toml"), folder.path().join("edge.toml")).unwrap();
    stdout(folder.path(), "simulate --config edge.toml --experiments 2 --candump o.log");
    let log = fs::read_to_string(folder.path().join("o.log")).unwrap();
    let first: Vec<&str> = log.lines().take(log.lines().count() / 2).collect();
    fs::write(folder.path().join("one.log"), first.join("\n") + "\n").unwrap();
    let warning =
        "warning: all records are of one pose, which does not determine a robot of 6 joints: ";
    for (log, is_warned) in [("one.log", true), ("o.log", false)] {
        let output = flexid(folder.path(), &format!("identify --config edge.toml {log}"));
        assert!(output.status.success(), "{}", stderr(&output));
        assert_eq!(besides(&output).starts_with(warning), is_warned, "{log}: {}", stderr(&output));
    }
}

/// The first three joints of the robot of six have the identifiers of this one's, so that its log gives records.
#[test]
fn the_log_of_a_robot_of_more_joints_is_warned_of() {
    let folder = folder();
    let path = folder.path();
    stdout(path, "simulate --config mill6-edge.toml --experiments 1 --candump six.log");
    stdout(path, "simulate --config edge.toml --experiments 1 --candump o.log");
    let said = |log: &str| {
        let output = flexid(path, &format!("identify --config edge.toml {log}"));
        assert!(output.status.success(), "{}", stderr(&output));
        besides(&output)
    };
    let mend = " (name the log of this robot; for one of more joints import all of them, and name their angles)\n";
    let unknown = "warning: next to the identifiers of the joint angles, and at their rate, [bus] dbc lacks 0x114, 0x115 and 0x116: \
        is the log of a robot of more than 3 joints?";
    assert_eq!(said("six.log"), format!("{unknown}{mend}"));
    edit(&path.join("edge.toml"), "mill3.dbc", "mill6.dbc");
    let named = "warning: q4, q5 and q6 are in the log, and [signals] joints does not name q4, q5 and q6: \
        is the log of a robot of more than 3 joints?";
    assert_eq!(said("six.log"), format!("{named}{mend}"));
    assert_eq!(said("o.log"), "");

    // Half a second of it has no cut.
    let log = fs::read_to_string(path.join("six.log")).unwrap();
    let rest: String = log.lines().take(600).map(|line| format!("{line}\n")).collect();
    fs::write(path.join("rest.log"), rest).unwrap();
    let message = refused(path, "identify --config edge.toml rest.log");
    assert!(message.contains("; q4, q5 and q6 are in the log, and "), "{message}");
}

/// One pose and ten times the noise determine little, and the report says so.
#[test]
fn what_a_single_pose_does_not_determine_is_named() {
    let folder = folder();
    let (table, report) = identified(folder.path(), "--experiments 1 --noise 10", || ());
    let confidence = &report["confidence"];
    assert_eq!(confidence["held_out"].as_array().unwrap().len(), 0);
    assert!(!table.contains("held out"), "{table}");
    let weak = confidence["weak_directions"].as_array().unwrap();
    assert!(!weak.is_empty(), "all is determined:\n{table}");
    for direction in weak {
        let text = direction["text"].as_str().unwrap();
        assert!(text.contains(direction["shares"][0]["name"].as_str().unwrap()), "{text}");
    }
    let worst = format!("\nweak         {}\n", weak[0]["text"].as_str().unwrap());
    assert!(table.contains(&worst), "{worst:?} is not in\n{table}");
}

/// A link that weighs a fifth less than it should: the advice is to look at the model, not for more data.
#[test]
fn a_wrong_model_is_reported_as_one() {
    let folder = found();
    edit(&folder.path().join("mill3-model.toml"), "mass_kg = 485.0", "mass_kg = 388.0");
    let (table, report) = fitted(folder.path());
    assert_eq!(report["confidence"]["residuals"]["size_objects"], true);
    let warnings = report["warnings"].as_array().unwrap();
    let said = |part: &str| warnings.iter().any(|line| line.as_str().unwrap().contains(part));
    assert!(said("the model is wrong") && said("masses") && !said("more poses"), "{warnings:?}");
    let kinds = report["warning_kinds"].as_array().unwrap();
    assert_eq!((&report["schema"], kinds.len()), (&serde_json::json!(2), warnings.len()));
    assert!(kinds.iter().any(|kind| kind["objection"].is_object()), "{kinds:?}");
    let consistency = report["fit"]["consistency"].as_f64().unwrap();
    let caveat =
        if consistency > 10.0 { " no intervals: " } else { " intervals are √(χ²/dof) = " };
    assert!(table.contains(caveat), "{table}");
    let interval = &report["confidence"]["joints"][0]["stiffness_interval"][0];
    assert!(consistency <= 10.0 || interval.is_null(), "{interval} at {consistency}");
}

/// The simulated sensors are in time, and joint 1 is as stiff as it is said to be.
#[test]
fn what_is_sought_beside_the_joints_and_what_is_fixed_is_reported() {
    let folder = found();
    let sections = "\n[calibration]\ndelay_s = 5e-4\n\n[parameters]\n\
                    fixed = { \"joint_1.stiffness.tx\" = 6.0e7 }\n";
    let config = folder.path().join("edge.toml");
    fs::write(&config, fs::read_to_string(&config).unwrap() + sections).unwrap();
    let (table, report) = fitted(folder.path());
    let joint = &report["joints"][0];
    assert_eq!(joint["stiffness_verdict"][0], "fixed");
    assert!((joint["stiffness"][0].as_f64().unwrap() / 6.0e7 - 1.0).abs() < 1e-12, "{joint}");
    assert_eq!(joint["stiffness_std"][0], Value::Null);
    let confidence = &report["confidence"];
    assert_eq!(confidence["joints"][0]["stiffness_interval"][0], Value::Null);
    let unknowns = confidence["correlations"]["unknowns"].as_array().unwrap();
    assert_eq!((unknowns.len(), &unknowns[0]), (36, &"joint_1 ty stiffness".into()));
    assert_eq!(unknowns[35], "delay");
    let [delay] = confidence["nuisances"].as_array().unwrap().as_slice() else {
        panic!("{confidence}")
    };
    assert_eq!((&delay["name"], &delay["unit"]), (&"delay".into(), &"s".into()));
    assert_eq!(delay["verdict"], "identified");
    let [value, std] = ["value", "std"].map(|key| delay[key].as_f64().unwrap());
    // A hundredth of a sample, and four standard deviations.
    assert!(std < 5e-6 && value.abs() < 4.0 * std, "{delay}");
    for part in ["     fixed ", ", 1 fixed\n", "calibration  delay "] {
        assert!(table.contains(part), "{part:?} is not in\n{table}");
    }
}

/// A slip of the shell's completion costs no recording, configuration or result.
#[test]
fn no_command_overwrites_what_it_reads() {
    let folder = found();
    let folder = folder.path();
    fs::copy(folder.join("mill3.urdf"), folder.join("robot.urdf")).unwrap();
    fs::write(folder.join("path.csv"), "q1,q2,q3,fx,fy,fz\n0,0.1,0.2,0,100,0\n").unwrap();
    fs::write(folder.join("o.log"), "(1767000000.000060) can0 101#03000000FEFFFE0E\n").unwrap();
    let names = ["o.json", "o.log", "edge.toml", "mill3.toml", "path.csv", "robot.urdf"];
    let contents = || names.map(|name| fs::read(folder.join(name)).unwrap());
    let before = contents();
    for (command, file) in [
        ("identify --config edge.toml o.log --json o.log", "o.log"),
        ("identify --config edge.toml o.log --report ./edge.toml", "edge.toml"),
        ("simulate --config edge.toml --candump edge.toml", "edge.toml"),
        ("simulate --config edge.toml --candump mill3.toml", "mill3.toml"),
        ("simulate --config edge.toml --candump new.log --truth-json edge.toml", "edge.toml"),
        ("plan --config edge.toml --from o.json --json o.json", "o.json"),
        ("export o.json --format csv --out o.json", "o.json"),
        ("compensate o.json path.csv -o path.csv", "path.csv"),
        ("model import robot.urdf --tcp tcp -o robot.urdf", "robot.urdf"),
    ] {
        let message = refused(folder, command);
        assert!(message.contains(&format!("{file}: is read by this command")), "{message}");
        assert!(contents() == before, "{command}");
    }
    let message = refused(folder, "identify --config edge.toml o.log --json new --report new");
    assert!(message.contains("new: is another result"), "{message}");
}

/// The part that is there is used, and the user learns that it is not all.
#[test]
fn a_log_that_is_cut_off_is_used_and_named() {
    let folder = folder();
    let folder = folder.path();
    stdout(folder, "simulate --config edge.toml --experiments 1 --candump o.log");
    let log = fs::read_to_string(folder.join("o.log")).unwrap();
    fs::write(folder.join("o.log"), &log[..log.len() - 3]).unwrap();
    // As of a packed log that is cut off.
    let output = flexid(folder, "identify --config edge.toml o.log --json o.json");
    let cause = "cannot be read: the last line is cut off";
    let said = format!("the recording breaks off: o.log:{}: {cause}", log.lines().count());
    assert_eq!(output.status.code(), Some(1));
    let said = said + ": copy or record it again";
    let errors = stderr(&output);
    let lines: Vec<_> = errors.lines().collect();
    let [doubt, error] = lines[..] else { panic!("two lines: {errors}") };
    assert!(doubt.starts_with("warning: [accuracy] takes as perfect"), "{errors}");
    assert_eq!(error, format!("flexid: {said}"));
    let found = json(folder, "o.json");
    assert_eq!((&found["fit"]["records"], &found["warnings"][0]), (&1.into(), &said.into()));
    assert!(found["warning_kinds"][0]["trouble"]["recording_broken"].is_string());
}

/// A result file that cannot be written does not cost the result.
#[test]
fn the_table_is_printed_although_the_disk_is_full() {
    let folder = folder();
    let folder = folder.path();
    stdout(folder, "simulate --config edge.toml --experiments 1 --candump o.log");
    let output = flexid(folder, "identify --config edge.toml o.log --json /dev/full");
    assert!(!output.status.success());
    assert!(stderr(&output).contains("/dev/full: cannot be written"), "{}", stderr(&output));
    assert!(String::from_utf8(output.stdout).unwrap().contains("36 of 36 parameters"));
}
