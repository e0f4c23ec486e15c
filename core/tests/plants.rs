//! Plants that are not perfect: an identifier that judges its minima on the plant, interrupted anywhere.

use std::thread;

use flexid_core::identify::{Acceptance, Identifier, Phase, PlantEstimate};
use flexid_core::imperfection::{Accuracies, Imperfection, Sensor};
use flexid_core::parameters::Bushings;
use flexid_core::refine::{BinLeft, Explanation, LeftOver, Plant};
use flexid_core::spectrum::Experiment;
use flexid_core::stream::Record;
use nalgebra::DMatrix;

use crate::common::fits::{Generator, identifier, mean_square, parameters, relative, scores};
use crate::common::milling::{Conditions, SAMPLES, STEPS, cut, record};
use crate::common::{BINS, EXPERIMENTS, MEASUREMENT, Random, mill3};

/// Room for the normal equations of a plant, which are made in place, bytes.
const STACK: usize = 32 << 20;
/// True gain of the accelerometer's y.
const GAIN: f64 = 1.03;

/// Records of a robot, with what is off in them.
pub(crate) fn experiments(
    truth: &Bushings,
    conditions: &Conditions,
    spoil: impl Fn(&mut Record<SAMPLES>),
) -> Vec<Experiment<BINS>> {
    experiments_drawn(72, truth, conditions, spoil)
}

/// Those whose cut and noise are drawn from `seed`.
fn experiments_drawn(
    seed: u64,
    truth: &Bushings,
    conditions: &Conditions,
    spoil: impl Fn(&mut Record<SAMPLES>),
) -> Vec<Experiment<BINS>> {
    let mut random = Random::new(seed);
    let mut buffer = [0.0; SAMPLES];
    let one = |(pose, rpm, feed): &([f64; 3], [f64; 2], usize)| {
        let force = cut(&mut random, *rpm, *feed);
        let mut record = record(&mill3(), pose, truth, &force, conditions, &mut random);
        spoil(&mut record);
        Experiment::new(&mill3(), &MEASUREMENT, &record, &mut buffer).expect("a good record")
    };
    EXPERIMENTS.iter().map(one).collect()
}

/// Those of a robot whose acceleration is 0.1 ms late and 3 % too large along y.
fn late_and_too_large(truth: &Bushings, seed: u64) -> Vec<Experiment<BINS>> {
    let conditions = Conditions { late: STEPS / 5, ..Conditions::default() };
    experiments_drawn(seed, truth, &conditions, |record| {
        record.acceleration[1].iter_mut().for_each(|value| *value *= GAIN as f32);
        record.acceleration_noise[1] *= GAIN as f32;
    })
}

fn finish(
    identifier: &mut Identifier<Generator>,
    experiments: &[Experiment<BINS>],
    plant: &mut Plant,
) -> PlantEstimate {
    let mut experiments = experiments.to_vec();
    while identifier.step_on_plant(&mut experiments, plant) != Phase::Settled {}
    identifier.estimate_of_plant(&mut experiments, plant, || true).expect("it has settled")
}

fn assert_right(found: &PlantEstimate, truth: &Bushings, step: usize) {
    let PlantEstimate { estimate, imperfections, explanations, .. } = found;
    assert_eq!(estimate.acceptance, Acceptance::Consistent, "renewed after {step} steps");
    let scores = scores(&estimate.bushings, truth, &relative(estimate));
    assert!(scores.iter().all(|score| score.abs() < 4.0), "after {step}: {scores:?}");
    assert!(mean_square(&scores) < 2.0, "after {step}: {scores:?}");
    for (imperfection, wanted) in
        [(Imperfection::Delay, 1e-4), (Imperfection::Gain(Sensor::Accelerometer, 1), GAIN.ln())]
    {
        let found = imperfections.iter().find(|one| one.imperfection == imperfection).unwrap();
        assert!((found.value - wanted).abs() < 4.0 * found.deviation, "after {step}: {found:?}");
        assert!(found.deviation < 0.5 * wanted, "after {step}: {found:?}");
    }
    // The typical delay is a fifth of this one. The typical gain is a third.
    let first = explanations.first().expect("an explanation");
    assert!(first.is_contradicted() && first.share > 0.8, "after {step}: {explanations:?}");
    assert_eq!(first.largest.imperfection, Imperfection::Delay, "after {step}: {explanations:?}");
}

