//! A result in `flexid predict` and `flexid export`.

use std::fs;
use std::path::Path;

use serde_json::{Value, json as value};

use crate::setup::{flexid, folder, found, identified, json, refused, stderr, stdout};

/// The result with the parameters replaced by the truth, whose covariance is that of the fit.
fn with_truth(folder: &Path, found: &Value) {
    let truth = json(folder, "t.json");
    let mut true_robot = found.clone();
    for joint in true_robot["joints"].as_array_mut().unwrap() {
        let own = &truth["truth"][joint["name"].as_str().unwrap()];
        joint["stiffness"] = own["stiffness"].clone();
        joint["damping"] = own["damping"].clone();
    }
    fs::write(folder.join("true.json"), true_robot.to_string()).unwrap();
}

#[test]
fn intervals_hold_what_is_true_and_files_hold_what_is_printed() {
    let folder = folder();
    let folder = folder.path();
    let (_, found) = identified(folder, "--truth-json t.json", || ());
    with_truth(folder, &found);
    let predicted = |file: &str| -> Value {
        let arguments = format!(
            "predict {file} --pose 0.4,-0.7,1.1 --force 120,-80,200 --json --receptance h.csv --points 400"
        );
        serde_json::from_str(&stdout(folder, &arguments)).unwrap()
    };
    let (own, truth) = (predicted("o.json"), predicted("true.json"));
    let (own, truth) = (&own[0], &truth[0]);
    let mut held = [0, 0];
    let mut hold = |own: &Value, truth: &Value| {
        let [low, high] = [0, 1].map(|end| own["interval"][end].as_f64().unwrap());
        let truth = truth["value"].as_f64().unwrap();
        // Neither is wide enough to hold all that there could be.
        assert!((high - low).abs() < 0.1 * truth.abs().max(1e-7), "{own}");
        held[0] += u32::from((low..=high).contains(&truth));
        held[1] += 1;
    };
    for mode in 0..3 {
        hold(&own["modes"][mode]["frequency_hz"], &truth["modes"][mode]["frequency_hz"]);
    }
    for axis in 0..3 {
        let [own, truth] = [own, truth].map(|one| &one["deflection"]["translation"][axis]);
        hold(own, truth);
    }
    for point in (0..400).step_by(20) {
        let [own, truth] = [own, truth].map(|one| &one["receptance"][point]["magnitude"]);
        for axis in 0..3 {
            hold(&own[axis][axis], &truth[axis][axis]);
        }
    }
    // Of 66 intervals of 95 %, as dependent as they are, fewer hold once in a thousand robots.
    assert!(held[0] >= 50, "{held:?}");

    // The file was written last of the true robot.
    let csv = fs::read_to_string(folder.join("h.csv")).unwrap();
    let mut lines = csv.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let first: Vec<f64> = lines.next().unwrap().split(',').map(|x| x.parse().unwrap()).collect();
    let column = |name: &str| first[header.iter().position(|own| *own == name).unwrap()];
    assert_eq!(column("frequency_hz"), 2.0);
    let printed = truth["receptance"][0]["magnitude"][0][0]["value"].as_f64().unwrap();
    assert!((column("h_xx_m_per_n") / printed - 1.0).abs() < 1e-8);
    assert_eq!(column("h_xx_determined"), 1.0);
    assert_eq!(truth["receptance"][0]["magnitude"][0][0]["determined"], true);
    assert_eq!(csv.lines().count(), 401);

    let table = stdout(folder, "predict o.json --force 120,-80,200 --receptance h.uff");
    for part in [" mode ", " Hz ", " deflection, µm: x ", " stiffness at the tool, N/µm: x "] {
        assert!(table.contains(part), "{part:?} is not in\n{table}");
    }
    // Without a number of frequencies there are more about each mode.
    stdout(folder, "predict o.json --pose 0.4,-0.7,1.1 --receptance fine.csv");
    assert!(fs::read_to_string(folder.join("fine.csv")).unwrap().lines().count() > 500);
    // Nine entries in each of three poses.
    let uff = fs::read_to_string(folder.join("h.uff")).unwrap();
    assert_eq!(uff.lines().filter(|line| *line == "    58").count(), 27);
    assert!(uff.lines().all(|line| line.len() <= 80));

    for (format, part) in [
        ("mjcf", "<mujoco"),
        ("simscape", "Bushing Joint"),
        ("drake", "LinearBushingRollPitchYaw"),
        ("csv", "joint_1"),
    ] {
        stdout(folder, &format!("export o.json --format {format} --out out"));
        let text = fs::read_to_string(folder.join("out")).unwrap();
        assert!(text.contains(part), "{format}: {part:?} is not in\n{text}");
    }
}

