//! The recursion against a dense model that shares nothing with it, and its gradient against finite differences.

use flexid_core::chain::Chain;
use flexid_core::chain::linearise::LinearChain;
use flexid_core::mounting::Mounting;
use flexid_core::parameters::Bushings;
use flexid_core::receptance::lanes::Scalar;
use flexid_core::receptance::{Complex, PerDof, Terms, receptance};
use flexid_core::sensors::{Accelerometer, Sensors};

use crate::common::{Dense, Random, respond};
use nalgebra::Vector3;
use proptest::prelude::*;

const EARTH: Vector3<f64> = Vector3::new(0.0, 0.0, -9.80665);

struct Case {
    dense: Dense,
    linear: LinearChain,
    bushings: Bushings,
    s: Complex<f64>,
}

fn strapdown() -> Sensors {
    Sensors { accelerometer: Accelerometer::Strapdown, ..Sensors::default() }
}

fn case(seed: u64, joints: usize, gravity: Vector3<f64>) -> Case {
    let mut random = Random::new(seed);
    let robot = (random.chain(joints), random.pose(joints));
    case_of(&mut random, robot, gravity)
}

fn case_of(random: &mut Random, (chain, pose): (Chain, Vec<f64>), gravity: Vector3<f64>) -> Case {
    let bushings = random.bushings(chain.joints().len());
    let linear = chain.linearise(&pose, gravity, &bushings).unwrap();
    let sag: Vec<[f64; 6]> = linear.joints.iter().map(|joint| joint.sag.into()).collect();
    let dense = Dense::new(&chain, &pose, gravity, &sag);
    let s = Complex { re: random.uniform(0.0, 2.0), im: random.uniform(10.0, 1300.0) };
    Case { dense, linear, bushings, s }
}

fn full(packed: [Complex<f64>; 6]) -> [[nalgebra::Complex<f64>; 3]; 3] {
    let index = [[0, 1, 3], [1, 2, 4], [3, 4, 5]];
    index.map(|row| row.map(|i| nalgebra::Complex::new(packed[i].re, packed[i].im)))
}

fn dense_error(case: &Case) -> f64 {
    let s = nalgebra::Complex::new(case.s.re, case.s.im);
    let reference = case.dense.receptance(&case.bushings, s);
    let ours = full(receptance(
        &Terms::new(&case.linear, &case.bushings, &Sensors::default()).unwrap(),
        case.s,
    ));
    let size = reference.iter().map(|h| h.norm()).fold(0.0, f64::max);
    let mut error = 0.0_f64;
    for a in 0..3 {
        for b in 0..3 {
            error = error.max((ours[a][b] - reference[(a, b)]).norm() / size);
        }
    }
    error
}

#[test]
fn equals_a_dense_solve_on_a_thousand_robots() {
    let mut worst = 0.0_f64;
    for seed in 0..1000 {
        worst = worst.max(dense_error(&case(seed, 1 + (seed % 7) as usize, Vector3::zeros())));
    }
    println!("receptance against a dense solve, 1000 robots, J = 1..7: worst {worst:.1e}");
    assert!(worst < 1e-9, "{worst:e}");
}

#[test]
fn equals_a_dense_solve_with_gravity() {
    let mut worst = 0.0_f64;
    for seed in 0..300 {
        worst = worst.max(dense_error(&case(seed, 1 + (seed % 7) as usize, EARTH)));
    }
    assert!(worst < 1e-9, "{worst:e}");
}

/// Pedestals and bolted extensions anywhere in the chain. A pose has angles of the driven joints alone.
#[test]
fn equals_a_dense_solve_where_some_joints_are_fixed() {
    let (mut worst, mut fixed) = (0.0_f64, 0);
    for seed in 0..300 {
        let mut random = Random::new(seed);
        let robot = random.partly_fixed(1 + (seed % 7) as usize);
        fixed += robot.0.joints().len() - robot.1.len();
        worst = worst.max(dense_error(&case_of(&mut random, robot, EARTH)));
    }
    assert!(worst < 1e-9 && fixed > 400, "{worst:e}, {fixed} fixed joints");
}

#[test]
fn sags_to_the_static_equilibrium() {
    for seed in 0..50 {
        let case = case(seed, 1 + (seed % 7) as usize, EARTH);
        let load = case.dense.gravity_load();
        for (joint, bushing) in case.bushings.iter().enumerate() {
            for dof in 0..6 {
                let spring = bushing.stiffness[dof] * case.linear.joints[joint].sag[dof];
                let error = (spring - load[6 * joint + dof]).abs();
                assert!(error < 1e-3, "robot {seed}, joint {joint}, dof {dof}: {error} N or Nm");
            }
        }
    }
}

