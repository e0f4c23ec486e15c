//! Predictions against a dense model that shares nothing with them, and their intervals against finite differences.

#[path = "../../../core/tests/common/mod.rs"]
mod common;

use std::f64::consts::TAU;
use std::path::Path;

use common::{Dense, Random};
use flexid_core::imperfection::Imperfection;
use flexid_core::parameters::Bushings;
use flexid_pipeline::model::Model;
use flexid_pipeline::robot::{FoundRobot, FoundValue, JointBounds};
use flexid_prediction::Robot;
use nalgebra::{Complex, DMatrix};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// By how much stiffer than the others the robots are whose standard deviations are compared: those sag by centimetres, and predictions
/// leave out the change of the sag with a stiffness.
const STIFFER: f64 = 4.0;
/// Part of a standard deviation that comes from that change.
const LEFT_OUT: f64 = 0.03;
/// Error of a standard deviation, in that of the coordinate: the sag, and hysteresis, whose derivative along the imaginary axis is taken
/// for that along any.
const FLOOR: f64 = 0.01;
/// Error of a difference of logarithms over its step: a few units in the last digit, by a fifth.
const ROUNDING: f64 = 1e-14;
const EARTH: [f64; 3] = [0.0, 0.0, -9.80665];
/// Imperfections of all kinds that move a robot, and the unit of each.
const IMPERFECTIONS: [(Imperfection, f64); 18] = [
    (Imperfection::Mass(2), 0.02),
    (Imperfection::Inertia(4, 1), 0.05),
    (Imperfection::Inertia(2, 3), 0.05),
    (Imperfection::CentreOfMass(1, 0), 5e-3),
    (Imperfection::JointAngle(3), 1e-3),
    (Imperfection::ElasticCentre(2, 2), 0.01),
    (Imperfection::ToolCentrePoint(1), 1e-3),
    (Imperfection::ToolTurn(0), 1e-3),
    (Imperfection::Hysteresis, 0.3),
    (Imperfection::Servo(1), 0.02),
    (Imperfection::Load, 1e-5),
    (Imperfection::Ground(0), 3e-10),
    (Imperfection::Ground(4), 3e-10),
    (Imperfection::GroundDamping(5), 3e-14),
    (Imperfection::RecordStiffness(0), 1e-3),
    (Imperfection::BaseMass, 0.5),
    (Imperfection::Hose, 1e3),
    (Imperfection::HoseDamping, 20.0),
];

/// Bushings with a tenth of the dampings that core's tests draw.
fn lightly_damped(random: &mut Random) -> Bushings {
    let mut bushings = random.bushings(6);
    for bushing in &mut bushings {
        bushing.damping.iter_mut().for_each(|damping| *damping *= 0.1);
    }
    bushings
}

fn model() -> Model {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenario/mill6-model.toml");
    Model::load(&file).unwrap()
}

/// Standard deviation of an uncertain coordinate: a thousandth of its unit, which is 1 for the logarithm of a parameter.
fn std(index: usize) -> f64 {
    1e-3 * if index < 72 { 1.0 } else { IMPERFECTIONS[index - 72].1 }
}

/// The robot with these bushings and imperfections, each in its unit of the table. Only the coordinate `uncertain` varies.
fn robot(bushings: &Bushings, values: &[f64], uncertain: Option<usize>) -> Robot {
    let model = model();
    let size = 12 * bushings.len() + values.len();
    let mut covariance = vec![0.0; size * (size + 1) / 2];
    if let Some(index) = uncertain {
        covariance[(index + 1) * (index + 2) / 2 - 1] = std(index).powi(2);
    }
    let found = FoundRobot {
        model,
        gravity_m_per_s2: EARTH,
        band_hz: [2.0, 200.0],
        reference_hz: None,
        poses: Vec::new(),
        bounds: vec![JointBounds { stiffness: [[1.0, 2.0]; 6], damping: [[1.0, 2.0]; 6] }; 6],
        imperfections: IMPERFECTIONS
            .iter()
            .zip(values)
            .map(|(&(imperfection, unit), value)| FoundValue { imperfection, value: unit * value })
            .collect(),
        covariance,
    };
    Robot::new(found, bushings.clone()).unwrap()
}

