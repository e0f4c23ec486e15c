//! The command line as its users meet it: what it says, where it says it, and its exit status.

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread;

use tempfile::TempDir;

const FLEXID: &str = env!("CARGO_BIN_EXE_flexid");
const DEMO: &str = env!("CARGO_BIN_EXE_flexid-demo");
const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenario");
const URDF: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/urdf");

/// A folder with the scenario in it.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(SCENARIO).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), folder.path().join(entry.file_name())).unwrap();
    }
    folder
}

fn flexid(folder: &Path, arguments: &str) -> Output {
    Command::new(FLEXID).args(arguments.split_whitespace()).current_dir(folder).output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// Replaces `from`, which must be there, in a file.
fn edit(file: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(file).unwrap();
    assert!(text.contains(from), "{} has no {from}", file.display());
    fs::write(file, text.replacen(from, to, 1)).unwrap();
}

#[test]
fn bad_input_ends_with_status_2_and_one_line_that_names_place_and_mend() {
    // Arguments; file, text and its replacement; what stderr says.
    type Case = (&'static str, Option<[&'static str; 3]>, &'static [&'static str]);
    let cases: [Case; 37] = [
        ("model import gone.urdf --tcp tcp -o m.toml", None, &["gone.urdf: cannot be read"]),
        (
            "model import mill3.urdf --tcp hand -o m.toml",
            None,
            &["mill3.urdf: --tcp hand: no such link; the file has base_link, link_1, link_2"],
        ),
        ("model import mill3.toml --tcp tcp -o m.toml", None, &["mill3.toml: not a URDF: "]),
        (
            "model import mill3.urdf --tcp tcp -o m.toml",
            Some(["mill3.urdf", "<mass value=\"485\"/>", "<mass value=\"0\"/>"]),
            &["mill3.urdf: no mass on link 'link_2' (moved by 'joint_2')", "<mass value=\"kg\"/>"],
        ),
        ("simulate --config gone.toml --candump o.log", None, &["gone.toml: cannot be read"]),
        (
            "simulate --config edge.toml --candump o.log",
            Some(["edge.toml", "rate_hz = 2000.0", "rate_hz = -5"]),
            &["edge.toml: [measurement] rate_hz is -5: must be positive"],
        ),
        (
            "simulate --config edge.toml --candump o.log",
            Some(["edge.toml", "[simulation] ", "[simulations] "]),
            &["edge.toml:", "simulations"],
        ),
        (
            "simulate --config edge.toml --candump o.log",
            Some(["edge.toml", "rate_hz = 2000.0", "rate_hz = 1000.0"]),
            &["edge.toml: [measurement] rate_hz is 1000, but mill3.toml has 2000: make them equal"],
        ),
        (
            "simulate --config edge.toml --candump o.log",
            Some(["mill3.toml", "teeth = 2", "teeth = 0"]),
            &["mill3.toml: [force] teeth is 0: must lie between 1 and 1000"],
        ),
        (
            "simulate --config edge.toml --candump o.log",
            Some(["mill3.toml", "teeth = 2", "tooth = 2"]),
            &["mill3.toml:", "[force] tooth: unknown key `tooth`: did you mean `teeth`"],
        ),
        (
            "simulate --config edge.toml --candump o.log --truth-json gone/t.json",
            None,
            &["gone/t.json: cannot be written: its folder is not there: make it first"],
        ),
        (
            "simulate --config edge.toml --candump gone/o.log",
            None,
            &["gone/o.log: cannot be written: its folder is not there: make it first"],
        ),
        ("simulate --config edge.toml --repeat 1000000000", None, &["--repeat", "1..=10000"]),
        ("simulate --config edge.toml --experiments 1000000000", None, &["1..=10000"]),
        ("simulate --config edge.toml --experiments 0", None, &["--experiments", "1..=10000"]),
        ("simulate --config edge.toml --candump o.log --drop 1", None, &["--drop 1: must be"]),
        ("simulate --config edge.toml --candump o.log --truth me", None, &["drawn:SEED"]),
        ("simulate --config edge.toml --can nocan9", None, &["--can nocan9: interface \"nocan9\""]),
        (
            "",
            None,
            &[
                "flexid: 'flexid' requires a subcommand",
                "identify, plan, reproduce, watch",
                "(see --help)",
            ],
        ),
        ("model", None, &["flexid: 'flexid model' requires a subcommand", "import"]),
        ("simulate", None, &["flexid: ", "--config <EDGE.toml>", "(see --help)"]),
        (
            "identify --config edge.toml",
            None,
            &["edge.toml: nothing to identify from: name a LOG", "[static]"],
        ),
        ("found", None, &["flexid: unrecognized subcommand 'found'"]),
        ("watch unix:s --records 0 --until identified", None, &["--records", "(see --help)"]),
        // All of these before the recording is even opened.
        (
            "identify --config edge.toml gone.log --json .",
            None,
            &[".: cannot be written: is a folder: name"],
        ),
        (
            "identify --config edge.toml gone.log --truth gone.json",
            None,
            &["gone.json: cannot be read"],
        ),
        (
            "identify --config edge.toml gone.log --truth edge.toml",
            None,
            &["edge.toml: ", "give a file as `flexid simulate --truth-json` writes it"],
        ),
        (
            "model import mill3.urdf --tcp tcp -o gone/m.toml",
            None,
            &["gone/m.toml: cannot be written: its folder is not there: make it first"],
        ),
        ("identify --config edge.toml gone.log", None, &["gone.log: cannot be read"]),
        (
            "identify --config edge.toml mill3.urdf",
            None,
            &["mill3.urdf: no record to identify from: waiting for frames"],
        ),
        ("plan --config edge.toml --force -1", None, &["--force -1: must be above 0 N"]),
        ("plan --config edge.toml --poses 1 --force 0.001", None, &["--force 0.001: is lost in"]),
        (
            "plan --config edge.toml --poses 1",
            Some(["mill3.toml", "peak_tangential_n = 400.0", "peak_tangential_n = 0.001"]),
            &["mill3.toml: [force] peak_tangential_n is 0.001: is lost in", "in every cut: allow"],
        ),
        ("plan --config edge.toml --from gone.json", None, &["gone.json: cannot be read"]),
        (
            "plan --config edge.toml --from edge.toml",
            None,
            &["edge.toml: ", "give a file as `flexid identify --json` writes it"],
        ),
        (
            "plan --config edge.toml",
            Some(["mill3.toml", "g_per_sqrt_hz = 5.0e-5", "g_per_sqrt_hz = 0.0"]),
            &["mill3.toml: [measurement] acceleration_noise_g_per_sqrt_hz is 0: give"],
        ),
        ("watch flexid.sock", None, &["ADDRESS: \"flexid.sock\" is no address", "unix:PATH"]),
    ];
    for (arguments, change, said) in cases {
        let folder = folder();
        if let Some([file, from, to]) = change {
            edit(&folder.path().join(file), from, to);
        }
        let output = flexid(folder.path(), arguments);
        let errors = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments}: {errors}");
        for part in said {
            assert!(errors.contains(part), "{arguments}: {errors:?} does not say {part:?}");
        }
        let complaint = errors.lines().filter(|line| !line.starts_with("warning: ")).count();
        assert_eq!(complaint, 1, "{arguments}: {errors}");
        for left in ["m.toml", "o.log"] {
            assert!(!folder.path().join(left).exists(), "{arguments} left {left} behind");
        }
    }
}

