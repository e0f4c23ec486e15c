//! Errors beside the joints: found where it is sought, seen where it is not. And records that retire.

use flexid_core::chain::Chain;
use flexid_core::identify::{Acceptance, Estimate};
use flexid_core::imperfection::{Imperfection, Sensor};
use flexid_core::parameters::Bushings;
use flexid_core::sought::{Coordinate, Sought};
use flexid_core::spectrum::Experiment;
use flexid_core::stream::Record;

use crate::common::fits::{identifier, mean_square, parameters, relative, scores, settle};
use crate::common::milling::{Conditions, SAMPLES, STEPS, cut, experiments, record};
use crate::common::{BINS, EXPERIMENTS, MEASUREMENT, Random, mill3};

type Samples = Record<SAMPLES>;

/// The scenario's records under these conditions, each changed by `spoil`.
fn spoilt(
    chain: &Chain,
    truth: &Bushings,
    seed: u64,
    conditions: &Conditions,
    spoil: impl Fn(&mut Samples),
) -> Vec<Experiment<BINS>> {
    let mut random = Random::new(seed);
    let mut buffer = [0.0; SAMPLES];
    EXPERIMENTS
        .iter()
        .map(|(pose, rpm, feed)| {
            let force = cut(&mut random, *rpm, *feed);
            let mut record = record(chain, pose, truth, &force, conditions, &mut random);
            spoil(&mut record);
            Experiment::new(&mill3(), &MEASUREMENT, &record, &mut buffer).expect("a good record")
        })
        .collect()
}

