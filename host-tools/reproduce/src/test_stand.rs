//! A robot on the test stand, which computes the losses and the parameter deviation of every guess of its parameters.

use fearless_simd::Level;
use flexid_core::parameters::{Bushing, Bushings};
use flexid_core::search::Sensitivities;
use flexid_simulation::scenario::Sampling;
use flexid_simulation::validation;
use nalgebra::Vector3;
use rand_core::Rng as _;

use super::displacement::{Loss, Scratch};
use super::effort::Effort;
use super::robot::{Purpose, Robot, Study, generator};
use super::sobol::{self, SobolError};

/// One robot, and buffers.
pub struct TestStand<'a> {
    /// The study that the robot belongs to.
    pub study: &'a Study,
    /// The robot to be found.
    pub robot: &'a Robot,
    /// SIMD level of the model's evaluation.
    pub level: Level,
    scratch: Scratch,
    /// The experiments in their order, that with the largest losses first.
    order: Vec<usize>,
    /// Number of evaluations so far. Each is of all experiments.
    pub evaluations: u64,
}

impl<'a> TestStand<'a> {
    /// A test stand without evaluations.
    pub fn new(study: &'a Study, robot: &'a Robot, level: Level) -> Self {
        let order = (0..robot.seen.len()).collect();
        Self { study, robot, level, scratch: Scratch::default(), order, evaluations: 0 }
    }

    /// The parameters at `fractions` of the bounds; none if there are not as many fractions as the study has
    /// parameters.
    pub fn bushings(&self, fractions: &[f32]) -> Bushings {
        self.study.bounds().bushings(fractions).unwrap_or_default()
    }

    /// Losses of the guess at `fractions` of the bounds, direction by direction, experiment by experiment.
    pub fn losses(&mut self, loss: Loss, fractions: &[f32]) -> Vec<f32> {
        self.losses_below(f32::INFINITY, loss, fractions)
    }

    /// The losses of the guess, if their mean is below `limit`. If it is not, experiments that are not needed to
    /// decide this are left out, and have losses of 0.
    pub fn losses_below(&mut self, limit: f32, loss: Loss, fractions: &[f32]) -> Vec<f32> {
        self.evaluations += 1;
        let bushings = self.bushings(fractions);
        let mut losses = vec![0.0; 3 * self.robot.seen.len()];
        for &experiment in &self.order {
            let reference = &self.robot.seen[experiment].reference;
            let found = reference.losses(loss, &bushings, self.level, &mut self.scratch);
            losses[3 * experiment..3 * experiment + 3].copy_from_slice(&found);
            // No loss is negative, and the rounding of a sum is less than this margin.
            if mean(&losses) > limit * (1.0 + 1e-5) {
                return losses;
            }
        }
        let size =
            |experiment: usize| losses[3 * experiment..3 * experiment + 3].iter().sum::<f32>();
        self.order.sort_by(|&a, &b| size(b).total_cmp(&size(a)));
        losses
    }

    /// Mean of the losses.
    pub fn loss(&mut self, loss: Loss, fractions: &[f32]) -> f64 {
        let losses = self.losses(loss, fractions);
        losses.iter().map(|&loss| f64::from(loss)).sum::<f64>() / losses.len() as f64
    }

    /// Parameter deviation of the guess at `fractions` of the bounds.
    pub fn deviation(&self, fractions: &[f32]) -> f64 {
        self.deviation_of(&self.bushings(fractions))
    }

    /// Parameter deviation of these bushings.
    pub fn deviation_of(&self, bushings: &[Bushing]) -> f64 {
        validation::parameter_deviation(&self.robot.truth, bushings, self.study.bounds())
    }

    /// Displacement errors of the equation of motion with these bushings on the unseen experiments, direction by
    /// direction.
    pub fn unseen_errors(&self, bushings: &[Bushing]) -> Vec<f64> {
        let Sampling { rate_hz, band_hz, .. } = self.study.scenario.measurement;
        let errors = self.robot.unseen.iter().flat_map(|unseen| {
            let model = unseen.cut.response(&self.study.chain, bushings).displacement;
            validation::displacement_error(&unseen.response.displacement, &model, rate_hz, band_hz)
        });
        errors.collect()
    }

    /// Jacobian sensitivities of the experiments. They need no evaluation.
    pub fn jacobian_sensitivities(&self) -> Sensitivities {
        let chain = &self.study.chain;
        let any = Bushing { stiffness: [1.0; 6], damping: [1.0; 6] };
        let bushings = vec![any; chain.joints().len()];
        let jacobians: Vec<_> = (self.robot.seen.iter())
            .filter_map(|trial| chain.linearise(&trial.pose, Vector3::zeros(), &bushings).ok())
            .map(|linear| linear.jacobian())
            .collect();
        Sensitivities::jacobian(&jacobians, chain.joints().len())
    }

    /// Sensitivities from the Sobol total-order indices of the losses over the bounds.
    ///
    /// # Errors
    /// The sequence has too few samples or dimensions, or a loss is not finite.
    pub fn global_sensitivities(
        &mut self,
        loss: Loss,
        effort: &Effort,
    ) -> Result<Sensitivities, SobolError> {
        let (parameters, outputs) = (self.study.parameters(), 3 * self.robot.seen.len());
        let seed = generator(effort.seed, self.robot.number, Purpose::Analysis).next_u32();
        let evaluate = |fractions: &[f32], values: &mut [f32]| {
            values.copy_from_slice(&self.losses(loss, fractions));
        };
        let total = sobol::total_order(parameters, outputs, effort.sobol_samples, seed, evaluate)?;
        let index = |row, column| total.indices[(row, column)] as f32;
        Ok(Sensitivities::new(outputs, parameters, index))
    }
}

/// Mean of the losses of a sample, as the search takes it.
pub(super) fn mean(losses: &[f32]) -> f32 {
    losses.iter().sum::<f32>() / losses.len() as f32
}
