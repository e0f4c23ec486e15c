//! MuJoCo's robot against flexid's: natural frequencies from the dense model, receptance from the recursion.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::process::Command;

use flexid_core::imperfection::Imperfection;
use flexid_core::parameters::{Bushing, Bushings};
use flexid_core::receptance::{Complex, Terms, receptance};
use flexid_core::sensors::Sensors;
use flexid_export::{Format, Robot, export};
use flexid_pipeline::robot::{FoundRobot, FoundValue};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use crate::FOLDER;
use crate::common::Dense;
use crate::packages::{run, with};
use crate::scenario::{EARTH, Scenario};

/// Frequencies at which receptances are compared.
const BINS: usize = 100;
/// Band in which receptances are compared, Hz.
const BAND_HZ: [f64; 2] = [2.0, 200.0];
/// Largest relative deviation of a natural frequency, and of the receptance from its largest element at a frequency.
/// Finite differences of MuJoCo's forces leave 1e-8.
const EXACT: f64 = 1e-6;
/// The bound for a robot on ground that gives way, whose base has an inertia in MuJoCo and a mass alone in flexid, and whose rest with the
/// ground is taken without its sag.
const REST: f64 = 3e-5;
const FREQUENCY: f64 = 1e-3;
/// The bound for the lowest natural frequency, at which a damped robot does not answer alike along the imaginary axis and at its λ.
const LOWEST: f64 = 5e-4;
const RECEPTANCE: f64 = 5e-3;
/// Largest relative deviation of a natural frequency in [`BAND_HZ`] that the steps of time may cause. The integrator is of first
/// order: a mode of 200 Hz and a damping ratio of 0.3 deviates by 1 % at 50 µs.
const STEPPED: f64 = 1e-2;

/// A robot at one pose for `mujoco_check.py`.
#[derive(Serialize)]
struct Case {
    mjcf: String,
    /// All natural frequencies without damping, rising, or the lowest of the damped robot.
    natural_hz: Vec<f64>,
    is_damped: bool,
    hz: Vec<f64>,
    /// Receptance per frequency, packed as `xx yx yy zx zy zz`, `[re, im]`.
    receptance: Vec<[[f64; 2]; 6]>,
}

/// The output of `mujoco_check.py` of a case.
#[derive(Debug, Deserialize)]
struct Deviation {
    /// Distance of the keyframe from the static equilibrium, in units of the largest elongation there; absolute without gravity.
    rest: f64,
    /// Largest relative deviation of a natural frequency.
    frequency: f64,
    /// Largest deviation of an element of the receptance over the largest element at its frequency.
    receptance: f64,
    /// Largest relative deviation of a natural frequency in the band with the steps of time.
    stepped: f64,
    /// Product of the step and the highest natural frequency, rad.
    step_angle: f64,
}

fn case(robot: &Robot, mjcf: &Path) -> Case {
    std::fs::write(mjcf, export(robot, Format::Mjcf).unwrap()).unwrap();
    let chain = robot.model.chain().unwrap();
    let bushings: Vec<Bushing> = robot
        .joints
        .iter()
        .map(|joint| Bushing { stiffness: joint.stiffness, damping: joint.damping })
        .collect();
    let gravity = robot.gravity_m_per_s2.into();
    let linear = chain.linearise(robot.pose, gravity, &bushings).unwrap();
    let terms = Terms::<f64>::new(&linear, &bushings, &Sensors::default()).unwrap();
    let [lowest, highest] = BAND_HZ;
    let at = |bin: usize| lowest * (highest / lowest).powf(bin as f64 / (BINS - 1) as f64);
    let hz: Vec<f64> = (0..BINS).map(at).collect();
    let pairs = |hz: &f64| {
        receptance(&terms, Complex { re: 0.0, im: TAU * hz })
            .map(|element| [element.re, element.im])
    };
    let sag: Vec<[f64; 6]> = linear.joints.iter().map(|joint| joint.sag.into()).collect();
    Case {
        mjcf: mjcf.to_string_lossy().into_owned(),
        natural_hz: natural_hz(&Dense::new(&chain, robot.pose, gravity, &sag), &bushings),
        is_damped: false,
        receptance: hz.iter().map(pairs).collect(),
        hz,
    }
}

