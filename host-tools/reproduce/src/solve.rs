//! One method on one robot.

use std::time::Instant;

use fearless_simd::Level;
use flexid_core::parameters::Bushing;
use flexid_core::search::{Search, Weighing};

use rand_core::Rng as _;

use super::displacement::Loss;
use super::effort::Effort;
use super::flexid;
use super::method::{Kind, Method, SAMPLES, Sensitivity, Variant};
use super::rivals::Minimise;
use super::robot::{Purpose, Robot, Study, generator};
use super::sobol::SobolError;
use super::test_stand::{TestStand, mean};

/// The outcome of one method on one robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Parameter deviation before the first and after each iteration.
    pub curve: Vec<f64>,
    /// Parameter deviation at the end.
    pub deviation: f64,
    /// Displacement errors on the unseen experiments, direction by direction; empty without unseen experiments, or
    /// for a method that is not tested on them.
    pub errors: Vec<f64>,
    /// Parameters at the end.
    pub fitted: Vec<Bushing>,
    /// Wall time, s.
    pub seconds: f64,
    /// Cost of the sensitivities, a part of the whole.
    pub sensitivities: Cost,
}

/// Cost of a part of the work.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Number of evaluations of all experiments.
    pub evaluations: u64,
    /// Wall time, s.
    pub seconds: f64,
}

/// Identifies `robot` with `method`.
///
/// # Errors
/// The global sensitivity analysis fails.
pub fn solve(
    method: &Method,
    study: &Study,
    robot: &Robot,
    effort: &Effort,
    level: Level,
) -> Result<Outcome, SobolError> {
    let start = Instant::now();
    let mut stand = TestStand::new(study, robot, level);
    let mut sensitivities = Cost::default();
    let (curve, fitted) = match method.kind {
        Kind::Search(variant) => {
            let weighing = weigh(&variant, &mut stand, effort)?;
            let seconds = start.elapsed().as_secs_f64();
            sensitivities = Cost { evaluations: stand.evaluations, seconds };
            search(&variant, weighing, &mut stand, effort)
        }
        Kind::Rival(minimise) => compete(minimise, &mut stand, effort),
        Kind::Flexid => (Vec::new(), flexid::identify(study, robot, effort.seed, level)),
    };
    let seconds = start.elapsed().as_secs_f64();
    let deviation = stand.deviation_of(&fitted);
    let errors = if method.is_validated() { stand.unseen_errors(&fitted) } else { Vec::new() };
    Ok(Outcome { curve, deviation, errors, fitted, seconds, sensitivities })
}

fn weigh(
    variant: &Variant,
    stand: &mut TestStand<'_>,
    effort: &Effort,
) -> Result<Weighing, SobolError> {
    Ok(match variant.sensitivity {
        Sensitivity::None => Weighing::Mean,
        Sensitivity::Jacobian => Weighing::Sensitivities(stand.jacobian_sensitivities()),
        Sensitivity::Global => {
            Weighing::Sensitivities(stand.global_sensitivities(variant.loss, effort)?)
        }
    })
}

fn search(
    variant: &Variant,
    weighing: Weighing,
    stand: &mut TestStand<'_>,
    effort: &Effort,
) -> (Vec<f64>, Vec<Bushing>) {
    let mut rng = generator(effort.seed, stand.robot.number, Purpose::Search);
    let mut search = Search::new(variant.strategy(effort.iterations), stand.study.parameters());
    // A sample that is worse than another is useless only if samples are taken whole.
    let taken_whole = matches!(weighing, Weighing::Mean);
    search.renew(weighing);
    let mut curve = vec![stand.deviation(search.centre())];
    let mut best = Tried::default();
    while !search.finished() {
        let mut least = f32::INFINITY;
        for _ in 0..SAMPLES {
            let sample = search.ask(&mut rng);
            // The sample is mostly the centre: the best sample of the iteration before.
            if sample != best.sample {
                let limit = if taken_whole { least } else { f32::INFINITY };
                let losses = stand.losses_below(limit, variant.loss, sample);
                if mean(&losses) >= least {
                    search.tell(&losses);
                    continue;
                }
                best = Tried { sample: sample.to_vec(), losses };
            }
            least = mean(&best.losses);
            search.tell(&best.losses);
        }
        curve.push(stand.deviation(search.centre()));
    }
    (curve, stand.bushings(search.centre()).to_vec())
}

/// A sample, and its losses.
#[derive(Default)]
struct Tried {
    sample: Vec<f32>,
    losses: Vec<f32>,
}

fn compete(
    minimise: Minimise,
    stand: &mut TestStand<'_>,
    effort: &Effort,
) -> (Vec<f64>, Vec<Bushing>) {
    let parameters = stand.study.parameters();
    let seed = generator(effort.seed, stand.robot.number, Purpose::Rival).next_u64();
    let mut loss = |fractions: &[f32]| stand.loss(Loss::Mae, fractions);
    let progress = minimise(parameters, effort.evaluations(), SAMPLES.into(), seed, &mut loss);
    let middle = vec![0.5; parameters];
    let points = std::iter::once(&middle).chain(&progress.curve);
    let curve = points.map(|point| stand.deviation(point)).collect();
    (curve, stand.bushings(&progress.best).to_vec())
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use crate::reference::{mill3, model};

    use super::*;
    use crate::method::METHODS;

    /// The course of the search if every sample has all of its losses, and the centre is evaluated each time.
    fn plain(variant: &Variant, stand: &mut TestStand<'_>, effort: &Effort) -> Vec<f64> {
        let mut rng = generator(effort.seed, stand.robot.number, Purpose::Search);
        let parameters = stand.study.parameters();
        let mut search = Search::new(variant.strategy(effort.iterations), parameters);
        search.renew(weigh(variant, stand, effort).unwrap());
        let mut curve = vec![stand.deviation(search.centre())];
        while !search.finished() {
            for _ in 0..SAMPLES {
                let losses = stand.losses(variant.loss, search.ask(&mut rng));
                search.tell(&losses);
            }
            curve.push(stand.deviation(search.centre()));
        }
        curve
    }

    #[test]
    fn what_is_left_out_changes_nothing() {
        let (scenario, chain) = mill3();
        let file = PathBuf::from("scenario.toml");
        let study = Study { file, is_reference: true, chain, model: model(), scenario };
        let robot = study.draw(3, 0, 0).unwrap();
        let effort = Effort { iterations: 25, ..Effort::QUICK };
        for key in ["baseline", "ssp", "abl", "lo", "jacobian"] {
            let method = METHODS.iter().find(|method| method.key == key).unwrap();
            let Kind::Search(variant) = method.kind else { panic!("{key} does not search") };
            let mut stand = TestStand::new(&study, &robot, Level::new());
            let plain = plain(&variant, &mut stand, &effort);
            let all = std::mem::take(&mut stand.evaluations);
            let weighing = weigh(&variant, &mut stand, &effort).unwrap();
            let (curve, _) = search(&variant, weighing, &mut stand, &effort);
            assert_eq!(curve, plain, "{key}");
            println!("{key}: {} of {all} evaluated", stand.evaluations);
        }
    }
}
