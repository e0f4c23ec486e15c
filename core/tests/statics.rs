//! Static tests: the displacement against a dense solve, its gradient against finite differences, and fits that rest
//! on them, with records and without.

use flexid_core::chain::Chain;
use flexid_core::chain::linearise::LinearisationError;
use flexid_core::identify::{Acceptance, Estimate, Identifier};
use flexid_core::parameters::{Bounds, Bushings, End};
use flexid_core::refine::{Fit, Problem};
use flexid_core::spectrum::{Experiment, Measurement};
use flexid_core::statics::{
    Deflection, Gauge, MAX_STATIC_TESTS, Reading, StaticTest, StaticTestError,
};
use flexid_core::verdict::Verdict;

use crate::common::fits::{
    self, Generator, mean_square, parameters, problem, relative, scores, settle,
};
use crate::common::milling::{Conditions, SAMPLES, cut, experiments, record};
use crate::common::{BINS, Dense, EXPERIMENTS, MEASUREMENT, Random, bounds, mill3};
use fearless_simd::Level;
use nalgebra::{Complex, DMatrix, DVector, UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;

const EARTH: Vector3<f64> = Vector3::new(0.0, 0.0, -9.80665);
/// Standard deviation of a reading: a laser tracker's, m.
pub(crate) const NOISE: f64 = 5e-6;

/// Displacement of the TCP by a dense solve, TCP axes, m.
pub(crate) fn dense_displacement(
    chain: &Chain,
    pose: &[f64],
    gravity: Vector3<f64>,
    bushings: &Bushings,
    wrench: &[f64; 6],
) -> [f64; 3] {
    dense_motion(chain, pose, gravity, bushings, wrench).fixed_rows::<3>(0).into()
}

/// Displacement and turn of the tool at the TCP by a dense solve, TCP axes, m and rad.
fn dense_motion(
    chain: &Chain,
    pose: &[f64],
    gravity: Vector3<f64>,
    bushings: &Bushings,
    wrench: &[f64; 6],
) -> Vector6<f64> {
    let linear = chain.linearise(pose, gravity, bushings).unwrap();
    let sag: Vec<[f64; 6]> = linear.joints.iter().map(|joint| joint.sag.into()).collect();
    let dense = Dense::new(chain, pose, gravity, &sag);
    let tip = dense.tip();
    let load = tip.transpose() * DVector::from_row_slice(wrench);
    let compliance = dense.compliance(bushings, Complex::from(0.0)).map(|entry| entry.re);
    let moved = tip * compliance * load;
    Vector6::from_fn(|row, _| moved[row])
}

/// A gauge anywhere near the tool, along any axes.
fn gauge(random: &mut Random) -> Gauge {
    let mut within = |size: f64| random.uniform(-size, size);
    let place = [within(0.5), within(0.5), within(0.5)];
    let turn = UnitQuaternion::from_euler_angles(within(3.0), within(1.5), within(3.0));
    Gauge { place, axes: [0, 1, 2].map(|axis| (turn * Vector3::ith(axis, 1.0)).into()) }
}

pub(crate) fn wrench(random: &mut Random) -> [f64; 6] {
    std::array::from_fn(
        |i| if i < 3 { random.uniform(-2e3, 2e3) } else { random.uniform(-5e2, 5e2) },
    )
}

/// Tests of the scenario's robot, every axis read.
pub(crate) fn measure(
    truth: &Bushings,
    count: usize,
    gravity: Vector3<f64>,
    random: &mut Random,
) -> Vec<StaticTest> {
    let test = |_| {
        let pose = [random.uniform(-2.0, 2.0), random.uniform(-1.5, 0.0), random.uniform(0.0, 2.0)];
        let wrench = wrench(random);
        let exact = dense_displacement(&mill3(), &pose, gravity, truth, &wrench);
        StaticTest {
            pose: pose.into_iter().collect(),
            wrench,
            gauge: Gauge::default(),
            displacement: exact.map(|d| Some(Reading::stated(d + NOISE * random.normal(), NOISE))),
        }
    };
    (0..count).map(test).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(7), ..ProptestConfig::with_cases(256) })]

    #[test]
    fn displacement_equals_a_dense_solve(seed in 0_u64..100_000, joints in 1_usize..=7, weight in any::<bool>()) {
        let mut random = Random::new(seed);
        let (chain, pose) = (random.chain(joints), random.pose(joints));
        let bushings = random.bushings(joints);
        let gravity = if weight { EARTH } else { Vector3::zeros() };
        let wrench = wrench(&mut random);
        let linear = chain.linearise(&pose, gravity, &bushings).unwrap();
        let gauge = gauge(&mut random);
        let ours = Deflection::new(&linear, &bushings, &wrench, &gauge).unwrap().displacement;
        let motion = dense_motion(&chain, &pose, gravity, &bushings, &wrench);
        let (shift, turn) = (motion.fixed_rows::<3>(0), motion.fixed_rows::<3>(3));
        let at_gauge = shift + turn.cross(&Vector3::from(gauge.place));
        let dense = Vector3::from(gauge.axes.map(|axis| Vector3::from(axis).dot(&at_gauge)));
        let size = dense.norm();
        let gap = (Vector3::from(ours) - dense).norm();
        prop_assert!(gap < 1e-10 * size, "{:e} of {:e}", gap, size);
    }

    #[test]
    fn gradient_equals_finite_differences(seed in 0_u64..100_000, joints in 1_usize..=7) {
        let mut random = Random::new(seed);
        let (chain, pose) = (random.chain(joints), random.pose(joints));
        let bushings = random.bushings(joints);
        let wrench = wrench(&mut random);
        let linear = chain.linearise(&pose, EARTH, &bushings).unwrap();
        let gauge = gauge(&mut random);
        let here = Deflection::new(&linear, &bushings, &wrench, &gauge).unwrap();
        let size = Vector3::from(here.displacement).norm();
        for joint in 0..joints {
            for dof in 0..6 {
                let moved = |by: f64| {
                    let mut bushings = bushings.clone();
                    bushings[joint].stiffness[dof] *= by.exp();
                    Deflection::new(&linear, &bushings, &wrench, &gauge).unwrap().displacement
                };
                let (up, down) = (moved(1e-4), moved(-1e-4));
                for axis in 0..3 {
                    let gap = here.gradient[axis][joint][dof] - (up[axis] - down[axis]) / 2e-4;
                    prop_assert!(gap.abs() < 1e-8 * size, "{} {} {}: {:e} of {:e}", joint, dof, axis, gap, size);
                }
            }
        }
    }
}

