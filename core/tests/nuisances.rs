//! What is off beside the joints: found where it is sought, seen where it is not. And records that retire.

mod common;

use common::milling::{Conditions, SAMPLES, cut, experiments, record};
use common::{BINS, EXPERIMENTS, MEASUREMENT, Random, bounds, mill3};
use fearless_simd::Level;
use flexid_core::calibration::Nuisances;
use flexid_core::chain::Chain;
use flexid_core::identify::{Acceptance, Estimate, Identifier, Phase};
use flexid_core::parameters::Bushings;
use flexid_core::spectrum::Experiment;
use flexid_core::stream::Record;
use flexid_core::unknowns::{Coordinate, Sought};

type Samples = Record<SAMPLES>;

/// The scenario's records, each changed by `spoil`.
fn spoilt(
    chain: &Chain,
    truth: &Bushings,
    seed: u64,
    spoil: impl Fn(&mut Samples),
) -> Vec<Experiment<BINS>> {
    let mut random = Random::new(seed);
    let mut buffer = [0.0; SAMPLES];
    EXPERIMENTS
        .iter()
        .map(|(pose, rpm, feed)| {
            let force = cut(&mut random, *rpm, *feed);
            let conditions = Conditions::default();
            let mut record = record(chain, pose, truth, &force, &conditions, &mut random);
            spoil(&mut record);
            Experiment::new(&mill3(), &MEASUREMENT, &record, &mut buffer).expect("a good record")
        })
        .collect()
}

fn identify(nuisances: &Nuisances, experiments: &mut [Experiment<BINS>]) -> Estimate {
    let generator = Random::new(5).0;
    let identifier = Identifier::new(mill3(), bounds(), MEASUREMENT, Level::new(), generator);
    let mut identifier = Box::new(identifier.seeking(Sought::new(3, nuisances)));
    identifier.renew(experiments);
    while identifier.step(experiments) != Phase::Settled {}
    identifier.estimate().expect("settled").clone()
}

/// Mean square of the errors in standard deviations, of all 36.
fn scores(estimate: &Estimate, truth: &Bushings) -> f64 {
    let mut sum = 0.0;
    for ((found, truth), deviation) in
        estimate.bushings.iter().zip(truth).zip(&estimate.standard_deviations)
    {
        for dof in 0..6 {
            sum +=
                ((found.stiffness[dof] - truth.stiffness[dof]) / deviation.stiffness[dof]).powi(2);
            sum += ((found.damping[dof] - truth.damping[dof]) / deviation.damping[dof]).powi(2);
        }
    }
    sum / 36.0
}

/// Sought, the nuisance is found within four of its deviations and the intervals hold; not sought, the fit says no.
fn found_and_seen(
    nuisances: &Nuisances,
    wanted: &[(Coordinate, f64)],
    make: impl Fn() -> Vec<Experiment<BINS>>,
    truth: &Bushings,
) {
    let estimate = identify(nuisances, &mut make());
    assert_eq!(estimate.acceptance, Acceptance::Consistent);
    for (coordinate, value) in wanted {
        let nuisance = estimate.nuisances.iter().find(|n| n.coordinate == *coordinate).unwrap();
        println!(
            "{coordinate:?}: {:.6} +- {:.2e}, true {value}",
            nuisance.value, nuisance.deviation
        );
        assert!((nuisance.value - value).abs() < 4.0 * nuisance.deviation, "{nuisance:?}");
    }
    let scores = scores(&estimate, truth);
    assert!((0.3..2.0).contains(&scores), "mean square of the scores {scores}");
    let ignorant = identify(&Nuisances::default(), &mut make());
    println!("ignored: chi^2/dof {:.2}, whiteness {:.0}", ignorant.consistency, ignorant.whiteness);
    assert_ne!(ignorant.acceptance, Acceptance::Consistent);
    assert!(ignorant.consistency > 3.0 && ignorant.whiteness > 20.0);
}

