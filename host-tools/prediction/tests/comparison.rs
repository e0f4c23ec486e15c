//! How often two fits of the same robot are called different, and how often a change is found.

#[path = "../../../core/tests/common/mod.rs"]
mod common;

use std::path::Path;

use common::{Random, nominal};
use flexid_core::parameters::Bushings;
use flexid_pipeline::model::Model;
use flexid_pipeline::robot::{FoundRobot, JointBounds};
use flexid_prediction::Robot;
use flexid_prediction::comparison::{LEVEL, compare};
use flexid_prediction::document::Found;
use flexid_prediction::parameter::{IncomparableError, Quantity};
use flexid_wire::report::{Fit, JointReport, Verdict};
use flexid_wire::text::clipped;
use nalgebra::{DMatrix, DVector};

const PARAMETERS: usize = 36;
const PAIRS: usize = 400;
/// The parameter that changes: joint_2 rz, a stiffness.
const CHANGED: usize = 12 + 5;

/// A covariance with standard deviations of 0.3 to 3 %, whose correlations are those of eight shared causes: some combinations are known thirty times better
/// than a parameter.
fn covariance(random: &mut Random) -> DMatrix<f64> {
    let causes = DMatrix::from_fn(PARAMETERS, 8, |_, _| random.normal());
    let mut all = &causes * causes.transpose() + DMatrix::identity(PARAMETERS, PARAMETERS) * 0.01;
    let scale: Vec<f64> = (0..PARAMETERS)
        .map(|i| 0.003 * 10_f64.powf(random.uniform(0.0, 1.0)) / all[(i, i)].sqrt())
        .collect();
    all = DMatrix::from_fn(PARAMETERS, PARAMETERS, |i, j| all[(i, j)] * scale[i] * scale[j]);
    all
}

/// A fit whose logarithms are off from the `truth` by a draw from the covariance.
fn fit(truth: &Bushings, covariance: &DMatrix<f64>, random: &mut Random) -> Found {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenario/mill3-model.toml");
    let model = Model::load(&file).unwrap();
    let root = covariance.clone().cholesky().unwrap().l();
    let off = root * DVector::from_fn(PARAMETERS, |_, _| random.normal());
    let mut bushings = truth.clone();
    for (joint, bushing) in bushings.iter_mut().enumerate() {
        let all = bushing.stiffness.iter_mut().chain(&mut bushing.damping);
        all.zip(off.rows(12 * joint, 12).iter()).for_each(|(value, off)| *value *= off.exp());
    }
    let std = |joint: usize, first: usize, values: &[f64; 6]| {
        std::array::from_fn(|dof| {
            let own = 12 * joint + first + dof;
            Some(values[dof] * covariance[(own, own)].sqrt())
        })
    };
    let joints = bushings.iter().enumerate().map(|(joint, own)| JointReport {
        name: clipped(&model.joints[joint].name),
        stiffness: own.stiffness,
        stiffness_std: std(joint, 0, &own.stiffness),
        stiffness_verdict: [Verdict::Identified; 6],
        damping: own.damping,
        damping_std: std(joint, 6, &own.damping),
        damping_verdict: [Verdict::Weak; 6],
    });
    let joints: Vec<JointReport> = joints.collect();
    let found = FoundRobot {
        model,
        gravity_m_per_s2: [0.0; 3],
        band_hz: [2.0, 200.0],
        reference_hz: None,
        poses: Vec::new(),
        bounds: vec![JointBounds { stiffness: [[1.0, 2.0]; 6], damping: [[1.0, 2.0]; 6] }; 3],
        imperfections: Vec::new(),
        covariance: (0..PARAMETERS)
            .flat_map(|row| (0..=row).map(move |column| (row, column)))
            .map(|place| covariance[place])
            .collect(),
    };
    let fit: Fit = serde_json::from_value(serde_json::json!({
        "records": 3, "frames": 0, "frames_lost": 0, "ssp": 0.1, "ssp_max": 0.1, "consistency": 1.0,
        "search_evaluations": 0, "refine_iterations": 0, "starts": 1, "bridged": 0, "seconds": 0.0,
        "acceptance": "consistent", "found_by": "descent", "random_searches": 0, "branches": 0
    }))
    .unwrap();
    let robot = Robot::new(found, bushings).unwrap();
    Found { joints, fit, warnings: Vec::new(), robot, shared: None, date: None, logs: Vec::new() }
}

