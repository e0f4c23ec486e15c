//! The verdict of a fit on each static test: residuals against fits without it, gross errors among them, their noise where
//! nobody states it; and fits that seek little, or have little to go by.

use fearless_simd::Level;
use flexid_core::identify::{Acceptance, Estimate, Identifier};
use flexid_core::parameters::{Bounds, Bushings, End};
use flexid_core::sought::{STIFF, Sought, SoughtError};
use flexid_core::statics::{DIAL_GAUGE, Deflection, Gauge, StaticTest};
use nalgebra::Vector3;

use crate::common::fits::{Generator, parameters, settle};
use crate::common::{BINS, MEASUREMENT, Random, bounds, mill3};
use crate::statics::{NOISE, dense_displacement, measure, wrench};

/// Degree of freedom of each joint's drive.
const DRIVES: [usize; 3] = [5, 4, 4];

fn drives() -> Sought {
    let mut sought = parameters(3);
    sought.seek_drives(&mill3()).unwrap();
    sought
}

/// Ranges that hold [`STIFF`] as well.
fn wide() -> Bounds {
    Bounds::new([1e4, 1e12], [1e4, 1e12], [1e3, 1e5], [1e2, 5e4]).unwrap()
}

/// A robot that gives way about its drives only, by 1e5 to 1e7 Nm/rad.
fn driven(random: &mut Random) -> Bushings {
    let mut bushings = random.bushings(3);
    for (bushing, drive) in bushings.iter_mut().zip(DRIVES) {
        bushing.stiffness = [STIFF; 6];
        bushing.stiffness[drive] = 1e5 * 100_f64.powf(random.uniform(0.0, 1.0));
    }
    bushings
}

fn identifier(tests: &[StaticTest], sought: Sought, bounds: Bounds) -> Box<Identifier<Generator>> {
    let generator = Random::new(5).0;
    let mut identifier =
        Box::new(Identifier::new(mill3(), bounds, MEASUREMENT, Level::new(), generator));
    identifier.add_statics(tests).unwrap();
    identifier.seek(sought).unwrap();
    identifier
}

fn fit(tests: &[StaticTest], sought: Sought, bounds: Bounds) -> Estimate {
    settle(&mut identifier(tests, sought, bounds), &[])
}

/// Residual of a test, in its standard deviations.
fn residual(test: &StaticTest, bushings: &Bushings) -> [Option<f64>; 3] {
    let linear = mill3().linearise(&test.pose, Vector3::zeros(), bushings).unwrap();
    let model = Deflection::new(&linear, bushings, &test.wrench, &test.gauge).unwrap();
    std::array::from_fn(|axis| {
        let reading = test.displacement[axis]?;
        Some((reading.value - model.displacement[axis]) / reading.deviation)
    })
}

/// Takes displacements away, so that there are tests of one, two and three.
fn thin(tests: &mut [StaticTest]) {
    for (index, test) in tests.iter_mut().enumerate() {
        test.displacement[index % 3] = test.displacement[index % 3].filter(|_| index % 4 == 0);
        test.displacement[(index + 1) % 3] =
            test.displacement[(index + 1) % 3].filter(|_| index % 2 == 0);
    }
}

/// Says nothing of the noise.
fn unstated(tests: &mut [StaticTest]) {
    for reading in tests.iter_mut().flat_map(|test| &mut test.displacement).flatten() {
        (reading.deviation, reading.is_stated) = (DIAL_GAUGE, false);
    }
}

#[test]
fn residuals_are_those_of_fits_with_and_without_the_test() {
    for seed in 200..206 {
        let mut random = Random::new(seed);
        let truth = driven(&mut random);
        let mut tests = measure(&truth, 8, Vector3::zeros(), &mut random);
        thin(&mut tests);
        // Their scatter counts, however small it is.
        for reading in tests.iter_mut().flat_map(|test| &mut test.displacement).flatten() {
            reading.is_stated = false;
        }
        let estimate = fit(&tests, drives(), wide());
        assert_eq!(estimate.static_tests.len(), tests.len());
        for (index, (test, own)) in tests.iter().zip(&estimate.static_tests).enumerate() {
            let mut others = tests.clone();
            others.remove(index);
            let without = fit(&others, drives(), wide());
            let pairs = [
                (own.residual, residual(test, &estimate.bushings)),
                (own.left_out, residual(test, &without.bushings)),
            ];
            for (ours, other) in pairs.iter().flat_map(|(ours, other)| ours.iter().zip(other)) {
                assert_eq!(ours.is_some(), other.is_some());
                let gap = (ours.unwrap_or(0.0) - other.unwrap_or(0.0)).abs();
                let size = other.unwrap_or(0.0).abs();
                assert!(gap < 0.02 + 0.02 * size, "{seed} {index}: {ours:?}, refitted {other:?}");
            }
            let squares = |estimate: &Estimate| estimate.consistency * estimate.degrees_of_freedom;
            let fall = squares(&estimate) - squares(&without);
            let expected = (fall / test.readings().count() as f64 / without.consistency).sqrt();
            let found = own.deviations.expect("enough others");
            assert!((found - expected).abs() < 0.03, "{seed} {index}: {found} {expected}");
        }
        let redundancy: f64 = estimate.static_tests.iter().flat_map(|test| test.redundancy).sum();
        assert!((redundancy - estimate.degrees_of_freedom).abs() < 1e-6, "{redundancy}");
    }
}