#[test]
fn the_demo_tells_wrong_usage_in_one_line() {
    let output = Command::new(DEMO).args(["--truth", "me"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let errors = stderr(&output);
    assert!(errors.starts_with("flexid-demo: ") && errors.contains("drawn:SEED"), "{errors}");
    assert_eq!(errors.lines().count(), 1, "{errors}");
}

#[test]
fn the_demo_says_which_bus_it_took_and_then_only_news() {
    let mut demo = Command::new(DEMO).stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(demo.stdout.take().unwrap()).lines();
    let [bus, news] = [(); 2].map(|()| lines.next().unwrap().unwrap());
    demo.kill().unwrap();
    demo.wait().unwrap();
    let pair = "bus: a socket pair that carries the same CAN frames (";
    let vcan = "bus: vcan0, a virtual CAN bus in a network namespace of its own";
    let reason = bus.strip_prefix(pair).and_then(|rest| rest.strip_suffix(')'));
    assert!(bus == vcan || reason.is_some(), "{bus}");
    assert!(!bus.contains("Error") && !bus.contains("RTNETLINK"), "{bus}");
    assert!(news.starts_with("waiting for "), "{news}");
}

/// As in `flexid ... | true`.
fn unheard(folder: &Path, program: &str, arguments: &str) -> Output {
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

#[test]
fn nobody_who_listens_is_no_reason_to_panic() {
    let folder = folder();
    let cases = [
        (FLEXID, "model import mill3.urdf --tcp tcp -o m.toml", Some("m.toml")),
        (FLEXID, "simulate --config edge.toml --experiments 1 --candump o.log", Some("o.log")),
        (FLEXID, "--help", None),
        (DEMO, "", None),
    ];
    for (program, arguments, made) in cases {
        let output = unheard(folder.path(), program, arguments);
        assert!(matches!(output.status.code(), Some(0 | 1)), "{arguments}: {:?}", output.status);
        assert_eq!(stderr(&output), "", "{arguments}");
        if let Some(made) = made {
            assert!(folder.path().join(made).exists(), "{arguments}: no {made}");
        }
    }
}

#[test]
fn what_was_identified_stays_whatever_happens_afterwards() {
    let folder = folder();
    let simulated = flexid(folder.path(), "simulate --config edge.toml --candump a.log");
    assert!(simulated.status.success(), "{}", stderr(&simulated));
    let log = folder.path().join("a.log");
    fs::write(&log, "hello\n".to_owned() + &fs::read_to_string(&log).unwrap()).unwrap();
    let found = || {
        let file = folder.path().join("o.json");
        let text = fs::read_to_string(&file).unwrap();
        fs::remove_file(file).unwrap();
        let report: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(report["joints"].as_array().unwrap().len(), 3);
    };

    // The second recording cannot be read, whoever asks.
    let command = "identify --config edge.toml a.log /proc/self/mem --json o.json";
    let output = flexid(folder.path(), command);
    let (table, errors) = (String::from_utf8(output.stdout.clone()).unwrap(), stderr(&output));
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert!(table.contains("joint_3") && table.contains("3 records"), "{table}");
    assert!(errors.contains("the recording breaks off") && errors.lines().count() == 1, "{errors}");
    found();

    let output = flexid(folder.path(), "identify --config edge.toml a.log --json o.json");
    let table = String::from_utf8(output.stdout.clone()).unwrap();
    assert!(output.status.success() && output.stderr.is_empty(), "{}", stderr(&output));
    assert_eq!(table.matches("a.log:1: no line of candump -L").count(), 1, "{table}");
    found();

    let command = "identify --config edge.toml a.log --json o.json";
    let output = unheard(folder.path(), FLEXID, command);
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(1), ""));
    found();
}

/// Simulates and identifies; the table and the result file.
fn identified(folder: &Path, simulation: &str, before_identifying: impl FnOnce()) -> [String; 2] {
    let simulated =
        flexid(folder, &format!("simulate --config edge.toml --candump o.log {simulation}"));
    assert!(simulated.status.success(), "{}", stderr(&simulated));
    before_identifying();
    let output = flexid(folder, "identify --config edge.toml o.log --json o.json");
    assert!(output.status.success(), "{}", stderr(&output));
    let table = String::from_utf8(output.stdout).unwrap();
    [table, fs::read_to_string(folder.join("o.json")).unwrap()]
}

#[test]
fn the_result_says_how_far_to_trust_it() {
    let folder = folder();
    let [table, json] = identified(folder.path(), "--truth-json t.json", || ());
    let report: serde_json::Value = serde_json::from_str(&json).unwrap();
    let truth = fs::read_to_string(folder.path().join("t.json")).unwrap();
    let truth: serde_json::Value = serde_json::from_str(&truth).unwrap();
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
    // Of 36 intervals of 95 % fewer cover once in a thousand robots, if their errors are correlated as they are.
    assert!(covered >= 28, "{covered} of 36 intervals cover the truth");
    assert_eq!(confidence["correlations"]["unknowns"].as_array().unwrap().len(), 36);
    assert_eq!(confidence["correlations"]["percent"].as_array().unwrap().len(), 630);
    assert_eq!(confidence["weak_directions"].as_array().unwrap().len(), 0);
    assert_eq!(confidence["residuals"]["size_objects"], false);
    assert_eq!(confidence["residuals"]["whiteness_objects"], false);
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
        "held out     each of 3 records predicted from the others: ",
    ] {
        assert!(table.contains(part), "{part:?} is not in\n{table}");
    }
    for part in ["warning: ", "weak  ", "no intervals", "intervals are"] {
        assert!(!table.contains(part), "{part:?} is in\n{table}");
    }
}