fn refine(
    guess: &Bushings,
    statics: &[StaticTest],
    experiments: &[Experiment<BINS>],
) -> (Bushings, Fit) {
    let (chain, bounds) = (mill3(), bounds());
    let sought = parameters(guess.len());
    let problem = Problem { statics, ..problem(&chain, &MEASUREMENT, &bounds, &sought) };
    let (refinement, fit) = fits::refine(&problem, guess, experiments);
    (refinement.bushings(&sought), fit)
}

/// [`scores`] of the stiffnesses that are known to 5 %: by logarithms, for what is found is not normal at 5 %.
fn stiffness_scores(found: &Bushings, truth: &Bushings, deviations: &[f64]) -> Vec<f64> {
    let scores = scores(found, truth, deviations).into_iter().zip(deviations).enumerate();
    let known = scores.filter(|(index, (_, deviation))| index % 12 < 6 && **deviation <= 0.05);
    known.map(|(_, (score, _))| score).collect()
}

/// One record with thirty times the noise: a cut that hardly moves the robot.
fn faint(truth: &Bushings, random: &mut Random) -> Experiment<BINS> {
    let (pose, rpm, feed) = EXPERIMENTS[0];
    let force = cut(random, rpm, feed);
    let conditions = Conditions { noise: 30.0, ..Conditions::default() };
    let record = record(&mill3(), &pose, truth, &force, &conditions, random);
    Experiment::new(&mill3(), &MEASUREMENT, &record, &mut [0.0; SAMPLES]).expect("a good record")
}