fn dense(robot: &Robot, pose: &[f64], bushings: &Bushings) -> Dense {
    let chain = robot.model().chain().unwrap();
    let linear = chain.linearise(pose, EARTH.into(), bushings).unwrap();
    let sag: Vec<[f64; 6]> = linear.joints.iter().map(|joint| joint.sag.into()).collect();
    Dense::new(&chain, pose, EARTH.into(), &sag)
}

/// Stiffness, with that due to gravity, and damping of the dense model, with a hose of these two at the tool.
fn with_hose(dense: &Dense, bushings: &Bushings, [k, d]: [f64; 2]) -> [DMatrix<f64>; 2] {
    let tip = dense.tip();
    let pulled = tip.rows(0, 3).transpose() * tip.rows(0, 3);
    let (mut stiffness, mut damping) = (dense.gravity_stiffness() + k * &pulled, d * pulled);
    for (joint, bushing) in bushings.iter().enumerate() {
        for dof in 0..6 {
            let i = 6 * joint + dof;
            stiffness[(i, i)] += bushing.stiffness[dof];
            damping[(i, i)] += bushing.damping[dof];
        }
    }
    [stiffness, damping]
}

/// Values of [`IMPERFECTIONS`] that are those of a hose alone, of this stiffness, N/m, and damping, Ns/m.
fn hose([k, d]: [f64; 2]) -> Vec<f64> {
    let value = |(imperfection, unit): &(Imperfection, f64)| match imperfection {
        Imperfection::Hose => k / unit,
        Imperfection::HoseDamping => d / unit,
        _ => 0.0,
    };
    IMPERFECTIONS.iter().map(value).collect()
}

