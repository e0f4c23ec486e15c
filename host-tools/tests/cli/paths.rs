//! Recordings of a robot that feeds along a path: what `check` says of it, and of angles that do not tell where the robot is.

use std::fs;
use std::sync::OnceLock;

use tempfile::TempDir;

use crate::check::typical;
use crate::faults::{Checked, Line, check, good, texts};
use crate::setup::{edit, flexid, folder, json, stderr, stdout};

/// A folder with the scenario and the lines of a log of one path of 50 mm at 10 mm/s, `cut.log`.
fn path() -> (TempDir, Vec<Line>) {
    static LOG: OnceLock<String> = OnceLock::new();
    let folder = folder();
    let file = folder.path().join("mill3.toml");
    let text = include_str!("../../scenario/mill3-feed.toml");
    let text = text.replace("[[200.0, 0.0, 0.0]]", "[[50.0, 0.0, 0.0]]");
    fs::write(&file, text.replace("duration_s = 22.0", "duration_s = 7.0")).unwrap();
    typical(folder.path());
    let log = LOG.get_or_init(|| {
        // The other paths are longer than their time now.
        let text = fs::read_to_string(&file).unwrap();
        let short =
            text.replace("-120.0, 160.0, 0.0", "-30.0, 40.0, 0.0").replace("-200.0", "-50.0");
        fs::write(&file, short).unwrap();
        let arguments = "simulate --config edge.toml --experiments 1 --candump cut.log";
        let output = flexid(folder.path(), arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        fs::read_to_string(folder.path().join("cut.log")).unwrap()
    });
    (folder, log.lines().map(Line::parse).collect())
}

/// The log with other angles, µrad.
fn angles(lines: &[Line], of: impl Fn(&Line) -> i32) -> Vec<String> {
    let changed = lines.iter().cloned().map(|mut line| {
        if line.joint().is_some() {
            let angle = of(&line);
            line.set_angle(angle);
        }
        line
    });
    texts(&changed.collect::<Vec<_>>())
}

#[test]
fn a_path_has_its_length_its_feed_and_what_counts_of_it() {
    let (folder, lines) = path();
    let checked = check(&folder, texts(&lines));
    checked.says("path 1: 48 mm at 10.0 mm/s, joints up to 0.0");
    checked.says(" s along paths count: in ");
    checked.says("the robot starts, stops or turns: feed evenly, in long straight stretches");
    checked.says(" of 36 parameters to 5 % or better (of a robot in the middle of its bounds): mill in regions far");
    assert!(checked.is_ready());
    assert!(checked.json["verdict"].as_str().unwrap().contains(" along 1 path"));
    let travel = &checked.json["records"][0]["travel"];
    assert_eq!(travel["path"], 1);
    assert!(travel["length_m"].as_f64().unwrap() > 0.02, "{travel}");
    // The table names the path.
    let output = flexid(folder.path(), "check --config edge.toml fault.log");
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains(" path 1: 48 mm at 10.0 mm/s"), "{text}");
}

/// Angles of 0.1°, and angles that are held for a fifth of a second.
#[test]
fn angles_in_steps_are_named_with_their_step() {
    let (folder, lines) = path();
    let coarse = check(&folder, angles(&lines, |line| line.angle() / 1745 * 1745));
    coarse.says("in steps while the robot feeds, of 0.0017 rad, each held for 0.");
    coarse.says(
        "let the controller send more digits, for steps of 0.0005 rad or less, and each angle",
    );
    let held = |line: &Line| {
        let since = line.us - line.us % 200_000;
        let first = lines.iter().find(|one| one.joint() == line.joint() && one.us >= since);
        first.map_or_else(|| line.angle(), Line::angle)
    };
    let held = check(&folder, angles(&lines, held));
    held.says(
        "each held for 0.20 s: the poses of the path are as uncertain: let the controller send",
    );
}

#[test]
fn angles_that_come_too_rarely_for_the_feed_are_named_with_the_rate_that_is_enough() {
    let (folder, lines) = path();
    // One in fifty of 100 a second.
    let rare = lines.iter().filter(|line| line.joint().is_none() || line.us % 500_000 < 10_000);
    let rare = check(&folder, rare.map(Line::text).collect::<Vec<_>>());
    rare.says("too rarely for the feed, 2 times a second: by 0.00");
    rare.says(": let the controller send each angle 3 times a second or more");
}

#[test]
fn a_path_in_degrees_or_beyond_the_limits_is_named() {
    let (folder, lines) = path();
    let degrees = check(&folder, angles(&lines, |line| (f64::from(line.angle()) * 57.3) as i32));
    degrees.says("is it in degrees?");
    assert!(degrees.json["verdict"].as_str().unwrap().contains("is it in degrees?"));
    assert!(!degrees.is_ready());
    let shifted = |line: &Line| line.angle() - if line.joint() == Some(2) { 2_000_000 } else { 0 };
    check(&folder, angles(&lines, shifted)).says("and the limits of joint_2 are -2.30 to 0.40 rad");
}

