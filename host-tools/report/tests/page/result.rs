//! A result as `flexid identify --json` writes it, with made-up numbers.

use std::path::Path;

use flexid_pipeline::model::Model;
use flexid_pipeline::robot::{FoundRobot, JointBounds};
use flexid_report::evidence::{
    DataQuality, Evidence, MeasuredPoint, MeasuredReceptance, Octave, Origin, POINTS,
    RecordEvidence, RecordSpectra, Step,
};
use serde_json::{Value, json};

/// Poses of the result.
pub(crate) const POSES: usize = 3;

/// A robot of three joints.
pub(crate) fn robot() -> FoundRobot {
    robot_of("mill3-model.toml")
}

fn robot_of(file: &str) -> FoundRobot {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenario").join(file);
    let model = Model::load(&file).unwrap();
    let angles = [0.0, -0.4, 0.9, 0.2, 0.7, -0.3];
    let pose = |pose: usize| -> Vec<f64> {
        let turned = angles.iter().take(model.joints.len()).enumerate();
        turned
            .map(|(joint, angle)| angle + if joint == 0 { 0.3 * pose as f64 } else { 0.0 })
            .collect()
    };
    let size = 12 * model.joints.len();
    let mut covariance = vec![0.0; size * (size + 1) / 2];
    for index in 0..size {
        covariance[(index + 1) * (index + 2) / 2 - 1] = 1e-4;
    }
    FoundRobot {
        gravity_m_per_s2: [0.0; 3],
        band_hz: [2.0, 200.0],
        reference_hz: None,
        poses: (0..POSES).map(pose).collect(),
        bounds: vec![
            JointBounds { stiffness: [[1e5, 1e9]; 6], damping: [[1e2, 1e6]; 6] };
            model.joints.len()
        ],
        imperfections: Vec::new(),
        covariance,
        model,
    }
}

/// Evidence of a record in each pose of a robot.
pub(crate) fn evidence(robot: &FoundRobot) -> Evidence {
    let hz: Vec<f64> = (0..POINTS).map(|i| 2.0 * 100_f64.powf(i as f64 / POINTS as f64)).collect();
    let curve = |size: f64| -> [Vec<f64>; 3] { std::array::from_fn(|_| vec![size; POINTS]) };
    let point = |frequency_hz: &f64| {
        let entry = Some([1e-7 / frequency_hz, -1e-8]);
        MeasuredPoint {
            frequency_hz: *frequency_hz,
            measured: [[entry, None, entry]; 3],
            modelled: [[entry; 3]; 3],
            direction: [[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]],
            measured_along: [[1e-8, -1e-8]; 3],
            modelled_along: [[1e-8, -1e-8]; 3],
            coherence: [0.9; 3],
        }
    };
    let record = |(index, pose): (usize, &Vec<f64>)| RecordEvidence {
        number: index as u64 + 1,
        is_of_test: false,
        start_s: 5.0 * index as f64,
        seconds: 4.096,
        rate_hz: 2000.0,
        has_doubtful_rate: false,
        starts_at_rest: true,
        pose: pose.clone(),
        path: Vec::new(),
        pose_number: index + 1,
        rms_force_n: 120.0,
        lines: 0,
        octaves: vec![
            Octave { band_hz: [2.0, 4.0], clear: 0.2 },
            Octave { band_hz: [4.0, 8.0], clear: 1.0 },
        ],
        spectra: RecordSpectra {
            frequency_hz: hz.clone(),
            force: curve(1.0),
            force_noise: curve(0.01),
            measured: curve(0.5),
            modelled: curve(0.5),
            residual: curve(0.004),
            noise: curve(0.002),
        },
    };
    let measured = |(index, pose): (usize, &Vec<f64>)| MeasuredReceptance {
        is_of_test: false,
        pose: pose.clone(),
        records: vec![index as u64 + 1],
        segments: 15,
        segment_s: 0.512,
        points: hz.iter().map(point).collect(),
    };
    let step =
        |step: u64| Step { step, starts: 1, records: 3, misfit: 1.0 + 1e3 / (1.0 + step as f64) };
    Evidence {
        records: robot.poses.iter().enumerate().map(record).collect(),
        measured_receptance: robot.poses.iter().enumerate().map(measured).collect(),
        course: (0..200).map(step).collect(),
        data_quality: DataQuality {
            frames: 1000,
            readings: 900,
            lost: 3,
            ..DataQuality::default()
        },
    }
}

/// A result of three joints.
pub(crate) fn result() -> Value {
    result_of(&robot())
}

/// A result of six joints.
pub(crate) fn result_of_six() -> Value {
    result_of(&robot_of("mill6-model.toml"))
}