/// Keys of imperfections that are sought, each with its prior.
type Keys<'a> = &'a [(&'a str, f64)];

fn seeking(keys: Keys<'_>) -> Sought {
    let mut sought = Sought::new(3).unwrap();
    keys.iter().for_each(|(key, prior)| sought.seek(key, *prior).unwrap());
    sought
}

fn identify(keys: Keys<'_>, experiments: &[Experiment<BINS>]) -> Estimate {
    settle(&mut identifier(seeking(keys)), experiments)
}

/// Sought, the imperfections are found within four of their deviations and the intervals hold; not sought, the fit says no.
fn found_and_seen(
    keys: Keys<'_>,
    wanted: &[(Imperfection, f64)],
    make: impl Fn() -> Vec<Experiment<BINS>>,
    truth: &Bushings,
) -> Estimate {
    let estimate = identify(keys, &make());
    assert_eq!(estimate.acceptance, Acceptance::Consistent);
    for (imperfection, value) in wanted {
        let own = estimate.imperfections.iter().find(|own| own.imperfection == *imperfection);
        let own = own.unwrap();
        println!("{imperfection:?}: {:.6} +- {:.2e}, true {value}", own.value, own.deviation);
        assert!((own.value - value).abs() < 4.0 * own.deviation, "{own:?}");
    }
    let mean_square = mean_square(&scores(&estimate.bushings, truth, &relative(&estimate)));
    assert!((0.3..2.0).contains(&mean_square), "mean square of the scores {mean_square}");
    let ignorant = identify(&[], &make());
    println!("ignored: chi^2/dof {:.2}, {:?}", ignorant.consistency, ignorant.structure);
    assert_ne!(ignorant.acceptance, Acceptance::Consistent);
    assert!(ignorant.consistency > 3.0 && ignorant.structure.significance > 20.0);
    estimate
}

/// The records determine all imperfections that are sought: what is left of the prior's deviation is a fifth at most. Whoever reports
/// the prior has all of it left.
fn assert_determined(estimate: &Estimate) {
    for own in &estimate.imperfections {
        assert!(own.deviation < own.prior / 5.0, "{own:?}");
    }
}

#[test]
fn delay() {
    let truth = Random::new(61).bushings(3);
    // 0.3 ms are 0.6 samples.
    let conditions = Conditions { late: STEPS * 6 / 10, ..Conditions::default() };
    let make = || spoilt(&mill3(), &truth, 62, &conditions, |_| {});
    let wanted = [(Imperfection::Delay, 0.3e-3)];
    assert_determined(&found_and_seen(&[("delay_s", 1e-3)], &wanted, make, &truth));
}

/// Both sensors twice as sensitive read the same robot: the mean of all logarithms stays what was believed beforehand,
/// and only the ratios are determined.
#[test]
fn gains() {
    let truth = Random::new(63).bushings(3);
    let make = || {
        spoilt(&mill3(), &truth, 64, &Conditions::default(), |record| {
            record.acceleration[1].iter_mut().for_each(|value| *value *= 1.1);
            record.acceleration_noise[1] *= 1.1;
            record.force[2].iter_mut().for_each(|value| *value *= 0.95);
            record.force_noise[2] *= 0.95;
        })
    };
    let prior = 0.1;
    let keys = [("acceleration_gain", prior), ("force_gain", prior)];
    let wanted =
        [1.0_f64, 1.1, 1.0, 1.0, 1.0, 0.95].into_iter().enumerate().map(|(index, gain)| {
            let sensor = [Sensor::Accelerometer, Sensor::Force][index / 3];
            (Imperfection::Gain(sensor, index % 3), gain.ln())
        });
    let wanted: Vec<_> = wanted.collect();
    let estimate = found_and_seen(&keys, &wanted, make, &truth);
    let sought = seeking(&keys);
    let unknown = |own| sought.unknown(Coordinate::Imperfection(own)).unwrap();
    let unknowns: Vec<usize> = wanted.iter().map(|wanted| unknown(wanted.0)).collect();
    let covariance = |a: usize, b: usize| {
        let (a, b) = (unknowns[a], unknowns[b]);
        let own = &estimate.covariance;
        // Unknowns are in units of the prior.
        prior * prior * own.correlation(a, b) * own.deviation(a) * own.deviation(b)
    };
    let gain = |index: usize| {
        estimate.imperfections.iter().find(|own| own.imperfection == wanted[index].0).unwrap().value
    };
    for a in 0..6 {
        for b in 0..a {
            let deviation = (covariance(a, a) + covariance(b, b) - 2.0 * covariance(a, b)).sqrt();
            let error = gain(a) - gain(b) - (wanted[a].1 - wanted[b].1);
            println!("ratio of gains {a} and {b}: off by {error:+.1e} +- {deviation:.1e}");
            assert!(deviation < prior * 2.0_f64.sqrt() / 5.0, "{a} by {b}: {deviation}");
            assert!(error.abs() < 4.0 * deviation, "{a} by {b}: {error} +- {deviation}");
        }
    }
    let mean: f64 = (0..36).map(|pair| covariance(pair / 6, pair % 6)).sum::<f64>().sqrt() / 6.0;
    let believed = prior / 6.0_f64.sqrt();
    assert!((mean / believed - 1.0).abs() < 1e-2, "mean +- {mean}, beforehand {believed}");
}

#[test]
fn misalignment() {
    let truth = Random::new(65).bushings(3);
    let turns = [0.01, -0.02, 0.015];
    let turn = |axis: usize| nalgebra::Rotation3::new(nalgebra::Vector3::ith(axis, turns[axis]));
    let back = (turn(0) * turn(1) * turn(2)).inverse();
    let make = || {
        spoilt(&mill3(), &truth, 66, &Conditions::default(), |record| {
            for n in 0..SAMPLES {
                let a =
                    nalgebra::Vector3::from_fn(|axis, _| f64::from(record.acceleration[axis][n]));
                for (axis, value) in (back * a).iter().enumerate() {
                    record.acceleration[axis][n] = *value as f32;
                }
            }
        })
    };
    let own = |axis| Imperfection::Turn(Sensor::Accelerometer, axis);
    let wanted = [0, 1, 2].map(|axis| (own(axis), turns[axis]));
    let keys = [("accelerometer_angle_rad", 0.03)];
    assert_determined(&found_and_seen(&keys, &wanted, make, &truth));
}

#[test]
fn masses() {
    let truth = Random::new(67).bushings(3);
    let scales = [1.0, 1.05, 0.95];
    // By hand: the fit has its own way to make links heavier.
    let mut joints = mill3().joints().to_vec();
    for (joint, scale) in joints.iter_mut().zip(scales) {
        joint.link.mass *= scale;
        joint.link.inertia *= scale;
    }
    let heavy = Chain::new(&joints, *mill3().tcp()).expect("as physical as before");
    let make = || spoilt(&heavy, &truth, 68, &Conditions::default(), |_| {});
    let wanted = [0, 1, 2].map(|link| (Imperfection::Mass(link), f64::ln(scales[link])));
    assert_determined(&found_and_seen(&[("link_mass", 0.05)], &wanted, make, &truth));
}

#[test]
fn fixed_and_tied_parameters() {
    let mut truth = Random::new(69).bushings(3);
    truth[1].stiffness[1] = truth[1].stiffness[0];
    let records = experiments(&truth, &mut Random::new(70));
    let mut sought = Sought::new(3).unwrap();
    sought.fix(Coordinate::Damping { joint: 0, dof: 3 }, truth[0].damping[3]).unwrap();
    sought
        .tie(Coordinate::Stiffness { joint: 1, dof: 1 }, Coordinate::Stiffness { joint: 1, dof: 0 })
        .unwrap();
    assert_eq!(sought.unknowns(), 34);
    let estimate = settle(&mut identifier(sought), &records);
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
    let all: Vec<_> = rounds.iter().flatten().cloned().collect();
    let whole = settle(&mut identifier(parameters(3)), &all);
    let mut folding = identifier(parameters(3));
    let mut kept: Vec<Experiment<BINS>> = Vec::new();
    for experiment in rounds.iter().flatten() {
        if kept.len() == 3 {
            assert!(folding.retire(&kept[0]));
            kept.remove(0);
        }
        kept.push(experiment.clone());
        settle(&mut folding, &kept);
    }
    let folded = folding.estimate().unwrap();
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
fn a_small_change_is_seen_beside_much_information() {
    changes(40, 0.97);
}

/// Each of three records retires so many times; then a stiffness changes by a factor.
fn changes(times: usize, factor: f64) {
    let before = Random::new(73).bushings(3);
    let mut after = before.clone();
    after[1].stiffness[4] *= factor;
    let mut random = Random::new(74);
    let mut identifier = identifier(parameters(3));
    let mut kept = experiments(&before, &mut random);
    settle(&mut identifier, &kept);
    for _ in 0..times {
        assert!(kept.iter().all(|experiment| identifier.retire(experiment)));
    }
    kept = experiments(&after, &mut random);
    let estimate = settle(&mut identifier, &kept);
    let forgotten = 3 * times as u64;
    assert_eq!((estimate.acceptance, estimate.forgotten), (Acceptance::Consistent, forgotten));
    let off = estimate.bushings[1].stiffness[4] / after[1].stiffness[4] - 1.0;
    assert!(off.abs() < 0.01, "{off}");
}
