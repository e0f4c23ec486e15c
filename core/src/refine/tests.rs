//! The gradient that the steps follow, against central differences of the sum of squares that they lower.
//!
//! It is checked where it is hard: beside a minimum, so that the residuals are large; with as much noise in the force as
//! in the acceleration, so that the weights move with the parameters; and with the seam found anew at every point.

pub(crate) mod divided;
mod slow;

use fearless_simd::Level;
use nalgebra::{Isometry3, Matrix3, Rotation3, Unit, Vector3};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng as _;

use super::objective::Objective as _;
use super::*;
use crate::chain::{Chain, Joint, JointKind, Link};
use crate::linear::normal::Normal;
use crate::mounting::Mounting;
use crate::parameters::{Bounds, Bushing};
use crate::receptance::{Complex, Response};
use crate::search::MAX_EXPERIMENTS;
use crate::sensors::Accelerometer;
use crate::sought::Coordinate;
use crate::spectrum::Measurement;
use crate::statics::{Gauge, Reading, StaticTest};
use crate::stream::Record;

pub(crate) const SAMPLES: usize = 1024;
pub(crate) const BINS: usize = 128;

/// Two joints.
pub(crate) fn chain() -> Chain {
    chain_of(&[(0.5, Vector3::z_axis()), (0.9, Vector3::y_axis())])
}

/// A joint a pair: the larger its number, the longer and heavier.
pub(super) fn chain_of(joints: &[(f64, Unit<Vector3<f64>>)]) -> Chain {
    let joint = |x: f64, axis| Joint {
        origin: Isometry3::new(Vector3::new(x, 0.3, -0.2), Vector3::new(0.4, x, -0.7)),
        axis,
        kind: JointKind::Revolute,
        link: Link {
            mass: 300.0 * x,
            centre_of_mass: Vector3::new(0.2, -0.1, x),
            inertia: Matrix3::from_diagonal(&Vector3::new(30.0, 40.0, 25.0)),
        },
    };
    let joints: std::vec::Vec<_> = joints.iter().map(|(x, axis)| joint(*x, *axis)).collect();
    Chain::new(&joints, Isometry3::translation(0.4, 0.1, 0.2)).unwrap()
}

/// At the TCP, without gravity.
pub(crate) fn measurement() -> Measurement {
    Measurement {
        band_hz: [5.0, 60.0],
        gravity: [0.0; 3],
        accelerometer: Accelerometer::Strapdown,
        mounting: Mounting::default(),
    }
}

/// Its bushings, both alike.
pub(crate) fn bushings() -> Bushings {
    let bushing = Bushing {
        stiffness: [2e7, 3e7, 1e7, 5e6, 2e6, 4e6],
        damping: [2e4, 1e4, 3e4, 4e3, 5e3, 1e3],
    };
    [bushing; 2].into_iter().collect()
}

/// The force sensor's noise, seen through the robot, is about that of the accelerometer.
pub(crate) fn record(random: &mut Xoshiro256PlusPlus) -> Record<SAMPLES> {
    let mut noise = |size: f32| {
        let mut uniform = |_| size * (random.next_u32() as f32 / u32::MAX as f32 - 0.5);
        core::array::from_fn(|_| (0..SAMPLES).map(&mut uniform).collect())
    };
    Record {
        start_s: 0.0,
        pose: [0.4, -0.3].into_iter().collect(),
        path: Default::default(),
        since_s: 0.0,
        rate_hz: 500.0,
        force: noise(400.0),
        acceleration: noise(2.0),
        force_noise: [20.0; 3],
        acceleration_noise: [0.05; 3],
        force_noise_shape: Default::default(),
        acceleration_noise_shape: Default::default(),
        has_doubtful_rate: false,
        starts_at_rest: true,
        point: [0.0; 3],
    }
}

/// The record of an accelerometer that lacks this axis, if there is such an axis.
fn without(mut record: Record<SAMPLES>, axis: usize) -> Record<SAMPLES> {
    if axis < 3 {
        record.acceleration[axis].fill(0.0);
        record.acceleration_noise[axis] = f32::INFINITY;
    }
    record
}

