//! The columns of the imperfections, against differences of the reading of a plant that has them.

use nalgebra::{Rotation3, Vector3};
use proptest::array::{uniform3, uniform6};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::super::Problem;
use super::super::batch::Batch;
use super::super::further::Further as _;
use super::super::model::Model;
use super::super::objective::Objective as _;
use super::super::record::Workspace;
use super::super::retired::RetiredInformation;
use super::super::seam::ORDERS;
use super::super::tests::{BINS, SAMPLES, bounds, bushings, chain, problem, record};
use super::objective::PlantSumOfSquares;
use super::*;
use crate::linear::gram::WIDEST;
use crate::mounting::Mounting;
use crate::receptance::{Complex, PerDof, Response};
use crate::sensors::Accelerometer;
use crate::sought::Sought;
use crate::spectrum::{Experiment, Measurement};
use crate::{DOF, MAX_JOINTS};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng as _;

const POSE: [f64; 2] = [0.4, -0.3];
type Three = [Complex<f64>; 3];

fn measurement(places: &[[f64; 3]; 4], tool_mass: f64, gravity: [f64; 3]) -> Measurement {
    let [accelerometer, accelerometer_turn, force_turn, tool_centre] = places.map(Vector3::from);
    Measurement {
        band_hz: [5.0, 60.0],
        gravity,
        accelerometer: Accelerometer::Strapdown,
        mounting: Mounting {
            accelerometer,
            accelerometer_axes: Rotation3::new(accelerometer_turn),
            force_axes: Rotation3::new(force_turn),
            tool_mass,
            tool_centre,
        },
    }
}

/// The model of a plant with these imperfections, each in its standard deviation.
fn of_plant(problem: &Problem<'_>, plant: &Plant, values: &[f64]) -> Model {
    let calibration = problem.sought.calibration(&plant.point.coordinates);
    let mut imperfect = imperfect::Imperfect::new(problem, &calibration, &POSE);
    for (&(imperfection, deviation), value) in plant.imperfections.all.iter().zip(values) {
        imperfect.add(imperfection, value * deviation);
    }
    let bushings = bushings();
    let linear = imperfect.linearise(problem, &bushings).unwrap();
    imperfect.model(problem, &linear, &bushings).unwrap()
}