#[test]
fn delay() {
    let truth = Random::new(61).bushings(3);
    // 0.3 ms are 0.6 samples: the spectra are turned instead of the samples.
    let make = || {
        let mut experiments = spoilt(&mill3(), &truth, 62, |_| {});
        for experiment in &mut experiments {
            for bin in 0..experiment.bins() {
                let (sine, cosine) = (experiment.omega(bin) * 0.3e-3).sin_cos();
                for axis in 0..3 {
                    let (re, im) = (
                        experiment.acceleration.re[axis][bin],
                        experiment.acceleration.im[axis][bin],
                    );
                    let (re, im) = (f64::from(re), f64::from(im));
                    experiment.acceleration.re[axis][bin] = (re * cosine + im * sine) as f32;
                    experiment.acceleration.im[axis][bin] = (im * cosine - re * sine) as f32;
                }
            }
        }
        experiments
    };
    let nuisances = Nuisances { delay: Some(1e-3), ..Nuisances::default() };
    found_and_seen(&nuisances, &[(Coordinate::Delay, 0.3e-3)], make, &truth);
}

#[test]
fn gains() {
    let truth = Random::new(63).bushings(3);
    let make = || {
        spoilt(&mill3(), &truth, 64, |record| {
            record.acceleration[1].iter_mut().for_each(|value| *value *= 1.1);
            record.acceleration_noise[1] *= 1.1;
            record.force[2].iter_mut().for_each(|value| *value *= 0.95);
            record.force_noise[2] *= 0.95;
        })
    };
    let nuisances =
        Nuisances { acceleration_gain: Some(0.1), force_gain: Some(0.1), ..Nuisances::default() };
    let wanted = [
        (Coordinate::AccelerationGain(0), 1.0),
        (Coordinate::AccelerationGain(1), 1.1),
        (Coordinate::ForceGain(2), 0.95),
    ];
    found_and_seen(&nuisances, &wanted, make, &truth);
}

#[test]
fn misalignment() {
    let truth = Random::new(65).bushings(3);
    let turn = nalgebra::Vector3::new(0.01, -0.02, 0.015);
    let back = nalgebra::Rotation3::new(turn).inverse();
    let make = || {
        spoilt(&mill3(), &truth, 66, |record| {
            for n in 0..SAMPLES {
                let a =
                    nalgebra::Vector3::from_fn(|axis, _| f64::from(record.acceleration[axis][n]));
                for (axis, value) in (back * a).iter().enumerate() {
                    record.acceleration[axis][n] = *value as f32;
                }
            }
        })
    };
    let nuisances = Nuisances { misalignment: Some(0.03), ..Nuisances::default() };
    let wanted = [0, 1, 2].map(|axis| (Coordinate::Misalignment(axis), turn[axis]));
    found_and_seen(&nuisances, &wanted, make, &truth);
}

#[test]
fn masses() {
    let truth = Random::new(67).bushings(3);
    let heavy = mill3().weighing(&[1.0, 1.05, 0.95]);
    let make = || spoilt(&heavy, &truth, 68, |_| {});
    let nuisances = Nuisances { mass: Some(0.05), ..Nuisances::default() };
    let wanted = [1.0, 1.05, 0.95].into_iter().enumerate();
    let wanted: Vec<_> = wanted.map(|(link, mass)| (Coordinate::Mass(link), mass)).collect();
    found_and_seen(&nuisances, &wanted, make, &truth);
}

/// A damping that is known and two stiffnesses that are one.
#[test]
fn fixed_and_tied_parameters() {
    let mut truth = Random::new(69).bushings(3);
    truth[1].stiffness[1] = truth[1].stiffness[0];
    let mut records = experiments(&truth, &mut Random::new(70));
    let mut sought = Sought::new(3, &Nuisances::default());
    sought.fix(Coordinate::Damping { joint: 0, dof: 3 }, truth[0].damping[3]);
    sought.tie(
        Coordinate::Stiffness { joint: 1, dof: 1 },
        Coordinate::Stiffness { joint: 1, dof: 0 },
    );
    assert_eq!(sought.unknowns(), 34);
    let identifier =
        Identifier::new(mill3(), bounds(), MEASUREMENT, Level::new(), Random::new(5).0);
    let mut identifier = Box::new(identifier.seeking(sought));
    identifier.renew(&records);
    while identifier.step(&mut records) != Phase::Settled {}
    let estimate = identifier.estimate().expect("settled");
    assert_eq!(estimate.acceptance, Acceptance::Consistent);
    let [first, second, ..] = estimate.bushings[1].stiffness;
    assert_eq!(first, second);
    assert!((estimate.bushings[0].damping[3] / truth[0].damping[3] - 1.0).abs() < 1e-12);
    assert_eq!(estimate.standard_deviations[0].damping[3], 0.0);
    let z = (first - truth[1].stiffness[0]) / estimate.standard_deviations[1].stiffness[0];
    assert!(z.abs() < 4.0, "{z}");
}

