//! Random search with annealing (paper, sections 3.2 to 4.2): finds the basin that the refinement needs.
//!
//! Parameters are sought as fractions of their bounds, on a linear scale. An iteration draws
//! [`Schedule::samples`] samples:
//!
//! - the first is the centre itself, so that a lucky value is not lost;
//! - then samples from a hypersphere about the centre;
//! - the last [`Schedule::outside`] _look outside_: one parameter, chosen at random, takes any value within
//!   its bounds, the others stay.
//!
//! Every sample yields the SSP of every direction and experiment, and through the sensitivities a loss of its
//! own for every parameter. The next centre takes each parameter from the sample that served it best; the
//! sphere shrinks by a constant factor.
//!
//! It stops when the schedule has run out, and hands its centre to the refinement: at the default schedule, 100
//! iterations of 20 samples, this centre lies in the right basin for about 39 of 40 robots drawn from the bounds,
//! and who is not is found out by the refinement's residuals and searched for again. More iterations lower
//! the parameter deviation, but not the number of restarts.

pub mod evaluate;
mod random;
pub mod sensitivity;

use fearless_simd::Level;
use heapless::Vec;
use rand_core::Rng;

use crate::DOF;
use crate::parameters::{Bounds, Bushing, Bushings, MAX_PARAMETERS};
use crate::spectrum::Experiment;
use sensitivity::{MAX_EXPERIMENTS, Sensitivities};

/// How long to search, and where. What the paper leaves open is chosen here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Schedule {
    /// Iterations.
    pub iterations: u32,
    /// Samples that an iteration costs, the centre and those that look outside included.
    pub samples: u32,
    /// Of these, samples that look outside.
    pub outside: u32,
    /// Radius of the first hypersphere, in units of the bound ranges. In 36 dimensions a sphere of radius 1 moves
    /// a single parameter by a sixth of its range.
    pub first_radius: f32,
    /// Radius after the last iteration.
    pub last_radius: f32,
}

impl Default for Schedule {
    fn default() -> Self {
        Self { iterations: 100, samples: 20, outside: 10, first_radius: 1.0, last_radius: 0.05 }
    }
}

/// State of a search.
#[derive(Clone, Debug)]
pub struct Search {
    schedule: Schedule,
    joints: usize,
    sensitivities: Sensitivities,
    /// Fractions of the bounds: joint by joint, six stiffnesses, six dampings.
    centre: [f32; MAX_PARAMETERS],
    /// Of the iteration so far: the value that served each parameter best, and its loss.
    best: [f32; MAX_PARAMETERS],
    best_loss: [f32; MAX_PARAMETERS],
    iteration: u32,
    sample: u32,
    /// Mean loss of the centre, once evaluated.
    centre_loss: f32,
}

impl Search {
    /// From the middle of the bounds, for a chain of `joints`.
    pub fn new(schedule: Schedule, joints: usize) -> Self {
        Self {
            schedule,
            joints,
            sensitivities: Sensitivities::default(),
            centre: [0.5; MAX_PARAMETERS],
            best: [0.5; MAX_PARAMETERS],
            best_loss: [f32::INFINITY; MAX_PARAMETERS],
            iteration: 0,
            sample: 0,
            centre_loss: f32::INFINITY,
        }
    }

    /// Takes notice of a changed set of experiments: goes on from the centre, with the iteration begun anew.
    pub fn renew<const B: usize>(&mut self, experiments: &[Experiment<B>]) {
        self.sensitivities = Sensitivities::new(experiments.iter().map(|e| &e.search.jacobian));
        self.begin_iteration();
    }

    /// Whether the schedule has run out.
    pub fn finished(&self) -> bool {
        self.iteration >= self.schedule.iterations
    }

    /// Iterations done, of how many.
    pub fn iterations(&self) -> (u32, u32) {
        (self.iteration, self.schedule.iterations)
    }