#[test]
fn an_export_says_what_its_comments_say() {
    let folder = found();
    let folder = folder.path();
    let mut found = json(folder, "o.json");
    found["fit"]["acceptance"] = "unsettled".into();
    found["joints"][0]["stiffness_verdict"] = vec!["not_observable"; 6].into();
    found["joints"][0]["stiffness_std"] = vec![Value::Null; 6].into();
    fs::write(folder.join("open.json"), found.to_string()).unwrap();
    let output = flexid(folder, "export open.json --format csv --out open.csv");
    assert!(output.status.success());
    let said = stderr(&output);
    let [written, doubt, open] = said.lines().collect::<Vec<_>>()[..] else { panic!("{said}") };
    assert_eq!(written, "open.csv: robot written");
    assert!(doubt.starts_with("warning: open.csv: NOT SETTLED: "), "{said}");
    assert!(open.starts_with("warning: open.csv: 6 parameters not observable"), "{said}");

    // So does what is predicted, in each format that has a place for it, and else on stderr.
    let output = flexid(folder, "export open.json --format uff --out open.uff --points 3");
    assert!(
        stderr(&output).ends_with(
            "may have missed the right minimum, and the intervals do not allow for that\n"
        )
    );
    let uff = fs::read_to_string(folder.join("open.uff")).unwrap();
    assert_eq!(
        uff.matches("\nfit NOT SETTLED: the fit may have missed the right minimum\n").count(),
        9
    );
    let output = flexid(folder, "predict open.json --json");
    assert!(
        stderr(&output).starts_with("warning: open.json: NOT SETTLED: "),
        "{}",
        stderr(&output)
    );
    let predicted: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        (&predicted[0]["verdict"], &predicted[0]["schema"]),
        (&"unsettled".into(), &2.into())
    );
    stdout(folder, "map open.json --points 2 --out open.svg");
    assert!(fs::read_to_string(folder.join("open.svg")).unwrap().contains("NOT SETTLED: "));
}

/// A drive that stiffens has no constant spring: the note says how far the modes are off, and the file, too.
#[test]
fn an_export_says_what_it_cannot_carry() {
    let folder = found();
    let folder = folder.path();
    let export = |result: &str| {
        let output = flexid(folder, &format!("export {result} --format mjcf --out o.xml"));
        assert!(output.status.success(), "{}", stderr(&output));
        (stderr(&output), fs::read_to_string(folder.join("o.xml")).unwrap())
    };
    let (said, file) = export("o.json");
    assert!(!said.contains("note: ") && !file.contains("are up to"), "{said}");

    let mut found = json(folder, "o.json");
    let all = (0..3).map(|joint| value!({"imperfection": {"servo": joint}, "value": 0.05}));
    found["robot"]["imperfections"] = all.collect();
    let covariance = found["robot"]["covariance"].as_array_mut().unwrap();
    covariance.resize(39 * 40 / 2, value!(0.0));
    fs::write(folder.join("servo.json"), found.to_string()).unwrap();
    let (said, file) = export("servo.json");
    let note = said.lines().find(|line| line.starts_with("note: o.xml: natural frequencies up to"));
    let note = note.unwrap_or_else(|| panic!("{said}"));
    // A stiffness that is 5 % off moves a natural frequency by 2.5 % at most.
    let (_, off) = note.split_once("are up to ").unwrap();
    let off: f64 = off.split_once(" %").unwrap().0.parse().unwrap();
    assert!((0.1..2.6).contains(&off), "{note}");
    assert!(file.contains(note.strip_prefix("note: o.xml: ").unwrap()), "{file}");
    // The mode whose damping is off most, and the one at which dampings are right.
    let modes = note.matches("the mode at ").count();
    assert!(modes == 2 && note.contains("; they are right at "), "{note}");

    // Ground that gives way carries a mass, which a viewer counts beside that of the links.
    found["robot"]["imperfections"] = value!([{"imperfection": {"ground": 2}, "value": 1e-9}]);
    let covariance = found["robot"]["covariance"].as_array_mut().unwrap();
    covariance.resize(37 * 38 / 2, value!(0.0));
    fs::write(folder.join("ground.json"), found.to_string()).unwrap();
    let (_, file) = export("ground.json");
    let masses =
        file.split(" mass=\"").skip(1).filter_map(|own| own.split_once('"')?.0.parse().ok());
    let mut masses: Vec<f64> = masses.filter(|mass: &f64| *mass > 0.0).collect();
    let ground = masses.remove(0);
    let links: f64 = masses.iter().sum();
    let says =
        format!("its mass, {ground:.1} kg beside {links:.1} kg of the links, and an inertia");
    assert!(file.contains(&says), "{says}: {file}");
}