/// A joint whose angle jitters by more than a pose may change, while the robot stands.
#[test]
fn a_standing_robot_whose_angles_jitter_is_named() {
    let (folder, lines) = good();
    let jitter = |line: &Line| {
        let turns = 1.3 * line.us as f64 * 1e-6 * std::f64::consts::TAU;
        line.angle() + if line.joint() == Some(2) { (800.0 * turns.sin()) as i32 } else { 0 }
    };
    let checked: Checked = check(&folder, angles(&lines, jitter));
    checked.says("the robot stands, but angles, most of all q2, jitter by 0.00");
    checked.says("taken for a feed: let the controller send steadier angles");
}

/// Three cuts forth and back at 80 mm/s, of a spindle that speeds up.
const FAST: &str = "
[[experiment]]
name = \"slot\"
pose = [0.0, -0.45, 0.95]
spindle_rpm = [600, 4200]
feed = \"x\"
path_mm = [[150.0, 0.0, 0.0], [0.0, 0.0, 0.0], [150.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
[[experiment]]
name = \"face\"
pose = [0.7, -1.1, 1.9]
spindle_rpm = [900, 5400]
feed = \"y\"
path_mm = [[-90.0, 120.0, 0.0], [0.0, 0.0, 0.0], [-90.0, 120.0, 0.0], [0.0, 0.0, 0.0]]
[[experiment]]
name = \"plunge\"
pose = [-0.6, -0.2, 0.45]
spindle_rpm = [600, 3000]
feed = \"z\"
path_mm = [[0.0, 0.0, -150.0], [0.0, 0.0, 0.0], [0.0, 0.0, -150.0], [0.0, 0.0, 0.0]]
";

/// Angles that come 50 ms late, in places by 6 mrad, are named with the mend and corrected. Angles that come in time are not accused.
#[test]
fn angles_that_come_late_are_named_and_corrected() {
    let folder = folder();
    let text = include_str!("../../scenario/mill3-feed.toml");
    let [cuts, rest] = ["[[experiment]]", "[force]\n"].map(|part| text.find(part).unwrap());
    let each = "feed_mm_per_s = 80.0\nacceleration_mm_per_s2 = 1000.0\nduration_s = 10.0\n";
    let fast = FAST.replace("\n[[exp", &format!("\n{each}[[exp")).replacen(each, "", 1) + each;
    let scenario = [&text[..cuts], &fast, &text[rest..]].concat();
    fs::write(folder.path().join("mill3.toml"), scenario).unwrap();
    for late_s in [0.05, 0.0] {
        let plant = format!("[robot]\njoint_delay_s = {late_s}\n");
        fs::write(folder.path().join("plant.toml"), plant).unwrap();
        let edge = folder.path().join("edge.toml");
        let stated = "assume = \"perfect\"\njoint_delay_s = 0.01\njoint_angle_rad = 0.001";
        let perfect = "assume = \"perfect\"";
        let command =
            "simulate --config edge.toml --plant plant.toml --candump o.log --truth-json t.json";
        stdout(folder.path(), command);
        edit(&edge, perfect, stated);
        let command = "identify --config edge.toml o.log --json o.json --truth t.json";
        let table = stdout(folder.path(), command);
        edit(&edge, stated, perfect);

        let found = json(folder.path(), "o.json");
        assert_eq!(found["fit"]["acceptance"], "consistent");
        let sum = |key: &str| {
            let of = |kind: &str| found["truth"][kind][key].as_u64().unwrap();
            of("stiffness") + of("damping")
        };
        // With no accuracy of the angles 36 are identified, and 21 hold.
        let [intervals, hold] = ["intervals", "hold"].map(sum);
        assert!(intervals >= 34 && hold + 3 >= intervals, "{hold} of {intervals}:\n{table}");
        let explanations = found["confidence"]["explanations"].as_array().unwrap();
        let contradicted = explanations.iter().find(|own| own["evidence"].as_f64().unwrap() > 0.0);
        if late_s == 0.0 {
            assert!(contradicted.is_none(), "{table}");
            continue;
        }
        let deviation = &contradicted.unwrap()["deviation"];
        assert_eq!(deviation["entry"], "joint_delay_s", "{table}");
        let [value, std] = ["value", "std"].map(|key| deviation[key].as_f64().unwrap());
        assert!((value - late_s).abs() < 3.0 * std && std < 0.005, "{deviation}");
        let named = "times its accuracy (joint_delay_s, 10.0 ms): give the angles the time of their measurement, or feed more slowly, \
                     or state joint_delay_s as it is";
        assert!(table.contains(named), "{table}");
    }
}