/// The reading of a model in its force filter and its gains.
fn reading(model: &Model, s: Complex<f64>, raw: &Three, seam: &PerDof<f64>) -> Three {
    let inverse = model.force_filter.inverse(s);
    let gain = model.calibration.force_gain;
    let force = core::array::from_fn(|axis| (raw[axis] * inverse).scale(1.0 / gain[axis]));
    let mut response = Response::new(0.0);
    response.evaluate(&model.terms, s, &force, Some(seam));
    response.observed
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(2), ..ProptestConfig::with_cases(24) })]

    /// At the model and away from it, in a record with a seam. Without gravity, whose stiffness the derivatives leave out.
    #[test]
    fn columns_equal_differences_of_the_plant(
        places in proptest::array::uniform4(uniform3(-0.5_f64..0.5)),
        tool_mass in prop_oneof![Just(0.0), Just(30.0)],
        omega in 40.0_f64..800.0,
        raw in uniform6(-100.0_f64..100.0),
        away in prop_oneof![Just(0.0), -2.0_f64..2.0],
        load in -30.0_f64..30.0,
    ) {
        let measurement = measurement(&places, tool_mass, [0.0; 3]);
        let (chain, bounds) = (chain(), bounds());
        let sought = Sought::new(2, &Default::default()).unwrap();
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let raw: Three = core::array::from_fn(|axis| Complex { re: raw[axis], im: raw[3 + axis] });
        let s = Complex { re: 0.0, im: omega };
        let seam = [[Complex { re: load, im: -0.3 * load }; DOF]; MAX_JOINTS];

        let mut plant = Plant::new(&Accuracies::typical(), 2);
        let count = plant.imperfections.all.len();
        plant.point.coordinates = sought.coordinates(&bushings());
        plant.point.imperfections[..count].fill(away);
        let model = objective::prepare(&problem, &plant.point, &mut plant.imperfections, &POSE).unwrap();
        let inverse = model.force_filter.inverse(s);
        let gain = model.calibration.force_gain;
        let force = core::array::from_fn(|axis| (raw[axis] * inverse).scale(1.0 / gain[axis]));
        let mut response = Response::new(0.0);
        response.evaluate(&model.terms, s, &force, Some(&seam));
        let inverse_s = Complex { re: 0.0, im: -1.0 / omega };
        let batch = Batch { s, inverse_s, force, powers: [[1.0; ORDERS]; WIDEST] };
        let mut rows = [[[0.0; MAX_IMPERFECTIONS]; 6]];
        (&plant.imperfections).write(&mut rows, 0, &response, &model, &batch, &seam);

        let size = |all: &Three| all.iter().map(|a| libm::hypot(a.re, a.im)).fold(0.0, f64::max);
        for index in 0..count {
            let by = 1e-3;
            let beside = |by: f64| {
                let mut values = [away; MAX_IMPERFECTIONS];
                values[index] += by;
                reading(&of_plant(&problem, &plant, &values), s, &raw, &seam)
            };
            let (plus, minus) = (beside(by), beside(-by));
            let numeric: Three = core::array::from_fn(|axis| (plus[axis] - minus[axis]).scale(0.5 / by));
            let gap: Three = core::array::from_fn(|axis| Complex {
                re: rows[0][2 * axis][index] - numeric[axis].re,
                im: rows[0][2 * axis + 1][index] - numeric[axis].im,
            });
            let allowed = 1e-3 * size(&numeric) + 1e-8 * size(&response.observed);
            let imperfection = plant.imperfections.all[index].0;
            prop_assert!(size(&gap) <= allowed, "{imperfection:?}: {gap:?} of {numeric:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(5), ..ProptestConfig::with_cases(4) })]

    /// The slope of the sum of squares that a step lowers, under gravity.
    #[test]
    fn the_gradient_equals_finite_differences(
        seed in 0_u64..1000,
        places in proptest::array::uniform4(uniform3(-0.3_f64..0.3)),
        tool_mass in prop_oneof![Just(0.0), Just(30.0)],
    ) {
        let measurement = measurement(&places, tool_mass, [0.3, -0.5, -9.8]);
        let (chain, bounds) = (chain(), bounds());
        let sought = Sought::new(2, &Default::default()).unwrap();
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let record = record(&mut Xoshiro256PlusPlus::seed_from_u64(seed));
        let experiment = Experiment::<BINS>::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]);
        let experiments = [experiment.unwrap()];
        let mut plant = Plant::new(&Accuracies::typical(), 2);
        plant.point.coordinates = sought.coordinates(&bushings());
        let point = plant.point;
        let (retired, mut workspace) = (RetiredInformation::none(sought.unknowns()), Workspace::new());
        let Plant { imperfections, record, summary, factor: normal, .. } = &mut plant;
        let count = imperfections.all.len();
        let mut objective = PlantSumOfSquares {
            problem: &problem,
            experiments: &experiments,
            retired: &retired,
            workspace: &mut workspace,
            imperfections,
            record,
            others: &mut Normal::new(),
            summary,
        };
        let standing = objective.cost(&point);
        objective.linearise(&point, normal).unwrap();
        prop_assert!((normal.sum_of_squares() / standing - 1.0).abs() < 1e-9);
        for index in 0..count {
            let mut beside = |by: f64| {
                let mut point = point;
                point.imperfections[index] += by;
                objective.cost(&point)
            };
            let step = 0.05;
            let numeric = (beside(step) - beside(-step)) / (2.0 * step);
            let ours = -2.0 * normal.right()[index];
            let size = libm::sqrt(normal.row(index)[index] * standing);
            prop_assert!((ours - numeric).abs() < 1e-2 * size, "{index}: {ours} {numeric}, of {size}");
        }
    }
}
