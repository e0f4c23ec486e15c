//! The optimisers that the paper dismissed for its random search, each from an existing crate: a genetic
//! algorithm, a particle swarm and, beyond the paper, CMA-ES.
//!
//! All three minimise over the unit cube with a fixed number of evaluations, so that they differ by the method alone.
//! Their settings are those of the literature, named in each file. None is tuned.

pub mod cma_es;
pub mod genetic;
pub mod swarm;

/// Loss of a point of the unit cube, above −∞. NaN counts as infinitely bad.
pub type Loss<'a> = dyn FnMut(&[f32]) -> f64 + Send + 'a;

/// One of [`genetic::minimise`], [`swarm::minimise`] and [`cma_es::minimise`].
///
/// Arguments: the number of parameters, the budget of evaluations, the evaluations between two points of
/// [`Progress::curve`] (0: no curve), the seed, and the loss. The same arguments give the same result.
pub type Minimise = fn(usize, u64, u64, u64, &mut Loss<'_>) -> Progress;

/// The result of a minimisation, and its course.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Progress {
    /// Best point so far after each `every` evaluations.
    pub curve: Vec<Vec<f32>>,
    /// Best point of all, in the unit cube; empty when nothing was evaluated.
    pub best: Vec<f32>,
    /// Loss at `best`; infinite when no loss was a number.
    pub loss: f64,
    /// Number of evaluations of the loss: the budget, or none without parameters.
    pub evaluations: u64,
}

/// A loss that counts its evaluations, keeps the best, and ends when the budget is spent.
///
/// Generations do not divide the budget. The last one is cut short here, for every optimiser.
struct Metered<'a> {
    loss: &'a mut Loss<'a>,
    budget: u64,
    every: u64,
    progress: Progress,
}

impl<'a> Metered<'a> {
    fn new(budget: u64, every: u64, loss: &'a mut Loss<'_>) -> Self {
        let progress = Progress { loss: f64::INFINITY, ..Progress::default() };
        Self { loss, budget, every, progress }
    }

    fn is_spent(&self) -> bool {
        self.remaining() == 0
    }

    /// Number of evaluations left.
    fn remaining(&self) -> u64 {
        self.budget - self.progress.evaluations
    }

