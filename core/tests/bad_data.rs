//! Data that determine no parameter: a clear error, or a verdict that says so; never a confident number, never a
//! panic.

use std::error::Error;

use flexid_core::MAX_JOINTS;
use flexid_core::chain::{Chain, Joint, JointKind, Link};
use flexid_core::identify::{Acceptance, Estimate, Identifier};
use flexid_core::imperfection::Imperfection;
use flexid_core::parameters::{Bounds, Bushings, EmptyBounds, Ranges};
use flexid_core::sought::Coordinate;
use flexid_core::spectrum::{Experiment, Measurement, SpectrumError};
use flexid_core::statics::StaticTestError;
use flexid_core::stream::{AngleSignal, Record, Stream, StreamConfig};
use flexid_core::verdict::Verdict;

use crate::common::fits::{Generator, parameters, settle};
use crate::common::milling::{Conditions, SAMPLES, cut, record};
use crate::common::{BINS, EXPERIMENTS, MEASUREMENT, Random, bounds, mill3, nominal};
use fearless_simd::Level;
use nalgebra::{Isometry3, Matrix3, Translation3, Vector3};

/// Spoils a record with a value.
type Spoil = fn(&mut Record<SAMPLES>, f32);

// An identifier is large: inlined, it would take room on the stack of its caller.
#[inline(never)]
fn identifier(
    chain: &Chain,
    measurement: Measurement,
    bounds: Bounds,
) -> Box<Identifier<Generator>> {
    let generator = Random::new(7).0;
    Box::new(Identifier::new(chain.clone(), bounds, measurement, Level::new(), generator))
}

/// The result of an [`Identifier`] from these experiments, and its remarks on each.
fn identify(
    chain: &Chain,
    measurement: Measurement,
    bounds: Bounds,
    experiments: &[Experiment<BINS>],
) -> (Estimate, Vec<(Coordinate, Verdict)>) {
    let mut identifier = identifier(chain, measurement, bounds);
    let estimate = settle(&mut identifier, experiments);
    let verdicts = verdicts(&estimate);
    (estimate, verdicts)
}

/// The record of a cut in a pose, from one spindle speed to another, along a feed, once it has been spoilt.
// Records are large: inlined, they would take room on the stack of a test that identifies.
#[inline(never)]
fn cut_of(
    chain: &Chain,
    truth: &Bushings,
    (pose, rpm, feed): (&[f64], [f64; 2], usize),
    random: &mut Random,
    spoil: &dyn Fn(&mut Record<SAMPLES>),
) -> Experiment<BINS> {
    let force = cut(random, rpm, feed);
    let mut record = record(chain, pose, truth, &force, &Conditions::default(), random);
    spoil(&mut record);
    Experiment::new(chain, &MEASUREMENT, &record, &mut [0.0; SAMPLES]).expect("a good record")
}

fn verdicts(estimate: &Estimate) -> Vec<(Coordinate, Verdict)> {
    let trust = estimate.trust();
    let pairs = estimate.bushings.iter().zip(&estimate.standard_deviations).enumerate();
    let verdicts = pairs.flat_map(|(joint, (value, deviation))| {
        (0..6).flat_map(move |dof| {
            [
                (
                    Coordinate::Stiffness { joint, dof },
                    value.stiffness[dof],
                    deviation.stiffness[dof],
                ),
                (Coordinate::Damping { joint, dof }, value.damping[dof], deviation.damping[dof]),
            ]
        })
    });
    verdicts.map(|(who, value, deviation)| (who, trust.verdict(value, deviation).0)).collect()
}

fn identified(verdicts: &[(Coordinate, Verdict)]) -> Vec<Coordinate> {
    verdicts
        .iter()
        .filter(|(_, verdict)| *verdict == Verdict::Identified)
        .map(|(who, _)| *who)
        .collect()
}

/// The scenario's first record, before it is looked at.
fn one_record() -> Box<Record<SAMPLES>> {
    let mut random = Random::new(3);
    let (pose, rpm, feed) = EXPERIMENTS[0];
    let force = cut(&mut random, rpm, feed);
    Box::new(record(&mill3(), &pose, &nominal(), &force, &Conditions::default(), &mut random))
}

// Inlined, its buffer would take room on the stack of a test that identifies.
#[inline(never)]
fn spectra(
    record: &Record<SAMPLES>,
    measurement: &Measurement,
) -> Result<Experiment<BINS>, SpectrumError> {
    Experiment::new(&mill3(), measurement, record, &mut [0.0; SAMPLES])
}

/// The fate of a record that is spoilt.
fn spoilt(spoil: impl FnOnce(&mut Record<SAMPLES>)) -> Result<Experiment<BINS>, SpectrumError> {
    let mut record = one_record();
    spoil(&mut record);
    spectra(&record, &MEASUREMENT)
}