/// The robot by what flexid predicts of it, imperfections included.
fn predicted(scenario: &Scenario, pose: usize, mjcf: &Path) -> Case {
    let robot = scenario.robot(pose);
    std::fs::write(mjcf, export(&robot, Format::Mjcf).unwrap()).unwrap();
    let value = |&(imperfection, value): &(Imperfection, f64)| FoundValue { imperfection, value };
    let bushings: Bushings = robot
        .joints
        .iter()
        .map(|joint| Bushing { stiffness: joint.stiffness, damping: joint.damping })
        .collect();
    let size = 12 * bushings.len() + robot.imperfections.len();
    let found = FoundRobot {
        model: robot.model.clone(),
        gravity_m_per_s2: robot.gravity_m_per_s2,
        band_hz: robot.band_hz,
        reference_hz: None,
        poses: Vec::new(),
        bounds: Vec::new(),
        imperfections: robot.imperfections.iter().map(value).collect(),
        covariance: vec![0.0; size * (size + 1) / 2],
    };
    let found = flexid_prediction::Robot::new(found, bushings).unwrap();
    let at = found.at(robot.pose).unwrap();
    let hz: Vec<f64> = flexid_prediction::receptance::grid(BAND_HZ, BINS).collect();
    let packed = |hz: &f64| {
        let own = at.receptance_value(*hz).unwrap();
        [own[0][0], own[1][0], own[1][1], own[2][0], own[2][1], own[2][2]]
            .map(|entry| [entry.re, entry.im])
    };
    Case {
        mjcf: mjcf.to_string_lossy().into_owned(),
        natural_hz: at.modes(BAND_HZ[1]).iter().map(|mode| mode.frequency_hz.value).collect(),
        is_damped: true,
        receptance: hz.iter().map(packed).collect(),
        hz,
    }
}

/// Natural frequencies without damping, Hz, rising: `K v = ω² M v`.
fn natural_hz(dense: &Dense, bushings: &[Bushing]) -> Vec<f64> {
    let mut stiffness = dense.gravity_stiffness();
    for (joint, bushing) in bushings.iter().enumerate() {
        for dof in 0..6 {
            stiffness[(6 * joint + dof, 6 * joint + dof)] += bushing.stiffness[dof];
        }
    }
    let factor = dense.mass().cholesky().unwrap().l();
    let half: DMatrix<f64> = factor.solve_lower_triangular(&stiffness).unwrap();
    let whole = factor.solve_lower_triangular(&half.transpose()).unwrap();
    let mut hz: Vec<f64> =
        whole.symmetric_eigenvalues().iter().map(|square| square.sqrt() / TAU).collect();
    hz.sort_by(f64::total_cmp);
    hz
}

/// Deviations of these cases in MuJoCo.
fn deviations(name: &str, cases: &[Case]) -> Vec<Deviation> {
    let folder = Path::new(FOLDER);
    let file = folder.join(format!("{name}.json"));
    std::fs::write(&file, serde_json::to_vec(&cases).unwrap()).unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/mujoco_check.py");
    let output = run(Command::new(with("mujoco")).arg(script).arg(&file)).unwrap();
    let deviations: Vec<Deviation> = serde_json::from_str(&output).unwrap();
    assert_eq!(deviations.len(), cases.len());
    deviations
}

/// Compares the robot at all its poses.
fn is_the_same(name: &str, scenario: &Scenario) {
    let cases: Vec<Case> = (0..scenario.poses.len())
        .map(|pose| case(&scenario.robot(pose), &file_of(name, pose)))
        .collect();
    let deviations = deviations(name, &cases);
    for (pose, deviation) in deviations.iter().enumerate() {
        println!("{name}, pose {pose}: {deviation:?}");
        assert!(deviation.rest < EXACT, "{name}, pose {pose}: {deviation:?}");
        assert!(deviation.frequency < EXACT, "{name}, pose {pose}: {deviation:?}");
        assert!(deviation.receptance < EXACT, "{name}, pose {pose}: {deviation:?}");
        assert!(deviation.stepped < STEPPED, "{name}, pose {pose}: {deviation:?}");
        assert!(deviation.step_angle <= 0.5, "{name}, pose {pose}: {deviation:?}");
    }
}

fn file_of(name: &str, pose: usize) -> PathBuf {
    Path::new(FOLDER).join(format!("{name}-{pose}.xml"))
}

