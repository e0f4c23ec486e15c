//! `flexid plan`.

use std::fs;
use std::path::Path;

use nalgebra::{DMatrix, Vector6};
use serde_json::Value;

use crate::setup::{add_static_test, edit, flexid, folder, found, json, stderr};
use crate::statics::motions;

/// A plan, as a table and as JSON.
fn planned(folder: &Path, arguments: &str) -> (String, Value) {
    let output = flexid(folder, &format!("plan --config edge.toml --json p.json {arguments}"));
    assert!(output.status.success(), "{}", stderr(&output));
    (String::from_utf8(output.stdout).unwrap(), json(folder, "p.json"))
}

/// A report's word on its parameters' relative standard deviations, all of which are determined.
struct Found {
    /// In the order of the report's correlations.
    deviations: Vec<f64>,
    /// Logarithm for their covariance, the correlations as the report has them: to a per cent.
    log_determinant: f64,
}

impl Found {
    fn of(report: &Value) -> Self {
        let mut deviations = Vec::new();
        for joint in report["joints"].as_array().unwrap() {
            for kind in ["stiffness", "damping"] {
                let list = |key: &str| joint[key].as_array().unwrap().iter();
                let pairs = list(&format!("{kind}_std")).zip(list(kind));
                deviations.extend(
                    pairs.map(|(std, value)| std.as_f64().unwrap() / value.as_f64().unwrap()),
                );
            }
        }
        let mut percent =
            report["confidence"]["correlations"]["percent"].as_array().unwrap().iter();
        let mut correlations = DMatrix::identity(deviations.len(), deviations.len());
        for row in 0..deviations.len() {
            for column in 0..row {
                let one = percent.next().unwrap().as_f64().unwrap() / 100.0;
                correlations[(row, column)] = one;
                correlations[(column, row)] = one;
            }
        }
        let logarithms: f64 = deviations.iter().map(|deviation| deviation.ln()).sum();
        let log_determinant = 2.0 * logarithms + correlations.determinant().ln();
        Self { deviations, log_determinant }
    }

    fn worst(&self) -> f64 {
        self.deviations.iter().copied().fold(0.0, f64::max)
    }

    fn median(&self) -> f64 {
        let mut sorted = self.deviations.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    }

    /// Over the axes of the confidence ellipsoid.
    fn geometric_mean(&self) -> f64 {
        (self.log_determinant / (2.0 * self.deviations.len() as f64)).exp()
    }

    fn root_mean_square(&self) -> f64 {
        let squares: f64 = self.deviations.iter().map(|deviation| deviation.powi(2)).sum();
        (squares / self.deviations.len() as f64).sqrt()
    }
}

/// Replaces what a file has from `from` until `until`.
fn rewrite(file: &Path, from: &str, until: &str, with: &str) {
    let text = fs::read_to_string(file).unwrap();
    let (before, rest) = text.split_once(from).unwrap();
    let (_, after) = rest.split_once(until).unwrap();
    fs::write(file, format!("{before}{with}{until}{after}")).unwrap();
}

/// Result if the plan is carried out, from these experiments and the logs of those `before`.
fn carried_out(folder: &Path, plan: &Value, before: &str) -> Found {
    milled(folder, &experiments(plan), before)
}

/// The `[[experiment]]` entries of a plan.
fn experiments(plan: &Value) -> String {
    let experiment = |step: &Value| {
        let [pose, rpm, feed] = ["pose", "spindle_rpm", "feed"].map(|key| &step[key]);
        format!(
            "[[experiment]]\nname = \"planned\"\npose = {pose}\nspindle_rpm = {rpm}\nfeed = {feed}\n"
        )
    };
    plan["steps"].as_array().unwrap().iter().map(experiment).collect()
}