/// A robot of which two in three stiffnesses are sought, and what is measured on it.
fn table(seed: u64, count: usize) -> Vec<StaticTest> {
    let mut random = Random::new(seed);
    let truth = random.bushings(3);
    let mut tests = measure(&truth, count, Vector3::zeros(), &mut random);
    thin(&mut tests);
    tests
}

/// The test that is farthest out, if that is no chance.
fn outlier(tests: &[StaticTest]) -> Option<usize> {
    let mut identifier = identifier(tests, parameters(3), bounds());
    identifier.estimate_static_deviation::<BINS>();
    let estimate = settle(&mut identifier, &[]);
    let chance = |index: &usize| estimate.static_tests[*index].chance.unwrap_or(1.0);
    let worst = (0..tests.len()).min_by(|a, b| chance(a).total_cmp(&chance(b)))?;
    estimate.static_tests[worst].is_outlier().then_some(worst)
}

#[test]
fn a_gross_error_is_named_and_a_clean_table_names_none() {
    const TABLES: u64 = 40;
    let (mut found, mut false_alarms) = ([0; 2], [0; 2]);
    for seed in 0..TABLES {
        let clean = table(300 + seed, 30);
        let wrong = seed as usize % clean.len();
        let mut spoilt = clean.clone();
        for reading in spoilt[wrong].displacement.iter_mut().flatten() {
            // The sign of the dial was not noted.
            reading.value += 40.0 * NOISE * reading.value.signum();
        }
        for (kind, is_stated) in [true, false].into_iter().enumerate() {
            let [mut clean, mut spoilt] = [clean.clone(), spoilt.clone()];
            if !is_stated {
                [&mut clean, &mut spoilt].into_iter().for_each(|tests| unstated(tests));
            }
            false_alarms[kind] += u32::from(outlier(&clean).is_some());
            let named = outlier(&spoilt);
            assert!(named.is_none_or(|named| named == wrong), "{seed}: {named:?} for {wrong}");
            found[kind] += u32::from(named.is_some());
        }
    }
    println!(
        "of {TABLES} tables with a gross error {found:?} are named, of clean ones {false_alarms:?}"
    );
    // One in twenty at most: more than six of forty come once in 200.
    assert!(false_alarms.iter().all(|alarms| *alarms <= 6), "{false_alarms:?}");
    assert!(found.iter().all(|found| *found >= 38), "{found:?}");
}

/// Residuals that are those of rounding have no outlier, whether noise is stated or not.
#[test]
fn exact_displacements_name_none() {
    for seed in 393..399 {
        let mut random = Random::new(seed);
        let truth = driven(&mut random);
        let mut tests = measure(&truth, 12, Vector3::zeros(), &mut random);
        for (index, test) in tests.iter_mut().enumerate() {
            let exact =
                dense_displacement(&mill3(), &test.pose, Vector3::zeros(), &truth, &test.wrench);
            for (reading, exact) in test.displacement.iter_mut().flatten().zip(exact) {
                // A nanometre is no gross error.
                reading.value = exact + if index == 4 { 1e-9 } else { 0.0 };
            }
        }
        for is_stated in [true, false] {
            if !is_stated {
                unstated(&mut tests);
            }
            let mut identifier = identifier(&tests, drives(), wide());
            identifier.estimate_static_deviation::<BINS>();
            let estimate = settle(&mut identifier, &[]);
            let outliers = estimate.static_tests.iter().filter(|test| test.is_outlier()).count();
            assert_eq!(outliers, 0, "{seed} {is_stated}");
        }
    }
}