/// With static tests no log is needed; where one is given and brings no record, the table says why.
#[test]
fn static_tests_need_no_log() {
    let folder = folder();
    let path = folder.path();
    let config = fs::read_to_string(path.join("edge.toml")).unwrap();
    fs::write(path.join("edge.toml"), config + "\n[static]\nfile = \"static.csv\"\n").unwrap();
    let gauge = "q1,q2,q3,fx,fy,fz,mx,my,mz,dx,dy,dz,sx,sy,sz\n\
                 0,-0.45,0.95,0,0,-981,0,0,0,,,-1.12e-4,,,5e-6\n";
    fs::write(path.join("static.csv"), gauge).unwrap();
    let table = |arguments: &str| {
        let output = flexid(path, arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let alone = table("identify --config edge.toml --json o.json");
    assert!(alone.contains("joint_3") && !alone.contains("no record"), "{alone}");
    assert!(path.join("o.json").exists());
    let wrong = table("identify --config edge.toml mill3.urdf");
    assert!(wrong.contains("warning: no record: waiting for frames"), "{wrong}");
}

/// One pose tells little, and says so.
#[test]
fn what_a_single_pose_does_not_tell_is_named() {
    let folder = folder();
    let [table, json] = identified(folder.path(), "--experiments 1", || ());
    let report: serde_json::Value = serde_json::from_str(&json).unwrap();
    let confidence = &report["confidence"];
    assert_eq!(confidence["held_out"].as_array().unwrap().len(), 0);
    assert!(!table.contains("held out"), "{table}");
    for direction in confidence["weak_directions"].as_array().unwrap() {
        let text = direction["text"].as_str().unwrap();
        assert!(text.contains(direction["shares"][0]["name"].as_str().unwrap()), "{text}");
        assert!(table.contains(text), "{text:?} is not in\n{table}");
    }
}

/// A link that weighs a fifth less than it should: the advice is to look at the model, not for more data.
#[test]
fn a_wrong_model_is_told_as_one() {
    let folder = folder();
    let model = folder.path().join("mill3-model.toml");
    let lighter = || edit(&model, "mass_kg = 485.0", "mass_kg = 388.0");
    let [table, json] = identified(folder.path(), "", lighter);
    let report: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(report["confidence"]["residuals"]["size_objects"], true);
    let warnings = report["warnings"].as_array().unwrap();
    let said = |part: &str| warnings.iter().any(|line| line.as_str().unwrap().contains(part));
    assert!(said("the model is wrong") && said("masses") && !said("more poses"), "{warnings:?}");
    let consistency = report["fit"]["consistency"].as_f64().unwrap();
    let caveat =
        if consistency > 10.0 { " no intervals: " } else { " intervals are √(χ²/dof) = " };
    assert!(table.contains(caveat), "{table}");
    let interval = &report["confidence"]["joints"][0]["stiffness_interval"][0];
    assert!(consistency <= 10.0 || interval.is_null(), "{interval} at {consistency}");
}

/// The simulated sensors are in time, and joint 1 is as stiff as it is said to be.
#[test]
fn what_is_sought_beside_the_joints_and_what_is_fixed_is_told() {
    let folder = folder();
    let sections = "\n[calibration]\ndelay_s = 5e-4\n\n[parameters]\n\
                    fixed = { \"joint_1.stiffness.tx\" = 6.0e7 }\n";
    let config = folder.path().join("edge.toml");
    fs::write(&config, fs::read_to_string(&config).unwrap() + sections).unwrap();
    let [table, json] = identified(folder.path(), "", || ());
    let report: serde_json::Value = serde_json::from_str(&json).unwrap();
    let joint = &report["joints"][0];
    assert_eq!(joint["stiffness_verdict"][0], "fixed");
    assert!((joint["stiffness"][0].as_f64().unwrap() / 6.0e7 - 1.0).abs() < 1e-12, "{joint}");
    assert_eq!(joint["stiffness_std"][0], serde_json::Value::Null);
    let confidence = &report["confidence"];
    assert_eq!(confidence["joints"][0]["stiffness_interval"][0], serde_json::Value::Null);
    let unknowns = confidence["correlations"]["unknowns"].as_array().unwrap();
    assert_eq!((unknowns.len(), &unknowns[0]), (36, &"joint_1 ty stiffness".into()));
    assert_eq!(unknowns[35], "delay");
    let [delay] = confidence["nuisances"].as_array().unwrap().as_slice() else { panic!("{json}") };
    assert_eq!((&delay["name"], &delay["unit"]), (&"delay".into(), &"s".into()));
    assert_eq!(delay["verdict"], "identified");
    let [value, std] = ["value", "std"].map(|key| delay[key].as_f64().unwrap());
    // A hundredth of a sample, and four standard deviations.
    assert!(std < 5e-6 && value.abs() < 4.0 * std, "{delay}");
    for part in ["     fixed ", ", 1 fixed\n", "calibration  delay "] {
        assert!(table.contains(part), "{part:?} is not in\n{table}");
    }
}

#[test]
fn what_was_found_is_what_a_plan_starts_from() {
    let folder = folder();
    let [_, found] = identified(folder.path(), "", || ());
    let found: serde_json::Value = serde_json::from_str(&found).unwrap();
    let relative = |joint: &serde_json::Value, kind: &str| -> Vec<f64> {
        let values = joint[kind].as_array().unwrap().iter();
        let deviations = joint[format!("{kind}_std")].as_array().unwrap().iter();
        let pairs = deviations.zip(values);
        pairs.map(|(std, value)| std.as_f64().unwrap() / value.as_f64().unwrap()).collect()
    };
    let joints = found["joints"].as_array().unwrap().iter();
    let known: Vec<f64> = joints
        .flat_map(|joint| ["stiffness", "damping"].map(|kind| relative(joint, kind)))
        .flatten()
        .collect();
    assert_eq!(known.len(), 36);
    let worst = known.iter().copied().fold(0.0, f64::max);
    let geometric_mean = (known.iter().map(|std| std.ln()).sum::<f64>() / 36.0).exp();

    let command = "plan --config edge.toml --from o.json --poses 8 --experiments 2 --json p.json";
    let output = flexid(folder.path(), command);
    assert!(output.status.success(), "{}", stderr(&output));
    let table = String::from_utf8(output.stdout).unwrap();
    let plan = fs::read_to_string(folder.path().join("p.json")).unwrap();
    let plan: serde_json::Value = serde_json::from_str(&plan).unwrap();
    let number = |prediction: &serde_json::Value, key: &str| prediction[key].as_f64().unwrap();
    // The bounds add a part in a thousand to what is known so well.
    assert!((number(&plan["now"], "worst") / worst - 1.0).abs() < 1e-9);
    assert!((number(&plan["now"], "uncertainty") / geometric_mean - 1.0).abs() < 1e-3);
    assert_eq!(plan["now"]["identified"], 36);
    let steps = plan["steps"].as_array().unwrap();
    assert_eq!(steps.len(), 2);
    let mut before = number(&plan["now"], "uncertainty");
    for step in steps {
        let after = number(&step["after"], "uncertainty");
        assert!(after < 0.9 * before, "{before} to {after}");
        before = after;
    }
    let worst = steps[1]["after"]["worst_parameter"].as_str().unwrap();
    assert!(table.contains(&format!("worst in the end: {worst}, ")), "{table}");

    // Its standard deviations say nothing if the fit does not hold.
    edit(&folder.path().join("o.json"), "\"consistent\"", "\"model_suspect\"");
    let output = flexid(folder.path(), command);
    assert_eq!(output.status.code(), Some(2));
    let errors = stderr(&output);
    assert!(errors.contains("o.json: its fit is \"model_suspect\""), "{errors}");
}

/// With so little force some of the spindle's runs are lost in the force sensor's noise, and others are not.
#[test]
fn a_plan_goes_without_the_cuts_that_tell_nothing() {
    let folder = folder();
    let command = "plan --config edge.toml --poses 2 --experiments 1 --force 1.1 --json p.json";
    let output = flexid(folder.path(), command);
    let errors = stderr(&output);
    assert!(output.status.success(), "{errors}");
    let warning = "warning: the force is lost in the force sensor's noise in 6 of 18 experiments";
    assert!(errors.starts_with(warning), "{errors}");
    let plan = fs::read_to_string(folder.path().join("p.json")).unwrap();
    let plan: serde_json::Value = serde_json::from_str(&plan).unwrap();
    assert_eq!(plan["candidates"], 12);
}

/// The simulated robot sags and the simulated accelerometer turns with the tool, as the fit assumes.
#[test]
fn what_gravity_does_to_the_simulated_robot_is_what_the_fit_expects() {
    let folder = folder();
    let edge = folder.path().join("edge.toml");
    edit(&edge, "[0.0, 0.0, 0.0]", "[0.0, 0.0, -9.80665]");
    edit(&edge, "\"inertial\"", "\"strapdown\"");
    for command in [
        "simulate --config edge.toml --candump o.log --truth drawn:1",
        "identify --config edge.toml o.log --json o.json",
    ] {
        let output = flexid(folder.path(), command);
        assert!(output.status.success(), "{}", stderr(&output));
    }
    let report = fs::read_to_string(folder.path().join("o.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let consistency = report["fit"]["consistency"].as_f64().unwrap();
    assert!((0.9..1.1).contains(&consistency), "chi^2/dof is {consistency}");
}

/// The simulated sensors sit where the configuration says, and the fit allows for it; without that it does not hold.
#[test]
fn sensors_that_sit_elsewhere_are_allowed_for() {
    let folder = folder();
    let edge = folder.path().join("edge.toml");
    edit(&edge, "[0.0, 0.0, 0.0]", "[0.0, 0.0, -9.80665]");
    edit(&edge, "\"inertial\"", "\"strapdown\"");
    let section = "\n[mounting]\naccelerometer_xyz_m = [0.08, -0.05, 0.22]\n\
                   accelerometer_rpy_rad = [0.4, -0.3, 1.2]\nforce_rpy_rad = [-0.2, 0.5, -0.7]\n\
                   tool_mass_kg = 2.0\ntool_centre_m = [0.01, 0.02, 0.12]\n";
    let config = fs::read_to_string(&edge).unwrap();
    fs::write(&edge, format!("{config}{section}")).unwrap();
    let [_, json] = identified(folder.path(), "--truth-json t.json", || ());
    let report: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(report["confidence"]["residuals"]["size_objects"], false);
    let consistency = report["fit"]["consistency"].as_f64().unwrap();
    assert!((0.9..1.1).contains(&consistency), "chi^2/dof is {consistency}");
    let truth = fs::read_to_string(folder.path().join("t.json")).unwrap();
    let truth: serde_json::Value = serde_json::from_str(&truth).unwrap();
    for joint in report["joints"].as_array().unwrap() {
        let truth = &truth["truth"][joint["name"].as_str().unwrap()];
        for kind in ["stiffness", "damping"] {
            for dof in 0..6 {
                let [value, std, truth] =
                    [&joint[kind], &joint[format!("{kind}_std")], &truth[kind]]
                        .map(|list| list[dof].as_f64().unwrap());
                assert!((value - truth).abs() < 4.5 * std, "{kind} {dof} of {joint}");
            }
        }
    }
    let ignorant = || fs::write(&edge, &config).unwrap();
    let [_, json] = identified(folder.path(), "", ignorant);
    let report: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(report["confidence"]["residuals"]["size_objects"], true);
}

#[test]
fn import_writes_the_model_of_the_scenario_and_warns_of_placeholders() {
    let folder = folder();
    let output = flexid(folder.path(), "model import mill3.urdf --tcp tcp -o new.toml");
    assert!(output.status.success() && output.stderr.is_empty(), "{}", stderr(&output));
    let read = |name| fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(read("new.toml"), read("mill3-model.toml"));

    let arm = format!("model import {URDF}/kuka_kr16_2.urdf --tcp tool0 -o arm.toml");
    let output = flexid(folder.path(), &arm);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stderr(&output).contains("every moving link weighs 2 kg: are these placeholders?"));
}

#[test]
fn the_same_seed_gives_the_same_log() {
    let folder = folder();
    let log = |arguments: &str| {
        let command =
            format!("simulate --config edge.toml --experiments 1 --candump o.log {arguments}");
        let output = flexid(folder.path(), &command);
        assert!(output.status.success(), "{}", stderr(&output));
        fs::read_to_string(folder.path().join("o.log")).unwrap()
    };
    let first = log("--seed 3");
    // 8192 samples of force and acceleration, and 41 poses of three joints.
    assert_eq!(first.lines().count(), 2 * 8192 + 41 * 3);
    assert!(first.starts_with("(1767000000.000060) vcan0 101#"));
    assert_eq!(first, log("--seed 3"));
    assert_ne!(first, log("--seed 4"));
    assert_ne!(first, log("--seed 3 --truth drawn:1"));
}

#[test]
fn lost_frames_are_in_the_truth_and_not_in_the_log() {
    let folder = folder();
    let command = "simulate --config edge.toml --drop 0.01 --experiments 4 --candump o.log --truth-json t.json";
    let output = flexid(folder.path(), command);
    assert!(output.status.success(), "{}", stderr(&output));
    let truth = fs::read_to_string(folder.path().join("t.json")).unwrap();
    let truth: serde_json::Value = serde_json::from_str(&truth).unwrap();
    let experiments = truth["experiments"].as_array().unwrap();
    assert_eq!(experiments.len(), 4);
    let sum = |key: &str| experiments.iter().map(|one| one[key].as_u64().unwrap()).sum::<u64>();
    let lost = sum("dropped_force") + sum("dropped_acc");
    assert!((500..800).contains(&lost), "1 % of 65536 is not {lost}");
    let log = fs::read_to_string(folder.path().join("o.log")).unwrap();
    assert_eq!(log.lines().count() as u64, 4 * (2 * 8192 + 41 * 3) - lost);
    assert_eq!(truth["truth"]["joint_1"]["stiffness"][5], 2.3e6);
}

#[test]
fn watch_says_why_it_cannot_listen() {
    let folder = folder();
    let output = flexid(folder.path(), "watch unix:flexid.sock");
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("unix:flexid.sock: nobody listens there"),
        "{}",
        stderr(&output)
    );

    // Somebody who hangs up, and somebody who talks of something else.
    for (answer, said) in [
        (&b""[..], "hung up"),
        (b"HTTP/1.1 400 Bad Request\r\n\r\n", "does not speak flexid's protocol"),
    ] {
        let socket = folder.path().join("other.sock");
        let listener = UnixListener::bind(&socket).unwrap();
        let stranger = thread::spawn(move || {
            let (mut client, _) = listener.accept().unwrap();
            let _ = client.read(&mut [0; 64]);
            client.write_all(answer).unwrap();
        });
        let output = flexid(folder.path(), "watch unix:other.sock --until identified --timeout 5");
        stranger.join().unwrap();
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).contains(said), "{:?} is not {said:?}", stderr(&output));
        assert_eq!(stderr(&output).lines().count(), 1);
        fs::remove_file(&socket).unwrap();
    }
}
