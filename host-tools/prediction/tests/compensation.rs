//! Joint offsets against the kinematics of the chain, and their intervals against finite differences.

#[path = "../../../core/tests/common/mod.rs"]
mod common;

use std::path::Path;

use common::Random;
use flexid_core::parameters::Bushings;
use flexid_pipeline::model::Model;
use flexid_pipeline::robot::{FoundRobot, JointBounds};
use flexid_prediction::Robot;
use flexid_prediction::compensation::Compensation;
use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// A robot of a scenario; the logarithm of one parameter varies by `std`.
fn robot(scenario: &str, bushings: &Bushings, uncertain: Option<(usize, f64)>) -> Robot {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenario").join(scenario);
    let joints = bushings.len();
    let mut covariance = vec![0.0; 12 * joints * (12 * joints + 1) / 2];
    if let Some((index, std)) = uncertain {
        covariance[(index + 1) * (index + 2) / 2 - 1] = std * std;
    }
    let found = FoundRobot {
        model: Model::load(&file).unwrap(),
        gravity_m_per_s2: [0.0; 3],
        band_hz: [2.0, 200.0],
        reference_hz: None,
        poses: Vec::new(),
        bounds: vec![JointBounds { stiffness: [[1.0, 2.0]; 6], damping: [[1.0, 2.0]; 6] }; joints],
        imperfections: Vec::new(),
        covariance,
    };
    Robot::new(found, bushings.clone()).unwrap()
}

fn compensation(robot: &Robot, pose: &[f64], wrench: [f64; 6]) -> Compensation {
    let dynamics = robot.at(pose).unwrap();
    Compensation::of(&dynamics, &dynamics.compliance().unwrap(), wrench)
}

fn values(all: &[flexid_prediction::Estimate]) -> Vec<f64> {
    all.iter().map(|own| own.value).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    /// The tool stands after the offsets and its deflection, by the chain itself, as it stood, but for the deflection that is said to be left.
    #[test]
    fn offsets_move_the_tool_against_its_deflection(seed in any::<u64>(), joints in prop::sample::select(vec![3_usize, 6])) {
        let mut random = Random::new(seed);
        let (bushings, pose) = (random.bushings(joints), random.pose(joints));
        let robot = robot(if joints == 3 { "mill3-model.toml" } else { "mill6-model.toml" }, &bushings, None);
        let own = compensation(&robot, &pose, [40.0, -20.0, 30.0, 1.0, 2.0, -1.0]);
        let before = robot.chain().tool(&pose);
        let moved: Vec<f64> = pose.iter().zip(&own.offsets).map(|(q, offset)| q + offset.value).collect();
        let [deflected, left] = [&own.deflection, &own.left];
        let vector = |of: &[flexid_prediction::Estimate; 3]| Vector3::from(of.map(|own| own.value));
        let deflection = Isometry3::new(vector(&deflected.translation), vector(&deflected.rotation));
        let after = before.inverse() * robot.chain().tool(&moved) * deflection;
        let size = values(&deflected.translation).iter().map(|own| own.abs()).fold(0.0, f64::max);
        for axis in 0..3 {
            let error = after.translation.vector[axis] - left.translation[axis].value;
            prop_assert!(error.abs() < 1e-9 * size, "{error:e} of {size:e}");
            let error = after.rotation.scaled_axis()[axis] - left.rotation[axis].value;
            prop_assert!(error.abs() < 1e-9 * size, "{error:e} of {size:e}");
            // The offsets are commanded as they are: what is uncertain is the deflection.
            prop_assert_eq!(left.translation[axis].std, deflected.translation[axis].std);
        }
        if !own.is_singular {
            // Three joints take the translation back, six the rotation, too.
            let left: Vec<f64> = values(&left.translation).into_iter().chain(if joints == 6 { values(&left.rotation) } else { vec![] }).collect();
            prop_assert!(left.iter().all(|own| own.abs() < 1e-9 * size), "{left:?}");
        }
        // Along the base it is the same vector.
        let base = before.rotation * Vector3::from_vec(values(&deflected.translation));
        for axis in 0..3 {
            prop_assert!((base[axis] - own.along_base.translation[axis].value).abs() < 1e-9 * size);
        }
    }

    #[test]
    fn standard_deviations_of_offsets_are_those_of_finite_differences(seed in any::<u64>(), dof in 0..6_usize, joint in 0..6_usize) {
        let mut random = Random::new(seed);
        let (bushings, pose) = (random.bushings(6), random.pose(6));
        let wrench = [40.0, -20.0, 30.0, 1.0, 2.0, -1.0];
        let std = 1e-3;
        let shifted = |by: f64| {
            let mut bushings = bushings.clone();
            bushings[joint].stiffness[dof] *= by.exp();
            compensation(&robot("mill6-model.toml", &bushings, None), &pose, wrench)
        };
        let (up, down) = (shifted(std), shifted(-std));
        let own = compensation(&robot("mill6-model.toml", &bushings, Some((12 * joint + dof, std))), &pose, wrench);
        let all = |of: &Compensation| -> Vec<flexid_prediction::Estimate> {
            let moves = of.deflection.translation.iter().chain(&of.along_base.rotation);
            of.offsets.iter().chain(moves).copied().collect()
        };
        let largest = all(&own).iter().map(|own| own.value.abs()).fold(0.0, f64::max);
        for ((found, above), below) in all(&own).iter().zip(all(&up)).zip(all(&down)) {
            let change = ((above.value - below.value) / 2.0).abs();
            // The standard deviation of an offset is that of its first step. Further ones are smaller by the size of the offsets, rad.
            prop_assert!((found.std - change).abs() < 1e-2 * change + 1e-7 * largest, "{found:?}: {change:e}");
        }
    }

    #[test]
    fn standard_deviations_of_sizes_are_those_of_finite_differences(seed in any::<u64>(), dof in 0..6_usize, joint in 0..6_usize) {
        let mut random = Random::new(seed);
        let (bushings, pose) = (random.bushings(6), random.pose(6));
        let std = 1e-4;
        let of = |bushings: &Bushings, uncertain| {
            let robot = robot("mill6-model.toml", bushings, uncertain);
            let dynamics = robot.at(&pose).unwrap();
            let compliance = dynamics.compliance().unwrap();
            [dynamics.softest(&compliance), dynamics.moved_by(&compliance, [40.0, -20.0, 30.0])]
        };
        let shifted = |by: f64| {
            let mut bushings = bushings.clone();
            bushings[joint].stiffness[dof] *= by.exp();
            of(&bushings, None)
        };
        let (up, down) = (shifted(std), shifted(-std));
        let found = of(&bushings, Some((12 * joint + dof, std)));
        for ((found, above), below) in found.iter().zip(up).zip(down) {
            let change = ((above.value / below.value).ln() / 2.0).abs();
            prop_assert!((found.relative_std - change).abs() < 1e-3 * change + 1e-9, "{found:?}: {change:e}");
        }
    }
}
