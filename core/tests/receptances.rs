//! Measured receptances as records without a seam: alone, beside cuts, and with exponential windows. The responses are those of the dense
//! model.

use std::f64::consts::TAU;

use flexid_core::identify::Acceptance;
use flexid_core::parameters::Bushings;
use flexid_core::spectrum::{Experiment, MeasuredBin, MeasuredReceptance, SpectrumError};
use nalgebra::{Complex, Vector3};

use crate::common::fits::{identifier, mean_square, parameters, relative, scores, settle};
use crate::common::milling::experiments;
use crate::common::{BINS, Dense, EXPERIMENTS, MEASUREMENT, Random, mill3, nominal};

/// As far apart as the bins of a record of 4.1 s.
const SPACING_HZ: f64 = 0.25;
/// Standard deviation of magnitude and phase, relative.
const NOISE: f64 = 0.01;
/// Robots that are also cut.
const CUT: u64 = 5;

/// A modal test: what was struck, and what was read.
#[derive(Clone, Copy)]
struct Test {
    /// Directions of the blows, TCP axes.
    directions: &'static [[f64; 3]],
    /// Axes of the accelerometer that read.
    axes: [bool; 3],
    noise: f64,
    decay: f64,
    first_hz: f64,
}

const WHOLE: Test = Test {
    directions: &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    axes: [true; 3],
    noise: NOISE,
    decay: 0.0,
    first_hz: 1.0,
};

/// The frequency responses of a robot in the scenario's poses.
fn tested(test: &Test, truth: &Bushings, random: &mut Random) -> Vec<Experiment<BINS>> {
    let mut all = Vec::new();
    for (pose, ..) in EXPERIMENTS {
        let dense = Dense::new(&mill3(), &pose, Vector3::zeros(), &[[0.0; 6]; 3]);
        let s =
            |bin: usize| Complex::new(test.decay, TAU * (test.first_hz + SPACING_HZ * bin as f64));
        let accelerances: Vec<_> =
            (0..=820).map(|bin| dense.receptance(truth, s(bin)) * (s(bin) * s(bin))).collect();
        for direction in test.directions {
            let along = Vector3::from(*direction).map(Complex::from);
            let axes = [0, 1, 2].map(|axis| -> Vec<MeasuredBin> {
                if !test.axes[axis] {
                    return Vec::new();
                }
                let measured = accelerances.iter().map(|entries| {
                    let own = (entries * along)[axis];
                    let deviation = test.noise * own.norm();
                    let accelerance =
                        [own.re, own.im].map(|part| part + deviation * random.normal());
                    MeasuredBin { accelerance, variance: 2.0 * deviation * deviation }
                });
                measured.collect()
            });
            let measured = MeasuredReceptance {
                pose: &pose,
                point: [0.0; 3],
                direction: *direction,
                spacing_hz: SPACING_HZ,
                first_hz: test.first_hz,
                decay: test.decay,
                axes: axes.each_ref().map(Vec::as_slice),
            };
            all.push(Experiment::of_receptance(&mill3(), &MEASUREMENT, &measured).unwrap());
        }
    }
    all
}

/// Identifies a drawn robot, and returns the errors of its parameters in standard deviations, and these.
fn identified(test: &Test, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let mut random = Random::new(seed);
    let truth = random.bushings(3);
    let tested = tested(test, &truth, &mut random);
    let estimate = settle(&mut identifier(parameters(3)), &tested);
    assert_eq!(estimate.acceptance, Acceptance::Consistent, "robot {seed}");
    let relative = relative(&estimate);
    (scores(&estimate.bushings, &truth, &relative), relative)
}

/// Three poses, three directions, 1 % noise: the intervals hold, and the deviations are those of three cuts or less.
#[test]
fn receptances_alone_identify_as_much_as_cuts() {
    let (mut all, mut held, mut known, mut known_by_cuts) = (Vec::new(), 0, 0, 0);
    let is_known = |relative: &[f64]| relative.iter().filter(|own| **own < 0.1).count();
    for seed in 0..20 {
        let (scores, relative) = identified(&WHOLE, seed);
        held += scores.iter().filter(|score| score.abs() < 1.96).count();
        all.extend(scores);
        if seed < CUT {
            known += is_known(&relative);
            let mut random = Random::new(seed);
            let truth = random.bushings(3);
            let cuts = experiments(&truth, &mut random);
            let estimate = settle(&mut identifier(parameters(3)), &cuts);
            known_by_cuts += is_known(&self::relative(&estimate));
        }
    }
    let coverage = held as f64 / all.len() as f64;
    println!(
        "receptances of 3 poses and 3 directions, 1 % noise, 20 robots: {coverage:.3} of {} intervals hold, mean square {:.2}; {CUT} robots, known to 10 %: {known}, by three cuts {known_by_cuts}",
        all.len(),
        mean_square(&all)
    );
    assert!((0.93..0.98).contains(&coverage), "{coverage}");
    assert!(known as f64 > 0.8 * known_by_cuts as f64, "{known} {known_by_cuts}");
}