#[test]
fn static_tests_identify_what_records_hardly_excite() {
    let mut scores = Vec::new();
    for seed in 80..85 {
        let mut random = Random::new(seed);
        let truth = random.bushings(3);
        let records = [faint(&truth, &mut random)];
        let tests = measure(&truth, 60, Vector3::zeros(), &mut random);
        let known = |statics: &[StaticTest]| {
            let (found, fit) = refine(&truth, statics, &records);
            let consistency = fit.sum_of_squares / fit.degrees_of_freedom;
            assert!((consistency - 1.0).abs() < 0.06, "robot {seed}: {consistency}");
            stiffness_scores(&found, &truth, &fit.deviations)
        };
        let (before, after) = (known(&[]), known(&tests));
        println!(
            "robot {seed}: {} of 18 stiffnesses to 5 %, with tests {}",
            before.len(),
            after.len()
        );
        assert!(after.len() >= before.len() + 3, "{} and {}", before.len(), after.len());
        scores.extend(after);
    }
    let mean_square = mean_square(&scores);
    assert!((0.5..1.7).contains(&mean_square), "{mean_square}: {scores:.1?}");
}

fn identifier(tests: &[StaticTest]) -> Box<Identifier<Generator>> {
    identifier_of(tests, MEASUREMENT)
}

fn identifier_of(tests: &[StaticTest], measurement: Measurement) -> Box<Identifier<Generator>> {
    let generator = Random::new(5).0;
    let identifier = Identifier::new(mill3(), bounds(), measurement, Level::new(), generator);
    let mut identifier = Box::new(identifier);
    identifier.add_statics(tests).expect("good tests");
    identifier
}

/// Without a record the stiffnesses are found where the tests determine them, in gravity and without, and no damping
/// passes for found.
#[test]
fn static_tests_alone() {
    let mut scores = Vec::new();
    for seed in 90..100 {
        let mut random = Random::new(seed);
        let truth = random.bushings(3);
        let gravity = if seed % 2 == 0 { Vector3::zeros() } else { EARTH };
        let tests = measure(&truth, 60, gravity, &mut random);
        let measurement = Measurement { gravity: gravity.into(), ..MEASUREMENT };
        let estimate = settle(&mut identifier_of(&tests, measurement), &[]);
        assert_eq!(estimate.acceptance, Acceptance::Consistent, "robot {seed}");
        for deviation in &estimate.standard_deviations {
            assert!(deviation.damping.iter().all(|deviation| deviation.is_infinite()));
        }
        scores.extend(stiffness_scores(&estimate.bushings, &truth, &relative(&estimate)));
    }
    let (known, mean_square) = (scores.len(), mean_square(&scores));
    println!(
        "ten robots: {known} of 180 stiffnesses known to 5 %, mean square score {mean_square:.2}"
    );
    assert!(known >= 20, "{known}");
    assert!((0.7..1.4).contains(&mean_square), "{mean_square}: {scores:.1?}");
}

/// Decades around the scenario's bounds: the robot in their middle has 1e4 Nm/rad, where the weight of its links asks for some 2e4.
fn wide() -> Bounds {
    Bounds::new([1e4, 1e10], [1.0, 1e8], [1e3, 1e5], [1e2, 5e4]).expect("ranges")
}

/// The middle of wide bounds gives way under gravity without end; the data do not care.
#[test]
fn a_start_that_gravity_leaves_no_equilibrium_is_stiffened() {
    let measurement = Measurement { gravity: EARTH.into(), ..MEASUREMENT };
    let middle = wide().middle(3);
    let mut scores = Vec::new();
    for seed in 150..156 {
        let mut random = Random::new(seed);
        let truth = random.bushings(3);
        let tests = measure(&truth, 60, EARTH, &mut random);
        let sagging = mill3().linearise(&tests[0].pose, EARTH, &middle).err();
        assert!(matches!(sagging, Some(LinearisationError::NoEquilibrium(_))), "{sagging:?}");
        let generator = Random::new(5).0;
        let identifier = Identifier::new(mill3(), wide(), measurement, Level::new(), generator);
        let mut identifier = Box::new(identifier);
        identifier.add_statics(&tests).expect("good tests");
        let estimate = settle(&mut identifier, &[]);
        assert_eq!(estimate.acceptance, Acceptance::Consistent, "robot {seed}");
        scores.extend(stiffness_scores(&estimate.bushings, &truth, &relative(&estimate)));
    }
    let mean_square = mean_square(&scores);
    println!("{} stiffnesses known to 5 %, mean square score {mean_square:.2}", scores.len());
    assert!(scores.len() >= 6, "{}", scores.len());
    assert!(mean_square < 2.0, "{mean_square}: {scores:.1?}");
}