#[test]
fn jacobian_equals_the_dense_one() {
    for seed in 0..50 {
        let case = case(seed, 1 + (seed % 7) as usize, EARTH);
        let (ours, dense) = (case.linear.jacobian(), case.dense.tip());
        for dof in 0..dense.ncols() {
            for axis in 0..3 {
                let difference = ours[dof / 6][dof % 6][axis] - dense[(axis, dof)];
                assert!(difference.abs() < 1e-12, "robot {seed}: {difference:e}");
            }
        }
    }
}

fn is_reciprocal(seed: u64, joints: usize) -> Result<(), TestCaseError> {
    let case = case(seed, joints, EARTH);
    let terms = Terms::new(&case.linear, &case.bushings, &Sensors::default()).unwrap();
    let none = [[Complex::default(); 6]; 7];
    let full = respond(&terms, case.s, &[Complex::default(); 3], &none).per_force;
    let size = full.iter().flatten().map(|h| h.re.hypot(h.im)).fold(0.0, f64::max);
    for a in 0..3 {
        for b in 0..a {
            let gap = full[a][b] - full[b][a];
            prop_assert!(gap.re.hypot(gap.im) < 1e-12 * size);
        }
    }
    Ok(())
}

fn has_an_exact_gradient(seed: u64, joints: usize) -> Result<(), TestCaseError> {
    let case = case(seed, joints, EARTH);
    let mut random = Random::new(seed ^ 0x5eed);
    let mut complex =
        |size: f64| Complex { re: random.uniform(-size, size), im: random.uniform(-size, size) };
    let force: [Complex<f64>; 3] = std::array::from_fn(|_| complex(100.0));
    let seam: PerDof<f64> = std::array::from_fn(|_| std::array::from_fn(|_| complex(50.0)));
    let terms = Terms::new(&case.linear, &case.bushings, &strapdown()).unwrap();
    let reading = |bushings: &Bushings, seam: &PerDof<f64>| {
        let mut moved = terms.clone();
        moved.set_bushings(bushings);
        respond(&moved, case.s, &force, seam).observed
    };
    let at = respond(&terms, case.s, &force, &seam);
    let size = at.observed.iter().map(|a| a.re.hypot(a.im)).fold(0.0, f64::max);
    let close = |ours: Complex<f64>, numeric: Complex<f64>| {
        let gap = ours - numeric;
        gap.re.hypot(gap.im) < 1e-5 * (size + ours.re.hypot(ours.im))
    };
    for joint in 0..joints {
        for dof in 0..6 {
            for damping in [false, true] {
                let with = |factor: f64| {
                    let mut bushings = case.bushings.clone();
                    let bushing = &mut bushings[joint];
                    let all = if damping { &mut bushing.damping } else { &mut bushing.stiffness };
                    all[dof] *= factor;
                    reading(&bushings, &seam)
                };
                let step = 1e-4_f64;
                let (up, down) = (with(step.exp()), with((-step).exp()));
                for axis in 0..3 {
                    let ours = at.derivatives(&terms, joint, dof)[axis][usize::from(damping)];
                    let numeric = (up[axis] - down[axis]).scale(0.5 / step);
                    prop_assert!(close(ours, numeric), "{ours:?} {numeric:?}");
                }
            }
            let mut pushed = seam;
            pushed[joint][dof].re += 1e3;
            let pushed = reading(&case.bushings, &pushed);
            for axis in 0..3 {
                let numeric = (pushed[axis] - at.observed[axis]).scale(1e-3);
                let ours = at.per_load[axis][joint][dof];
                let (gap, size) = (ours - numeric, ours.re.hypot(ours.im));
                prop_assert!(gap.re.hypot(gap.im) < 1e-8 * size + 1e-12 * case.s.im.powi(2) / 1e6);
            }
        }
    }
    Ok(())
}