/// The records are renewed after any number of steps, also while a minimum or its branch is judged on the plant: the result is right. A
/// plant that is taken away leaves an identifier that settles without it.
#[test]
fn an_identifier_goes_on_from_any_step() {
    let test = || {
        let truth = Random::new(71).bushings(3);
        let mut experiments = late_and_too_large(&truth, 72);
        let mut plant = Box::new(Plant::new(&Accuracies::typical(), &mill3()));
        let mut identifier = identifier(parameters(3));
        identifier.renew(&experiments);
        let mut step = 0;
        while identifier.step_on_plant(&mut experiments, &mut plant) != Phase::Settled {
            step += 1;
            if step % 40 == 0 {
                let (mut renewed, mut lost) = (identifier.clone(), identifier.clone());
                renewed.renew(&experiments);
                assert_right(&finish(&mut renewed, &experiments, &mut plant.clone()), &truth, step);
                while lost.step(&mut experiments) != Phase::Settled {}
                let mut plant = plant.clone();
                let found = lost.estimate_of_plant(&mut experiments, &mut plant, || true);
                assert!(found.is_some(), "without a plant after {step}");
            }
        }
        assert!(step > 60, "{step} steps: too few to interrupt");
        let found = finish(&mut identifier, &experiments, &mut plant);
        assert_right(&found, &truth, step);
        assert!(found.explanations.iter().all(|explanation| !explanation.is_adopted));
        plant.adopt(true);
        let adopted = finish(&mut identifier, &experiments, &mut plant);
        assert_right(&adopted, &truth, step);
        let Explanation { is_adopted, largest, times, .. } = &adopted.explanations[0];
        assert!(*is_adopted, "{:?}", adopted.explanations);
        // The delay is found by the records alone.
        let delay =
            adopted.imperfections.iter().find(|one| one.imperfection == Imperfection::Delay);
        assert!((delay.unwrap().value - largest.value).abs() < 0.1 * largest.deviation);
        assert!(*times > 3.0 && *times < 10.0, "{times}");
    };
    thread::Builder::new().stack_size(STACK).spawn(test).unwrap().join().unwrap();
}

/// Standard deviation of each unknown by the information where a plant stands.
fn deviations(plant: &Plant) -> Vec<f64> {
    let information = plant.information();
    let (first, size) = (information.imperfections().len(), information.size());
    let matrix = DMatrix::from_fn(size, size, |row, column| information.get(row, column));
    let covariance = matrix.try_inverse().expect("every unknown is determined");
    (first..size).map(|unknown| covariance[(unknown, unknown)].sqrt()).collect()
}

/// Nine records, of which six are kept: as good as all nine.
#[test]
fn records_that_retire_on_a_plant_lose_nothing() {
    let test = || {
        let truth = Random::new(81).bushings(3);
        let rounds = [72, 73, 74].map(|seed| late_and_too_large(&truth, seed));
        let all: Vec<_> = rounds.iter().flatten().cloned().collect();
        let accuracies = Accuracies::typical();
        let mut plant = Box::new(Plant::new(&accuracies, &mill3()));
        let mut whole = identifier(parameters(3));
        whole.renew(&all);
        let whole = finish(&mut whole, &all, &mut plant);
        let own = deviations(&plant);

        let mut plant = Box::new(Plant::new(&accuracies, &mill3()));
        let mut folding = identifier(parameters(3));
        let (first, others) = all.split_at(6);
        let mut kept = first.to_vec();
        folding.renew(&kept);
        let mut folded = finish(&mut folding, &kept, &mut plant);
        for experiment in others {
            assert!(folding.retire_on_plant(&kept, 0, &mut plant, &folded));
            kept.remove(0);
            kept.push(experiment.clone());
            folding.renew(&kept);
            folded = finish(&mut folding, &kept, &mut plant);
        }
        assert_eq!((folded.estimate.retired, folded.estimate.forgotten), (3, 0));
        assert_eq!(plant.retired(), 3);
        let other = deviations(&plant);
        let apart = scores(&folded.estimate.bushings, &whole.estimate.bushings, &own);
        // The ground and the first joint share a compliance. The data divide it by the square of the ground's, and the better the larger that is.
        let all = apart.iter().zip(own.iter().zip(&other));
        let known: Vec<_> = all.filter(|(_, (own, _))| **own < 0.03).collect();
        assert!(known.len() >= 24, "{own:?}");
        for (apart, (own, other)) in known {
            assert!(apart.abs() < 0.3, "{apart} {own} {other}");
            assert!((0.95..1.1).contains(&(other / own)), "{own} {other}");
        }
    };
    thread::Builder::new().stack_size(STACK).spawn(test).unwrap().join().unwrap();
}