/// Result of these `[[experiment]]` entries and the logs of those `before`.
fn milled(folder: &Path, experiments: &str, before: &str) -> Found {
    rewrite(&folder.join("mill3.toml"), "[[experiment]]", "[force]", experiments);
    for command in [
        "simulate --config edge.toml --seed 2 --candump planned.log",
        &format!("identify --config edge.toml {before} planned.log --json both.json"),
    ] {
        let output = flexid(folder, command);
        assert!(output.status.success(), "{}", stderr(&output));
    }
    Found::of(&json(folder, "both.json"))
}

/// Cuts of another roughness, and a noise that was measured in a fifth of a second: that is good for a few per cent.
fn is_as_predicted(what: &str, found: f64, predicted: &Value) {
    let ratio = found / predicted.as_f64().unwrap();
    println!("{what}: {ratio:.3} of what was predicted");
    assert!((0.85..1.15).contains(&ratio), "{what}: {found} is {ratio} of {predicted}");
}

/// Makes the robot the one that a plan assumes which starts from the bounds alone.
fn assume_truth(folder: &Path) {
    let middle = |lower: f64, upper: f64| format!("{:e}", (lower * upper).sqrt());
    let six = |of: [String; 2]| of.map(|one| [(); 3].map(|()| one.clone()).join(", ")).join(", ");
    let stiffness = six([middle(1e7, 2e8), middle(1e6, 1e8)]);
    let damping = six([middle(1e3, 1e5), middle(1e2, 5e4)]);
    let truth = ["joint_1", "joint_2", "joint_3"].map(|joint| {
        format!(
            "[[truth]]\njoint = \"{joint}\"\nstiffness = [{stiffness}]\ndamping = [{damping}]\n"
        )
    });
    rewrite(&folder.join("mill3.toml"), "[[truth]]", "[[experiment]]", &truth.concat());
}

#[test]
fn an_experiment_determines_what_the_plan_predicts() {
    for criterion in ["d", "a"] {
        let folder = folder();
        assume_truth(folder.path());
        let arguments = format!("--poses 8 --experiments 3 --criterion {criterion}");
        let (_, plan) = planned(folder.path(), &arguments);
        let found = carried_out(folder.path(), &plan, "");
        let predicted = &plan["steps"][2]["after"];
        is_as_predicted("worst", found.worst(), &predicted["worst"]);
        is_as_predicted("median", found.median(), &predicted["median"]);
        let uncertainty = match criterion {
            "d" => found.geometric_mean(),
            _ => found.root_mean_square(),
        };
        is_as_predicted(criterion, uncertainty, &predicted["uncertainty"]);
    }
}

#[test]
fn what_was_found_is_what_a_plan_starts_from() {
    let folder = found();
    let report = json(folder.path(), "o.json");
    let known = Found::of(&report);
    assert_eq!(known.deviations.len(), 36);
    let geometric_mean = (known.deviations.iter().map(|std| std.ln()).sum::<f64>() / 36.0).exp();

    let arguments = "--from o.json --poses 8 --experiments 2";
    let (table, plan) = planned(folder.path(), arguments);
    let number = |prediction: &Value, key: &str| prediction[key].as_f64().unwrap();
    // The bounds add a part in a thousand to what is known so well.
    assert!((number(&plan["now"], "worst") / known.worst() - 1.0).abs() < 1e-9);
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
    assert!(table.contains("if `flexid identify` finds the right minimum"), "{table}");
    let last = table.lines().last().unwrap();
    assert!(last.starts_with("2 experiments planned, ") && last.ends_with(" s"), "{last}");

    // That the first three's correlations are left aside costs some of their information.
    let both = carried_out(folder.path(), &plan, "o.log");
    is_as_predicted("worst", both.worst(), &steps[1]["after"]["worst"]);
    is_as_predicted("median", both.median(), &steps[1]["after"]["median"]);

    // A fit that does not hold has a warning, and is taken.
    edit(&folder.path().join("o.json"), "\"consistent\"", "\"model_suspect\"");
    let arguments = "--from o.json --poses 1 --experiments 1";
    let output = flexid(folder.path(), &format!("plan --config edge.toml {arguments}"));
    let errors = stderr(&output);
    assert!(output.status.success(), "{errors}");
    assert!(errors.starts_with("warning: o.json: its fit is \"model_suspect\""), "{errors}");
}

