//! Search alone, and search with refinement, on robots drawn uniformly within the scenario's bounds.

use flexid_core::identify::Acceptance;
use flexid_core::loss::spectral;
use flexid_core::search::{Search, Sensitivities, Strategy, Weighing};

use crate::common::fits::{identifier, parameters, settle, targets};
use crate::common::milling::{Conditions, cut, displacement_error, experiments, motion};
use crate::common::{MEASUREMENT, Random, bounds, mill3, parameter_deviation};
use fearless_simd::Level;

#[test]
fn search_alone_beats_the_papers_deviation() {
    let bounds = bounds();
    let strategy = Strategy { iterations: 500, ..Strategy::default() };
    let mut deviations = Vec::new();
    for seed in 0..10 {
        let mut random = Random::new(seed);
        let truth = random.bushings(3);
        let experiments = experiments(&truth, &mut random);
        let mut search = Search::new(strategy, 36);
        let targets = targets(&mill3(), &MEASUREMENT, &experiments);
        let jacobians = targets.iter().map(|target| &target.jacobian);
        search.renew(Weighing::Sensitivities(Sensitivities::jacobian(jacobians, 3)));
        while !search.finished() {
            let guess = bounds.bushings(search.ask(&mut random.0)).unwrap();
            search.tell(&spectral::losses(&targets, &experiments, &guess, Level::new()));
        }
        deviations.push(parameter_deviation(&bounds.bushings(search.centre()).unwrap(), &truth));
    }
    let mean = deviations.iter().sum::<f64>() / 10.0;
    println!(
        "search alone, 500 iterations of {} samples, ten robots: parameter deviation {mean:.4} (the paper: 0.2124); {deviations:.3?}",
        strategy.samples
    );
    assert!(mean <= 0.15, "{mean}");
}

#[test]
fn identifies_ten_robots_to_the_noise_limit() {
    let chain = mill3();
    let unseen = [([0.3, -0.8, 1.2], [700.0, 3600.0], 0), ([-0.9, -1.4, 0.6], [800.0, 4500.0], 1)];
    let mut worst = (0.0_f64, 0.0_f64, 0.0_f64);
    for seed in 100..110 {
        let mut random = Random::new(seed);
        let truth = random.bushings(3);
        let experiments = experiments(&truth, &mut random);
        let mut identifier = identifier(parameters(3));
        let estimate = settle(&mut identifier, &experiments);
        assert_eq!(estimate.acceptance, Acceptance::Consistent, "robot {seed}");
        let deviation = parameter_deviation(&estimate.bushings, &truth);
        let mut errors = Vec::new();
        for (pose, rpm, feed) in unseen {
            let force = cut(&mut random, rpm, feed);
            let run = |bushings| motion(&chain, &pose, bushings, &force, &Conditions::default());
            errors.extend(displacement_error(&run(&truth), &run(&estimate.bushings), [2.0, 200.0]));
        }
        errors.sort_by(f64::total_cmp);
        let median = 0.5 * (errors[2] + errors[3]);
        println!(
            "robot {seed}: parameter deviation {deviation:.5}, displacement error on unseen poses median {:.3} %, largest {:.3} %, {} starts",
            100.0 * median,
            100.0 * errors[5],
            identifier.progress().effort.starts,
        );
        worst = (worst.0.max(deviation), worst.1.max(median), worst.2.max(errors[5]));
    }
    println!("worst of ten: {:.5}, {:.3} %, {:.3} %", worst.0, 100.0 * worst.1, 100.0 * worst.2);
    assert!(worst.0 <= 0.005 && worst.1 <= 0.01 && worst.2 <= 0.05, "{worst:?}");
}

/// Experiments come one by one: each goes on from the last estimate, and the same ones give the same bytes.
#[test]
fn goes_on_from_record_to_record_deterministically() {
    let run = || {
        let mut random = Random::new(7);
        let truth = random.bushings(3);
        let all = experiments(&truth, &mut random);
        let mut identifier = identifier(parameters(3));
        let mut known = Vec::new();
        let mut starts = Vec::new();
        for experiment in all {
            known.push(experiment);
            settle(&mut identifier, &known);
            starts.push(identifier.progress().effort.starts);
        }
        let estimate = identifier.estimate().expect("settled").clone();
        let deviation = parameter_deviation(&estimate.bushings, &truth);
        (estimate, deviation, starts)
    };
    let (first, deviation, starts) = run();
    let (second, ..) = run();
    assert_eq!(first, second);
    assert!(deviation < 0.005, "{deviation}");
    assert_eq!(starts[1], starts[2], "the third record needs no new search: {starts:?}");
}