/// A case of one joint that has failed before.
#[test]
fn holds_where_it_has_failed() -> Result<(), TestCaseError> {
    let (seed, joints) = (8685, 1);
    is_reciprocal(seed, joints)?;
    has_an_exact_gradient(seed, joints)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, rng_seed: proptest::test_runner::RngSeed::Fixed(7), ..ProptestConfig::default() })]

    /// Force along a read along b equals force along b read along a, by the two ways that do not assume it.
    #[test]
    fn receptance_is_reciprocal(seed in 0_u64..10_000, joints in 1_usize..=7) {
        is_reciprocal(seed, joints)?;
    }

    /// A delayed, turned and amplified reading is the ideal one, delayed, turned and amplified.
    #[test]
    fn errors_of_a_sensor_act_on_the_reading(seed in 0_u64..10_000, delay in -5e-3_f64..5e-3) {
        let case = case(seed, 3, EARTH);
        let mut random = Random::new(seed ^ 0xca1);
        let turn: [f64; 3] = std::array::from_fn(|_| random.uniform(-0.3, 0.3));
        let gain: [f64; 3] = std::array::from_fn(|_| random.uniform(0.5, 2.0));
        let turn = nalgebra::Rotation3::new(turn.into());
        let mounting = Mounting { accelerometer_axes: turn, ..Mounting::AT_TCP };
        let sensors = Sensors { delay, mounting, acceleration_gain: gain, ..strapdown() };
        let force = [Complex { re: 3.0, im: 1.0 }; 3];
        let none = [[Complex::default(); 6]; 7];
        let ideal = respond(&Terms::new(&case.linear, &case.bushings, &strapdown()).unwrap(), case.s, &force, &none).observed;
        let terms = Terms::new(&case.linear, &case.bushings, &sensors).unwrap();
        let real = respond(&terms, case.s, &force, &none).observed;
        let back = turn.inverse();
        let s = nalgebra::Complex::new(case.s.re, case.s.im);
        let size = ideal.iter().map(|a| a.re.hypot(a.im)).fold(0.0, f64::max);
        for axis in 0..3 {
            let turned: nalgebra::Complex<f64> = (0..3)
                .map(|k| nalgebra::Complex::new(ideal[k].re, ideal[k].im) * back.matrix()[(axis, k)])
                .sum();
            let expected = turned * gain[axis] * (-s * delay).exp();
            let gap = nalgebra::Complex::new(real[axis].re, real[axis].im) - expected;
            prop_assert!(gap.norm() < 1e-11 * size, "{axis}: {gap}");
        }
    }

    /// Derivatives in every parameter and every seam load, strapdown in gravity: central differences.
    #[test]
    fn gradient_equals_finite_differences(seed in 0_u64..10_000, joints in 1_usize..=4) {
        has_an_exact_gradient(seed, joints)?;
    }

    /// A strapdown accelerometer reads `a + θ × g`.
    #[test]
    fn strapdown_feels_gravity(seed in 0_u64..10_000, joints in 1_usize..=4) {
        let case = case(seed, joints, EARTH);
        let terms = Terms::new(&case.linear, &case.bushings, &strapdown()).unwrap();
        let none = [[Complex::default(); 6]; 7];
        let s = nalgebra::Complex::new(case.s.re, case.s.im);
        let tip = case.dense.tip().map(nalgebra::Complex::from);
        let motion = &tip * case.dense.compliance(&case.bushings, s) * tip.rows(0, 3).transpose();
        let g = case.dense.gravity_at_tip();
        let ours = respond(&terms, case.s, &[Complex::default(); 3], &none).per_force;
        for force in 0..3 {
            let turn = |axis: usize| motion[(3 + axis, force)];
            let tilt = [turn(1) * g.z - turn(2) * g.y, turn(2) * g.x - turn(0) * g.z, turn(0) * g.y - turn(1) * g.x];
            for reading in 0..3 {
                let expected = s * s * motion[(reading, force)] + tilt[reading];
                let gap = (ours[reading][force].re - expected.re).hypot(ours[reading][force].im - expected.im);
                prop_assert!(gap < 1e-9 * expected.norm() + 1e-12);
            }
        }
    }
}

#[test]
fn single_precision_agrees_with_double() {
    let mut worst = 0.0_f64;
    for seed in 0..200 {
        let mut case = case(seed, 1 + (seed % 7) as usize, Vector3::zeros());
        case.s.re = 1.7;
        let double = receptance(
            &Terms::<f64>::new(&case.linear, &case.bushings, &Sensors::default()).unwrap(),
            case.s,
        );
        let s = Complex { re: case.s.re as f32, im: case.s.im as f32 };
        let single = receptance(
            &Terms::<f32>::new(&case.linear, &case.bushings, &Sensors::default()).unwrap(),
            s,
        );
        let size = double.iter().map(|h| h.re.hypot(h.im)).fold(0.0, f64::max);
        for (a, b) in double.iter().zip(&single) {
            worst = worst.max((a.re - b.re.to_f64()).hypot(a.im - b.im.to_f64()) / size);
        }
    }
    println!("single precision against double, 200 robots: worst {worst:.1e}");
    assert!(worst < 5e-3, "{worst:e}");
}
