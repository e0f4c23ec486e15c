//! The cut has more noise than the rest, in a part of the band.

use std::thread;

use flexid_core::identify::{Acceptance, Estimate, MAX_NOISE_ROUNDS};
use flexid_core::noise::{Level, NoiseShape};
use flexid_core::parameters::Bushings;
use flexid_core::spectrum::Experiment;
use flexid_core::stream::Record;

use crate::common::fits::{
    Generator, go_on, identifier, mean_square, parameters, relative, scores, settle,
};
use crate::common::milling::{Conditions, SAMPLES, STEPS};
use crate::common::{BINS, Random};
use crate::plants::experiments;

const STACK: usize = 32 << 20;
/// Power of the noise in the cut over that at rest, from [`FROM_HZ`] on.
const TIMES: f64 = 5.0;
const FROM_HZ: f64 = 100.0;

/// The spectrum at rest of a record along an axis, whose cut has white noise: less from [`FROM_HZ`] on.
fn quieter_at_rest(record: &mut Record<SAMPLES>, axis: usize) {
    let end = (FROM_HZ / record.rate_hz) as f32;
    let levels = [Level { end, density: 1.0 }, Level { end: 0.5, density: (1.0 / TIMES) as f32 }];
    record.acceleration_noise_shape[axis] =
        NoiseShape { levels: levels.into_iter().collect(), ..NoiseShape::WHITE };
}

/// Settles, and reads the noise again until it stays. Returns the first and the last estimate.
fn settle_and_read(
    identifier: &mut flexid_core::identify::Identifier<Generator>,
    experiments: &mut [Experiment<BINS>],
) -> [Estimate; 2] {
    let first = settle(identifier, experiments);
    let mut last = first.clone();
    for _ in 0..MAX_NOISE_ROUNDS {
        if !identifier.read_noise_again(experiments, None, &last) {
            return [first, last];
        }
        identifier.renew_noise(experiments);
        last = go_on(identifier, experiments);
    }
    panic!("the noise changes for ever");
}

fn with_stack(test: impl FnOnce() + Send + 'static) {
    thread::Builder::new().stack_size(STACK).spawn(test).unwrap().join().unwrap();
}

#[test]
fn the_level_of_the_cut_is_found_in_its_band() {
    with_stack(|| {
        let truth: Bushings = Random::new(71).bushings(3);
        let mut experiments = experiments(&truth, &Conditions::default(), |record| {
            [0, 1, 2].into_iter().for_each(|axis| quieter_at_rest(record, axis));
        });
        let mut identifier = identifier(parameters(3));
        let [first, last] = settle_and_read(&mut identifier, &mut experiments);
        assert!(first.size_objects && first.structure_objects, "{:?}", first.structure);
        assert!(!last.size_objects && !last.structure_objects, "{:?}", last.structure);
        assert_eq!(last.acceptance, Acceptance::Consistent);
        assert!((0.9..1.1).contains(&last.consistency), "{}", last.consistency);
        let errors = scores(&last.bushings, &truth, &relative(&last));
        assert!(errors.iter().all(|score| score.abs() < 4.0), "{errors:?}");
        assert!((0.4..2.0).contains(&mean_square(&errors)), "{errors:?}");
        for experiment in &experiments {
            let louder: Vec<_> = experiment.louder_bands().collect();
            assert_eq!(louder.len(), 6, "three axes, two bands: {louder:?}");
            for (axis, [from, to], times) in louder {
                assert!(from > FROM_HZ - 3.0 && to < 201.0, "{axis}: {from} to {to} Hz");
                assert!((0.7 * TIMES..1.4 * TIMES).contains(&times), "{axis}: {times}");
            }
        }
    });
}

/// A delay that the model does not have leaves a smooth response to the force.
#[test]
fn an_error_of_the_model_is_no_noise() {
    with_stack(|| {
        let truth = Random::new(71).bushings(3);
        let conditions = Conditions { late: STEPS / 5, ..Conditions::default() };
        let mut experiments = experiments(&truth, &conditions, |_| {});
        let mut identifier = identifier(parameters(3));
        let [first, last] = settle_and_read(&mut identifier, &mut experiments);
        assert_eq!(first.acceptance, Acceptance::ModelSuspect);
        assert_eq!(last.acceptance, Acceptance::ModelSuspect);
        assert!(
            last.consistency > 0.8 * first.consistency,
            "{} {}",
            first.consistency,
            last.consistency
        );
    });
}