/// With typical accuracies masses, gains and mountings are known within these: the parameters are, too.
#[test]
fn a_plan_counts_the_accuracies() {
    let folder = folder();
    assume_truth(folder.path());
    let perfect = planned(folder.path(), "--poses 8 --experiments 3").1;
    edit(&folder.path().join("edge.toml"), "assume = \"perfect\"", "assume = \"typical\"");
    let (_, plan) = planned(folder.path(), "--poses 8 --experiments 3");
    let found = carried_out(folder.path(), &plan, "");
    let predicted = &plan["steps"][2]["after"];
    is_as_predicted("worst", found.worst(), &predicted["worst"]);
    is_as_predicted("median", found.median(), &predicted["median"]);
    let median = |plan: &Value| plan["steps"][2]["after"]["median"].as_f64().unwrap();
    assert!(median(&plan) > 2.0 * median(&perfect), "{plan} {perfect}");
}

/// Places of the tools of a plan, m.
fn tools(plan: &Value) -> Vec<[f64; 3]> {
    let steps = plan["steps"].as_array().unwrap().iter();
    steps.map(|step| serde_json::from_value(step["tool_m"].clone()).unwrap()).collect()
}

/// In a box, from poses of the user, and near poses. What is predicted there comes true.
#[test]
fn a_plan_keeps_to_the_place_that_it_is_given() {
    let folder = found();
    let path = folder.path();
    let boxed = "--experiments 3 --poses 8 --box 0.5,2.6,-0.9,1.2,0.2,1.8";
    let (table, plan) = planned(path, boxed);
    for at @ [x, y, z] in tools(&plan) {
        assert!(
            (0.5..=2.6).contains(&x) && (-0.9..=1.2).contains(&y) && (0.2..=1.8).contains(&z),
            "{at:?}"
        );
        assert!(table.contains(&format!("{x:.2}, {y:.2}, {z:.2}")), "{table}");
    }
    // Three of one's own, one of which is behind the robot, as the user wants; a box leaves one of them.
    let own = "q1,q2_deg,q3\n0.1,-25,0.9\n3.0,-30,1.0\n-0.3,-40,1.4\n";
    fs::write(path.join("own.csv"), own).unwrap();
    let (_, own) = planned(path, "--from o.json --experiments 3 --poses own.csv");
    assert_eq!(own["candidates"], 27);
    let wanted = [
        [0.1, -25_f64.to_radians(), 0.9],
        [3.0, -30_f64.to_radians(), 1.0],
        [-0.3, -40_f64.to_radians(), 1.4],
    ];
    for step in own["steps"].as_array().unwrap() {
        let pose: Vec<f64> = serde_json::from_value(step["pose"].clone()).unwrap();
        assert!(
            wanted.iter().any(|own| own.iter().zip(&pose).all(|(a, b)| (a - b).abs() < 1e-9)),
            "{pose:?}"
        );
    }
    let (_, left) = planned(path, "--poses own.csv --experiments 1 --box -9,0,-9,9,-9,9");
    assert_eq!(left["candidates"], 9);
    let output = flexid(path, "plan --config edge.toml --poses own.csv --box 8,9,8,9,8,9");
    let none = stderr(&output);
    assert!(none.contains("own.csv: none of its poses has the tool in --box"), "{none}");
    assert_eq!((output.status.code(), none.lines().count()), (Some(2), 1), "{none}");
    // Near the poses that were milled, and near one: no tool is as far from it as the farthest of as many poses in front.
    fs::write(path.join("one.csv"), "q1,q2,q3\n0,-0.45,0.95\n").unwrap();
    let (_, one) = planned(path, "--poses one.csv --experiments 1");
    let [there] = tools(&one)[..] else { panic!("{one}") };
    let distance =
        |at: &[f64; 3]| at.iter().zip(&there).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let farthest = |near: &str| {
        let (_, plan) = planned(path, &format!("--experiments 3 --poses 8 {near}"));
        tools(&plan).iter().map(distance).fold(0.0, f64::max)
    };
    let anywhere = farthest("");
    for near in ["o.json", "0,-0.45,0.95"] {
        let near = farthest(&format!("--near {near}"));
        assert!(near < 0.5 * anywhere, "{near} of {anywhere} m");
    }
    // Degrees are taken, and named.
    let output = flexid(path, "plan --config edge.toml --poses 1 --experiments 1 --near 0,-26,54");
    let degrees = stderr(&output);
    let named = "warning: --near: joint_3 is 54 rad, and its limits are -1.8 to 2.6 rad: looks like degrees: give rad";
    assert!(output.status.success() && degrees.contains(named), "{degrees}");
    assume_truth(path);
    let found = carried_out(path, &plan, "");
    let after = &plan["steps"][2]["after"];
    is_as_predicted("worst", found.worst(), &after["worst"]);
    is_as_predicted("median", found.median(), &after["median"]);
}

