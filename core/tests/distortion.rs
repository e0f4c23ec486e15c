//! The residuals are a response to the force, or they are not.

use std::thread;

use flexid_core::identify::Acceptance;
use flexid_core::refine::LeftOver;
use flexid_core::stream::Record;

use crate::common::Random;
use crate::common::fits::{identifier, parameters, settle};
use crate::common::milling::{Conditions, SAMPLES, STEPS};
use crate::plants::experiments;

const STACK: usize = 32 << 20;

/// The part of what a perfect model leaves that is no response to the force, if it is named.
fn part(conditions: Conditions, spoil: fn(&mut Record<SAMPLES>)) -> Option<f64> {
    let test = move || {
        let truth = Random::new(71).bushings(3);
        let experiments = experiments(&truth, &conditions, spoil);
        let mut identifier = identifier(parameters(3));
        let estimate = settle(&mut identifier, &experiments);
        assert_ne!(estimate.acceptance, Acceptance::Consistent);
        let left_over = identifier.left_over(&experiments, None, &estimate);
        left_over.iter().find_map(|one| match *one {
            LeftOver::Distortion { part } => Some(part),
            _ => None,
        })
    };
    thread::Builder::new().stack_size(STACK).spawn(test).unwrap().join().unwrap()
}

/// A delay of 0.1 ms.
#[test]
fn an_error_of_a_linear_model_leaves_a_response() {
    assert_eq!(part(Conditions { late: STEPS / 5, ..Conditions::default() }, |_| {}), None);
}

/// The accelerometer has free play of a twentieth of its largest reading.
#[test]
fn what_is_not_linear_leaves_no_response() {
    let part = part(Conditions::default(), |record| {
        for signal in &mut record.acceleration {
            let largest = signal.iter().fold(0.0_f32, |largest, value| largest.max(value.abs()));
            let play = 0.05 * largest;
            let mut held = 0.0_f32;
            for value in signal.iter_mut() {
                held = held.clamp(*value - play, *value + play);
                *value = held;
            }
        }
    });
    assert!(part.is_some_and(|part| part > 0.1), "{part:?}");
}
