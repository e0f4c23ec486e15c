//! The search reads every fourth bin: it finds as much as it would in all of them.

use flexid_core::loss::spectral;
use flexid_core::parameters::Bushings;
use flexid_core::search::{Search, Sensitivities, Strategy, Weighing};
use flexid_core::spectrum::thinned::ThinnedSpectra;
use flexid_core::spectrum::{Experiment, Measurement};
use flexid_core::stream::Record;

use crate::common::fits::{parameters, problem, refine, targets};
use crate::common::milling::{Conditions, RATE, SAMPLES, cut, record};
use crate::common::{BINS, EXPERIMENTS, MEASUREMENT, Random, bounds, mill3, parameter_deviation};
use fearless_simd::Level;

/// From one bin that the search keeps to the next.
const THINNING: usize = 4;
/// Robots drawn from the bounds, and searches of each.
const ROBOTS: u64 = 12;
const SEARCHES: u64 = 2;

/// A record as the search reads it, and as it would if it left out nothing.
fn thinned_and_whole(record: &Record<SAMPLES>) -> [Experiment<BINS>; 2] {
    let mut buffer = [0.0; SAMPLES];
    let [lower, upper] = MEASUREMENT.band_hz;
    // A band that begins a bin later keeps the bins after those.
    let mut shifted = (0..THINNING).map(|bins| {
        let band_hz = [lower + bins as f64 * RATE / SAMPLES as f64, upper];
        let measurement = Measurement { band_hz, ..MEASUREMENT };
        Experiment::<BINS>::new(&mill3(), &measurement, record, &mut buffer).expect("a good record")
    });
    let thinned = shifted.next().expect("the first");
    let mut whole = thinned.clone();
    for mut other in shifted {
        append(&mut whole.thinned, &mut other.thinned);
    }
    assert_eq!(whole.thinned.bins, thinned.bins());
    for series in series(&mut whole.thinned) {
        // Silence up to the widest vector.
        while !series.len().is_multiple_of(16) {
            series.push(0.0).expect("there is room");
        }
    }
    [thinned, whole]
}

/// Adds another's bins; the filling of both goes.
fn append(spectra: &mut ThinnedSpectra<BINS>, other: &mut ThinnedSpectra<BINS>) {
    let (own, others) = (spectra.bins, other.bins);
    for (series, other) in series(spectra).zip(series(other)) {
        series.truncate(own);
        series.extend_from_slice(&other[..others]).expect("there is room");
    }
    spectra.bins += others;
}

/// All that has a value per bin.
fn series(
    spectra: &mut ThinnedSpectra<BINS>,
) -> impl Iterator<Item = &mut heapless::Vec<f32, BINS>> {
    let ThinnedSpectra { omega, force, acceleration, .. } = spectra;
    let spectra = [force, acceleration].into_iter();
    std::iter::once(omega).chain(spectra.flat_map(|own| own.re.iter_mut().chain(&mut own.im)))
}

/// The end of a search of the default length.
fn search(experiments: &[Experiment<BINS>], seed: u64) -> Bushings {
    let mut generator = Random::new(seed).0;
    let mut search = Search::new(Strategy::default(), 36);
    let targets = targets(&mill3(), &MEASUREMENT, experiments);
    let jacobians = targets.iter().map(|target| &target.jacobian);
    search.renew(Weighing::Sensitivities(Sensitivities::jacobian(jacobians, 3)));
    while !search.finished() {
        let guess = bounds().bushings(search.ask(&mut generator)).unwrap();
        search.tell(&spectral::losses(&targets, experiments, &guess, Level::new()));
    }
    bounds().bushings(search.centre()).unwrap()
}

/// Mean, and its standard error.
fn mean(values: &[f64]) -> [f64; 2] {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
    [mean, (squares / (count - 1.0) / count).sqrt()]
}

#[test]
fn thinning_loses_nothing() {
    let (chain, bounds, sought) = (mill3(), bounds(), parameters(3));
    let problem = problem(&chain, &MEASUREMENT, &bounds, &sought);
    // Thinned and whole.
    let (mut found, mut deviations) = ([0; 2], [const { Vec::new() }; 2]);
    for seed in 0..ROBOTS {
        let mut random = Random::new(130 + seed);
        let truth = random.bushings(3);
        let mut both = [const { Vec::new() }; 2];
        for (pose, rpm, feed) in &EXPERIMENTS {
            let force = cut(&mut random, *rpm, *feed);
            let conditions = Conditions::default();
            let record = record(&chain, pose, &truth, &force, &conditions, &mut random);
            let [thinned, whole] = thinned_and_whole(&record);
            both[0].push(thinned);
            both[1].push(whole);
        }
        for (way, experiments) in both.into_iter().enumerate() {
            let mut sum = 0.0;
            for start in 0..SEARCHES {
                let centre = search(&experiments, 1000 * seed + start);
                sum += parameter_deviation(&centre, &truth);
                let (_, fit) = refine(&problem, &centre, &experiments);
                // The nearest wrong basin of this robot lies at 2.
                found[way] += u64::from(fit.sum_of_squares < 1.3 * fit.degrees_of_freedom);
            }
            deviations[way].push(sum / SEARCHES as f64);
        }
    }
    let worse: Vec<f64> = deviations[0].iter().zip(&deviations[1]).map(|(t, w)| t - w).collect();
    let [thinned, whole, worse] = [&deviations[0], &deviations[1], &worse].map(|own| mean(own));
    println!("{ROBOTS} robots, {SEARCHES} searches each, from every fourth bin and from all:");
    println!("basin found: {} and {} of {}", found[0], found[1], ROBOTS * SEARCHES);
    println!(
        "parameter deviation of the search: {:.4} and {:.4}, difference {:+.4} ± {:.4}",
        thinned[0], whole[0], worse[0], worse[1]
    );
    // One search in forty misses: three standard deviations of the difference.
    let by_chance = 3.0 * (2.0 * (ROBOTS * SEARCHES) as f64 / 40.0).sqrt();
    assert!((found[0] as f64) > found[1] as f64 - by_chance, "{found:?}");
    assert!(worse[0] < 3.0 * worse[1], "{worse:?}");
    // And chance leaves no room for much.
    assert!(worse[1] < 0.1 * whole[0], "{worse:?}");
}