/// An output to a pipe or a device has a reader of its own.
#[test]
fn an_export_says_that_a_file_is_written() {
    let folder = found();
    let said = |format: &str, file: &str| {
        let arguments = format!("export o.json --format {format} --out {file}");
        let output = flexid(folder.path(), &arguments);
        assert!(output.status.success(), "{arguments}: {}", stderr(&output));
        stderr(&output)
    };
    assert_eq!(said("mjcf", "robot.xml"), "robot.xml: robot written\n");
    assert_eq!(said("uff", "h.uff"), "h.uff: receptance written\n");
    assert_eq!(said("mjcf", "/dev/stdout"), "");
    assert_eq!(said("mjcf", "-"), "");
    assert!(stdout(folder.path(), "export o.json --format mjcf --out -").contains("<mujoco"));
    assert!(!folder.path().join("-").exists());
    let message = refused(folder.path(), "compensate o.json path.csv --out -");
    assert!(
        message.contains("standard output has what the command says: name a file"),
        "{message}"
    );
}

#[test]
fn a_wrong_result_is_refused_with_its_place_and_mend() {
    let folder = found();
    let folder = folder.path();
    let found = json(folder, "o.json");
    type Change = fn(&mut Value);
    let changes: [(Change, &str); 12] = [
        (|found| found["schema"] = value!(9), "is of schema 9, this flexid reads 1 to 2"),
        (|found| drop(found.as_object_mut().unwrap().remove("robot")), "has no robot"),
        (
            |found| drop(found["robot"]["covariance"].as_array_mut().unwrap().pop()),
            "covariance has 665 entries, and this robot has 666",
        ),
        (|found| found["robot"]["covariance"][0] = value!(-1.0), "covariance is none"),
        (|found| found["joints"][0]["stiffness"][0] = value!(-1.0), "not positive"),
        (
            |found| {
                found["robot"]["imperfections"] =
                    value!([{"imperfection": {"mass": 7}, "value": 0.1}])
            },
            "imperfections[0] is of another robot",
        ),
        (|found| found["robot"]["band_hz"] = value!([200.0, 2.0]), "band_hz must be"),
        (|found| found["robot"]["band_hz"] = value!([2.0, 1e300]), "band_hz must be"),
        (|found| found["robot"]["poses"][1] = value!([0.1]), "poses[1] must have 3 angles"),
        (
            |found| {
                found["robot"]["imperfections"] = value!([{"imperfection": "hose", "value": -1e9}])
            },
            "imperfections[0] is of another robot, or out of its range",
        ),
        (|found| found["schema"] = value!(0), "schema must be 1 to 2"),
        (
            |found| drop(found["joints"].as_array_mut().unwrap().pop()),
            "joints and robot.model are of different robots",
        ),
    ];
    for (change, expected) in changes {
        let mut wrong = found.clone();
        change(&mut wrong);
        fs::write(folder.join("wrong.json"), wrong.to_string()).unwrap();
        for command in ["predict wrong.json", "export wrong.json --format mjcf --out x"] {
            let message = refused(folder, command);
            assert!(message.contains("wrong.json: ") && message.contains(expected), "{message}");
        }
    }
    fs::write(folder.join("empty.json"), "").unwrap();
    let whole = fs::read_to_string(folder.join("o.json")).unwrap();
    fs::write(folder.join("cut.json"), &whole[..whole.len() / 2]).unwrap();
    for (arguments, expected) in [
        ("predict gone.json", "gone.json: cannot be read"),
        ("predict empty.json", "empty.json: is empty: give a file as `flexid identify --json`"),
        ("predict cut.json", "give a file as `flexid identify --json` writes it"),
        ("predict edge.toml", "edge.toml: "),
        ("predict o.json --pose 0,0", "--pose has 2 angles: this robot has 3 driven joints"),
        ("predict o.json --force 1,2", "--force has 2 numbers: give three"),
        (
            "predict o.json --force 0,0,-1e12",
            "--force is -1000000000000: must lie between -1000000",
        ),
        ("predict o.json --highest 0", "--highest is 0: must be above 0 Hz"),
        ("predict o.json --receptance h.txt", "h.txt: a receptance is written as .csv or .uff"),
        ("export o.json --format mjcf --pose 0 --out x", "--pose has 1 angles"),
        ("export o.json --format mjcf --out gone/x", "its folder is not there"),
    ] {
        let message = refused(folder, arguments);
        assert!(message.contains(expected), "{arguments}: {message}");
    }
    assert!(!folder.join("x").exists());
}

