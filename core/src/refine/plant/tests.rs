//! The columns of the imperfections, against differences of the reading of a plant that has them.

use std::boxed::Box;

use nalgebra::{Complex as Dense, DMatrix, Matrix3, Rotation3, Vector3};
use proptest::array::{uniform3, uniform6};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::super::batch::Batch;
use super::super::model::Model;
use super::super::modelled;
use super::super::objective::{Domain as _, Objective as _};
use super::super::record::Workspace;
use super::super::seam::ORDERS;
use super::super::sum_of_squares::SumOfSquares;
use super::super::tests::{BINS, SAMPLES, bounds, bushings, chain, problem, record};
use super::super::{Outcome, Problem, Refinement};
use super::objective::OfPlant;
use super::*;
use crate::imperfection::Correction;
use crate::linear::gram::WIDEST;
use crate::mounting::Mounting;
use crate::parameters::MAX_PARAMETERS;
use crate::receptance::{Complex, PerDof, Response, receptance};
use crate::sensors::Accelerometer;
use crate::sought::Sought;
use crate::spectrum::{Experiment, Measurement, Site};
use crate::{DOF, MAX_JOINTS};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng as _;

pub(super) const POSE: [f64; 2] = [0.4, -0.3];
/// The robot feeds past the pose at these rates.
pub(super) const PASSING: Site<'_> = Site {
    pose: &POSE,
    rates: &[0.5, -0.3],
    point: Vector3::new(0.0, 0.0, 0.0),
    is_of_test: false,
};
pub(super) type Three = [Complex<f64>; 3];
/// Derivative of the reading by its drift.
const DRIFT: Three =
    [Complex { re: 3.0, im: -8.0 }, Complex { re: -20.0, im: 1.0 }, Complex { re: 5.0, im: 13.0 }];

pub(super) fn measurement(
    places: &[[f64; 3]; 4],
    tool_mass: f64,
    gravity: [f64; 3],
) -> Measurement {
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
    let coordinates = &plant.point.coordinates;
    let all = plant.imperfections.all.iter().zip(values);
    let all = all.map(|(&(imperfection, deviation), value)| (imperfection, value * deviation));
    let imperfect = imperfect::Imperfect::new(problem, coordinates, all, PASSING, 0);
    let bushings = bushings();
    imperfect.model(&imperfect.linearise(problem, &bushings).unwrap(), &bushings).unwrap()
}

/// The response of a model to a measured force at `s`, in its force filter and its gains, and the batch of this one bin.
pub(super) fn evaluated(
    model: &Model,
    s: Complex<f64>,
    raw: &Three,
    seam: &PerDof<f64>,
) -> (Response<f64>, Batch<f64>) {
    let inverse = model.force_filter.inverse(s);
    let gain = model.force_gain;
    let force = core::array::from_fn(|axis| (raw[axis] * inverse).scale(1.0 / gain[axis]));
    let mut response = Response::new(0.0);
    response.evaluate(&model.terms, s, &force, Some(seam));
    let inverse_s = Complex { re: 0.0, im: -1.0 / s.im };
    (response, Batch { s, inverse_s, force, drift: DRIFT, powers: [[1.0; ORDERS]; WIDEST] })
}