/// If the cut has twice the noise of the rest along these axes, the residuals are larger than that of the rest, but random: the fit is
/// consistent, and its intervals are as much wider. Returns χ²/dof, where more is left than elsewhere, and the mean square of what is left
/// in a bin in that of the noise, along each axis.
fn noisier_in_the_cut(axes: &'static [usize]) -> (f64, Vec<LeftOver>, [f64; 3]) {
    let test = || {
        let truth = Random::new(71).bushings(3);
        let experiments = experiments(&truth, &Conditions::default(), |record| {
            // What is read at rest is half of what the cut has.
            axes.iter().for_each(|axis| record.acceleration_noise[*axis] *= 0.5);
        });
        let mut plant = Box::new(Plant::new(&Accuracies::typical(), &mill3()));
        let mut identifier = identifier(parameters(3));
        identifier.renew(&experiments);
        let PlantEstimate { estimate, .. } = finish(&mut identifier, &experiments, &mut plant);
        assert_eq!(estimate.acceptance, Acceptance::Consistent);
        assert!(estimate.size_objects && !estimate.structure_objects, "{:?}", estimate.structure);
        let scores = scores(&estimate.bushings, &truth, &relative(&estimate));
        assert!(scores.iter().all(|score| score.abs() < 4.0), "{scores:?}");
        assert!((0.05..2.0).contains(&mean_square(&scores)), "{scores:?}");
        let left_over = identifier.left_over(&experiments, Some(&plant), &estimate);
        let (mut places, mut all_left, mut times) = (Vec::new(), Vec::new(), [0.0; 3]);
        let mut take = |bin: &BinLeft| {
            places.push((bin.record, bin.bin));
            all_left.push(*bin);
            for (axis, times) in times.iter_mut().enumerate() {
                let [re, im] = bin.left[axis];
                *times += (re * re + im * im) / bin.noise[axis];
            }
        };
        identifier.each_bin(&experiments, Some(&plant), &estimate, 0, &mut take).unwrap();
        let all = experiments.iter().enumerate();
        let all = all.flat_map(|(record, own)| (0..own.bins()).map(move |bin| (record, bin)));
        assert!(places.iter().copied().eq(all), "not every bin once, in order");
        let mut newest = Vec::new();
        let last = experiments.len() - 1;
        let mut take = |bin: &BinLeft| newest.push(*bin);
        identifier.each_bin(&experiments, Some(&plant), &estimate, last, &mut take).unwrap();
        all_left.retain(|bin| bin.record == last);
        assert_eq!(newest, all_left, "the last record alone");
        let times = times.map(|times| times / places.len() as f64);
        (estimate.consistency, left_over.into_iter().collect(), times)
    };
    thread::Builder::new().stack_size(STACK).spawn(test).unwrap().join().unwrap()
}

#[test]
fn noise_that_is_larger_in_the_cut_widens_the_intervals() {
    let (consistency, left_over, times) = noisier_in_the_cut(&[0, 1, 2]);
    assert!((2.0..4.5).contains(&consistency), "{consistency}");
    assert!(left_over.is_empty(), "{left_over:?}");
    assert!(times.iter().all(|times| (1.8..4.2).contains(times)), "{times:?}");
}

/// Power of four against that of one.
#[test]
fn what_is_left_over_names_the_axis_that_is_noisier() {
    let (consistency, left_over, times) = noisier_in_the_cut(&[2]);
    assert!((1.3..2.5).contains(&consistency), "{consistency}");
    assert!(times[..2].iter().all(|times| (0.8..1.2).contains(times)), "{times:?}");
    assert!((1.8..4.2).contains(&times[2]), "{times:?}");
    let [LeftOver::Direction { axis: 2, times }] = left_over[..] else { panic!("{left_over:?}") };
    assert!((2.0..4.5).contains(&times), "{times}");
}
