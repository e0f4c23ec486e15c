//! A divided record is as many records as it has parts.

use std::boxed::Box;
use std::vec::Vec;

use super::*;
use crate::noise::{Level as NoiseLevel, NoiseShape};
use crate::spectrum::Spectrum;
use crate::stream::Stage;

pub(crate) const PARTS: usize = 4;
/// Samples of a part.
pub(crate) const LENGTH: usize = SAMPLES / PARTS;

/// Stage of a part: no two have a pose in common.
pub(crate) fn stage(part: usize) -> Stage {
    let along = part as f64;
    let pose = [0.4 + 0.01 * along, -0.3 - 0.02 * along].into_iter().collect();
    Stage { pose, moves: 0.0, is_even: true }
}

/// A record along a path of so many parts, with noise that is not white.
pub(crate) fn along(parts: usize) -> Record<SAMPLES> {
    let levels = [NoiseLevel { end: 0.06, density: 1.5 }, NoiseLevel { end: 0.5, density: 0.5 }];
    let shape = NoiseShape { levels: levels.into_iter().collect(), ..NoiseShape::WHITE };
    Record {
        path: (0..parts).map(stage).collect(),
        acceleration_noise_shape: core::array::from_fn(|_| shape.clone()),
        ..record(&mut Xoshiro256PlusPlus::seed_from_u64(1))
    }
}

/// The record of the samples of one of [`PARTS`] parts alone.
pub(crate) fn alone(record: &Record<SAMPLES>, part: usize) -> Record<SAMPLES> {
    let cut = |signals: &[heapless::Vec<f32, SAMPLES>; 3]| {
        let samples = part * LENGTH..(part + 1) * LENGTH;
        signals.each_ref().map(|signal| signal[samples.clone()].iter().copied().collect())
    };
    Record {
        pose: record.path[part].pose.clone(),
        path: heapless::Vec::new(),
        since_s: record.since_s + (part * LENGTH) as f64 / record.rate_hz,
        force: cut(&record.force),
        acceleration: cut(&record.acceleration),
        ..record.clone()
    }
}

/// A divided experiment, and the experiments of its parts alone. Single precision rounds the drift of their delay otherwise, so that these have
/// that of the divided one.
pub(crate) fn divided_and_alone(
    measurement: &Measurement,
) -> (Box<Experiment<BINS>>, Vec<Experiment<BINS>>) {
    let record = along(PARTS);
    let experiment = |record: &Record<SAMPLES>| {
        Experiment::<BINS>::new(&chain(), measurement, record, &mut [0.0; SAMPLES]).unwrap()
    };
    let divided = Box::new(experiment(&record));
    let own = |(number, part): (usize, crate::spectrum::Part<'_>)| {
        let cut = |all: &[heapless::Vec<f32, BINS>; 3]| {
            all.each_ref().map(|own| own[part.bins.clone()].iter().copied().collect())
        };
        let drift = Spectrum { re: cut(&divided.drift.re), im: cut(&divided.drift.im) };
        Experiment { drift, divided: PARTS, ..experiment(&alone(&record, number)) }
    };
    let alone = divided.parts().enumerate().map(own).collect();
    (divided, alone)
}

/// Largest difference of two normal equations, each entry over the diagonals of its row and column.
pub(crate) fn apart<const L: usize>(one: &Normal<L>, other: &Normal<L>) -> f64 {
    let size = |k: usize| {
        let own = if k < other.unknowns() { other.row(k)[k] } else { other.sum_of_squares() };
        libm::sqrt(own)
    };
    let mut most = 0.0_f64;
    for i in 0..=other.unknowns() {
        for (j, (a, b)) in one.row(i).iter().zip(other.row(i)).enumerate() {
            most = most.max((a - b).abs() / (size(i) * size(j)).max(f64::MIN_POSITIVE));
        }
    }
    most
}

/// The order of the sums differs: 1e-9 is a thousand times the rounding of the elimination of a seam.
#[test]
fn a_divided_record_is_the_sum_of_its_parts() {
    let (chain, bounds, measurement, sought) = (chain(), bounds(), measurement(), sought());
    let problem = problem(&chain, &measurement, &bounds, &sought);
    let (divided, alone) = divided_and_alone(&measurement);
    let retired = RetiredInformation::none(sought.unknowns());
    let at = sought.coordinates(&bushings());
    for every in [1, 3] {
        let evaluate = |experiments: &[Experiment<BINS>]| {
            let mut workspace = Box::new(Workspace::new());
            let mut objective =
                SumOfSquares::new(&problem, experiments, &retired, &mut workspace, every);
            let cost = objective.cost(&at);
            let mut normal = Box::new(Normal::new());
            objective.linearise(&at, &mut normal).unwrap();
            (cost, normal)
        };
        let (cost, normal) = evaluate(core::slice::from_ref(&*divided));
        let (sum, of_parts) = evaluate(&alone);
        assert!((cost / sum - 1.0).abs() < 1e-9, "every {every}: {cost}, not {sum}");
        let apart = apart(&normal, &of_parts);
        assert!(apart < 1e-9, "every {every}: {apart}");
        assert!(evaluate(&alone[..1]).0 < 0.5 * cost, "a part is less than the whole");
    }
}

/// Until a model tells more, a pose that changes within a part is an error of `moves²/12` of the reading's square.
#[test]
fn a_part_counts_less_as_the_robot_moves_in_it() {
    let (chain, bounds, measurement, sought) = (chain(), bounds(), measurement(), sought());
    let problem = problem(&chain, &measurement, &bounds, &sought);
    let mut refinement = Box::new(Refinement::new(&sought, &bushings()));
    let mut deviation = |moves: f64| {
        let mut record = along(PARTS);
        record.path.iter_mut().for_each(|stage| stage.moves = moves);
        let divided = Experiment::<BINS>::new(&chain, &measurement, &record, &mut [0.0; SAMPLES]);
        refinement.fit(&problem, &[divided.unwrap()]).covariance.deviation(0)
    };
    let [standing, moving] = [0.0, 1.0].map(&mut deviation);
    assert!(moving > 1.2 * standing, "{moving}, {standing} without a movement");
}