/// Pairs of fits, the second to a robot whose parameter is `factor` times as large: how many are called different, and in how many the parameter
/// is named alone.
fn differing(factor: f64) -> [usize; 2] {
    let mut random = Random::new(11);
    let (mut differ, mut named) = (0, 0);
    for _ in 0..PAIRS {
        let covariances = [covariance(&mut random), covariance(&mut random)];
        let mut after = nominal();
        after[1].stiffness[5] *= factor;
        let [a, b] = [
            fit(&nominal(), &covariances[0], &mut random),
            fit(&after, &covariances[1], &mut random),
        ];
        let comparison = compare(&a, &b).unwrap();
        assert_eq!((comparison.parameters.len(), comparison.all), (PARAMETERS, PARAMETERS));
        differ += usize::from(!comparison.agree);
        let changed = comparison.parameters.iter().enumerate().filter(|(_, own)| own.has_changed);
        let changed: Vec<usize> = changed.map(|(place, _)| place).collect();
        named += usize::from(changed == [CHANGED]);
    }
    [differ, named]
}

/// 5 % of 400 pairs are 20; three standard deviations of that number are 13. Both tests have half of it, and share some pairs.
#[test]
fn two_fits_of_a_robot_are_seldom_called_different() {
    let [differ, _] = differing(1.0);
    let expected = LEVEL * PAIRS as f64;
    assert!((differ as f64) < expected + 13.0 && differ as f64 > 0.2 * expected, "{differ}");
}

#[test]
fn a_stiffness_that_has_changed_is_found_and_named() {
    for factor in [0.8, 0.5, 0.01, 3.0] {
        let [differ, named] = differing(factor);
        assert!(differ == PAIRS && named > PAIRS * 8 / 10, "{factor}: {differ} {named}");
    }
}

#[test]
fn changes_have_their_direction_size_and_interval() {
    let mut random = Random::new(3);
    let covariance = covariance(&mut random);
    let mut after = nominal();
    after[1].stiffness[5] *= 0.8;
    let mut still = Random::new(5);
    let before = fit(&nominal(), &covariance, &mut still);
    let mut still = Random::new(5);
    let after = fit(&after, &covariance, &mut still);
    let comparison = compare(&before, &after).unwrap();
    let own = &comparison.parameters[CHANGED];
    assert_eq!((own.joint.as_str(), own.dof, own.quantity), ("joint_2", 5, Quantity::Stiffness));
    assert!((own.ratio.value - 0.8).abs() < 1e-12 && own.has_changed && own.deviations < 0.0);
    let variance: f64 = 2.0 * covariance[(CHANGED, CHANGED)];
    assert!((own.ratio.relative_std - variance.sqrt()).abs() < 1e-12, "{own:?}");
}

#[test]
fn what_is_not_determined_is_left_out_and_other_robots_are_refused() {
    let mut random = Random::new(1);
    let covariance = covariance(&mut random);
    let mut pair = [0, 1].map(|_| fit(&nominal(), &covariance, &mut random));
    pair[0].joints[0].stiffness_verdict[2] = Verdict::NotObservable;
    pair[1].joints[2].damping_verdict[0] = Verdict::Fixed;
    let comparison = compare(&pair[0], &pair[1]).unwrap();
    assert_eq!(comparison.parameters.len(), PARAMETERS - 2);
    for joint in &mut pair[1].joints {
        (joint.stiffness_verdict, joint.damping_verdict) =
            ([Verdict::Fixed; 6], [Verdict::Fixed; 6]);
    }
    assert_eq!(compare(&pair[0], &pair[1]).unwrap_err(), IncomparableError::Nothing);
    let mut found = pair[1].robot.found().clone();
    found.model.joints[0].name = "waist".into();
    pair[1].robot = Robot::new(found, pair[1].robot.bushings().clone()).unwrap();
    let error = compare(&pair[0], &pair[1]).unwrap_err().to_string();
    assert!(error.contains("waist (revolute)") && error.contains("joint_1 (revolute)"), "{error}");
}