/// The experiment with the reading of a robot whose bushings are so many times stiffer, and sensors of a hundredth of the noise. The prior of
/// the seam, whose derivative is left out, then counts for nothing; it would where the seam had to explain a reading of noise alone.
fn explained(
    mut experiment: Experiment<BINS>,
    problem: &Problem<'_>,
    times: f64,
) -> Experiment<BINS> {
    let mut stiffer = bushings();
    stiffer.iter_mut().flat_map(|own| &mut own.stiffness).for_each(|stiffness| *stiffness *= times);
    let coordinates = problem.sought.coordinates(&stiffer);
    let model = modelled::perfect(problem, &coordinates, experiment.site()).unwrap();
    let mut response = Response::new(0.0);
    let Experiment { force_noise, acceleration_noise, .. } = &mut experiment;
    for noise in force_noise.iter_mut().chain(acceleration_noise).flatten() {
        *noise *= 1e-4;
    }
    let Experiment { force, acceleration, first_bin, spacing, .. } = &mut experiment;
    for bin in 0..force.re[0].len() {
        let omega = (*first_bin + bin) as f64 * *spacing;
        let force = core::array::from_fn(|axis| Complex {
            re: f64::from(force.re[axis][bin]),
            im: f64::from(force.im[axis][bin]),
        });
        response.evaluate(&model.terms, Complex { re: 0.0, im: omega }, &force, None);
        for (axis, read) in response.observed.iter().enumerate() {
            let own = [&mut acceleration.re[axis][bin], &mut acceleration.im[axis][bin]];
            for (own, read) in own.into_iter().zip([read.re, read.im]) {
                *own = 2.5e-4 * *own + read as f32;
            }
        }
    }
    experiment
}

pub(crate) fn bounds() -> Bounds {
    Bounds::new([1e6, 1e9], [1e5, 1e8], [1e3, 1e6], [1e2, 1e5]).unwrap()
}

/// Without static tests.
pub(crate) fn problem<'a>(
    chain: &'a Chain,
    measurement: &'a Measurement,
    bounds: &'a Bounds,
    sought: &'a Sought,
) -> Problem<'a> {
    Problem { chain, measurement, bounds, sought, statics: &[], level: Level::new() }
}