/// The limits of a model file may be narrower than those of the robot, so that it is a warning.
#[test]
fn a_pose_beyond_the_limits_of_the_joints_is_warned_of() {
    let folder = found();
    let folder = folder.path();
    let limits = "warning: --pose: joint_3 is 3 rad, and its limits are -1.8 to 2.6 rad\n";
    let degrees = "warning: --pose: joint_2 is -30 rad, and its limits are ";
    let cut = "--teeth 2 --kt 700 --angles 0,90 --feed 1,0,0 --rpm 60,1200";
    for command in [
        "predict o.json",
        &format!("lobes o.json {cut}"),
        "map o.json --points 2",
        "export o.json --format csv --out /dev/null",
    ] {
        let said = |pose: &str| {
            let output = flexid(folder, &format!("{command} --pose {pose}"));
            assert!(output.status.success(), "{command}: {}", stderr(&output));
            stderr(&output)
        };
        assert_eq!(said("0,-0.5,1"), "", "{command}");
        assert_eq!(said("0,-0.5,3"), limits, "{command}");
        let said = said("0,-30,1");
        assert!(said.starts_with(degrees), "{command}: {said}");
        assert!(said.ends_with(": looks like degrees: give rad\n"), "{command}: {said}");
    }
}

/// Modes end with the band unless others are asked for, and no table is wider than a window of 80 columns.
#[test]
fn modes_have_three_digits_and_a_mark_above_the_band() {
    let folder = found();
    for (highest, has_marked) in [("", false), ("--highest 400", true)] {
        let table = stdout(folder.path(), &format!("predict o.json --pose 0.4,-0.7,1.1 {highest}"));
        let mut marked = [0, 0];
        for line in table.lines().filter(|line| line.contains('±')) {
            assert!(line.starts_with(" stiffness") || line.chars().count() <= 80, "{line}");
            let words: Vec<&str> = line.split_whitespace().collect();
            if words[0].parse::<u32>().is_err() {
                continue;
            }
            let is_marked = words[1] == "*";
            let numbers = &words[if is_marked { 2 } else { 1 }..];
            // Frequency, `±0.2 %`, damping, `%`.
            for number in [numbers[0], numbers[3]] {
                let digits = number.trim_start_matches(['0', '.']).replace('.', "");
                assert_eq!(digits.len(), 3, "{number} in {line}");
            }
            assert_eq!(is_marked, numbers[0].parse::<f64>().unwrap() > 200.0, "{line}");
            marked[usize::from(is_marked)] += 1;
        }
        assert!(marked[0] >= 3 && (marked[1] >= 1) == has_marked, "{marked:?} in\n{table}");
        let mark = " * above the band that was fitted, 2 to 200 Hz: no record shows it";
        assert_eq!(table.contains(mark), has_marked, "{table}");
        let hint = " modes up to the end of the band, 200 Hz: --highest HZ lists others";
        assert_eq!(table.contains(hint), !has_marked, "{table}");
        assert!(table.ends_with("\n x, y, z: axes of the tool centre point (TCP)\n"), "{table}");
    }
}
