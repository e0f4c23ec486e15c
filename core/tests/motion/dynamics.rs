//! Inverse and forward dynamics: mass matrix, and each the other's inverse, on random chains.

use flexid_core::motion::{Coordinates, EquationOfMotion, State};
use flexid_core::parameters::{Bushing, Bushings};
use nalgebra::{DMatrix, Vector3};
use proptest::prelude::*;

use super::mechanics::kinetic_energy;
use crate::common::Random;

const EARTH: Vector3<f64> = Vector3::new(0.0, 0.0, -9.80665);

/// Bushings in which gravity, spin, springs and dampers are of one size when links turn by a radian.
fn soft(random: &mut Random, joints: usize) -> Bushings {
    let bushing = |_| Bushing {
        stiffness: std::array::from_fn(|_| random.uniform(1e3, 1e4)),
        damping: std::array::from_fn(|_| random.uniform(1e1, 1e3)),
    };
    (0..joints).map(bushing).collect()
}

/// Within ±`size` for each of the coordinates.
fn coordinates(random: &mut Random, joints: usize, size: f64) -> Coordinates {
    let mut all = Coordinates::default();
    for one in all[..joints].iter_mut() {
        one.iter_mut().for_each(|x| *x = random.uniform(-size, size));
    }
    all
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, rng_seed: proptest::test_runner::RngSeed::Fixed(3), ..ProptestConfig::default() })]

    #[test]
    fn forward_dynamics_inverts_inverse_dynamics(seed in 0_u64..100_000, joints in 1_usize..=7) {
        let mut random = Random::new(seed);
        let (chain, pose) = (random.chain(joints), random.pose(joints));
        let bushings = soft(&mut random, joints);
        let equation = EquationOfMotion::about(&chain, &pose, EARTH, &bushings, Coordinates::default()).unwrap();
        let state = State {
            elongation: coordinates(&mut random, joints, 1.0),
            rate: coordinates(&mut random, joints, 3.0),
        };
        let force = random.vector(1e3);
        let acceleration = equation.forward_dynamics(&state, &force);
        let left = equation.inverse_dynamics(&state, &acceleration, &force);
        // Beside the loads that cancel: those of the same motion without springs to hold it.
        let free = equation.inverse_dynamics(&State::default(), &acceleration, &force);
        let size = free.iter().map(|load| load.amax()).fold(0.0, f64::max);
        for load in &left {
            prop_assert!(load.amax() < 1e-11 * size, "{load} of {size}");
        }
        for idle in joints..7 {
            prop_assert_eq!(acceleration[idle].amax() + left[idle].amax(), 0.0);
        }
    }

    /// The mass matrix at a large displacement, from inverse dynamics: `2 T = q̇ᵀ M q̇`.
    #[test]
    fn the_mass_matrix_is_that_of_the_kinetic_energy(seed in 0_u64..100_000, joints in 1_usize..=7) {
        let mut random = Random::new(seed);
        let (chain, pose) = (random.chain(joints), random.pose(joints));
        let free = vec![Bushing::default(); joints];
        let equation = EquationOfMotion::new(&chain, &pose, Vector3::zeros(), &free).unwrap();
        let state = State {
            elongation: coordinates(&mut random, joints, 1.0),
            rate: Coordinates::default(),
        };
        let size = 6 * joints;
        let mut mass = DMatrix::zeros(size, size);
        for column in 0..size {
            let mut unit = Coordinates::default();
            unit[column / 6][column % 6] = 1.0;
            let loads = equation.inverse_dynamics(&state, &unit, &Vector3::zeros());
            for row in 0..size {
                mass[(row, column)] = loads[row / 6][row % 6];
            }
        }
        prop_assert!((&mass - mass.transpose()).amax() < 1e-12 * mass.amax());
        prop_assert!(mass.clone().cholesky().is_some());
        // Pairs of coordinates in turn, and all of them at once.
        for trial in 0..=size {
            let rate = if trial == size {
                coordinates(&mut random, joints, 1.0)
            } else {
                let mut pair = Coordinates::default();
                pair[trial / 6][trial % 6] = 1.0;
                let other = (random.uniform(0.0, 1.0) * size as f64) as usize;
                pair[other / 6][other % 6] = 1.0;
                pair
            };
            let moving = State { rate, ..state };
            let flat: Vec<f64> = rate[..joints].iter().flat_map(|rate| rate.iter().copied()).collect();
            let rates = nalgebra::DVector::from_vec(flat);
            let ours = 0.5 * rates.dot(&(&mass * &rates));
            let energy = kinetic_energy(&chain, &pose, &moving);
            prop_assert!((ours - energy).abs() < 1e-8 * energy, "{ours} J is not {energy} J");
        }
    }
}