    /// Mean SSP of the centre, once evaluated; infinite before.
    pub fn loss(&self) -> f32 {
        self.centre_loss
    }

    /// The parameters at the centre.
    pub fn centre(&self, bounds: &Bounds) -> Bushings {
        bushings(&self.centre, bounds, self.joints)
    }

    /// Draws and evaluates one sample.
    pub fn step<const B: usize>(
        &mut self,
        experiments: &[Experiment<B>],
        bounds: &Bounds,
        level: Level,
        generator: &mut impl Rng,
    ) {
        let (sample, looked_at) = self.draw(generator);
        let guess = bushings(&sample, bounds, self.joints);
        let mut losses: Vec<f32, { 3 * MAX_EXPERIMENTS }> = Vec::new();
        for experiment in experiments.iter().take(MAX_EXPERIMENTS) {
            let _ = losses.extend_from_slice(&evaluate::ssp(&experiment.search, &guess, level));
        }
        if self.sample == 0 {
            self.centre_loss = losses.iter().sum::<f32>() / losses.len() as f32;
        }
        match looked_at {
            Some(parameter) => self.consider(parameter, &sample, &losses),
            None => (0..self.parameters()).for_each(|p| self.consider(p, &sample, &losses)),
        }
        self.sample += 1;
        if self.sample >= self.schedule.samples {
            self.centre = self.best;
            self.iteration += 1;
            self.begin_iteration();
        }
    }

    fn parameters(&self) -> usize {
        2 * DOF * self.joints
    }

    fn begin_iteration(&mut self) {
        self.sample = 0;
        self.best = self.centre;
        self.best_loss = [f32::INFINITY; MAX_PARAMETERS];
    }

    /// The next sample, and the parameter that it looks outside with.
    fn draw(&self, generator: &mut impl Rng) -> ([f32; MAX_PARAMETERS], Option<usize>) {
        let mut sample = self.centre;
        if self.sample == 0 {
            return (sample, None);
        }
        let parameters = self.parameters();
        if self.sample + self.schedule.outside >= self.schedule.samples {
            let parameter = random::choice(generator, parameters);
            sample[parameter] = random::uniform(generator);
            return (sample, Some(parameter));
        }
        let mut offset = [0.0; MAX_PARAMETERS];
        random::in_ball(generator, self.radius(), &mut offset[..parameters]);
        for (fraction, offset) in sample.iter_mut().zip(&offset) {
            *fraction = (*fraction + offset).clamp(0.0, 1.0);
        }
        (sample, None)
    }

    /// Scheduled shrinking: a constant factor an iteration.
    fn radius(&self) -> f32 {
        let Schedule { first_radius, last_radius, iterations, .. } = self.schedule;
        let part = self.iteration as f32 / iterations as f32;
        first_radius * libm::powf(last_radius / first_radius, part)
    }

    /// Keeps a sample's value of one parameter if no other of this iteration has served it better.
    fn consider(&mut self, parameter: usize, sample: &[f32; MAX_PARAMETERS], losses: &[f32]) {
        let (joint, dof) = (parameter / (2 * DOF), parameter % DOF);
        let loss = self.sensitivities.loss(losses, joint, dof);
        if loss < self.best_loss[parameter] {
            self.best_loss[parameter] = loss;
            self.best[parameter] = sample[parameter];
        }
    }
}

fn bushings(fractions: &[f32; MAX_PARAMETERS], bounds: &Bounds, joints: usize) -> Bushings {
    let within =
        |fraction: f32, [lower, upper]: [f64; 2]| lower + f64::from(fraction) * (upper - lower);
    let (own, _) = fractions.as_chunks::<{ 2 * DOF }>();
    own[..joints]
        .iter()
        .map(|joint| Bushing {
            stiffness: core::array::from_fn(|dof| within(joint[dof], bounds.stiffness[dof])),
            damping: core::array::from_fn(|dof| within(joint[DOF + dof], bounds.damping[dof])),
        })
        .collect()
}