/// The reading of a model in its force filter and its gains.
pub(super) fn reading(model: &Model, s: Complex<f64>, raw: &Three, seam: &PerDof<f64>) -> Three {
    let reading = evaluated(model, s, raw, seam).0.observed;
    core::array::from_fn(|axis| reading[axis] + DRIFT[axis].scale(model.drift))
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(3), ..ProptestConfig::with_cases(24) })]

    /// A robot with a hose of impedance h, whose receptance without it is H, moves as one without it under the force `(1 + h H)⁻¹ F`.
    #[test]
    fn a_hose_takes_a_part_of_the_force(
        omega in 40.0_f64..800.0,
        raw in uniform6(-100.0_f64..100.0),
        [k, d] in [0.0_f64..1e6, 0.0_f64..1e3],
        gravity in prop_oneof![Just([0.0; 3]), Just([0.3, -0.5, -9.8])],
    ) {
        let measurement = measurement(&[[0.0; 3]; 4], 0.0, gravity);
        let (chain, bounds) = (chain(), bounds());
        let sought = Sought::new(2).unwrap();
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let raw: Three = core::array::from_fn(|axis| Complex { re: raw[axis], im: raw[3 + axis] });
        let s = Complex { re: 0.0, im: omega };
        let seam = [[Complex::zero(0.0); DOF]; MAX_JOINTS];
        let mut plant = plant();
        plant.imperfections.all = imperfection::all(&Accuracies::typical(), &chain.kinds(), 2);
        plant.point.coordinates = sought.coordinates(&bushings());
        let with = |k: f64, d: f64| {
            let own = plant.imperfections.all.iter().map(|(imperfection, unit)| match imperfection {
                Imperfection::Hose => k / unit,
                Imperfection::HoseDamping => d / unit,
                _ => 0.0,
            });
            of_plant(&problem, &plant, &own.collect::<std::vec::Vec<f64>>())
        };
        let without = with(0.0, 0.0);
        let [xx, yx, yy, zx, zy, zz] = receptance(&without.terms, s).map(|own| Dense::new(own.re, own.im));
        let h = Matrix3::new(xx, yx, zx, yx, yy, zy, zx, zy, zz) * Dense::new(k, omega * d);
        let force = Vector3::from(raw.map(|own| Dense::new(own.re, own.im)));
        let left = (Matrix3::identity() + h).try_inverse().unwrap() * force;
        let left: Three = core::array::from_fn(|axis| Complex { re: left[axis].re, im: left[axis].im });
        let (found, expected) = (reading(&with(k, d), s, &raw, &seam), reading(&without, s, &left, &seam));
        let size = |all: &Three| all.iter().map(|a| libm::hypot(a.re, a.im)).fold(0.0, f64::max);
        let gap: Three = core::array::from_fn(|axis| found[axis] - expected[axis]);
        prop_assert!(size(&gap) < 1e-9 * size(&expected), "{found:?} {expected:?}");
    }
}

/// Of all imperfections, high-passes and those of the ground and of hoses alone have an end, which is zero.
#[test]
fn what_is_positive_has_an_end() {
    let (chain, bounds) = (chain(), bounds());
    let sought = Sought::new(2).unwrap();
    let measurement = measurement(&[[0.0; 3]; 4], 0.0, [0.0; 3]);
    let problem = problem(&chain, &measurement, &bounds, &sought);
    let mut plant = plant();
    let all = plant.imperfections.all.clone();
    plant.point.coordinates = sought.coordinates(&bushings());
    plant.point.imperfections[..all.len()].fill(0.3);
    let room = domain::PlantDomain::new(&problem, &all).room(&plant.point);
    for ((imperfection, _), [least, most]) in all.iter().zip(room) {
        use Imperfection::{Ground, GroundDamping, HighPass, Hose, HoseDamping};
        let has_end =
            matches!(imperfection, HighPass(_) | Ground(_) | GroundDamping(_) | Hose | HoseDamping);
        let expected = if has_end { -0.3 } else { f64::NEG_INFINITY };
        assert_eq!([least, most], [expected, f64::INFINITY], "{imperfection:?}");
    }
}

