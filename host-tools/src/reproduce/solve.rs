//! One method on one robot.

use std::time::Instant;

use fearless_simd::Level;
use flexid_core::parameters::Bushing;
use flexid_core::search::{Search, Weighing};

use rand_core::Rng as _;

use super::displacement::Loss;
use super::method::{Kind, Method, SAMPLES, Sensitivity, Variant};
use super::rivals::Minimise;
use super::robot::{Purpose, Robot, Study, generator};
use super::sobol::SobolError;
use super::test_stand::TestStand;
use super::{Effort, flexid};

/// What one method made of one robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Parameter deviation before the first and after each iteration.
    pub curve: Vec<f64>,
    /// Parameter deviation at the end.
    pub deviation: f64,
    /// Displacement errors on the unseen experiments, direction by direction; empty where the paper validates none.
    pub errors: Vec<f64>,
    /// The parameters that it ends with.
    pub fitted: Vec<Bushing>,
    /// Wall time, s.
    pub seconds: f64,
    /// What of it the sensitivities cost.
    pub sensitivities: Cost,
}

/// What a part of the work cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Evaluations of all experiments.
    pub evaluations: u64,
    /// Wall time, s.
    pub seconds: f64,
}

/// Lets `method` find `robot`.
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
    search.renew(weighing);
    let mut curve = vec![stand.deviation(search.centre())];
    while !search.finished() {
        for _ in 0..SAMPLES {
            let losses = stand.losses(variant.loss, search.ask(&mut rng));
            search.tell(&losses);
        }
        curve.push(stand.deviation(search.centre()));
    }
    (curve, stand.bushings(search.centre()).to_vec())
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