/// The find of a search may be as soft: a record is fitted from there as well.
#[test]
fn a_soft_guess_is_stiffened_for_records_too() {
    let (chain, bounds, sought) = (mill3(), wide(), parameters(3));
    let measurement = Measurement { gravity: EARTH.into(), ..MEASUREMENT };
    let mut random = Random::new(157);
    let truth = random.bushings(3);
    let conditions = Conditions { gravity: EARTH, ..Conditions::default() };
    let (pose, rpm, feed) = EXPERIMENTS[0];
    let force = cut(&mut random, rpm, feed);
    let record = record(&chain, &pose, &truth, &force, &conditions, &mut random);
    let experiment = Experiment::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]);
    let experiments = [experiment.expect("a good record")];
    let problem = problem(&chain, &measurement, &bounds, &sought);
    // Its stiffnesses alone are too soft; its dampings are the truth's.
    let mut guess = truth.clone();
    for (bushing, soft) in guess.iter_mut().zip(wide().middle(sought.joints())) {
        bushing.stiffness = soft.stiffness;
    }
    let (refinement, fit) = fits::refine(&problem, &guess, &experiments);
    let found = refinement.bushings(&sought);
    assert!(fit.objective.is_finite() && fit.sum_of_squares.is_finite());
    assert!(chain.linearise(&pose, EARTH, &found).is_ok());
}

/// Bounds within which no robot bears its weight: it says so, and does not go on for ever.
#[test]
fn bounds_without_an_equilibrium_are_given_up() {
    let mut random = Random::new(158);
    let tests = measure(&random.bushings(3), 10, EARTH, &mut random);
    let measurement = Measurement { gravity: EARTH.into(), ..MEASUREMENT };
    let soft = Bounds::new([1e4, 1e10], [1.0, 1e3], [1e3, 1e5], [1e2, 5e4]).expect("ranges");
    let identifier = Identifier::new(mill3(), soft, measurement, Level::new(), Random::new(5).0);
    let mut identifier = Box::new(identifier);
    identifier.add_statics(&tests).expect("good tests");
    let estimate = settle(&mut identifier, &[]);
    assert_eq!(estimate.acceptance, Acceptance::Unsettled);
    assert!(identifier.progress().effort.refine_iterations < 20);
}

/// Least sum of squares within the bounds: displacements are linear in the compliances, so that it is a convex problem, which
/// cyclic coordinate descent over a dense matrix solves.
fn bounded_optimum(chain: &Chain, bounds: &Bounds, tests: &[StaticTest]) -> f64 {
    let springs = 6 * chain.joints().len();
    let mut jacobian = DMatrix::zeros(3 * tests.len(), springs);
    let mut readings = DVector::zeros(3 * tests.len());
    for (index, test) in tests.iter().enumerate() {
        let tip =
            Dense::new(chain, &test.pose, Vector3::zeros(), &vec![[0.0; 6]; springs / 6]).tip();
        let load = tip.transpose() * DVector::from_row_slice(&test.wrench);
        for (axis, reading) in test.readings() {
            readings[3 * index + axis] = reading.value / reading.deviation;
            for spring in 0..springs {
                jacobian[(3 * index + axis, spring)] = tip[(axis, spring)] * load[spring] / NOISE;
            }
        }
    }
    let range = |spring: usize| {
        bounds.joints[spring / 6].stiffness[spring % 6].map(|stiffness| 1.0 / stiffness)
    };
    let mut compliance = DVector::from_fn(springs, |spring, _| range(spring)[0]);
    let mut residual = &readings - &jacobian * &compliance;
    for _ in 0..50_000 {
        for spring in 0..springs {
            let column = jacobian.column(spring);
            let [most, least] = range(spring);
            let [least, most] = [most.min(least), most.max(least)];
            let next = compliance[spring] + column.dot(&residual) / column.norm_squared();
            let next = next.clamp(least, most);
            residual.axpy(compliance[spring] - next, &column, 1.0);
            compliance[spring] = next;
        }
    }
    residual.norm_squared()
}