fn result_of(robot: &FoundRobot) -> Value {
    let joints: Vec<Value> = robot
        .model
        .joints
        .iter()
        .map(|joint| {
            json!({
                "name": joint.name,
                "stiffness": [6e7, 6e7, 6e7, 4e6, 4e6, 4e6], "stiffness_std": [6e5, 6e5, 6e5, 4e4, 4e4, null],
                "stiffness_verdict":
                    ["identified", "identified", "identified", "identified", "weak", "not_observable"],
                "damping": [2e4, 2e4, 2e4, 2e3, 2e3, 2e3], "damping_std": [2e2, 2e2, 2e2, 2e1, 2e1, 2e1],
                "damping_verdict": ["identified", "identified", "identified", "identified", "weak", "weak"],
            })
        })
        .collect();
    let interval = |value: f64| json!([0.98 * value, 1.02 * value]);
    let intervals: Vec<Value> = (0..joints.len())
        .map(|_| {
            json!({
                "stiffness_interval": [interval(6e7), interval(6e7), interval(6e7), interval(4e6), interval(4e6), null],
                "damping_interval": ([2e4, 2e4, 2e4, 2e3, 2e3, 2e3].map(interval)),
            })
        })
        .collect();
    let number = |value: f64| json!({ "value": value, "interval": interval(value) });
    let drives: Vec<Value> = robot
        .model
        .joints
        .iter()
        .map(|joint| json!({ "joint": joint.name, "dof": 5, "stiffness": number(4e6) }))
        .collect();
    let mut result = json!({
        "schema": 2,
        "answer": {
            "pose": robot.poses[POSES - 1], "record": POSES,
            "softest": { "stiffness": number(3.8123e5), "direction": [0.71, 0.02, -0.7] },
            "stiffest": { "stiffness": null, "direction": null },
            "lowest_mode": { "frequency_hz": number(6.3312), "damping_ratio": { "value": 0.011, "interval": null } },
            "drives": drives,
            "text": "as identify states it",
        },
        "joints": joints,
        "fit": {
            "records": 3, "frames": 49152, "frames_lost": 3, "ssp": 0.001, "ssp_max": 0.02, "consistency": 1.0,
            "search_evaluations": 2000, "refine_iterations": 12, "starts": 1, "bridged": 0, "seconds": 1.2,
            "acceptance": "consistent", "found_by": "descent", "random_searches": 0, "branches": 1,
        },
        "warnings": ["2 frames are <odd> & lost", "look at `[bus]`: two axes are swapped"],
        "warning_kinds": [{ "misfit": 2 }, { "wrong_axes": {} }],
        "model_warnings": ["every moving link weighs 2 kg: are these placeholders?"],
        "confidence": {
            "joints": intervals,
            "nuisances": [
                {
                    "name": "accelerometer 1/omega^2", "entry": "accelerometer_resonance_hz", "unit": "s^2",
                    "value": 1e-8, "std": 1e-10, "interval": [9.8e-9, 1.02e-8], "verdict": "weak",
                },
                {
                    "name": "TCP z", "entry": "tcp_m", "accuracy": 1e-3, "unit": "m",
                    "value": 4e-3, "std": 5e-4, "interval": [3e-3, 5e-3], "verdict": "identified",
                },
                {
                    "name": "drives: growth with load", "entry": "drive_growth_per_knm", "unit": "1/Nm",
                    "value": 3.9e-7, "std": 2.8e-7, "interval": [-1.7e-7, 9.4e-7], "verdict": "identified",
                },
                // As older files state it.
                { "name": "delay", "unit": "s", "value": 3e-4, "std": 5e-6, "interval": [2.9e-4, 3.1e-4], "verdict": "identified" },
            ],
            "explanations": [{
                "text": "TCP z explains 75 %", "alike": "off as well: TCP x", "alternatives": "as likely: TCP y",
                "remedy": "measure the TCP", "other": 1,
            }, {
                "text": "ground tx explains 4 %", "remedy": "look at the ground", "deviation": { "value": 5e-13, "std": 5e-13 },
            }],
            "correlations": { "unknowns": ["joint_1 tx stiffness", "joint_2 tx stiffness"], "percent": [-93] },
            "weak_directions": [{
                "text": "joint_1 tx stiffness and joint_2 tx stiffness trade off in these poses (31 %)",
                "shares": [{ "name": "joint_1 tx stiffness", "weight": 0.7 }],
            }],
            "residuals": { "text": "noise explains them" },
            "left_over": [],
            "held_out": [{ "pose": [0.0, -0.4, 0.9], "frac": [0.999, 0.998, 0.9999], "vaf": [0.99, 0.98, -0.1] }],
            "robust_widening": 1.42,
        },
        "robot": robot,
        "origin": Origin {
            version: "0.1.0".into(),
            command: "flexid identify --config edge.toml cut.log".into(),
            ..Origin::default()
        },
    });
    let evidence = serde_json::to_value(evidence(robot)).unwrap();
    result.as_object_mut().unwrap().extend(evidence.as_object().unwrap().clone());
    result
}
