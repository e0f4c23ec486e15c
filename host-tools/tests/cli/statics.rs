//! Stiffnesses from static tests alone, against a compliance that is summed here, and what its Fisher information allows.

use std::fmt::Write as _;
use std::fs;
use std::iter::zip;
use std::path::Path;

use nalgebra::{DMatrix, DVector, Isometry3, Translation3, UnitQuaternion, Vector3, Vector6};
use rand_core::{Rng as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::setup::{edit, flexid, folder, json, refused, stderr, stdout};

/// Loads, each with its three displacements.
const LOADS: usize = 60;
/// Standard deviation of a displacement, m.
const NOISE: f64 = 1e-6;
/// Standard deviation of a logarithm of which nothing is known.
const WIDE: f64 = 10.0;
/// Stiffnesses of the scenario's robot.
const STIFFNESSES: usize = 18;

/// How the TCP moves if one of the robot's 18 springs gives way by one, along the TCP's axes: displacement, then turn.
pub(crate) fn motions(pose: [f64; 3]) -> [Vector6<f64>; STIFFNESSES] {
    let origins = [[0.0, 0.0, 0.5], [0.5, 0.0, 0.545], [1.3, 0.0, 0.0]].map(Vector3::from);
    let axes = [Vector3::z_axis(), Vector3::y_axis(), Vector3::y_axis()];
    let mut frame = Isometry3::identity();
    let frames = [0, 1, 2].map(|joint| {
        let turn = UnitQuaternion::from_axis_angle(&axes[joint], pose[joint]);
        frame *= Translation3::from(origins[joint]) * turn;
        frame
    });
    let tcp = frame * Translation3::new(1.35, 0.0, -0.3);
    std::array::from_fn(|spring| {
        let frame = frames[spring / 6];
        let along = frame.rotation * Vector3::ith(spring % 3, 1.0);
        let lever = tcp.translation.vector - frame.translation.vector;
        let (shift, turn) = match spring % 6 {
            ..3 => (along, Vector3::zeros()),
            _ => (along.cross(&lever), along),
        };
        let [shift, turn] = [shift, turn].map(|vector| tcp.rotation.inverse() * vector);
        Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
    })
}

/// A table of random loads on the robot with these stiffnesses, and what its readings, in units of their noise, change by
/// with the logarithms of these.
fn measured(truth: &[f64]) -> (String, DMatrix<f64>) {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
    let mut csv = "q1,q2,q3,fx,fy,fz,mx,my,mz,dx,dy,dz,sx,sy,sz\n".to_owned();
    let mut jacobian = DMatrix::zeros(3 * LOADS, STIFFNESSES);
    for load in 0..LOADS {
        let mut within = |lower: f64, upper: f64| {
            lower + (upper - lower) * (random.next_u32() as f64 / u32::MAX as f64)
        };
        let pose = [within(-2.0, 2.0), within(-1.5, 0.0), within(0.0, 2.0)];
        let wrench = Vector6::from_fn(|axis, _| {
            let most = if axis < 3 { 2000.0 } else { 500.0 };
            within(-most, most)
        });
        let mut moved = Vector3::zeros();
        for (spring, motion) in motions(pose).iter().enumerate() {
            let share = motion.fixed_rows::<3>(0) * motion.dot(&wrench) / truth[spring];
            moved += share;
            jacobian.view_mut((3 * load, spring), (3, 1)).copy_from(&(-share / NOISE));
        }
        let read = moved.map(|exact| {
            let noise: f64 = StandardNormal.sample(&mut random);
            exact + NOISE * noise
        });
        let cells = pose.iter().chain(&wrench).chain(&read).chain(&[NOISE; 3]);
        let cells: Vec<String> = cells.map(|cell| format!("{cell:e}")).collect();
        writeln!(csv, "{}", cells.join(",")).unwrap();
    }
    (csv, jacobian)
}

/// The scenario's stiffnesses, base first.
fn truth(folder: &Path) -> Vec<f64> {
    let command = "simulate --config edge.toml --experiments 1 --candump o.log --truth-json t.json";
    let simulated = flexid(folder, command);
    assert!(simulated.status.success(), "{}", stderr(&simulated));
    let truth = json(folder, "t.json");
    let joints = ["joint_1", "joint_2", "joint_3"].iter();
    let stiffnesses =
        joints.flat_map(|joint| truth["truth"][joint]["stiffness"].as_array().unwrap());
    stiffnesses.map(|stiffness| stiffness.as_f64().unwrap()).collect()
}

#[test]
fn static_tests_alone_find_what_their_information_allows() {
    let folder = folder();
    let path = folder.path();
    let truth = truth(path);
    let (csv, jacobian) = measured(&truth);
    // What is not determined at all has the inverse of a wide prior.
    let prior = DMatrix::identity(STIFFNESSES, STIFFNESSES) * WIDE.powi(-2);
    let covariance = (jacobian.transpose() * &jacobian + prior).try_inverse().unwrap();
    fs::write(path.join("static.csv"), csv).unwrap();
    edit(&path.join("edge.toml"), "[search]", "[static]\nfile = \"static.csv\"\n\n[search]");
    let output = flexid(path, "identify --config edge.toml --json o.json");
    assert!(output.status.success(), "{}", stderr(&output));

    let report = json(path, "o.json");
    let joints = report["joints"].as_array().unwrap();
    let all = |key: &str| {
        joints.iter().flat_map(|joint| joint[key].as_array().unwrap()).collect::<Vec<_>>()
    };
    let intervals = report["confidence"]["joints"].as_array().unwrap().iter();
    let intervals = intervals.flat_map(|joint| joint["stiffness_interval"].as_array().unwrap());
    let found = zip(all("stiffness"), all("stiffness_verdict")).zip(intervals);
    let (mut covered, mut determined_springs, mut errors) = (0, Vec::new(), Vec::new());
    for (spring, ((value, verdict), interval)) in found.enumerate() {
        let bound = covariance[(spring, spring)].sqrt();
        let expected = match bound {
            ..=0.05 => "identified",
            ..=0.3 => "weak",
            _ => "not_observable",
        };
        assert_eq!(verdict, expected, "spring {spring}, known to {bound}");
        if expected == "not_observable" {
            continue;
        }
        let [lower, upper] = [0, 1].map(|end| interval[end].as_f64().unwrap());
        let ratio = (upper / lower).ln() / (2.0 * 1.959_964 * bound);
        assert!((0.95..1.05).contains(&ratio), "spring {spring}: {ratio} of the bound");
        covered += u32::from((lower..=upper).contains(&truth[spring]));
        determined_springs.push(spring);
        errors.push((value.as_f64().unwrap() / truth[spring]).ln());
    }
    // Turns: what gives way along y, and evenly along x and z, does so wherever in the chain it is.
    assert_eq!(determined_springs, [3, 4, 5, 9, 10, 11, 15, 16, 17]);
    let among = covariance
        .select_rows(&determined_springs)
        .select_columns(&determined_springs)
        .try_inverse()
        .unwrap();
    let errors = DVector::from(errors);
    let chi_square = errors.dot(&(among * &errors));
    println!("{covered} of 9 intervals cover, chi^2 of their errors is {chi_square:.1}");
    // Of nine intervals of 95 % fewer cover in one of 120 tables; the sum of nine squares is beyond its range in one of 500.
    assert!(covered >= 7, "{covered} of 9 intervals cover the truth");
    assert!((1.15..27.9).contains(&chi_square), "chi^2 of the errors is {chi_square}");
    // 180 readings: three standard deviations and a half.
    let consistency = report["fit"]["consistency"].as_f64().unwrap();
    assert!((0.6..1.4).contains(&consistency), "chi^2/dof is {consistency}");
    assert!(all("damping_verdict").iter().all(|verdict| *verdict == "not_observable"));
}

/// A config of static tests alone: no bus, no noise stated, and a reading whose sign was not noted.
#[test]
fn a_file_of_static_tests_alone_gives_stiffnesses_and_names_a_gross_error() {
    let folder = folder();
    let path = folder.path();
    let truth = truth(path);
    let (csv, _) = measured(&truth);
    // The first line names the columns; the standard deviations are the last three cells.
    let unstated: Vec<String> =
        csv.lines().map(|line| line.rsplitn(4, ',').last().unwrap().to_owned()).collect();
    let table = |wrong: Option<usize>| {
        let mut lines = unstated.clone();
        if let Some(line) = wrong.and_then(|line| lines.get_mut(line - 1)) {
            let (rest, last) = line.rsplit_once(',').unwrap();
            *line = format!("{rest},{:e}", -last.parse::<f64>().unwrap());
        }
        lines.join("\n")
    };
    fs::write(
        path.join("static.toml"),
        "[model]\nfile = \"mill3-model.toml\"\ngravity_m_per_s2 = [0.0, 0.0, 0.0]\n\n[static]\nfile = \"static.csv\"\n",
    )
    .unwrap();
    for wrong in [None, Some(23)] {
        fs::write(path.join("static.csv"), table(wrong)).unwrap();
        let output = flexid(path, "identify --config static.toml --json s.json");
        assert!(output.status.success(), "{}", stderr(&output));
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(said.contains("joint_3") && !said.contains("damping"), "{said}");
        let report = json(path, "s.json");
        let predicted = stdout(path, "predict s.json --pose 0.1,-0.5,0.9 --force 0,200,0");
        assert!(
            predicted.contains("static tests show none") && !predicted.contains("damping  "),
            "{predicted}"
        );
        for command in [
            "lobes s.json --pose 0,-0.5,0.9 --teeth 2 --kt 700 --feed 1,0,0 --rpm 60,900 --angles 0,90",
            "export s.json --pose 0,-0.5,0.9 --format uff --out x.uff",
            "predict s.json --pose 0,-0.5,0.9 --receptance x.uff",
        ] {
            let message = refused(path, command);
            assert!(message.contains("static tests alone, which show no damping"), "{message}");
        }
        let tests = &report["static_tests"];
        assert_eq!(tests["deviation_is_estimated"], true);
        assert_eq!(tests["tests"].as_array().unwrap().len(), LOADS);
        let warned = report["warning_kinds"].as_array().unwrap();
        let warned = warned.iter().find_map(|kind| kind["static_outlier"]["line"].as_u64());
        assert_eq!(warned, wrong.map(|line| line as u64), "{said}");
        let of_line = |line: usize| &tests["tests"][line - 2];
        assert_eq!(of_line(23)["line"], 23);
        match wrong {
            None => {
                let ratio = tests["deviation_m"].as_f64().unwrap() / NOISE;
                assert!((0.8..1.25).contains(&ratio), "{ratio} of the noise");
                let identified = |verdict: &&serde_json::Value| **verdict == "identified";
                let joints = report["joints"].as_array().unwrap().iter();
                let verdicts = joints.flat_map(|j| j["stiffness_verdict"].as_array().unwrap());
                assert!(verdicts.filter(identified).count() >= 6, "{said}");
            }
            Some(_) => {
                assert!(said.contains("warning: line 23 of [static] file"), "{said}");
                assert!(of_line(23)["left_out"][2].as_f64().unwrap().abs() > 3.0, "{said}");
            }
        }
    }
    // Records need what describes them.
    for command in ["identify --config static.toml a.log", "plan --config static.toml"] {
        let said = refused(path, command);
        assert!(said.contains("static.toml: [signals], [measurement] are missing: add"), "{said}");
    }
}

/// A weight whose displacement was noted upwards.
#[test]
fn a_displacement_against_its_load_is_wrong() {
    let folder = folder();
    let path = folder.path();
    let config = "[model]\nfile = \"mill3-model.toml\"\n\n[static]\nfile = \"static.csv\"\n";
    fs::write(path.join("static.toml"), config).unwrap();
    let table = |second: f64| {
        format!(
            "q1,q2,q3,fx,fy,fz,mx,my,mz,dx,dy,dz\n\
             0,-0.45,0.95,0,0,-981,0,0,0,,,-1.12e-4\n\
             0.5,-0.45,0.95,0,0,-981,0,0,0,,,{second:e}\n"
        )
    };
    for (second, is_ready) in [(-1.12e-4, true), (1.12e-4, false)] {
        fs::write(path.join("static.csv"), table(second)).unwrap();
        let checked = flexid(path, "check --config static.toml");
        assert_eq!(checked.status.success(), is_ready);
        let said = String::from_utf8(checked.stdout).unwrap();
        let named = "line 3 of [static] file has a displacement against the load";
        assert_eq!(said.starts_with(&format!("not ready: {named}")), !is_ready, "{said}");
        let warned = stderr(&flexid(path, "identify --config static.toml"));
        assert_eq!(warned.contains(&format!("warning: {named}")), !is_ready, "{warned}");
    }
}