#[test]
fn fewer_data_than_unknowns_identify_nothing() {
    // Bins of 0.244 Hz: 48 real numbers, of which the seam takes 42.
    let measurement = Measurement { band_hz: [20.0, 21.8], ..MEASUREMENT };
    let experiments = [spectra(&one_record(), &measurement).expect("8 bins are enough")];
    assert_eq!(experiments[0].bins(), 8);
    let (estimate, verdicts) = identify(&mill3(), measurement, bounds(), &experiments);
    assert_eq!(identified(&verdicts), [], "χ²/dof {}", estimate.consistency);
    assert!(!estimate.weak_directions.is_empty());

    let measurement = Measurement { band_hz: [20.0, 21.6], ..MEASUREMENT };
    assert_eq!(spectra(&one_record(), &measurement).err(), Some(SpectrumError::Bins(7)));
}

#[test]
fn a_record_without_force_is_refused() {
    let mut random = Random::new(5);
    let quiet = spoilt(|record| {
        for sample in record.force.iter_mut().flatten() {
            *sample = record.force_noise[0] * random.normal() as f32;
        }
    });
    assert_eq!(quiet.err(), Some(SpectrumError::NoForce));
    for noise in [0.16, 0.0] {
        let dead = spoilt(|record| {
            record.force.iter_mut().flatten().for_each(|sample| *sample = 0.0);
            record.force_noise = [noise; 3];
        });
        assert_eq!(dead.err(), Some(SpectrumError::NoForce), "noise {noise}");
    }
}

/// An arm that stands upright with its TCP on the first axis: no force at the TCP turns anything about it.
#[test]
fn a_singular_pose_names_what_it_does_not_tell() {
    let joint = |height, axis| Joint {
        origin: Translation3::new(0.0, 0.0, height).into(),
        axis,
        kind: JointKind::Revolute,
        link: Link {
            mass: 300.0,
            centre_of_mass: Vector3::new(0.0, 0.0, 0.5),
            inertia: Matrix3::from_diagonal(&Vector3::new(40.0, 50.0, 20.0)),
        },
    };
    let joints = [joint(0.0, Vector3::z_axis()), joint(1.0, Vector3::y_axis())];
    let tcp = Isometry3::from(Translation3::new(0.0, 0.0, 1.1));
    let chain = Chain::new(&joints, tcp).expect("physical");
    let truth: Bushings = nominal().into_iter().take(2).collect();
    let mut random = Random::new(11);
    let experiments: Vec<Experiment<BINS>> = (0..3)
        .map(|feed| {
            let at = (&[0.4, 0.0][..], [600.0, 4200.0], feed);
            cut_of(&chain, &truth, at, &mut random, &|_| {})
        })
        .collect();
    let (estimate, verdicts) = identify(&chain, MEASUREMENT, bounds(), &experiments);
    let about_the_axis = |who: &Coordinate| {
        let (Coordinate::Stiffness { dof, .. } | Coordinate::Damping { dof, .. }) = who else {
            return false;
        };
        *dof == 5
    };
    for (who, verdict) in &verdicts {
        let expected = about_the_axis(who).then_some(Verdict::NotObservable);
        assert!(expected.is_none_or(|expected| *verdict == expected), "{who:?} is {verdict:?}");
    }
    assert!(identified(&verdicts).len() >= 12, "the rest is determined: {verdicts:?}");
    assert_true(&estimate, &truth, &verdicts);
    let named: Vec<usize> = estimate
        .weak_directions
        .iter()
        .flat_map(|direction| direction.shares.iter().map(|(unknown, _)| usize::from(*unknown)))
        .collect();
    // Without nuisances an unknown is its coordinate: 12 per joint.
    for unknown in [5, 11, 17, 23] {
        assert!(named.contains(&unknown), "{unknown} is not in {named:?}");
    }
}

/// Whatever is said to be identified is right.
fn assert_true(estimate: &Estimate, truth: &Bushings, verdicts: &[(Coordinate, Verdict)]) {
    for who in identified(verdicts) {
        let (found, truth, deviation) = match who {
            Coordinate::Stiffness { joint, dof } => (
                estimate.bushings[joint].stiffness[dof],
                truth[joint].stiffness[dof],
                estimate.standard_deviations[joint].stiffness[dof],
            ),
            Coordinate::Damping { joint, dof } => (
                estimate.bushings[joint].damping[dof],
                truth[joint].damping[dof],
                estimate.standard_deviations[joint].damping[dof],
            ),
            _ => unreachable!("no nuisances are sought"),
        };
        let score = (found - truth) / deviation;
        assert!(score.abs() < 4.5, "{who:?}: {found:e} ± {deviation:e}, not {truth:e}");
    }
}