/// All imperfections at `away`, in their standard deviations, but those that are positive clear of zero.
pub(super) fn inside(all: &[(Imperfection, f64)], away: f64) -> [f64; MAX_IMPERFECTIONS] {
    let mut values = [0.0; MAX_IMPERFECTIONS];
    for (value, (imperfection, _)) in values.iter_mut().zip(all) {
        *value = if imperfection.is_positive() { away.abs().max(0.5) } else { away };
    }
    values
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(2), ..ProptestConfig::with_cases(24) })]

    /// At the model and away from it, in a record with a seam. Under gravity only of what leaves the links in their places, since the
    /// derivatives leave out what gravity adds to the stiffness. [`sag`] has a test of what they leave out through the sag.
    #[test]
    fn columns_equal_differences_of_the_plant(
        places in proptest::array::uniform4(uniform3(-0.5_f64..0.5)),
        tool_mass in prop_oneof![Just(0.0), Just(30.0)],
        omega in 40.0_f64..800.0,
        raw in uniform6(-100.0_f64..100.0),
        away in prop_oneof![Just(0.0), -2.0_f64..2.0],
        load in -30.0_f64..30.0,
        gravity in prop_oneof![Just([0.0; 3]), Just([0.3, -0.5, -9.8])],
    ) {
        let measurement = measurement(&places, tool_mass, gravity);
        let (chain, bounds) = (chain(), bounds());
        let sought = Sought::new(2).unwrap();
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let raw: Three = core::array::from_fn(|axis| Complex { re: raw[axis], im: raw[3 + axis] });
        let s = Complex { re: 0.0, im: omega };
        let seam = [[Complex { re: load, im: -0.3 * load }; DOF]; MAX_JOINTS];

        let mut plant = plant();
        plant.imperfections.all = imperfection::all(&Accuracies::typical(), &chain.kinds(), 2);
        plant.imperfections.all.extend(imperfection::of_low_pass(1e-3));
        let count = plant.imperfections.all.len();
        plant.point.coordinates = sought.coordinates(&bushings());
        let standing = inside(&plant.imperfections.all, away);
        plant.point.imperfections = standing;
        let model = plant.imperfections.prepare(&problem, &plant.point, PASSING, 0).unwrap();
        let (response, batch) = evaluated(&model, s, &raw, &seam);
        let mut rows = [[[0.0; MAX_IMPERFECTIONS]; 6]];
        plant.imperfections.columns().write(&mut rows, (0, &sought), &response, &model, &batch, &seam);

        let size = |all: &Three| all.iter().map(|a| libm::hypot(a.re, a.im)).fold(0.0, f64::max);
        for index in 0..count {
            let imperfection = plant.imperfections.all[index].0;
            let is_of_place = imperfection.is_of_model()
                && !matches!(imperfection, Imperfection::Load | Imperfection::RecordStiffness(_));
            if gravity != [0.0; 3] && is_of_place {
                continue;
            }
            let by = 1e-3;
            let beside = |by: f64| {
                let mut values = standing;
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
            prop_assert!(size(&gap) <= allowed, "{imperfection:?}: {gap:?} of {numeric:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(5), ..ProptestConfig::with_cases(4) })]

    /// The slope of the sum of squares that a step lowers, under gravity, whatever error of the model the weights allow for, and
    /// however many bins count.
    #[test]
    fn the_gradient_equals_finite_differences(
        seed in 0_u64..1000,
        places in proptest::array::uniform4(uniform3(-0.3_f64..0.3)),
        tool_mass in prop_oneof![Just(0.0), Just(30.0)],
        relative_error in prop_oneof![Just(0.0), Just(0.05)],
        every in 1..4_usize,
    ) {
        // The normal equations are too large for the stack of a test.
        on_large_stack(move || check_gradient(seed, &places, tool_mass, relative_error, every))?;
    }
}

fn check_gradient(
    seed: u64,
    places: &[[f64; 3]; 4],
    tool_mass: f64,
    relative_error: f64,
    every: usize,
) -> Result<(), TestCaseError> {
    let measurement = measurement(places, tool_mass, [0.3, -0.5, -9.8]);
    let (chain, bounds) = (chain(), bounds());
    let mut sought = Sought::new(2).unwrap();
    sought.seek("delay_s", 1e-3).unwrap();
    sought.seek("link_mass", 0.02).unwrap();
    let problem = problem(&chain, &measurement, &bounds, &sought);
    let mut record = record(&mut Xoshiro256PlusPlus::seed_from_u64(seed));
    // Beside clear readings the prior of the seam, whose derivative is left out, counts for little.
    for noise in record.force_noise.iter_mut().chain(&mut record.acceleration_noise) {
        *noise *= 0.01;
    }
    let experiment = Experiment::<BINS>::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]);
    let experiments = [experiment.unwrap()];
    let mut plant = Box::new(Plant::new(&Accuracies::typical(), &chain));
    plant.point.coordinates = sought.coordinates(&bushings());
    plant.point.imperfections = inside(&plant.imperfections.all, 0.0);
    let point = plant.point;
    let mut workspace = Workspace::new();
    let Plant { imperfections, record, summary, factor: normal, .. } = &mut *plant;
    let count = imperfections.all.len();
    let workspace = &mut workspace;
    let fitted = OfPlant { retired: None, workspace, imperfections, record, summary };
    let (problem, experiments) = (&problem, &experiments);
    let mut objective = SumOfSquares { problem, experiments, fitted, relative_error, every };
    let standing = objective.cost(&point);
    objective.linearise(&point, normal).unwrap();
    prop_assert!((normal.sum_of_squares() / standing - 1.0).abs() < 1e-9);
    let of_sought = count + sought.first_imperfection();
    for index in (0..count).chain(of_sought..of_sought + 3) {
        let mut beside = |by: f64| {
            let mut point = point;
            match index.checked_sub(of_sought) {
                None => point.imperfections[index] += by,
                Some(place) => point.coordinates[MAX_PARAMETERS + place] += by,
            }
            objective.cost(&point)
        };
        let step = 0.01;
        let numeric = (beside(step) - beside(-step)) / (2.0 * step);
        let ours = -2.0 * normal.right()[index];
        let size = libm::sqrt(normal.row(index)[index] * standing);
        prop_assert!((ours - numeric).abs() < 5e-3 * size, "{index}: {ours} {numeric}, of {size}");
    }
    Ok(())
}

/// A plant of typical accuracies. It is too large for the stack of a test until it is in its box.
pub(super) fn plant() -> Box<Plant> {
    on_large_stack(|| Box::new(Plant::new(&Accuracies::typical(), &chain())))
}

pub(super) fn on_large_stack<T: Send + 'static>(run: impl FnOnce() -> T + Send + 'static) -> T {
    std::thread::Builder::new().stack_size(16 << 20).spawn(run).unwrap().join().unwrap()
}

