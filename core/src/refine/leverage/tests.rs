//! White noise in short parts, and the number of residuals that their seams take against dense matrices.

use std::boxed::Box;

use nalgebra::{Complex as Dense, DMatrix, Matrix3, Vector3};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng as _, SeedableRng as _};

use super::super::seam::cost_of;
use super::super::tests::{BINS, SAMPLES, bounds, bushings, chain_of, problem, record};
use super::*;
use crate::DOF;
use crate::chain::Chain;
use crate::parameters::Bushings;
use crate::refine::structure::Structure;
use crate::sensors::Accelerometer;
use crate::sought::Sought;
use crate::spectrum::Measurement;
use crate::stream::{Record, Stage};

/// Parts of a record, of 26 bins each from 5.9 to 54.7 Hz.
const PARTS: usize = 4;
const PER_PART: usize = 26;
/// Records of noise.
const RECORDS: u64 = 200;
const GRAVITY: [f64; 3] = [0.3, -0.5, -9.8];

pub(in crate::refine) fn measurement(gravity: [f64; 3]) -> Measurement {
    Measurement {
        band_hz: [5.0, 55.0],
        accelerometer: Accelerometer::Strapdown,
        gravity,
        ..super::super::tests::measurement()
    }
}

/// A robot of two or three joints.
pub(in crate::refine) fn robot(joints: usize) -> (Chain, Bushings) {
    let axes = [Vector3::z_axis(), Vector3::y_axis(), Vector3::x_axis()];
    let all: std::vec::Vec<_> = [0.5, 0.9, 0.6].into_iter().zip(axes).take(joints).collect();
    (chain_of(&all), core::iter::repeat_n(bushings()[0], joints).collect())
}

/// A record along a path.
pub(in crate::refine) fn divided(chain: &Chain, measurement: &Measurement) -> Experiment<BINS> {
    let joints = chain.joints().len();
    let pose = |part: usize| {
        [0.4, -0.3, 0.7].into_iter().take(joints).map(|q| q + 0.01 * part as f64).collect()
    };
    let stage = |part| Stage { pose: pose(part), moves: 0.0, is_even: true };
    let record = Record {
        pose: pose(0),
        path: (0..PARTS).map(stage).collect(),
        ..record(&mut Xoshiro256PlusPlus::seed_from_u64(1))
    };
    let experiment = Experiment::new(chain, measurement, &record, &mut [0.0; SAMPLES]).unwrap();
    assert_eq!((experiment.path.len(), experiment.bins_of_part()), (PARTS, PER_PART));
    experiment
}