pub(crate) fn sought() -> Sought {
    let mut sought = Sought::new(2).unwrap();
    for (key, prior) in [
        ("delay_s", 1e-3),
        ("acceleration_gain", 0.1),
        ("force_gain", 0.1),
        ("accelerometer_angle_rad", 0.1),
        ("link_mass", 0.1),
    ] {
        sought.seek(key, prior).unwrap();
    }
    let stiffness = |dof| Coordinate::Stiffness { joint: 0, dof };
    sought.tie(stiffness(1), stiffness(0)).unwrap();
    sought.fix(Coordinate::Damping { joint: 1, dof: 2 }, 8e3).unwrap();
    sought
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::with_cases(12) })]

    #[test]
    fn the_gradient_equals_finite_differences(
        seed in 0_u64..1000, tool_mass in prop_oneof![Just(0.0), Just(30.0)], every in 1..3_usize,
        point in prop_oneof![Just([0.0; 3]), Just([0.1, -0.3, 0.2])], absent in 0..6_usize,
    ) {
        const STEP: f64 = 3e-4;
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let chain = chain();
        let measurement = Measurement {
            band_hz: [5.0, 60.0],
            // Its share in the derivatives of the masses is left out.
            gravity: [0.0; 3],
            accelerometer: Accelerometer::Strapdown,
            mounting: Mounting {
                accelerometer: Vector3::new(0.1, -0.2, 0.05),
                accelerometer_axes: Rotation3::new(Vector3::new(0.2, 0.1, -0.3)),
                force_axes: Rotation3::new(Vector3::new(-0.1, 0.3, 0.2)),
                tool_mass,
                tool_centre: Vector3::new(0.05, 0.0, 0.1),
            },
        };
        let mut buffer = [0.0; SAMPLES];
        let record = without(Record { point, ..record(&mut random) }, absent);
        let experiment = Experiment::<BINS>::new(&chain, &measurement, &record, &mut buffer);
        let (bounds, sought) = (bounds(), sought());
        let problem = problem(&chain, &measurement, &bounds, &sought);
        let experiments = [explained(experiment.unwrap(), &problem, 1.01)];
        let (retired, mut workspace) = (RetiredInformation::none(sought.unknowns()), Workspace::new());
        let mut objective =
            SumOfSquares::new(&problem, &experiments, &retired, &mut workspace, every);
        let start = sought.coordinates(&bushings());
        let mut at = |unknown: usize, by: f64| {
            let mut step = [0.0; MAX_UNKNOWNS];
            step[unknown] = by;
            let mut moved = start;
            sought.advance(&mut moved, &step);
            let sum_of_squares = objective.cost(&moved);
            let mut normal = Normal::new();
            objective.linearise(&moved, &mut normal).unwrap();
            (sum_of_squares, normal)
        };
        let (standing, normal) = at(0, 0.0);
        // The normal equations know the sum of squares that they are the expansion of.
        prop_assert!((normal.sum_of_squares() / standing - 1.0).abs() < 1e-9);
        for unknown in 0..sought.unknowns() {
            let (up, _) = at(unknown, STEP);
            let (down, _) = at(unknown, -STEP);
            let numeric = (up - down) / (2.0 * STEP);
            let ours = -2.0 * normal.right()[unknown];
            // The size of a gradient that is not small. Seams that hardly differ leave rounding in both.
            let size = libm::sqrt(normal.row(unknown)[unknown] * standing);
            let name = sought.coordinate(unknown);
            prop_assert!((ours - numeric).abs() < 1e-4 * size, "{name:?}: {ours} {numeric}, of {size}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(4), ..ProptestConfig::with_cases(32) })]

    /// Static tests that tell hardly more than the prior of the stiffnesses, with tied and fixed parameters and without gravity, whose sag
    /// the derivatives take as it is.
    #[test]
    fn the_gradient_of_static_tests_equals_finite_differences(
        pose in prop::array::uniform2(-1.0..1.0_f64),
        loads in prop::array::uniform6(-1e3..1e3_f64),
        place in prop::array::uniform3(-0.5..0.5_f64),
        value in -1e-4..1e-4_f64,
    ) {
        const STEP: f64 = 1e-4;
        let (chain, bounds, mut sought) = (chain(), bounds(), sought());
        sought.expect_stiffnesses();
        let measurement = Measurement {
            band_hz: [5.0, 60.0],
            gravity: [0.0; 3],
            accelerometer: Accelerometer::Inertial,
            mounting: Mounting::AT_TCP,
        };
        let gauge = Gauge { place, ..Gauge::default() }.along_base(&chain, &pose);
        let displacement = [Some(Reading::stated(value, 3e-5)), None, Some(Reading::stated(-value, 1e-4))];
        let test =
            StaticTest { pose: pose.into_iter().collect(), wrench: loads, gauge, displacement };
        let statics = [test];
        let problem = Problem { statics: &statics, ..problem(&chain, &measurement, &bounds, &sought) };
        let (retired, mut workspace) = (RetiredInformation::none(sought.unknowns()), Workspace::new());
        let none: [Experiment<BINS>; 0] = [];
        let mut objective = SumOfSquares::new(&problem, &none, &retired, &mut workspace, 1);
        let start = sought.coordinates(&bushings());
        let mut cost = |unknown: usize, by: f64| {
            let mut step = [0.0; MAX_UNKNOWNS];
            step[unknown] = by;
            let mut moved = start;
            sought.advance(&mut moved, &step);
            objective.cost(&moved)
        };
        let pairs: std::vec::Vec<[f64; 2]> =
            (0..sought.unknowns()).map(|unknown| [cost(unknown, STEP), cost(unknown, -STEP)]).collect();
        let mut normal = Normal::new();
        objective.linearise(&start, &mut normal).unwrap();
        prop_assert!((normal.sum_of_squares() / objective.cost(&start) - 1.0).abs() < 1e-12);
        for (unknown, [up, down]) in pairs.into_iter().enumerate() {
            let numeric = (up - down) / (2.0 * STEP);
            let ours = -2.0 * normal.right()[unknown];
            let name = sought.coordinate(unknown);
            prop_assert!((ours - numeric).abs() < 1e-5 * (1.0 + ours.abs()), "{name:?}: {ours} {numeric}");
        }
    }
}

/// More records than there is room for seams: each determines as much as the first, which has room.
#[test]
fn every_record_counts_with_its_seam() {
    const MANY: usize = MAX_EXPERIMENTS + 2;
    let (chain, bounds) = (chain(), bounds());
    let sought = Sought::new(2).unwrap();
    let measurement = Measurement {
        band_hz: [5.0, 60.0],
        gravity: [0.0; 3],
        accelerometer: Accelerometer::Inertial,
        mounting: Mounting::AT_TCP,
    };
    let record = record(&mut Xoshiro256PlusPlus::seed_from_u64(1));
    let experiment = Experiment::<BINS>::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]);
    let experiment = experiment.unwrap();
    let problem = problem(&chain, &measurement, &bounds, &sought);
    let mut refinement = Refinement::new(&sought, &bushings());
    let mut covariance =
        |experiments: &[Experiment<BINS>]| refinement.fit(&problem, experiments).covariance;
    let one = covariance(core::slice::from_ref(&experiment));
    let all = covariance(&std::vec![experiment; MANY]);
    for unknown in 0..sought.unknowns() {
        let ratio = one.deviation(unknown) / all.deviation(unknown);
        assert!((ratio / libm::sqrt(MANY as f64) - 1.0).abs() < 1e-6, "{unknown}: {ratio}");
    }
}