/// With so little force some of the spindle's runs are lost in the force sensor's noise, and others are not.
#[test]
fn a_plan_goes_without_the_cuts_that_are_lost_in_noise() {
    let folder = folder();
    let command = "plan --config edge.toml --poses 2 --experiments 1 --force 1.1 --json p.json";
    let output = flexid(folder.path(), command);
    let errors = stderr(&output);
    assert!(output.status.success(), "{errors}");
    let warning = "warning: the force is lost in the force sensor's noise in 6 of 18 experiments";
    assert!(errors.starts_with(warning), "{errors}");
    let plan = json(folder.path(), "p.json");
    assert_eq!(plan["candidates"], 12);
}

/// Before any cut a dial gauge determines one combination of the stiffnesses, each of which lies between its bounds:
/// the determinant of what is known of all parameters grows as that of one reading does.
#[test]
fn a_plan_counts_the_static_tests() {
    let folder = folder();
    let uncertainty = || {
        let (_, plan) = planned(folder.path(), "--poses 1 --experiments 1");
        plan["now"]["uncertainty"].as_f64().unwrap()
    };
    let before = uncertainty();
    add_static_test(folder.path());
    let shrunk = uncertainty() / before;

    let load = Vector6::new(0.0, 0.0, -981.0, 0.0, 0.0, 0.0);
    let variance = |(spring, motion): (usize, &Vector6<f64>)| {
        let [lower, upper]: [f64; 2] = if spring % 6 < 3 { [1e7, 2e8] } else { [1e6, 1e8] };
        let share = motion.z * motion.dot(&load) / (lower * upper).sqrt();
        (share * (upper / lower).ln()).powi(2) / 12.0
    };
    let motions = motions([0.0, -0.45, 0.95]);
    let known = motions.iter().enumerate().map(variance).sum::<f64>() / 5e-6_f64.powi(2);
    let expected = (1.0 + known).powf(-0.5 / 36.0);
    assert!((shrunk / expected - 1.0).abs() < 1e-6, "{shrunk} for {expected}");
}

/// Two cuts along paths and one standing.
const CUTS: &str = "[[experiment]]
name = \"slot\"
pose = [0.0, -0.45, 0.95]
spindle_rpm = [600, 4200]
feed = \"x\"
path_mm = [[150.0, 0.0, 0.0]]
feed_mm_per_s = 20.0
duration_s = 9.5
[[experiment]]
name = \"face\"
pose = [0.7, -1.1, 1.9]
spindle_rpm = [900, 5400]
feed = \"y\"
path_mm = [[-60.0, 80.0, 0.0]]
feed_mm_per_s = 20.0
duration_s = 7.0
[[experiment]]
name = \"plunge\"
pose = [-0.6, -0.2, 0.45]
spindle_rpm = [600, 3000]
feed = \"z\"
";