/// Three records of one pose and one cut hold little more than one of them.
#[test]
fn the_same_pose_again_and_again_makes_nothing_up() {
    let truth = nominal();
    let mut random = Random::new(13);
    let force = cut(&mut random, [600.0, 900.0], 2);
    // All axes in one plane, the arm stretched out.
    let pose = [0.0; 3];
    let experiments: Vec<Experiment<BINS>> = (0..3)
        .map(|_| {
            let conditions = Conditions { noise: 30.0, ..Conditions::default() };
            // On the heap: the stack is for the identifier.
            let record =
                Box::new(record(&mill3(), &pose, &truth, &force, &conditions, &mut random));
            spectra(&record, &MEASUREMENT).expect("a good record")
        })
        .collect();
    let (estimate, verdicts) = identify(&mill3(), MEASUREMENT, bounds(), &experiments);
    assert!(!estimate.weak_directions.is_empty());
    assert!(identified(&verdicts).len() < 36, "{verdicts:?}");
    assert_true(&estimate, &truth, &verdicts);
}

/// In gravity no guess within these bounds comes to rest: an estimate that says nothing, and no panic.
#[test]
fn bounds_too_soft_for_gravity_identify_nothing() {
    let measurement = Measurement { gravity: [0.0, 0.0, -9.80665], ..MEASUREMENT };
    let (soft, damping) = ([1e2, 1e3], [1e3, 1e5]);
    let limp = Bounds::new(soft, soft, damping, damping).expect("in order");
    let experiments = [spectra(&one_record(), &measurement).expect("a good record")];
    let (estimate, verdicts) = identify(&mill3(), measurement, limp, &experiments);
    assert_eq!(estimate.acceptance, Acceptance::Unsettled);
    assert!(verdicts.iter().all(|(_, verdict)| *verdict == Verdict::NotObservable), "{verdicts:?}");
}

/// No sensor is free of noise: who says so is not believed where it matters.
#[test]
fn noise_of_zero_gives_no_confident_number() {
    let silent: [(Spoil, usize); 4] = [
        // The acceleration's noise outweighs it by far: the numbers are right, and so are their deviations.
        (|record, zero| record.force_noise = [zero; 3], 36),
        (|record, zero| record.acceleration_noise = [zero; 3], 0),
        (|record, zero| record.acceleration_noise[1] = zero, 0),
        (
            |record, zero| (record.force_noise, record.acceleration_noise) = ([zero; 3], [zero; 3]),
            0,
        ),
    ];
    let truth = nominal();
    for (case, (silence, expected)) in silent.into_iter().enumerate() {
        let mut random = Random::new(17);
        let made = EXPERIMENTS.iter().map(|(pose, rpm, feed)| {
            let at = (&pose[..], *rpm, *feed);
            cut_of(&mill3(), &truth, at, &mut random, &|record| silence(record, 0.0))
        });
        let experiments: Vec<Experiment<BINS>> = made.collect();
        let (estimate, verdicts) = identify(&mill3(), MEASUREMENT, bounds(), &experiments);
        assert_eq!(identified(&verdicts).len(), expected, "{case}: {}", estimate.consistency);
        assert_true(&estimate, &truth, &verdicts);
    }
}

/// Noise that was read in the cut would explain any model.
#[test]
fn noise_that_is_too_loud_gives_no_confident_number() {
    let truth = nominal();
    let mut random = Random::new(18);
    let made = EXPERIMENTS.iter().map(|(pose, rpm, feed)| {
        cut_of(&mill3(), &truth, (&pose[..], *rpm, *feed), &mut random, &|record| {
            let noise = record.force_noise.iter_mut().chain(&mut record.acceleration_noise);
            noise.for_each(|noise| *noise *= 3.0);
        })
    });
    let experiments: Vec<Experiment<BINS>> = made.collect();
    let (estimate, verdicts) = identify(&mill3(), MEASUREMENT, bounds(), &experiments);
    assert!((0.1..0.12).contains(&estimate.consistency), "{}", estimate.consistency);
    assert!(estimate.noise_too_loud);
    assert_eq!(estimate.acceptance, Acceptance::Unsettled);
    assert_eq!(identified(&verdicts), []);
}

#[test]
fn what_is_no_number_is_refused() {
    let spoilings: [Spoil; 5] = [
        |record, value| record.force[1][77] = value,
        |record, value| record.acceleration[2][SAMPLES - 1] = value,
        |record, value| record.force_noise[0] = value,
        |record, value| record.acceleration_noise[2] = value,
        |record, value| record.pose[1] = f64::from(value),
    ];
    for value in [f32::NAN, f32::INFINITY] {
        for (number, spoil) in spoilings.iter().enumerate() {
            let refusal = spoilt(|record| spoil(record, value)).err();
            assert_eq!(refusal, Some(SpectrumError::NotFinite), "{number}, {value}");
        }
        let rate = spoilt(|record| record.rate_hz = f64::from(value));
        assert_eq!(rate.err(), Some(SpectrumError::Bins(0)));
    }
}