/// The record without a force, whose acceleration is white noise of the stated size.
pub(in crate::refine) fn noise(mut experiment: Experiment<BINS>, seed: u64) -> Experiment<BINS> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut uniform = || ((random.next_u64() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
    let Experiment { force, force_noise, acceleration, acceleration_noise, .. } = &mut experiment;
    force.re.iter_mut().chain(&mut force.im).flatten().for_each(|own| *own = 0.0);
    force_noise.iter_mut().flatten().for_each(|own| *own = 0.0);
    for axis in 0..3 {
        for (bin, mean_square) in acceleration_noise[axis].iter().enumerate() {
            let radius = libm::sqrt(-f64::from(*mean_square) * libm::log(uniform()));
            let angle = core::f64::consts::TAU * uniform();
            acceleration.re[axis][bin] = (radius * libm::cos(angle)) as f32;
            acceleration.im[axis][bin] = (radius * libm::sin(angle)) as f32;
        }
    }
    experiment
}

/// A problem without any unknown.
fn nothing_sought(chain: &Chain, bushings: &Bushings) -> Sought {
    let mut sought = Sought::parameters_of(chain);
    for (joint, own) in bushings.iter().enumerate() {
        for dof in 0..DOF {
            let stiffness = crate::sought::Coordinate::Stiffness { joint, dof };
            let damping = crate::sought::Coordinate::Damping { joint, dof };
            sought.fix(stiffness, own.stiffness[dof]).unwrap();
            sought.fix(damping, own.damping[dof]).unwrap();
        }
    }
    assert_eq!(sought.unknowns(), 0);
    sought
}

/// The structure of so many records of noise together, and the mean of χ² per degree of freedom of [`RECORDS`].
fn of_noise(joints: usize, together: u64) -> (Structure, f64) {
    let ((chain, bushings), measurement) = (robot(joints), measurement([0.0; 3]));
    let (bounds, sought) = (bounds(), nothing_sought(&chain, &bushings));
    let problem = problem(&chain, &measurement, &bounds, &sought);
    let plain = divided(&chain, &measurement);
    let mut refinement = Box::new(Refinement::new(&sought, &bushings));
    let mut structures = Structures::default();
    let [mut squares, mut degrees] = [0.0; 2];
    for seed in 0..RECORDS {
        let experiments = [noise(plain.clone(), seed)];
        let fit = refinement.fit(&problem, &experiments);
        (squares, degrees) = (squares + fit.sum_of_squares, degrees + fit.degrees_of_freedom);
        if seed < together {
            refinement.taken_by_seams(&problem, &experiments, None, &mut structures);
        }
    }
    (structures.structure(), squares / degrees)
}

/// A seam takes a sixth to a quarter of the residuals, and most of those of the lowest bins. 200 records have 100,000 degrees of freedom, so that
/// the mean is known to 0.5 %; 64 are as many as a fit has.
#[test]
fn noise_in_short_parts_has_no_structure() {
    for joints in [2, 3] {
        let (structure, consistency) = of_noise(joints, 64);
        assert!(!structure.is_there(), "{joints} joints: {structure:?}");
        assert!((consistency - 1.0).abs() < 0.02, "{joints} joints: {consistency}");
    }
}

fn dense(value: Complex<f64>) -> Dense<f64> {
    Dense::new(value.re, value.im)
}

/// `tr S (Sᵀ S + P)⁻¹ Sᵀ` of a part, by the covariance of each bin and the columns of the seam as the equations of the seam give them.
fn trace(
    problem: &Problem<'_>,
    model: &Model,
    experiment: &Experiment<BINS>,
    part: &Part<'_>,
) -> f64 {
    let (joints, unknowns) = (problem.chain.joints().len(), problem.seam_unknowns());
    let orders = unknowns / 3 - 4 * joints;
    let lowest = experiment.omega(part.bins.start);
    let mut information = DMatrix::<f64>::zeros(unknowns, unknowns);
    let mut square = 0.0;
    for bin in part.bins.clone() {
        let omega = experiment.omega(bin);
        let s = Dense::new(0.0, omega);
        let mut response = Response::new(0.0);
        response.evaluate(&model.terms, Complex::new(0.0, omega), &[Complex::zero(0.0); 3], None);
        let columns = DMatrix::from_fn(3, unknowns, |axis, column| {
            let (joint, own) = (column / (2 * DOF), column % (2 * DOF));
            if joint < joints {
                let load = dense(response.per_load[axis][joint][own % DOF]);
                return if own < DOF { load } else { load / s };
            }
            let (order, along) = ((column - 12 * joints) / 3, (column - 12 * joints) % 3);
            let jump = [Dense::from(1.0), s / lowest, Dense::from(lowest) / s][order];
            if along == axis { jump } else { Dense::from(0.0) }
        });
        let accelerance = Matrix3::from_fn(|row, push| dense(response.per_force[row][push]));
        let diagonal = |noise: &[heapless::Vec<f32, BINS>; 3]| {
            Matrix3::from_diagonal(&Vector3::from_fn(|axis, _| {
                Dense::from(f64::from(noise[axis][bin]))
            }))
        };
        let covariance = diagonal(&experiment.acceleration_noise)
            + accelerance * diagonal(&experiment.force_noise) * accelerance.adjoint();
        let inverse = covariance.try_inverse().unwrap();
        let inverse = DMatrix::from_fn(3, 3, |row, column| inverse[(row, column)]);
        information += (columns.adjoint() * inverse * &columns).map(|own| 2.0 * own.re);
        for axis in 0..3 {
            let [re, im] = [&experiment.acceleration.re, &experiment.acceleration.im]
                .map(|own| f64::from(own[axis][bin]));
            square += (re * re + im * im) / f64::from(experiment.acceleration_noise[axis][bin]);
        }
    }
    assert_eq!(orders, if problem.measurement.feels_gravity() { 3 } else { 2 });
    // The scale of each column is that of its unknown: with it, the inverse is no worse than that of a correlation matrix.
    let scale = information.diagonal().map(|own| 1.0 / own.sqrt());
    let scaled = DMatrix::from_fn(unknowns, unknowns, |row, column| {
        information[(row, column)] * scale[row] * scale[column]
    });
    let with_prior = &scaled
        + DMatrix::identity(unknowns, unknowns) * cost_of(square, experiment.divided as f64);
    (with_prior.try_inverse().unwrap() * scaled).trace()
}

/// Both are in double precision: they differ by their rounding, times the condition of a seam of 1e4.
#[test]
fn the_residuals_that_seams_take_are_the_trace_of_the_dense_projection() {
    for (joints, gravity) in [(2, [0.0; 3]), (3, [0.0; 3]), (2, GRAVITY), (3, GRAVITY)] {
        let ((chain, bushings), measurement) = (robot(joints), measurement(gravity));
        let (bounds, sought) = (bounds(), Sought::parameters_of(&chain));
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let experiment = divided(&chain, &measurement);
        let mut refinement = Box::new(Refinement::new(&sought, &bushings));
        let expected: f64 = experiment
            .parts()
            .map(|part| {
                let coordinates = &refinement.coordinates;
                let model = refinement.model_of(&problem, coordinates, None, &part, 0).unwrap();
                trace(&problem, &model, &experiment, &part)
            })
            .sum();
        let mut structures = Structures::default();
        let experiments = [experiment];
        let taken = refinement.taken_by_seams(&problem, &experiments, None, &mut structures);
        let most = (PARTS * problem.seam_unknowns()) as f64;
        assert!((taken / expected - 1.0).abs() < 1e-9, "{joints} joints: {taken}, not {expected}");
        assert!(taken < most, "{joints} joints: {taken} of {most}");
    }
}