/// Stiffness and damping of a hose that changes the receptance by much of itself.
fn strong_hose() -> impl Strategy<Value = [f64; 2]> {
    prop_oneof![Just([0.0; 2]), (1e4..1e6, 10.0..1e3).prop_map(|(k, d)| [k, d])]
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(7), ..ProptestConfig::with_cases(64) })]

    #[test]
    fn a_hose_is_a_spring_and_a_damper_at_the_tool_of_a_dense_model(
        seed in any::<u64>(),
        hz in 1.0..400.0,
        values in strong_hose(),
    ) {
        let mut random = Random::new(seed);
        let (bushings, pose) = (random.bushings(6), random.pose(6));
        let robot = robot(&bushings, &hose(values), None);
        let at = robot.at(&pose).unwrap();
        let dense = dense(&robot, &pose, &bushings);
        let [stiffness, damping] = with_hose(&dense, &bushings, values);
        let tip = dense.tip();
        let s = Complex::new(0.0, TAU * hz);
        let z = dense.mass().map(|m| s * s * m) + damping.map(|d| s * d) + stiffness.map(Complex::from);
        let tip_at = tip.map(Complex::from);
        let expected = &tip_at * z.try_inverse().unwrap() * tip_at.transpose();
        let found = at.receptance_value(hz).unwrap();
        let size = expected.view((0, 0), (3, 3)).iter().map(|h| h.norm()).fold(0.0, f64::max);
        for row in 0..3 {
            for column in 0..3 {
                let error = (found[row][column] - expected[(row, column)]).norm();
                prop_assert!(error < 1e-8 * size, "{error:e} of {size:e}");
            }
        }
        let expected = &tip * stiffness.try_inverse().unwrap() * tip.transpose();
        let compliance = at.compliance_estimates(&at.compliance().unwrap());
        for row in 0..6 {
            for column in 0..6 {
                let error = (compliance[row][column].value - expected[(row, column)]).abs();
                prop_assert!(error < 1e-8 * expected.amax(), "{row} {column}: {error:e}");
            }
        }
    }

    #[test]
    fn the_receptance_is_that_of_a_dense_model(seed in any::<u64>(), hz in 1.0..400.0) {
        let mut random = Random::new(seed);
        let (bushings, pose) = (random.bushings(6), random.pose(6));
        let robot = robot(&bushings, &[], None);
        let at = robot.at(&pose).unwrap();
        let expected = dense(&robot, &pose, &bushings)
            .receptance(&bushings, Complex::new(0.0, TAU * hz));
        let found = at.receptance_value(hz).unwrap();
        let size = expected.iter().map(|h| h.norm()).fold(0.0, f64::max);
        for row in 0..3 {
            for column in 0..3 {
                let error = (found[row][column] - expected[(row, column)]).norm();
                prop_assert!(error < 1e-8 * size, "{error:e} of {size:e}");
            }
        }
        // At rest.
        let dense = dense(&robot, &pose, &bushings);
        let tip = dense.tip();
        let at_rest = dense.compliance(&bushings, Complex::new(0.0, 0.0)).map(|entry| entry.re);
        let expected = &tip * at_rest * tip.transpose();
        let compliance = at.compliance_estimates(&at.compliance().unwrap());
        for row in 0..6 {
            for column in 0..6 {
                let error = (compliance[row][column].value - expected[(row, column)]).abs();
                prop_assert!(error < 1e-8 * expected.amax(), "{row} {column}: {error:e}");
            }
        }
    }

    /// The eigenvalues of the first-order form.
    #[test]
    fn the_modes_are_the_poles_of_a_dense_model(seed in any::<u64>(), values in strong_hose()) {
        let mut random = Random::new(seed);
        let (bushings, pose) = (lightly_damped(&mut random), random.pose(6));
        let robot = robot(&bushings, &hose(values), None);
        let dense = dense(&robot, &pose, &bushings);
        let n = 36;
        let [stiffness, damping] = with_hose(&dense, &bushings, values);
        let inverse = dense.mass().try_inverse().unwrap();
        let mut first_order = DMatrix::zeros(2 * n, 2 * n);
        first_order.view_mut((0, n), (n, n)).fill_diagonal(1.0);
        first_order.view_mut((n, 0), (n, n)).copy_from(&-(&inverse * stiffness));
        first_order.view_mut((n, n), (n, n)).copy_from(&-(&inverse * damping));
        let mut poles: Vec<Complex<f64>> = first_order
            .complex_eigenvalues()
            .iter()
            .copied()
            .filter(|pole| pole.im > 0.0 && pole.norm() < TAU * 150.0)
            .collect();
        poles.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
        let modes = robot.at(&pose).unwrap().modes(400.0);
        for (pole, mode) in poles.iter().zip(&modes) {
            let (hz, ratio) = (pole.norm() / TAU, -pole.re / pole.norm());
            prop_assert!((mode.frequency_hz.value / hz - 1.0).abs() < 1e-6, "{hz} {mode:?}");
            prop_assert!((mode.damping_ratio.value / ratio - 1.0).abs() < 1e-5, "{ratio} {mode:?}");
        }
        prop_assert!(poles.len() >= 3 && modes.len() >= poles.len());
    }

    /// An interval of a single uncertain coordinate is as wide as the prediction changes with it.
    #[test]
    fn standard_deviations_are_those_of_finite_differences(
        seed in any::<u64>(),
        uncertain in 0..72 + IMPERFECTIONS.len(),
        hz in 3.0..150.0,
    ) {
        let mut random = Random::new(seed);
        let (mut bushings, pose) = (lightly_damped(&mut random), random.pose(6));
        for bushing in &mut bushings {
            bushing.stiffness.iter_mut().for_each(|stiffness| *stiffness *= STIFFER);
        }
        let values: Vec<f64> = (0..IMPERFECTIONS.len()).map(|_| random.uniform(0.2, 1.0)).collect();
        let std = std(uncertain);
        let shifted = |by: f64| {
            let (mut bushings, mut values) = (bushings.clone(), values.clone());
            match uncertain.checked_sub(72) {
                Some(index) => values[index] += by / IMPERFECTIONS[index].1,
                None => {
                    let bushing = &mut bushings[uncertain / 12];
                    let mut all = bushing.stiffness.iter_mut().chain(&mut bushing.damping);
                    *all.nth(uncertain % 12).unwrap() *= by.exp();
                }
            }
            robot(&bushings, &values, None)
        };
        let step = 0.1 * std;
        let (up, down) = (shifted(step), shifted(-step));
        let (up, down) = (up.at(&pose).unwrap(), down.at(&pose).unwrap());
        let own = robot(&bushings, &values, Some(uncertain));
        let at = own.at(&pose).unwrap();

        let point = at.receptance(hz).unwrap();
        let (above, below) = (up.receptance_value(hz).unwrap(), down.receptance_value(hz).unwrap());
        for row in 0..3 {
            let change = (above[row][row] / below[row][row]).ln() / (2.0 * step) * std;
            let magnitude = point.magnitude[row][row].relative_std;
            prop_assert!((magnitude - change.re.abs()).abs() < FLOOR * std + ROUNDING + LEFT_OUT * change.norm(), "{magnitude:e} {change}");
            let phase = point.phase[row][row].std;
            prop_assert!((phase - change.im.abs()).abs() < FLOOR * std + ROUNDING + LEFT_OUT * change.norm(), "{phase:e} {change}");
        }

        let first = |at: &flexid_prediction::Dynamics<'_>| at.modes(400.0)[0].clone();
        let (mode, above, below) = (first(&at), first(&up), first(&down));
        let per = |ratio: f64| ratio.ln() / (2.0 * step) * std;
        let change = per(above.frequency_hz.value / below.frequency_hz.value);
        let found = mode.frequency_hz.relative_std;
        prop_assert!((found - change.abs()).abs() < FLOOR * std + ROUNDING + LEFT_OUT * change.abs(), "{found:e} {change:e}");
        let change = per(above.damping_ratio.value / below.damping_ratio.value);
        let found = mode.damping_ratio.relative_std;
        prop_assert!((found - change.abs()).abs() < FLOOR * std + ROUNDING + LEFT_OUT * change.abs(), "{found:e} {change:e}");

        let deflected = |at: &flexid_prediction::Dynamics<'_>| {
            at.deflection(&at.compliance().unwrap(), [100.0, 50.0, -30.0, 1.0, 2.0, 3.0]).translation
        };
        let (found, above, below) = (deflected(&at), deflected(&up), deflected(&down));
        let size = found.iter().map(|own| own.value.abs()).fold(0.0, f64::max);
        for axis in 0..3 {
            let change = (above[axis].value - below[axis].value) / (2.0 * step) * std;
            let found = found[axis].std;
            prop_assert!((found - change.abs()).abs() < FLOOR * std * size + LEFT_OUT * change.abs(), "{found:e} {change:e}");
        }
    }
}

/// Ground that is rigid may give way, and varies the receptance as ground that hardly gives way does.
#[test]
fn an_imperfection_at_the_end_of_its_range_varies_upwards() {
    let mut random = Random::new(1);
    let (bushings, pose) = (lightly_damped(&mut random), random.pose(6));
    let is_of_ground =
        |it: &Imperfection| matches!(it, Imperfection::Ground(_) | Imperfection::GroundDamping(_));
    for (index, _) in IMPERFECTIONS.iter().enumerate().filter(|(_, (it, _))| is_of_ground(it)) {
        let stds = [0.0, 0.01].map(|least| {
            let values: Vec<f64> = (0..IMPERFECTIONS.len())
                .map(|own| if own == index { least } else { 0.3 })
                .collect();
            let robot = robot(&bushings, &values, Some(72 + index));
            let point = robot.at(&pose).unwrap().receptance(50.0).unwrap();
            point.magnitude[0][0].relative_std
        });
        let [at_end, inside] = stds;
        assert!(at_end > 0.0 && (at_end / inside - 1.0).abs() < 0.02, "{index}: {stds:?}");
    }
}