/// Fewer displacements than would determine every stiffness, so that many lie on a bound: the optimum is that of a
/// dense solve, it is settled, and only what the readings determine is taken off the degrees of freedom.
#[test]
fn a_fit_on_its_bounds_is_the_optimum_and_settled() {
    let six_joints = Random::new(3).chain(6);
    let (mut sums, mut short) = ([0.0; 2], 0);
    for seed in 120..144 {
        let mut random = Random::new(seed);
        let (chain, count) = if seed % 2 == 0 { (mill3(), 7) } else { (six_joints.clone(), 13) };
        let joints = chain.joints().len();
        let truth = random.bushings(joints);
        let tests: Vec<StaticTest> = (0..count)
            .map(|_| {
                let (pose, wrench) = (random.pose(joints), wrench(&mut random));
                let exact = dense_displacement(&chain, &pose, Vector3::zeros(), &truth, &wrench);
                let reading = |d: f64, random: &mut Random| {
                    Reading::stated(d + NOISE * random.normal(), NOISE)
                };
                StaticTest {
                    pose: pose.into_iter().collect(),
                    wrench,
                    gauge: Gauge::default(),
                    displacement: exact.map(|d| Some(reading(d, &mut random))),
                }
            })
            .collect();
        let identifier =
            Identifier::new(chain.clone(), bounds(), MEASUREMENT, Level::new(), Random::new(5).0);
        let mut identifier = Box::new(identifier);
        identifier.add_statics(&tests).expect("good tests");
        let estimate = settle(&mut identifier, &[]);
        let readings = 3.0 * count as f64;
        let least = bounded_optimum(&chain, &bounds(), &tests);
        let found = estimate.static_consistency.expect("there are tests") * readings;
        let ranges = bounds().joints[0].stiffness;
        let on_bounds = estimate.bushings.iter().flat_map(|bushing| bushing.stiffness).enumerate();
        let on_bounds =
            on_bounds.filter(|(i, k)| End::reached(ranges[i % 6], *k).is_some()).count();
        let determined = readings - estimate.degrees_of_freedom;
        println!(
            "{seed}: {found:.4} where {least:.4} is possible, {on_bounds} of {} on bounds, {determined:.1} determined: {:?}",
            6 * joints,
            estimate.acceptance
        );
        // A fit may stop short of the optimum by a gain of 1, one standard deviation in all unknowns together.
        assert!(
            (-0.01..1.0).contains(&(found - least)),
            "robot {seed}: {found}, {least} is possible"
        );
        short += u32::from(found - least > 0.01);
        assert!(on_bounds > 0 && determined <= (6 * joints - on_bounds) as f64, "robot {seed}");
        assert_eq!(estimate.acceptance, Acceptance::Consistent, "robot {seed}");
        sums = [sums[0] + found, sums[1] + estimate.degrees_of_freedom];
        // No damping was asked for.
        for direction in &estimate.weak_directions {
            assert!(direction.shares.iter().all(|(i, _)| i % 12 < 6), "{direction:?}");
        }
    }
    println!("{:.1} of {} degrees of freedom; {short} stop short", sums[0], sums[1]);
    assert!(short <= 1, "{short} of 24 stop short of the optimum");
    // Some two hundred degrees of freedom: three standard deviations.
    let ratio = sums[0] / sums[1];
    assert!((0.6..1.3).contains(&ratio), "{ratio}");
}

