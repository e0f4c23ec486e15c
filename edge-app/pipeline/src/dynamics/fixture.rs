//! A robot for the tests.

use std::path::Path;

use flexid_core::imperfection::Imperfection;
use flexid_core::parameters::Bushing;

use super::robot::{OF_JOINT, Robot};
use crate::model::Model;
use crate::robot::{FoundRobot, FoundValue};

/// Parameters of the robot.
const PARAMETERS: usize = 6 * OF_JOINT;

/// The reference robot of six joints, of which all is certain, with hysteresis, drives that stiffen, and ground of this compliance, m/N and
/// rad/Nm.
pub(super) fn found(hysteresis: f64, servo: f64, ground: f64) -> FoundRobot {
    let file =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-tools/scenario/mill6-model.toml");
    let value = |imperfection, value| FoundValue { imperfection, value };
    let servos = (0..6).map(|joint| value(Imperfection::Servo(joint), servo));
    let grounds = (0..6).map(|dof| value(Imperfection::Ground(dof), ground));
    let others = [value(Imperfection::Hysteresis, hysteresis), value(Imperfection::BaseMass, 0.5)];
    let imperfections: Vec<_> = servos.chain(grounds).chain(others).collect();
    let size = PARAMETERS + imperfections.len();
    FoundRobot {
        model: Model::load(&file).unwrap(),
        gravity_m_per_s2: [0.0, 0.0, -9.81],
        band_hz: [2.0, 200.0],
        reference_hz: None,
        poses: Vec::new(),
        bounds: Vec::new(),
        covariance: vec![0.0; size * (size + 1) / 2],
        imperfections,
    }
}

/// The robot, where `coordinate` has this variance.
pub(super) fn uncertain(mut found: FoundRobot, coordinate: usize, variance: f64) -> FoundRobot {
    found.covariance[coordinate * (coordinate + 3) / 2] = variance;
    found
}

/// The coordinate of an imperfection.
pub(super) fn coordinate(found: &FoundRobot, imperfection: Imperfection) -> usize {
    let place = found.imperfections.iter().position(|own| own.imperfection == imperfection);
    PARAMETERS + place.unwrap()
}

/// The robot whose parameters differ by these factors.
pub(super) fn robot(found: FoundRobot, factors: &[f64]) -> Robot {
    let all = factors.chunks(OF_JOINT).zip(0..).map(|(own, joint)| {
        let size = 0.5_f64.powi(joint);
        let bushing = |dof: usize| size * own[dof] * if dof < 3 { 2e8 } else { 9e6 };
        let stiffness: [f64; 6] = std::array::from_fn(bushing);
        Bushing {
            stiffness,
            damping: std::array::from_fn(|dof| 1e-4 * own[6 + dof] * stiffness[dof]),
        }
    });
    Robot::new(found, all.collect()).unwrap()
}