    /// The loss at `point`, or None when the budget is spent. Never NaN.
    fn evaluate(&mut self, point: &[f32]) -> Option<f64> {
        if self.is_spent() {
            return None;
        }
        let loss = (self.loss)(point);
        let loss = if loss.is_nan() { f64::INFINITY } else { loss };
        let Progress { curve, best, loss: least, evaluations } = &mut self.progress;
        if best.is_empty() || loss < *least {
            *best = point.to_vec();
            *least = loss;
        }
        *evaluations += 1;
        if evaluations.is_multiple_of(self.every) {
            curve.push(best.clone());
        }
        Some(loss)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIVALS: [(&str, Minimise); 3] = [
        ("genetic algorithm", genetic::minimise),
        ("particle swarm", swarm::minimise),
        ("CMA-ES", cma_es::minimise),
    ];

    /// Squared distance from a point off the centre, since CMA-ES starts at the centre.
    fn sphere(point: &[f32]) -> f64 {
        point.iter().map(|&x| (f64::from(x) - 0.3).powi(2)).sum()
    }

    /// Rosenbrock's valley over [-2, 2] in every dimension; minimum 0 at 0.75.
    fn rosenbrock(point: &[f32]) -> f64 {
        let scaled: Vec<f64> = point.iter().map(|&x| 4.0 * f64::from(x) - 2.0).collect();
        let term =
            |pair: &[f64]| 100.0 * (pair[1] - pair[0] * pair[0]).powi(2) + (1.0 - pair[0]).powi(2);
        scaled.windows(2).map(term).sum()
    }

    /// Asserts that each rival's loss after `budget` evaluations is below a limit of its own.
    fn assert_losses(parameters: usize, budget: u64, loss: fn(&[f32]) -> f64, limits: [f64; 3]) {
        for ((name, minimise), limit) in RIVALS.into_iter().zip(limits) {
            for seed in [1, 2, 3] {
                let reached = minimise(parameters, budget, 0, seed, &mut |x| loss(x));
                assert_eq!(reached.loss, loss(&reached.best));
                assert!(reached.loss < limit, "{name}, seed {seed}: {} ≥ {limit}", reached.loss);
            }
        }
    }

    #[test]
    fn sphere_in_five_dimensions() {
        assert_losses(5, 4_000, sphere, [1e-3, 1e-9, 1e-9]);
    }

    /// A random point of the cube has a loss of 4.4 on average.
    #[test]
    fn sphere_in_thirty_six_dimensions() {
        assert_losses(36, 10_000, sphere, [0.01, 1.0, 1e-9]);
    }

    /// Random points have losses of some hundreds. The genetic algorithm ends on the valley's floor.
    #[test]
    fn rosenbrock_in_four_dimensions() {
        assert_losses(4, 10_000, rosenbrock, [2.0, 0.1, 1e-9]);
    }

    #[test]
    fn the_budget_is_met_to_the_evaluation() {
        for (name, minimise) in RIVALS {
            for budget in [0, 1, 7, 1_000, 1_234] {
                let mut count = 0;
                let mut loss = |point: &[f32]| {
                    count += 1;
                    sphere(point)
                };
                let progress = minimise(6, budget, 100, 1, &mut loss);
                assert_eq!(progress.evaluations, budget, "{name}");
                assert_eq!(count, budget, "{name}");
                assert_eq!(progress.curve.len() as u64, budget / 100, "{name}");
                assert_eq!(progress.best.len(), if budget == 0 { 0 } else { 6 }, "{name}");
            }
        }
    }

    #[test]
    fn the_curve_falls_to_the_best() {
        for (name, minimise) in RIVALS {
            let progress = minimise(6, 2_000, 50, 1, &mut |x| sphere(x));
            let losses: Vec<f64> = progress.curve.iter().map(|x| sphere(x)).collect();
            assert!(losses.is_sorted_by(|a, b| a >= b), "{name}");
            assert_eq!(progress.curve.last(), Some(&progress.best), "{name}");
        }
    }

    #[test]
    fn a_seed_decides_the_run() {
        for (name, minimise) in RIVALS {
            let run = |seed| minimise(36, 1_000, 10, seed, &mut |x| rosenbrock(x));
            assert_eq!(run(1), run(1), "{name}");
            assert_ne!(run(1), run(2), "{name}");
        }
    }

    /// The minimum is a corner, so that every step tends out of the cube.
    #[test]
    fn points_stay_in_the_cube() {
        for (name, minimise) in RIVALS {
            let mut loss = |point: &[f32]| {
                assert!(point.iter().all(|x| (0.0..=1.0).contains(x)), "{name}: {point:?}");
                point.iter().map(|&x| f64::from(x)).sum()
            };
            let progress = minimise(8, 5_000, 0, 1, &mut loss);
            assert!(progress.loss < 0.1, "{name}: {}", progress.loss);
        }
    }

    /// The loss is NaN in half of the cube, NaN in all of it, or the same in all of it.
    #[test]
    fn losses_without_information_do_not_stop_a_run() {
        for (name, minimise) in RIVALS {
            let mut half = |x: &[f32]| if x[0] > 0.5 { f64::NAN } else { sphere(x) };
            let progress = minimise(6, 3_000, 0, 1, &mut half);
            assert!(progress.loss < 0.01, "{name}: {}", progress.loss);
            for nothing in [f64::NAN, f64::INFINITY, 1.0] {
                let progress = minimise(6, 3_000, 0, 1, &mut |_| nothing);
                assert_eq!(progress.evaluations, 3_000, "{name}");
                assert_eq!(progress.best.len(), 6, "{name}");
            }
        }
    }

    #[test]
    fn without_parameters_nothing_is_asked() {
        for (name, minimise) in RIVALS {
            let progress = minimise(0, 100, 1, 1, &mut |_| 0.0);
            assert_eq!((progress.evaluations, progress.curve.len()), (0, 0), "{name}");
        }
    }
}