#[test]
fn noise_that_nobody_states_is_estimated() {
    let mut ratios = Vec::new();
    for seed in 340..360 {
        let mut tests = table(seed, 40);
        unstated(&mut tests);
        // Half of them state theirs, which is not the same.
        if seed % 2 == 0 {
            for test in &mut tests[..20] {
                for reading in test.displacement.iter_mut().flatten() {
                    (reading.deviation, reading.is_stated) = (NOISE, true);
                }
            }
        }
        let mut identifier = identifier(&tests, parameters(3), bounds());
        let deviation = identifier.estimate_static_deviation::<BINS>().expect("enough tests");
        let estimate = settle(&mut identifier, &[]);
        assert_eq!(estimate.acceptance, Acceptance::Consistent, "{seed}");
        ratios.push((deviation / NOISE).ln());
    }
    let count = ratios.len() as f64;
    let mean = ratios.iter().sum::<f64>() / count;
    let spread = (ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / count).sqrt();
    println!("estimated over true: {:.3}, spread {spread:.3}", mean.exp());
    // Some 30 to 60 degrees of freedom: 0.09 to 0.13 each, and a fifth of that in the mean.
    assert!(mean.abs() < 0.1 && spread < 0.25, "{mean} {spread}");
}

/// Noise as large as the displacements would explain any of them. All have the wrong sign, or every other one is 1.6 or 0.4 times as large.
#[test]
fn displacements_that_no_robot_has_are_no_noise() {
    for (seed, factors) in (340..345).flat_map(|seed| [(seed, [-1.0; 2]), (seed, [1.6, 0.4])]) {
        let mut tests = table(seed, 40);
        unstated(&mut tests);
        let readings = tests.iter_mut().flat_map(|test| test.displacement.iter_mut().flatten());
        for (index, reading) in readings.enumerate() {
            reading.value *= factors[index % 2];
        }
        let mut identifier = identifier(&tests, parameters(3), bounds());
        identifier.estimate_static_deviation::<BINS>();
        let estimate = settle(&mut identifier, &[]);
        assert!(estimate.statics_object, "{seed} {factors:?}");
        assert_ne!(estimate.acceptance, Acceptance::Consistent, "{seed} {factors:?}");
    }
}

/// A single dial gauge says nothing of its noise. All that state theirs leave the identifier as it is.
#[test]
fn too_few_tests_and_stated_noise_give_no_estimate() {
    let mut tests = table(361, 2);
    let mut stated = identifier(&tests, parameters(3), bounds());
    assert_eq!(stated.estimate_static_deviation::<BINS>(), None);
    unstated(&mut tests);
    let mut unstated = identifier(&tests, parameters(3), bounds());
    assert_eq!(unstated.estimate_static_deviation::<BINS>(), None);
    let estimate = settle(&mut unstated, &[]);
    assert_eq!(estimate.acceptance, Acceptance::Unsettled);
    assert!(estimate.static_tests.iter().all(|test| !test.is_outlier()));
}

/// Two tests of six readings leave three to estimate the noise by: 1.96 of its deviations hold the truth in 86 % of the cases.
#[test]
fn intervals_allow_for_noise_of_few_readings() {
    let (mut count, mut covered) = (0, 0);
    for seed in 400..550 {
        let mut random = Random::new(seed);
        let truth = driven(&mut random);
        let mut tests = measure(&truth, 2, Vector3::zeros(), &mut random);
        unstated(&mut tests);
        let mut identifier = identifier(&tests, drives(), wide());
        identifier.estimate_static_deviation::<BINS>();
        let estimate = settle(&mut identifier, &[]);
        for (joint, (own, drive)) in estimate.bushings.iter().zip(DRIVES).enumerate() {
            let relative =
                estimate.standard_deviations[joint].stiffness[drive] / own.stiffness[drive];
            let error = (own.stiffness[drive] / truth[joint].stiffness[drive]).ln();
            count += 1;
            covered += u32::from(error.abs() < 1.96 * relative);
        }
    }
    let share = f64::from(covered) / f64::from(count);
    println!("{covered} of {count} intervals cover");
    // 450 intervals, three of a table alike: 95 ± 2 %.
    assert!((0.915..0.99).contains(&share), "{share}");
}

#[test]
fn drives_alone_are_found() {
    for seed in 362..368 {
        let mut random = Random::new(seed);
        let truth = driven(&mut random);
        let tests = measure(&truth, 10, Vector3::zeros(), &mut random);
        let estimate = fit(&tests, drives(), wide());
        assert_eq!(estimate.acceptance, Acceptance::Consistent, "{seed}");
        for (joint, (own, drive)) in estimate.bushings.iter().zip(DRIVES).enumerate() {
            let deviation = estimate.standard_deviations[joint].stiffness[drive];
            let error = own.stiffness[drive] - truth[joint].stiffness[drive];
            assert!(error.abs() < 4.5 * deviation, "{seed} {joint}: {error} ± {deviation}");
            assert!(deviation < 0.05 * own.stiffness[drive], "{seed} {joint}");
            let others = (0..6).filter(|dof| *dof != drive);
            assert!(others.into_iter().all(|dof| own.stiffness[dof] == STIFF));
        }
    }
    let mut other = Sought::new(2).unwrap();
    assert_eq!(other.seek_drives(&mill3()), Err(SoughtError::JointCount(3)));
}

