//! The information of an experiment, predicted without its acceleration, against that of a fit to the simulated one.

use flexid_core::refine::{Basis, Information, Refinement};
use flexid_core::spectrum::Experiment;

use crate::common::fits::{parameters, problem};
use crate::common::milling::{Conditions, SAMPLES, cut, record};
use crate::common::{BINS, EXPERIMENTS, MEASUREMENT, Random, bounds, mill3, nominal};

/// Standard deviations of the scenario's first `count` experiments: predicted, of the records, and fitted.
fn deviations(count: usize) -> [Vec<f64>; 3] {
    let (chain, bushings, bounds) = (mill3(), nominal(), bounds());
    let sought = parameters(bushings.len());
    let problem = problem(&chain, &MEASUREMENT, &bounds, &sought);
    let mut random = Random::new(11);
    let mut refinement = Box::new(Refinement::new(&sought, &bushings));
    let mut buffer = [0.0; SAMPLES];
    let mut done: Vec<Experiment<BINS>> = Vec::new();
    let mut predicted = Information::none(sought.unknowns());
    for (pose, rpm, feed) in &EXPERIMENTS[..count] {
        let force = cut(&mut random, *rpm, *feed);
        let conditions = Conditions::default();
        let mut record = record(&chain, pose, &bushings, &force, &conditions, &mut random);
        done.push(Experiment::new(&chain, &MEASUREMENT, &record, &mut buffer).unwrap());
        record.acceleration.iter_mut().for_each(|axis| axis.fill(0.0));
        let planned: Experiment<BINS> =
            Experiment::new(&chain, &MEASUREMENT, &record, &mut buffer).unwrap();
        predicted.add(&refinement.information(&problem, &planned, Basis::Planned).unwrap());
    }
    let fitted = refinement.fit(&problem, &done).covariance;
    let mut of_records = Information::none(sought.unknowns());
    for experiment in &done {
        of_records.add(&refinement.information(&problem, experiment, Basis::Measured).unwrap());
    }
    let covariances = [predicted.covariance(), of_records.covariance(), fitted];
    covariances.map(|own| (0..sought.unknowns()).map(|i| own.deviation(i)).collect())
}

/// The lowest mode, joint 1 about its axis, rings on when a record ends, which is not predicted.
const RINGING: [usize; 2] = [5, 11];

#[test]
fn predicts_the_deviations_of_a_fit() {
    for count in [1, 3] {
        let [predicted, of_records, fitted] = deviations(count);
        for unknown in 0..fitted.len() {
            let ratio = predicted[unknown] / fitted[unknown];
            let least = if RINGING.contains(&unknown) { 0.45 } else { 0.93 };
            assert!((least..1.05).contains(&ratio), "{count}, unknown {unknown}: {ratio}");
            let ratio = of_records[unknown] / fitted[unknown];
            // The one at the force as measured, the other as it is best known.
            assert!((ratio - 1.0).abs() < 2e-3, "{count}, unknown {unknown}: {ratio}");
        }
    }
}