#[test]
fn a_record_of_other_lengths_or_another_robot_is_refused() {
    let short = spoilt(|record| record.acceleration[1].truncate(SAMPLES / 2));
    assert_eq!(short.err(), Some(SpectrumError::Length(SAMPLES / 2)));
    let odd = spoilt(|record| {
        let signals = record.force.iter_mut().chain(&mut record.acceleration);
        signals.for_each(|signal| signal.truncate(3000));
    });
    assert_eq!(odd.err(), Some(SpectrumError::Length(3000)));
    let other = spoilt(|record| record.pose.truncate(2));
    assert_eq!(other.err(), Some(SpectrumError::Pose(2)));
}

#[test]
fn bounds_without_width_are_refused() {
    let (stiffness, damping) = ([1e7, 2e8], [1e3, 1e5]);
    for empty in
        [[1e7; 2], [2e7, 1e7], [0.0, 1e7], [-1.0, 1e7], [1e7, f64::INFINITY], [f64::NAN; 2]]
    {
        assert_eq!(
            Bounds::new(empty, stiffness, damping, damping),
            Err(EmptyBounds { joint: 0, damping: false, dof: 0 })
        );
        assert_eq!(
            Bounds::new(stiffness, stiffness, damping, empty),
            Err(EmptyBounds { joint: 0, damping: true, dof: 3 })
        );
    }
    // Who makes them by hand gets values that lie on them, and no deviation.
    let experiments = [spectra(&one_record(), &MEASUREMENT).expect("a good record")];
    let none = Bounds::alike(Ranges { stiffness: [[5e7; 2]; 6], damping: [[1e4; 2]; 6] });
    let (estimate, verdicts) = identify(&mill3(), MEASUREMENT, none, &experiments);
    assert_eq!(identified(&verdicts), [], "χ²/dof {}", estimate.consistency);
}

#[test]
fn errors_name_the_place_and_the_remedy() {
    let (chain, link) = (mill3(), mill3().joints()[0]);
    let joints = |change: fn(&mut Joint)| {
        let mut joints = chain.joints().to_vec();
        change(&mut joints[1]);
        Chain::new(&joints, *chain.tcp()).err()
    };
    let nowhere = Translation3::new(f64::NAN, 0.0, 0.0).into();
    let delay = Coordinate::Imperfection(Imperfection::Delay);
    let stiffness = Coordinate::Stiffness { joint: 1, dof: 5 };
    let mut sought = parameters(3);
    let config = StreamConfig {
        rate_hz: 2000.0,
        record_samples: 8192,
        joints: 3,
        counter_bits: 4,
        force_resolution: 0.1,
        acceleration_resolution: 0.01,
        angles: [AngleSignal::FINE; MAX_JOINTS],
    };
    let empty = EmptyBounds { joint: 2, damping: true, dof: 0 };
    let errors: [(Option<Box<dyn Error>>, &str); 12] = [
        (Chain::new(&[], *chain.tcp()).err().map(Into::into), "0 joints: a chain has 1 to 7"),
        (
            joints(|joint| joint.link.mass = 0.0).map(Into::into),
            "mass of joint 2's link: must be positive and finite",
        ),
        (
            joints(|joint| joint.link.inertia[(0, 1)] = 1e3).map(Into::into),
            "inertia of joint 2's link: must be ",
        ),
        (
            joints(|joint| joint.link.centre_of_mass.x = f64::NAN).map(Into::into),
            "pose, axis and centre of mass of joint 2: must be finite",
        ),
        (Chain::new(&[link], nowhere).err().map(Into::into), "pose of the TCP: must be finite"),
        (sought.fix(delay, 1.0).err().map(Into::into), "Delay: the chain has no such parameter"),
        (
            sought.fix(stiffness, -1.0).err().map(Into::into),
            "joint 2 rz stiffness is fixed at -1: must be positive and finite",
        ),
        (
            Stream::<SAMPLES>::new(config).err().map(Into::into),
            "width of the counters: must be 8 to 32 bits",
        ),
        (Some(empty.into()), "range of joint 3's tx damping: must be 0 < lower < upper"),
        (
            Some(SpectrumError::Bins(7).into()),
            "the record's band holds 7 bins, of 8 that are needed: widen the band or record for longer",
        ),
        (
            Some(SpectrumError::Bins(9000).into()),
            "the record's band holds 9000 bins, more than fit: narrow the band or record for less time",
        ),
        (
            Some(StaticTestError::Pose(0).into()),
            "pose of static test 1: give one angle per driven joint",
        ),
    ];
    for (error, message) in errors {
        let error = error.expect(message).to_string();
        assert!(error.starts_with(message), "{error}");
    }
}