/// The acceleration that the model reads, and white noise of one part in a hundred thousand of the mean square.
pub(super) fn noisy(
    mut experiment: Experiment<BINS>,
    model: &Model,
    random: &mut Xoshiro256PlusPlus,
) -> Experiment<BINS> {
    let mut response = Response::new(0.0);
    let bins = experiment.force.re[0].len();
    for bin in 0..bins {
        let omega = (experiment.first_bin + bin) as f64 * experiment.spacing;
        let force = core::array::from_fn(|axis| Complex {
            re: f64::from(experiment.force.re[axis][bin]),
            im: f64::from(experiment.force.im[axis][bin]),
        });
        response.evaluate(&model.terms, Complex { re: 0.0, im: omega }, &force, None);
        for axis in 0..3 {
            experiment.acceleration.re[axis][bin] = response.observed[axis].re as f32;
            experiment.acceleration.im[axis][bin] = response.observed[axis].im as f32;
        }
    }
    let Experiment { acceleration, acceleration_noise, force_noise, .. } = &mut experiment;
    for axis in 0..3 {
        let parts = || acceleration.re[axis].iter().chain(&acceleration.im[axis]);
        let power = 1e-5 * parts().map(|part| part * part).sum::<f32>() / bins as f32;
        acceleration_noise[axis].fill(power);
        force_noise[axis].fill(1e-9 * power);
        for part in acceleration.re[axis].iter_mut().chain(&mut acceleration.im[axis]) {
            // Uniform of unit variance.
            let uniform = 12_f32.sqrt() * (random.next_u32() as f32 / u32::MAX as f32 - 0.5);
            *part += (0.5 * power).sqrt() * uniform;
        }
    }
    experiment
}