/// `identify` finds along paths what `plan` predicts of them, from a simulation with other cuts and other noise.
#[test]
fn a_path_determines_what_the_plan_predicts() {
    let folder = folder();
    assume_truth(folder.path());
    fs::write(folder.path().join("cuts.toml"), CUTS).unwrap();
    let (table, plan) = planned(folder.path(), "--cuts cuts.toml --poses 1 --experiments 1");
    let own = plan["own"].as_array().unwrap();
    let names: Vec<&str> = own.iter().map(|cut| cut["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["slot", "face", "plunge"]);
    assert!(own[0]["path"].as_str().unwrap().contains(" mm at 20.0 mm/s"), "{plan}");
    assert_eq!((&own[2]["path"], &own[2]["records"]), (&Value::Null, &Value::from(1)));
    assert!(own[0]["seconds"].as_f64().is_some_and(|own| (5.0..8.0).contains(&own)), "{plan}");

    let found = milled(folder.path(), CUTS, "");
    let after = &own[2]["after"];
    is_as_predicted("worst", found.worst(), &after["worst"]);
    is_as_predicted("median", found.median(), &after["median"]);
    let parameters = plan["parameters"].as_array().unwrap();
    assert_eq!(parameters.len(), 36);
    for (parameter, found) in parameters.iter().zip(&found.deviations) {
        let ratio = found / parameter["own"].as_f64().unwrap();
        assert!((0.7..1.4).contains(&ratio), "{parameter}: {ratio} of what was predicted");
        let name = parameter["name"].as_str().unwrap();
        assert!(table.contains(name), "{name} is not in\n{table}");
    }
    // The chosen pose stands in place of them.
    assert!(parameters[0]["steps"].as_f64() > parameters[0]["own"].as_f64(), "{plan}");
    assert!(
        table.contains("own: 3 cuts, simulated; steps 1 to 1 stand in place of them"),
        "{table}"
    );
}

#[test]
fn cuts_that_cannot_be_milled_are_named_with_the_mend() {
    let folder = folder();
    let first = CUTS.split("[[experiment]]").nth(1).map(|own| format!("[[experiment]]{own}"));
    let slot = first.unwrap();
    for (from, to, words) in [
        (
            "150.0",
            "2000.0",
            &["\"slot\" path_mm: point 1 of 1: after ", " mm of the way to it "][..],
        ),
        (
            "150.0, 0.0, 0.0",
            "0.0, 0.0, -1500.0",
            &["joint_2 leaves its limits, -2.3 to 0.4: start the path elsewhere"],
        ),
        ("duration_s = 9.5", "duration_s = 5", &["takes ", "give it duration_s = 9"]),
        (
            "feed_mm_per_s = 20.0",
            "feed_mm_per_s = 500\nacceleration_mm_per_s2 = 4000",
            &[
                "\"slot\": joint_3 moves by up to 0.75 rad/s",
                "no feed: by more than 0.03 rad (m) in 256 samples",
                "(feed 3.2 times as slowly)",
            ],
        ),
        ("[[150.0, 0.0, 0.0]]", "[[4.0, 0.0, 0.0]]", &["\"slot\": no record: ", "feeds evenly"]),
        ("feed = \"x\"\n", "", &["cuts.toml:1: [[experiment]] key `feed` is missing"]),
        ("[[experiment]]", "[[cut]]", &["cuts.toml:1: key `experiment` is missing"]),
    ] {
        assert!(slot.contains(from), "{from}");
        fs::write(folder.path().join("cuts.toml"), slot.replacen(from, to, 1)).unwrap();
        let command = "plan --config edge.toml --cuts cuts.toml --poses 1 --experiments 1";
        let output = flexid(folder.path(), command);
        let error = stderr(&output);
        assert_eq!((output.status.code(), error.lines().count()), (Some(2), 1), "{to}: {error}");
        assert!(error.contains("cuts.toml:"), "{error}");
        words.iter().for_each(|own| assert!(error.contains(own), "{own} is not in {error}"));
    }
}