/// Six tests of three readings and eighteen stiffnesses: what is predicted in other poses, with the prior and without.
#[test]
fn the_prior_predicts_where_tests_are_few() {
    let mut errors = [Vec::new(), Vec::new()];
    let mut expecting = parameters(3);
    expecting.expect_stiffnesses();
    for seed in 370..390 {
        let mut random = Random::new(seed);
        let truth = random.bushings(3);
        let tests = measure(&truth, 6, Vector3::zeros(), &mut random);
        let poses: Vec<([f64; 3], [f64; 6])> = (0..20)
            .map(|_| {
                let pose = [
                    random.uniform(-2.0, 2.0),
                    random.uniform(-1.5, 0.0),
                    random.uniform(0.0, 2.0),
                ];
                (pose, wrench(&mut random))
            })
            .collect();
        for (sought, errors) in [parameters(3), expecting.clone()].into_iter().zip(&mut errors) {
            let estimate = fit(&tests, sought, wide());
            let (mut off, mut size) = (0.0, 0.0);
            for (pose, wrench) in &poses {
                let of = |bushings: &Bushings| {
                    let none = Vector3::zeros();
                    Vector3::from(dense_displacement(&mill3(), pose, none, bushings, wrench))
                };
                let exact = of(&truth);
                off += (of(&estimate.bushings) - exact).norm_squared();
                size += exact.norm_squared();
            }
            errors.push((off / size).sqrt());
            let on_bounds = estimate.bushings.iter().flat_map(|bushing| bushing.stiffness);
            let on_bounds = on_bounds.filter(|k| End::reached([1e4, 1e12], *k).is_some()).count();
            println!("{seed}: off by {:.3}, {on_bounds} on bounds", (off / size).sqrt());
        }
    }
    let median = |errors: &mut Vec<f64>| {
        errors.sort_by(f64::total_cmp);
        errors[errors.len() / 2]
    };
    let [without, with] = errors.each_mut().map(median);
    println!("median error of predictions {without:.3}, with the prior {with:.3}");
    assert!(with < without, "{with} {without}");
}

/// One dial gauge determines nothing, and the prior does not make it so: no parameter is known by it alone.
#[test]
fn the_prior_makes_nothing_known() {
    let mut sought = parameters(3);
    sought.expect_stiffnesses();
    let mut tests = table(391, 1);
    tests[0].displacement[0] = None;
    tests[0].displacement[1] = None;
    // Bounds so narrow that what lies anywhere between them would be known to 5 %.
    let narrow = Bounds::new([1e7, 1.1e7], [1e6, 1.1e6], [1e3, 1e5], [1e2, 5e4]).unwrap();
    for bounds in [wide(), narrow] {
        let estimate = fit(&tests, sought.clone(), bounds);
        let joints = estimate.bushings.iter().zip(&estimate.standard_deviations);
        for ((value, deviation), ranges) in joints.zip(&bounds.joints) {
            for dof in 0..6 {
                assert!(deviation.stiffness[dof] > 0.3 * value.stiffness[dof]);
                let [lower, upper] = ranges.stiffness[dof].map(f64::ln);
                let away = value.stiffness[dof].ln() - 0.5 * (lower + upper);
                assert!(away.abs() < 3.0, "{dof}: {away} from the middle");
            }
        }
    }
}

/// A gauge along the base's axes reads the same whatever way the tool points.
#[test]
fn axes_of_the_base_are_turned_into_those_of_the_tcp() {
    let mut random = Random::new(392);
    let (chain, bushings) = (mill3(), random.bushings(3));
    for _ in 0..20 {
        let pose = [random.uniform(-2.0, 2.0), random.uniform(-1.5, 0.0), random.uniform(0.0, 2.0)];
        let wrench = wrench(&mut random);
        let linear = chain.linearise(&pose, Vector3::zeros(), &bushings).unwrap();
        let read = |gauge: &Gauge| {
            let read = Deflection::new(&linear, &bushings, &wrench, gauge).unwrap();
            Vector3::from(read.displacement)
        };
        // The scenario's robot turns about z, y and y.
        let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), pose[0])
            * nalgebra::Rotation3::from_axis_angle(&Vector3::y_axis(), pose[1] + pose[2]);
        let tcp = read(&Gauge::default());
        let base = read(&Gauge::default().along_base(&chain, &pose));
        assert!((base - turn * tcp).norm() < 1e-12 * tcp.norm(), "{base} {tcp}");
    }
}