/// Under white noise the scatter between blocks is that of the noise. The structure widens both by what it adds to a compliance.
#[test]
fn the_jackknife_agrees_with_the_noise() {
    let ratio = on_large_stack(|| {
        let measurement = measurement(&[[0.0; 3]; 4], 0.0, [0.0; 3]);
        let (chain, bounds) = (chain(), bounds());
        let sought = Sought::new(2).unwrap();
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut experiments = [POSE, [-0.5, 0.6]].map(|pose| {
            let record = record(&mut random);
            let experiment =
                Experiment::<BINS>::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]);
            let mut experiment = experiment.unwrap();
            experiment.path[0].pose = pose.into_iter().collect();
            experiment.pose.clone_from(&experiment.path[0].pose);
            let model =
                modelled::perfect(&problem, &sought.coordinates(&bushings()), Site::tcp(&pose))
                    .unwrap();
            noisy(experiment, &model, &mut random)
        });
        let accuracies =
            Accuracies { delay: 1e-6, structure_rotation: 1e-9, ..Accuracies::default() };
        let mut plant = Box::new(Plant::new(&accuracies, &chain));
        let mut refinement = Box::new(Refinement::new(&sought, &bushings()));
        refinement.restart_plant(&mut plant, 2, false);
        while refinement.step_plant(&problem, &mut experiments, &mut plant) == Outcome::Improving {}
        let (fit, _) = refinement.fit_plant(&problem, &experiments, &mut plant).unwrap();
        let mut widened = fit.clone();
        let found = refinement.bushings(&sought);
        plant.widen_by_structure(&mut widened, &sought, &found, 1.0);
        for unknown in 0..24 {
            // The first joint stands on the ground.
            let is_on_link = unknown >= 12 && unknown % 6 >= 3;
            let relative =
                if is_on_link { 1e-9 * found[unknown / 12].stiffness[unknown % 6] } else { 0.0 };
            let times = if unknown % 12 < 6 { 1.0 } else { 2.0 };
            let own = fit.covariance.deviation(unknown);
            let expected = libm::hypot(own, times * relative);
            let deviation = widened.covariance.deviation(unknown);
            assert!(own.is_infinite() || (deviation / expected - 1.0).abs() < 1e-9, "{unknown}");
        }
        let robust = refinement.jackknife_plant(&problem, &experiments, &mut plant, 1.0).unwrap();
        let inflation = libm::sqrt(fit.sum_of_squares / fit.degrees_of_freedom);
        let determined = (0..24).filter(|&i| fit.covariance.deviation(i) < 0.3);
        let logs =
            determined.map(|i| libm::log(robust[i] / fit.covariance.deviation(i) / inflation));
        let logs: std::vec::Vec<f64> = logs.collect();
        assert!(logs.len() > 8, "{}", logs.len());
        libm::exp(logs.iter().sum::<f64>() / logs.len() as f64)
    });
    assert!((0.8..1.6).contains(&ratio), "{ratio}");
}

/// Standard deviation of the logarithm of each parameter, by the scatter between blocks of N copies of one record.
fn scatter_of_copies<const N: usize>(accuracies: Accuracies) -> [f64; 24] {
    on_large_stack(move || {
        let measurement = measurement(&[[0.0; 3]; 4], 0.0, [0.0; 3]);
        let (chain, bounds) = (chain(), bounds());
        let sought = Sought::new(2).unwrap();
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
        let record = record(&mut random);
        let one = Experiment::<BINS>::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]);
        let model = modelled::perfect(&problem, &sought.coordinates(&bushings()), Site::tcp(&POSE))
            .unwrap();
        let one = noisy(one.unwrap(), &model, &mut random);
        let mut experiments: [_; N] = core::array::from_fn(|_| one.clone());
        let mut plant = Box::new(Plant::new(&accuracies, &chain));
        let mut refinement = Box::new(Refinement::new(&sought, &bushings()));
        refinement.restart_plant(&mut plant, N, false);
        while refinement.step_plant(&problem, &mut experiments, &mut plant) == Outcome::Improving {}
        refinement.fit_plant(&problem, &experiments, &mut plant).unwrap();
        let all = refinement.jackknife_plant(&problem, &experiments, &mut plant, 1.0).unwrap();
        core::array::from_fn(|unknown| all[unknown])
    })
}

