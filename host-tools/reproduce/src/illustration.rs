//! Figures 3 and 5: the search over two parameters, and the displacement of reference and models.

use fearless_simd::Level;
use flexid_core::search::{Search, Shrinking, Strategy};
use nalgebra::Vector3;

use super::displacement::Loss;
use super::effort::Effort;
use super::method::METHODS;
use super::robot::{Purpose, Robot, Study, Unseen, generator};
use super::solve::Outcome;
use super::tables::{DisplacementIllustration, SearchIllustration, SearchIteration};
use super::test_stand::TestStand;

/// Number of points of the loss map along each parameter.
const GRID: usize = 41;
/// A search small enough to be drawn.
const STRATEGY: Strategy = Strategy {
    iterations: 4,
    samples: 12,
    outside: 0,
    shrinking: Shrinking::Scheduled { first: 0.45, last: 0.1 },
};
/// Fig. 5 shows one sample of this many.
const THINNING: usize = 4;
/// Models that fig. 5 shows beside the reference.
const SHOWN: [&str; 3] = ["baseline", "jacobian", "flexid"];

/// Fig. 3: the stiffness about z of the first joint and about y of the last, with all other parameters known.
pub fn search(study: &Study, robot: &Robot, effort: &Effort, level: Level) -> SearchIllustration {
    let joints = &study.model.joints;
    let (first, last) = (&joints[0].name, &joints[joints.len() - 1].name);
    let places = [5, 12 * (joints.len() - 1) + 4];
    let truth = fractions(study, robot);
    let mut stand = TestStand::new(study, robot, level);
    let mut loss = |point: [f32; 2]| {
        let mut guess = truth.clone();
        places.iter().zip(point).for_each(|(&place, value)| guess[place] = value);
        stand.loss(Loss::Mae, &guess)
    };

    let along = |index: usize| index as f32 / (GRID - 1) as f32;
    let row = |loss: &mut dyn FnMut([f32; 2]) -> f64, y: usize| {
        (0..GRID).map(|x| loss([along(x), along(y)])).collect()
    };
    let map = (0..GRID).map(|y| row(&mut loss, y)).collect();

    let mut rng = generator(effort.seed, robot.number, Purpose::Illustration);
    let mut search = Search::new(STRATEGY, 2);
    let mut iterations = Vec::new();
    let pair = |point: &[f32]| [f64::from(point[0]), f64::from(point[1])];
    while !search.finished() {
        let (iteration, _) = search.iterations();
        let centre = pair(search.centre());
        let mut samples = Vec::new();
        let mut radius = 0.0;
        for sample in 0..STRATEGY.samples {
            let point = search.ask(&mut rng);
            let point = [point[0], point[1]];
            // The first sample is the centre.
            if sample > 0 {
                samples.push(pair(&point));
            }
            search.tell(&[loss(point) as f32]);
            if sample == 0 {
                radius = f64::from(search.radii()[0]);
            }
        }
        let best = pair(search.centre());
        iterations.push(SearchIteration {
            iteration: iteration + 1,
            centre,
            radius,
            samples,
            best,
        });
    }
    SearchIllustration {
        axes: [
            format!("stiffness rz of {first}, part of its bounds"),
            format!("stiffness ry of {last}, part of its bounds"),
        ],
        truth: places.map(|place| f64::from(truth[place])),
        loss: map,
        iterations,
    }
}

/// Fig. 5: the displacement along x in the first unseen experiment.
pub fn displacement(
    study: &Study,
    robot: &Robot,
    outcomes: &[Option<Outcome>],
) -> DisplacementIllustration {
    let Some(Unseen { cut, response }) = robot.unseen.first() else {
        return DisplacementIllustration::default();
    };
    let x = |series: &[Vector3<f64>]| series.iter().step_by(THINNING).map(|x| x[0]).collect();
    let shown = METHODS.iter().zip(outcomes).filter(|(method, _)| SHOWN.contains(&method.key));
    let models = shown.filter_map(|(method, outcome)| {
        let fitted = &outcome.as_ref()?.fitted;
        let moved = cut.response(&study.chain, fitted).displacement;
        Some((method.key.to_owned(), x(&moved)))
    });
    let pose: Vec<_> = cut.pose.iter().map(|angle| format!("{angle:.2}")).collect();
    let instants = (0..response.displacement.len()).step_by(THINNING);
    DisplacementIllustration {
        title: format!(
            "x at the TCP, first unseen experiment of the first robot, pose ({})",
            pose.join(", ").replace('-', "−")
        ),
        time_s: instants.map(|n| n as f64 / cut.rate_hz).collect(),
        reference_m: x(&response.displacement),
        models_m: models.collect(),
    }
}

/// The truth as fractions of the bounds.
fn fractions(study: &Study, robot: &Robot) -> Vec<f32> {
    let bounds = study.bounds();
    let part = |value: f64, [lower, upper]: [f64; 2]| ((value - lower) / (upper - lower)) as f32;
    let mut fractions = Vec::new();
    for (bushing, own) in robot.truth.iter().zip(&bounds.joints) {
        let stiffness = bushing.stiffness.iter().zip(own.stiffness);
        let damping = bushing.damping.iter().zip(own.damping);
        fractions.extend(stiffness.chain(damping).map(|(&value, range)| part(value, range)));
    }
    fractions
}
