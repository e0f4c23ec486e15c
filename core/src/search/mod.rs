//! Random search with annealing (paper, sections 3.2 to 4.2): finds the basin that the refinement needs.
//!
//! Parameters are sought as fractions of their bounds. The search only asks for losses; which loss, of
//! which model, is the caller's:
//!
//! ```
//! # use flexid_core::search::{Search, Strategy};
//! # use rand_core::SeedableRng;
//! # let mut generator = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(1);
//! let distance = |[x, y]: [f32; 2]| [(x - 0.2).abs(), (y - 0.7).abs()];
//! let mut search = Search::new(Strategy::default(), 2);
//! while !search.finished() {
//!     let sample = search.ask(&mut generator);
//!     let losses = distance([sample[0], sample[1]]);
//!     search.tell(&losses);
//! }
//! assert!(distance([search.centre()[0], search.centre()[1]]).iter().all(|&error| error < 0.01));
//! ```
//!
//! An iteration draws [`Strategy::samples`] samples:
//!
//! - the first is the centre itself, so that a value is not given up for a worse one;
//! - then samples from a hypersphere about the centre, clamped to the bounds;
//! - the last [`Strategy::outside`] _look outside_: one parameter, chosen at random, takes any value within
//!   its bounds, the others stay.
//!
//! The next centre is the best sample, or, with sensitivities, takes each parameter from the sample that
//! served it best ([`Weighing`]): a combination that has not been tried, and may be worse. Then the sphere
//! shrinks ([`Shrinking`]).
//!
//! It stops when its iterations have run out. At the default strategy the centre then lies in the right
//! basin for about 39 of 40 robots drawn from the bounds, and who is not is found out by the refinement's
//! residuals and searched for again. More iterations lower the parameter deviation, but not the number of restarts.

mod random;
mod sensitivity;
mod shrinking;

use rand_core::Rng;

use crate::parameters::MAX_PARAMETERS;
pub use sensitivity::{MAX_EXPERIMENTS, MAX_LOSSES, Sensitivities, Weighing};
use shrinking::Radii;
pub use shrinking::Shrinking;

/// How long to search, and where. What the paper leaves open is chosen here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strategy {
    /// Iterations.
    pub iterations: u32,
    /// Samples that an iteration costs, the centre and those that look outside included.
    pub samples: u32,
    /// Of these, samples that look outside.
    pub outside: u32,
    /// How the sphere of the others shrinks.
    pub shrinking: Shrinking,
}

impl Default for Strategy {
    fn default() -> Self {
        let shrinking = Shrinking::Scheduled { first: 1.0, last: 0.05 };
        Self { iterations: 100, samples: 20, outside: 10, shrinking }
    }
}

/// State of a search.
#[derive(Clone, Debug)]
pub struct Search {
    strategy: Strategy,
    parameters: usize,
    weighing: Weighing,
    radii: Radii,
    /// Fractions of the bounds.
    centre: [f32; MAX_PARAMETERS],
    /// The centre before.
    previous: [f32; MAX_PARAMETERS],
    /// What [`Search::ask`] gave last, and the parameter that it looks outside with.
    asked: [f32; MAX_PARAMETERS],
    looks_at: Option<usize>,
    /// Of the iteration so far: the value that served each parameter best, and its loss.
    best: [f32; MAX_PARAMETERS],
    best_loss: [f32; MAX_PARAMETERS],
    iteration: u32,
    sample: u32,
    /// Mean loss of the centre, once evaluated.
    centre_loss: f32,
}

impl Search {
    /// From the middle of the bounds, over so many parameters: at most [`MAX_PARAMETERS`]. Samples are taken
    /// whole until [`Search::renew`] says otherwise.
    ///
    /// # Panics
    ///
    /// If there are more parameters.
    pub fn new(strategy: Strategy, parameters: usize) -> Self {
        assert!(parameters <= MAX_PARAMETERS);
        Self {
            strategy,
            parameters,
            weighing: Weighing::Mean,
            radii: Radii::new(strategy.shrinking, strategy.iterations),
            centre: [0.5; MAX_PARAMETERS],
            previous: [0.5; MAX_PARAMETERS],
            asked: [0.5; MAX_PARAMETERS],
            looks_at: None,
            best: [0.5; MAX_PARAMETERS],
            best_loss: [f32::INFINITY; MAX_PARAMETERS],
            iteration: 0,
            sample: 0,
            centre_loss: f32::INFINITY,
        }
    }