/// Fewer displacements than stiffnesses: an estimate, and nothing in it that is sure without reason.
#[test]
fn one_dial_gauge_determines_next_to_nothing() {
    let mut random = Random::new(101);
    let truth = random.bushings(3);
    let mut tests = measure(&truth, 1, Vector3::zeros(), &mut random);
    tests[0].displacement[0] = None;
    tests[0].displacement[2] = None;
    let estimate = settle(&mut identifier(&tests), &[]);
    assert_eq!(estimate.acceptance, Acceptance::Unsettled);
    for deviation in &estimate.standard_deviations {
        assert!(deviation.stiffness.iter().chain(&deviation.damping).all(|d| d.is_infinite()));
    }
}

/// Records that come later start a search of their own and add the dampings; tests of another robot are seen.
#[test]
fn records_join_and_contradiction_is_seen() {
    let mut random = Random::new(103);
    let truth = random.bushings(3);
    let records = experiments(&truth, &mut random);
    let mut own = identifier(&measure(&truth, 20, Vector3::zeros(), &mut random));
    settle(&mut own, &[]);
    assert_eq!(own.progress().effort.starts, 0);
    let estimate = settle(&mut own, &records);
    assert!(own.progress().effort.starts > 0);
    assert_eq!(estimate.acceptance, Acceptance::Consistent);
    assert!(estimate.standard_deviations[0].damping[0].is_finite());
    let consistency = estimate.static_consistency.expect("there are tests");
    assert!((0.5..1.6).contains(&consistency), "{consistency}");
    assert!(!estimate.statics_object && identified(&estimate) > 0);

    let mut other = truth.clone();
    other[1].stiffness.iter_mut().for_each(|stiffness| *stiffness *= 1.2);
    let estimate =
        settle(&mut identifier(&measure(&other, 4, Vector3::zeros(), &mut random)), &records);
    assert!(estimate.consistency < 1.3, "outvoted: {}", estimate.consistency);
    assert_eq!(estimate.acceptance, Acceptance::ModelSuspect, "{:?}", estimate.static_consistency);
    assert!(estimate.statics_object && !estimate.size_objects);
    assert_eq!(identified(&estimate), 0, "who contradicts whom is not known");
}

/// How many stiffnesses pass for identified.
fn identified(estimate: &Estimate) -> usize {
    let trust = estimate.trust();
    let joints = estimate.bushings.iter().zip(&estimate.standard_deviations);
    let known = joints.flat_map(|(value, deviation)| {
        let pairs = value.stiffness.into_iter().zip(deviation.stiffness);
        pairs.map(|(value, deviation)| trust.verdict(value, deviation).0)
    });
    known.filter(|known| *known == Verdict::Identified).count()
}

#[test]
fn tests_that_no_fit_can_take_are_refused() {
    type Mistake = fn(&mut Vec<StaticTest>);
    let table: [(Mistake, StaticTestError); 8] = [
        (|t| *t = vec![t[0].clone(); MAX_STATIC_TESTS + 1], StaticTestError::Count(65)),
        (|t| t[1].pose.truncate(2), StaticTestError::Pose(1)),
        (|t| t[2].pose[0] = f64::INFINITY, StaticTestError::NotFinite(2)),
        (|t| t[0].wrench[5] = f64::NAN, StaticTestError::NotFinite(0)),
        (
            |t| t[0].displacement[1] = Some(Reading::stated(f64::NAN, 1e-6)),
            StaticTestError::NotFinite(0),
        ),
        (|t| t[2].displacement[1] = Some(Reading::stated(0.0, 0.0)), StaticTestError::Deviation(2)),
        (|t| t[1].gauge.place[2] = f64::NAN, StaticTestError::NotFinite(1)),
        (|t| t[2].gauge.axes[1] = [0.0, 2.0, 0.0], StaticTestError::Axes(2)),
    ];
    let good = measure(&Random::new(1).bushings(3), 3, Vector3::zeros(), &mut Random::new(2));
    for (mistake, error) in table {
        let mut tests = good.clone();
        mistake(&mut tests);
        let mut identifier =
            Identifier::new(mill3(), bounds(), MEASUREMENT, Level::new(), Random::new(5).0);
        assert_eq!(identifier.add_statics(&tests).err(), Some(error));
    }
}