/// Twelve records, of which three are kept: as good as all twelve.
#[test]
fn retired_records_lose_nothing() {
    let truth = Random::new(71).bushings(3);
    let mut random = Random::new(72);
    let rounds: Vec<_> = (0..4).map(|_| experiments(&truth, &mut random)).collect();
    let new = || Identifier::new(mill3(), bounds(), MEASUREMENT, Level::new(), Random::new(5).0);
    let mut all: Vec<_> = rounds.iter().flatten().cloned().collect();
    let mut whole = Box::new(new());
    whole.renew(&all);
    while whole.step(&mut all) != Phase::Settled {}
    let mut folding = Box::new(new());
    let mut kept: Vec<Experiment<BINS>> = Vec::new();
    for experiment in rounds.iter().flatten() {
        if kept.len() == 3 {
            assert!(folding.retire(&mut kept[0]));
            kept.remove(0);
        }
        kept.push(experiment.clone());
        folding.renew(&kept);
        while folding.step(&mut kept) != Phase::Settled {}
    }
    let (whole, folded) = (whole.estimate().unwrap(), folding.estimate().unwrap());
    assert_eq!((folded.retired, folded.forgotten), (9, 0));
    for (a, b, sigma) in [0, 1, 2].map(|j| {
        (
            &whole.bushings[j],
            &folded.bushings[j],
            (&whole.standard_deviations[j], &folded.standard_deviations[j]),
        )
    }) {
        for dof in 0..6 {
            let apart = (a.stiffness[dof] - b.stiffness[dof]) / sigma.0.stiffness[dof];
            let wider = sigma.1.stiffness[dof] / sigma.0.stiffness[dof];
            assert!(
                apart.abs() < 0.3 && (wider - 1.0).abs() < 0.03,
                "{dof}: {apart:.3} {wider:.3}"
            );
            let apart = (a.damping[dof] - b.damping[dof]) / sigma.0.damping[dof];
            let wider = sigma.1.damping[dof] / sigma.0.damping[dof];
            assert!(
                apart.abs() < 0.3 && (wider - 1.0).abs() < 0.03,
                "{dof}: {apart:.3} {wider:.3}"
            );
        }
    }
}

/// A robot whose bushing gives way: the old records contradict the new ones and are forgotten.
#[test]
fn a_robot_that_changes_is_not_averaged() {
    changes(1, 0.9);
}

/// However much is known of it as it was: 120 records against three.
#[test]
fn a_small_change_is_seen_beside_much_knowledge() {
    changes(40, 0.97);
}

/// Each of three records retires so many times; then a stiffness changes by a factor.
fn changes(times: usize, factor: f64) {
    let before = Random::new(73).bushings(3);
    let mut after = before.clone();
    after[1].stiffness[4] *= factor;
    let mut random = Random::new(74);
    let mut identifier =
        Box::new(Identifier::new(mill3(), bounds(), MEASUREMENT, Level::new(), Random::new(5).0));
    let mut kept = experiments(&before, &mut random);
    identifier.renew(&kept);
    while identifier.step(&mut kept) != Phase::Settled {}
    for _ in 0..times {
        assert!(kept.iter_mut().all(|experiment| identifier.retire(experiment)));
    }
    kept = experiments(&after, &mut random);
    identifier.renew(&kept);
    while identifier.step(&mut kept) != Phase::Settled {}
    let estimate = identifier.estimate().unwrap();
    let forgotten = 3 * times as u64;
    assert_eq!((estimate.acceptance, estimate.forgotten), (Acceptance::Consistent, forgotten));
    let off = estimate.bushings[1].stiffness[4] / after[1].stiffness[4] - 1.0;
    assert!(off.abs() < 0.01, "{off}");
}