/// Whatever the model reads along an axis that is not measured, the fit is the same, and it has the degrees of freedom of the other axes.
#[test]
fn an_axis_that_is_not_measured_counts_for_nothing() {
    let (chain, bounds, measurement) = (chain(), bounds(), measurement());
    let sought = Sought::new(2).unwrap();
    let problem = problem(&chain, &measurement, &bounds, &sought);
    let whole = record(&mut Xoshiro256PlusPlus::seed_from_u64(1));
    let fit = |absent: usize, shift: f32| {
        let record = without(whole.clone(), absent);
        let experiment =
            Experiment::<BINS>::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]);
        let mut experiment = experiment.unwrap();
        if absent < 3 {
            experiment.acceleration.re[absent].iter_mut().for_each(|value| *value += shift);
        }
        Refinement::new(&sought, &bushings()).fit(&problem, &[experiment])
    };
    let all = fit(3, 0.0);
    for absent in 0..3 {
        let rest = fit(absent, 0.0);
        assert_eq!(rest, fit(absent, 7.0), "{absent}");
        let experiment = Experiment::<BINS>::new(&chain, &measurement, &whole, &mut [0.0; SAMPLES]);
        // Two residuals a bin less, and two jumps of the seam.
        let gone = 2 * experiment.unwrap().bins() - 2;
        assert_eq!(all.degrees_of_freedom - rest.degrees_of_freedom, gone as f64, "{absent}");
        assert!(
            rest.sum_of_squares > 0.5 * all.sum_of_squares
                && rest.sum_of_squares < all.sum_of_squares
        );
    }
}

/// Where the model explains the readings, what is not measured leaves each unknown less certain.
#[test]
fn without_an_axis_no_unknown_is_known_better() {
    let (chain, bounds, measurement) = (chain(), bounds(), measurement());
    let sought = Sought::new(2).unwrap();
    let problem = problem(&chain, &measurement, &bounds, &sought);
    let whole = record(&mut Xoshiro256PlusPlus::seed_from_u64(1));
    let covariance = |absent: usize| {
        let record = without(whole.clone(), absent);
        let experiment =
            Experiment::<BINS>::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]);
        let experiment = explained(experiment.unwrap(), &problem, 1.0);
        Refinement::new(&sought, &bushings()).fit(&problem, &[experiment]).covariance
    };
    let all = covariance(3);
    for absent in 0..3 {
        let rest = covariance(absent);
        for unknown in 0..sought.unknowns() {
            let [own, other] = [&rest, &all].map(|covariance| covariance.deviation(unknown));
            assert!(own >= other * (1.0 - 1e-3), "{absent}, {unknown}: {own} {other}");
        }
    }
}

/// A fit is by all bins, whichever counted in the steps before, and the same where the last step has assembled it.
#[test]
fn a_fit_counts_all_bins() {
    let (chain, bounds, measurement) = (chain(), bounds(), measurement());
    let sought = Sought::new(2).unwrap();
    let record = record(&mut Xoshiro256PlusPlus::seed_from_u64(1));
    let experiment = Experiment::<BINS>::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]);
    let experiments = [experiment.unwrap()];
    let problem = problem(&chain, &measurement, &bounds, &sought);
    for every in [1, 3] {
        let mut refinement = Refinement::new(&sought, &bushings());
        refinement.restart_thinned(&sought.coordinates(&bushings()), every);
        let standing = refinement.step(&problem, &experiments);
        assert_eq!(standing, Outcome::Improving);
        let of_step = refinement.objective();
        let here = refinement.fit_here(&problem, &experiments);
        assert_eq!(here, refinement.fit(&problem, &experiments));
        assert_eq!(of_step == here.objective, every == 1, "{of_step}, {}", here.objective);
    }
}