/// The imperfections that a fit has found are exported: what MuJoCo does is what `flexid predict` says.
#[test]
fn imperfections_are_the_same_in_mujoco() {
    for (name, gravity) in [("mill3", [0.0; 3]), ("mill6", EARTH)] {
        let mut scenario = Scenario::load(name, gravity);
        scenario.imperfections = imperfections(scenario.joints.len());
        let name = format!("{name}-imperfect");
        let poses = 0..scenario.poses.len();
        let cases: Vec<Case> =
            poses.map(|pose| predicted(&scenario, pose, &file_of(&name, pose))).collect();
        for (pose, deviation) in deviations(&name, &cases).iter().enumerate() {
            println!("{name}, pose {pose}: {deviation:?}");
            assert!(deviation.rest < REST, "{name}, pose {pose}: {deviation:?}");
            assert!(deviation.frequency < FREQUENCY, "{name}, pose {pose}: {deviation:?}");
            assert!(deviation.receptance < RECEPTANCE, "{name}, pose {pose}: {deviation:?}");
            assert!(cases[pose].natural_hz.len() > 3, "{name}, pose {pose}");
        }
    }
}

/// Springs and dampers that change with frequency are right at the lowest natural frequency, for which they are exported.
#[test]
fn hysteresis_and_drives_are_right_at_the_lowest_natural_frequency() {
    let mut scenario = Scenario::load("mill6", EARTH);
    scenario.imperfections = vec![(Imperfection::Hysteresis, 0.3)];
    scenario.imperfections.extend((0..6).map(|joint| (Imperfection::Servo(joint), 0.05)));
    scenario.at_hz = predicted(&scenario, 0, &file_of("lowest", 0)).natural_hz[0];
    let whole = predicted(&scenario, 0, &file_of("lowest", 0));
    let lowest = Case { natural_hz: whole.natural_hz[..1].to_vec(), ..whole };
    let deviation = &deviations("lowest", &[lowest])[0];
    println!("{deviation:?}");
    assert!(deviation.frequency < LOWEST, "{deviation:?}");
    // The others are off: else this test would show nothing.
    assert!(deviation.receptance > 10.0 * LOWEST, "{deviation:?}");
}

/// Imperfections of two to five times their usual size, of all kinds that another program can carry, and usual ground.
fn imperfections(joints: usize) -> Vec<(Imperfection, f64)> {
    let mut all = vec![
        (Imperfection::Mass(joints - 1), -0.06),
        (Imperfection::Mass(0), 0.05),
        (Imperfection::Inertia(1, 2), 0.2),
        (Imperfection::Inertia(1, 3), 0.2),
        (Imperfection::CentreOfMass(1, 2), 0.02),
        (Imperfection::JointAngle(1), 5e-3),
        (Imperfection::ElasticCentre(0, 2), -0.03),
        (Imperfection::ElasticCentre(1, 0), 0.05),
        (Imperfection::ElasticCentre(joints - 1, 1), 0.02),
        (Imperfection::ToolCentrePoint(0), 5e-3),
        (Imperfection::ToolTurn(2), 5e-3),
        (Imperfection::Load, 5e-5),
        (Imperfection::BaseMass, 0.4),
        (Imperfection::RecordStiffness(0), 5e-3),
    ];
    for (dof, compliance) in [(0, 5e-10), (2, 5e-10), (3, 1e-9), (4, 1e-9)] {
        all.push((Imperfection::Ground(dof), compliance));
        all.push((Imperfection::GroundDamping(dof), 1e-4 * compliance));
    }
    all
}

#[test]
fn mill3_is_the_same_in_mujoco() {
    is_the_same("mill3", &Scenario::load("mill3", [0.0; 3]));
}

#[test]
fn mill6_is_the_same_in_mujoco_under_gravity() {
    is_the_same("mill6", &Scenario::load("mill6", EARTH));
}

#[test]
fn a_robot_with_a_pedestal_a_slide_and_turned_frames_is_the_same_in_mujoco() {
    is_the_same("skewed", &Scenario::skewed());
}

/// The step of time becomes shorter where a spring is hard.
#[test]
fn a_hard_robot_is_stable_in_mujoco() {
    let mut scenario = Scenario::load("mill6", EARTH);
    for joint in &mut scenario.joints {
        joint.stiffness = joint.stiffness.map(|value| 1000.0 * value);
    }
    is_the_same("hard", &scenario);
}