/// One axis is read, or the window decays: the intervals hold.
#[test]
fn a_part_of_the_directions_and_a_window_are_allowed() {
    let one_axis = Test { axes: [false, false, true], ..WHOLE };
    let one_blow = Test { directions: &[[0.0, 0.6, -0.8]], ..WHOLE };
    let windowed = Test { decay: 3.0, ..WHOLE };
    let zoomed = Test { first_hz: 1.9, ..WHOLE };
    for (name, test) in [
        ("one axis", one_axis),
        ("one blow", one_blow),
        ("a window", windowed),
        ("frequencies that are no multiples of their distance", zoomed),
    ] {
        let mut all = Vec::new();
        for seed in 30..34 {
            all.extend(identified(&test, seed).0);
        }
        let held = all.iter().filter(|score| score.abs() < 1.96).count() as f64;
        let coverage = held / all.len() as f64;
        println!("{name}: {coverage:.3} of {} intervals hold", all.len());
        // 144 intervals: 0.95 ± 0.018.
        assert!((0.89..=1.0).contains(&coverage), "{name}: {coverage}");
    }
}

/// A window that nobody states makes the dampings wrong, and the fit says so.
#[test]
fn a_window_that_is_not_stated_shows() {
    let mut random = Random::new(41);
    let truth = nominal();
    let mut tested = tested(&Test { decay: 3.0, ..WHOLE }, &truth, &mut random);
    for experiment in &mut tested {
        experiment.kind = flexid_core::spectrum::Kind::Receptance { decay: 0.0, first: TAU };
    }
    let estimate = settle(&mut identifier(parameters(3)), &tested);
    let relative = relative(&estimate);
    let wrong = scores(&estimate.bushings, &truth, &relative);
    assert!(
        estimate.acceptance != Acceptance::Consistent || mean_square(&wrong) > 10.0,
        "{wrong:.1?}"
    );
    assert!(estimate.acceptance != Acceptance::Consistent, "{:?}", estimate.consistency);
}

/// Errors that are stated four times too large widen the intervals, and the fit is consistent.
#[test]
fn errors_may_be_smaller_than_stated() {
    let mut random = Random::new(42);
    let truth = random.bushings(3);
    let mut tested = tested(&WHOLE, &truth, &mut random);
    for experiment in &mut tested {
        experiment.acceleration_noise.iter_mut().flatten().for_each(|noise| *noise *= 16.0);
    }
    let estimate = settle(&mut identifier(parameters(3)), &tested);
    assert_eq!(estimate.acceptance, Acceptance::Consistent);
    let scores = scores(&estimate.bushings, &truth, &relative(&estimate));
    assert!(mean_square(&scores) < 0.2, "{scores:.1?}");
}

/// Beside cuts: the information adds up.
#[test]
fn receptances_and_cuts_are_fitted_together() {
    let mut random = Random::new(51);
    let truth = random.bushings(3);
    let mut all = experiments(&truth, &mut random);
    let cuts = relative(&settle(&mut identifier(parameters(3)), &all));
    all.extend(tested(&WHOLE, &truth, &mut random));
    let estimate = settle(&mut identifier(parameters(3)), &all);
    assert_eq!(estimate.acceptance, Acceptance::Consistent);
    let both = relative(&estimate);
    let scores = scores(&estimate.bushings, &truth, &both);
    assert!(mean_square(&scores) < 2.0, "{scores:.1?}");
    for (both, cuts) in both.iter().zip(&cuts) {
        assert!(*both < 1.1 * cuts, "{both} {cuts}");
    }
}

/// Of values that say nothing there is no experiment.
#[test]
fn bad_input_is_refused() {
    let bins = |count: usize, variance: f64| {
        vec![MeasuredBin { accelerance: [1e-3, 1e-4], variance }; count]
    };
    let (good, short) = (bins(100, 1e-10), bins(99, 1e-10));
    let refused = |change: &dyn Fn(&mut MeasuredReceptance<'_>)| {
        let mut measured = MeasuredReceptance {
            pose: &[0.0; 3],
            point: [0.0; 3],
            direction: [1.0, 0.0, 0.0],
            spacing_hz: 1.0,
            first_hz: 2.0,
            decay: 0.0,
            axes: [&good, &good, &[]],
        };
        change(&mut measured);
        Experiment::<BINS>::of_receptance(&mill3(), &MEASUREMENT, &measured).err()
    };
    assert_eq!(refused(&|_| {}), None);
    assert_eq!(refused(&|own| own.pose = &[0.0]), Some(SpectrumError::Pose(1)));
    assert_eq!(refused(&|own| own.spacing_hz = 0.0), Some(SpectrumError::NotFinite));
    assert_eq!(refused(&|own| own.decay = f64::NAN), Some(SpectrumError::NotFinite));
    let bad = bins(100, 0.0);
    let unknown = bins(100, f64::INFINITY);
    let checked = [&bad[..], &good, &[]];
    let of = |axes: [&[MeasuredBin]; 3]| {
        let measured = MeasuredReceptance {
            pose: &[0.0; 3],
            point: [0.0; 3],
            direction: [1.0, 0.0, 0.0],
            spacing_hz: 1.0,
            first_hz: 2.0,
            decay: 0.0,
            axes,
        };
        Experiment::<BINS>::of_receptance(&mill3(), &MEASUREMENT, &measured).err()
    };
    assert_eq!(of(checked), Some(SpectrumError::NotFinite));
    assert_eq!(of([&unknown, &good, &[]]), None);
    assert_eq!(of([&good, &short, &[]]), Some(SpectrumError::Bins(99)));
    assert_eq!(of([&[], &[], &[]]), Some(SpectrumError::Bins(0)));
    assert_eq!(of([&good[..7], &good[..7], &[]]), Some(SpectrumError::Bins(7)));
}