    /// Takes notice of changed losses: goes on from the centre, with the iteration begun anew.
    pub fn renew(&mut self, weighing: Weighing) {
        self.weighing = weighing;
        self.centre_loss = f32::INFINITY;
        self.previous = self.centre;
        self.begin_iteration();
    }

    /// Whether the iterations have run out.
    pub fn finished(&self) -> bool {
        self.iteration >= self.strategy.iterations
    }

    /// Iterations done, of how many.
    pub fn iterations(&self) -> (u32, u32) {
        (self.iteration, self.strategy.iterations)
    }

    /// Mean loss of the centre, once evaluated; infinite before.
    pub fn loss(&self) -> f32 {
        self.centre_loss
    }

    /// The centre, as fractions of the bounds.
    pub fn centre(&self) -> &[f32] {
        &self.centre[..self.parameters]
    }

    /// Half axis along each parameter of what the present iteration samples from, in bound ranges; of the
    /// iteration before until the centre's losses are told.
    pub fn radii(&self) -> &[f32] {
        &self.radii.get()[..self.parameters]
    }

    /// Draws the next sample, as fractions of the bounds; tell its losses with [`Search::tell`].
    pub fn ask(&mut self, generator: &mut impl Rng) -> &[f32] {
        self.asked = self.centre;
        self.looks_at = None;
        if self.sample > 0 {
            if self.sample + self.strategy.outside >= self.strategy.samples {
                let parameter = random::choice(generator, self.parameters);
                self.asked[parameter] = random::uniform(generator);
                self.looks_at = Some(parameter);
            } else {
                self.draw_from_sphere(generator);
            }
        }
        &self.asked[..self.parameters]
    }

    /// Losses of the sample last asked for, per direction and experiment: at most [`MAX_LOSSES`]. One that
    /// is not a number serves no parameter.
    pub fn tell(&mut self, losses: &[f32]) {
        if self.sample == 0 {
            self.judge_centre(sensitivity::mean(losses));
        }
        match (&self.weighing, self.looks_at) {
            (Weighing::Sensitivities(_), Some(parameter)) => self.consider(parameter, losses),
            _ => (0..self.parameters).for_each(|parameter| self.consider(parameter, losses)),
        }
        self.sample += 1;
        if self.sample >= self.strategy.samples {
            self.previous = self.centre;
            self.centre = self.best;
            self.iteration += 1;
            self.begin_iteration();
        }
    }

    fn begin_iteration(&mut self) {
        self.sample = 0;
        self.best = self.centre;
        self.best_loss = [f32::INFINITY; MAX_PARAMETERS];
    }

    /// The centre's loss tells how the last iteration did.
    fn judge_centre(&mut self, loss: f32) {
        // The first of all, or the first since the losses have changed, tells nothing.
        if self.centre_loss != f32::INFINITY {
            let mut step = self.centre;
            for (step, previous) in step.iter_mut().zip(&self.previous) {
                *step -= previous;
            }
            let bettered = loss < self.centre_loss;
            self.radii.shrink(self.iteration, bettered, &step[..self.parameters]);
        }
        self.centre_loss = loss;
    }

    fn draw_from_sphere(&mut self, generator: &mut impl Rng) {
        let mut offset = [0.0; MAX_PARAMETERS];
        random::in_unit_ball(generator, &mut offset[..self.parameters]);
        for ((fraction, offset), radius) in self.asked.iter_mut().zip(&offset).zip(self.radii.get())
        {
            *fraction = (*fraction + radius * offset).clamp(0.0, 1.0);
        }
    }

    /// Keeps the sample's value of one parameter if no other of this iteration has served it better.
    fn consider(&mut self, parameter: usize, losses: &[f32]) {
        let loss = self.weighing.loss(losses, parameter);
        if loss < self.best_loss[parameter] {
            self.best_loss[parameter] = loss;
            self.best[parameter] = self.asked[parameter];
        }
    }
}