/// A record that is given three times says no more than once: its blocks are those of one pose. Each is left out of all copies.
#[test]
fn copies_of_a_record_are_one_cluster() {
    let accuracies = Accuracies { delay: 1e-2, ..Accuracies::default() };
    let [once, thrice] = [scatter_of_copies::<1>(accuracies), scatter_of_copies::<3>(accuracies)];
    let mut compared = 0;
    for (once, thrice) in once.iter().zip(&thrice).filter(|(once, _)| **once < 0.3) {
        assert!((thrice / once - 1.0).abs() < 0.02, "{thrice} of {once}");
        compared += 1;
    }
    assert!(compared > 8, "{compared}");
}

/// What priors add to the variances, against a dense inverse.
#[test]
fn the_variances_of_priors_are_those_of_a_dense_inverse() {
    let mut plant = plant();
    let (count, total) = (plant.imperfections.all.len(), plant.imperfections.all.len() + 24);
    let mut random = Xoshiro256PlusPlus::seed_from_u64(6);
    let uniform = |_, _| 2.0 * f64::from(random.next_u32()) / f64::from(u32::MAX) - 1.0;
    let jacobian = DMatrix::from_fn(3 * total, total, uniform);
    let mut n = jacobian.transpose() * &jacobian;
    for i in 0..count {
        n[(i, i)] += 1.0;
    }
    plant.minimiser.normal.reset(total);
    for i in 0..total {
        for j in 0..=i {
            *plant.minimiser.normal.entry(i, j) = n[(i, j)];
        }
    }
    plant.determine();
    let variances = plant.variances_of_priors();
    let inverse = n.try_inverse().unwrap();
    for i in 0..total {
        let expected: f64 = (0..count).map(|k| inverse[(i, k)] * inverse[(i, k)]).sum();
        assert!((variances[i] / expected - 1.0).abs() < 1e-4, "{} for {expected}", variances[i]);
    }
}

/// A model that was corrected by the imperfections of a plant leaves the sum of squares of that plant, without their priors.
#[test]
fn a_corrected_model_is_that_of_the_plant() {
    let [of_plant, corrected, perfect] = on_large_stack(|| {
        let measurement = measurement(&[[0.0; 3]; 4], 0.0, [0.3, -0.5, -9.8]);
        let (chain, bounds) = (chain(), bounds());
        let sought = Sought::new(2).unwrap();
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let mut random = Xoshiro256PlusPlus::seed_from_u64(4);
        let experiments = [0, 1].map(|_| {
            let record = record(&mut random);
            Experiment::<BINS>::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]).unwrap()
        });
        let mut plant = Box::new(Plant::new(&Accuracies::typical(), &chain));
        let mut refinement = Box::new(Refinement::new(&sought, &bushings()));
        refinement.restart_plant(&mut plant, 2, false);
        let count = plant.imperfections.all.len();
        for (index, value) in plant.point.imperfections[..count].iter_mut().enumerate() {
            *value = if index % 3 == 0 { -1.5 } else { 0.7 };
        }
        let point = plant.point;
        let mut workspace = Workspace::new();
        let Plant { imperfections, record, summary, .. } = &mut *plant;
        let workspace = &mut workspace;
        let fitted = OfPlant { retired: None, workspace, imperfections, record, summary };
        let (problem, experiments) = (&problem, &experiments);
        let mut objective =
            SumOfSquares { problem, experiments, fitted, relative_error: 0.0, every: 1 };
        let priors: f64 = point.imperfections[..count].iter().map(|value| value * value).sum();
        let of_plant = objective.cost(&point) - priors;
        refinement.set_correction(&plant.correction());
        refinement.restart_at(&plant.coordinates());
        let corrected = refinement.fit(problem, experiments).objective;
        refinement.set_correction(&Correction::NONE);
        [of_plant, corrected, refinement.fit(problem, experiments).objective]
    });
    assert!((corrected / of_plant - 1.0).abs() < 1e-9, "{corrected} of {of_plant}");
    assert!((perfect / of_plant - 1.0).abs() > 1e-3, "{perfect} of {of_plant}");
}
