//! The search with every combination of its parts, on a loss whose minimum is known.

use flexid_core::search::{Search, Sensitivities, Shrinking, Strategy, Weighing};
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

const PARAMETERS: usize = 12;

/// The place of the smallest loss.
fn truth(parameter: usize) -> f32 {
    0.1 + 0.8 * (parameter as f32 * 0.37).fract()
}

/// Three losses, each of a third of the parameters.
fn losses(sample: &[f32]) -> [f32; 3] {
    let mut losses = [0.0; 3];
    for (parameter, value) in sample.iter().enumerate() {
        assert!((0.0..=1.0).contains(value), "parameter {parameter} is {value}");
        losses[parameter % 3] += (value - truth(parameter)).powi(2);
    }
    losses
}

fn weighings() -> [(&'static str, Weighing); 2] {
    let entry = |loss: usize, parameter: usize| f32::from(u8::from(parameter % 3 == loss));
    let sensitivities = Sensitivities::new(3, PARAMETERS, entry);
    [("whole", Weighing::Mean), ("weighed", Weighing::Sensitivities(sensitivities))]
}

/// Mean distance of the centre from the truth at the end, and the evaluations.
fn run(strategy: Strategy, weighing: &Weighing, seed: u64) -> (f32, u32) {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut search = Search::new(strategy, PARAMETERS);
    search.renew(weighing.clone());
    let mut evaluations = 0;
    while !search.finished() {
        let losses = losses(search.ask(&mut generator));
        search.tell(&losses);
        evaluations += 1;
    }
    let distances =
        search.centre().iter().enumerate().map(|(parameter, value)| value - truth(parameter));
    (distances.map(f32::abs).sum::<f32>() / PARAMETERS as f32, evaluations)
}

#[test]
fn every_combination_finds_a_minimum_with_the_evaluations_it_was_given() {
    let (first, last) = (0.7, 0.02);
    let shrinkings = [
        Shrinking::Scheduled { first, last },
        Shrinking::Global { first, last },
        Shrinking::Local { first, last },
    ];
    let weighings = weighings();
    let mut lines = Vec::new();
    for shrinking in shrinkings {
        for outside in [0, 10] {
            for (name, weighing) in &weighings {
                let strategy = Strategy { iterations: 150, samples: 20, outside, shrinking };
                let runs = (0..5).map(|seed| run(strategy, weighing, seed));
                let distances: Vec<f32> = runs
                    .map(|(distance, evaluations)| {
                        assert_eq!(evaluations, 150 * 20);
                        distance
                    })
                    .collect();
                let mean = distances.iter().sum::<f32>() / 5.0;
                println!("{shrinking:?}, {outside} outside, {name}: {mean:.4}");
                lines.push((name, outside, mean));
                assert!(mean < 0.005, "{shrinking:?}, {outside} outside, {name}: {mean}");
            }
        }
    }
    // What separates parameters must help where losses are separate.
    for pair in lines.chunks(2) {
        assert!(pair[1].2 < pair[0].2, "sensitivities do not help: {pair:?}");
    }
}

#[test]
fn the_same_seed_gives_the_same_search() {
    let [_, (_, weighing)] = weighings();
    let strategy = Strategy { iterations: 20, ..Strategy::default() };
    assert_eq!(run(strategy, &weighing, 4), run(strategy, &weighing, 4));
    assert_ne!(run(strategy, &weighing, 4).0, run(strategy, &weighing, 5).0);
}

#[test]
fn a_loss_that_is_not_a_number_is_never_chosen() {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut search = Search::new(Strategy { iterations: 30, ..Strategy::default() }, 2);
    while !search.finished() {
        let sample = search.ask(&mut generator);
        let loss = if sample[0] > 0.6 { f32::NAN } else { 1.0 - sample[0] };
        search.tell(&[loss]);
    }
    assert!((0.55..=0.6).contains(&search.centre()[0]), "{:?}", search.centre());
}
