//! Random search with annealing (paper, sections 3.2 to 4.2). It finds the basin that the refinement needs.
//!
//! The search seeks parameters as fractions of their bounds. It needs only losses; the caller chooses the loss and the model:
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
//! - The first sample is the centre itself, so that a worse value does not replace the value of the centre.
//! - The next samples lie in a hypersphere about the centre and are clamped to the bounds.
//! - The last [`Strategy::outside`] samples _look outside_: one parameter, chosen at random, takes any value within its
//!   bounds, and the others keep the values of the centre.
//!
//! Without sensitivities the next centre is the best sample. With sensitivities the next centre takes each parameter from the
//! sample with the smallest loss of this parameter ([`Weighing`]). This combination has not been evaluated and may be worse.
//! Then the sphere shrinks ([`Shrinking`]).
//!
//! The search stops after all its iterations. With the default strategy the centre then lies in the right basin for about 39
//! of 40 robots drawn from the bounds. For the other robots the residuals of the refinement reveal the wrong basin, and the
//! search starts again. More iterations lower the parameter deviation, but not the number of restarts.

mod random;
mod sensitivity;
mod shrinking;

use rand_core::Rng;

use crate::parameters::MAX_PARAMETERS;
pub use sensitivity::{MAX_EXPERIMENTS, MAX_LOSSES, Sensitivities, Weighing};
use shrinking::Radii;
pub use shrinking::Shrinking;

/// Length of a search, and distribution of its samples. The paper leaves these choices open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strategy {
    /// Number of iterations.
    pub iterations: u32,
    /// Number of samples of an iteration, including the centre and the samples that look outside.
    pub samples: u32,
    /// Number of samples of an iteration that look outside.
    pub outside: u32,
    /// Shrinking of the sphere of the other samples.
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
    /// Present centre, fractions of the bounds.
    centre: [f32; MAX_PARAMETERS],
    /// Centre of the iteration before, fractions of the bounds.
    previous: [f32; MAX_PARAMETERS],
    /// Sample that [`Search::ask`] returned last, fractions of the bounds.
    asked: [f32; MAX_PARAMETERS],
    /// Parameter in which the last sample looks outside; `None` for a sample that does not.
    looks_at: Option<usize>,
    /// Value of each parameter with the smallest loss in this iteration, fractions of the bounds.
    best: [f32; MAX_PARAMETERS],
    /// Smallest loss of each parameter in this iteration.
    best_loss: [f32; MAX_PARAMETERS],
    iteration: u32,
    sample: u32,
    /// Mean loss of the centre that was evaluated last; infinite before the first evaluation with the present losses.
    centre_loss: f32,
}

impl Search {
    /// A search over `parameters` parameters, at most [`MAX_PARAMETERS`], from the middle of the bounds. Until
    /// [`Search::renew`] sets sensitivities, the next centre is the best sample as a whole.
    ///
    /// # Panics
    ///
    /// Panics if `parameters` is larger than [`MAX_PARAMETERS`].
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

    /// Continues from the present centre with changed losses and this `weighing`, and restarts the iteration.
    pub fn renew(&mut self, weighing: Weighing) {
        self.weighing = weighing;
        self.centre_loss = f32::INFINITY;
        self.previous = self.centre;
        self.begin_iteration();
    }

    /// Returns whether all iterations are done.
    pub fn finished(&self) -> bool {
        self.iteration >= self.strategy.iterations
    }

    /// Number of iterations that are done, and number of all iterations.
    pub fn iterations(&self) -> (u32, u32) {
        (self.iteration, self.strategy.iterations)
    }

    /// Mean loss of the centre that was evaluated last; infinite before the first evaluation with the present losses.
    pub fn loss(&self) -> f32 {
        self.centre_loss
    }

    /// Present centre, fractions of the bounds.
    pub fn centre(&self) -> &[f32] {
        &self.centre[..self.parameters]
    }

    /// Half axis of the sampling ellipsoid of the present iteration along each parameter, in units of the bound ranges.
    /// Before [`Search::tell`] has received the losses of the centre, these are the half axes of the iteration before.
    pub fn radii(&self) -> &[f32] {
        &self.radii.get()[..self.parameters]
    }

    /// Draws the next sample, as fractions of the bounds. The caller passes its losses to [`Search::tell`].
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

    /// Takes the losses of the last sample, one per direction and experiment: at most [`MAX_LOSSES`]. A sample with a loss
    /// that is not a number changes no parameter.
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

    /// Stores the loss of the centre, and shrinks the radii by the success of the iteration that led to this centre.
    fn judge_centre(&mut self, loss: f32) {
        // The first loss, and the first loss after a change of the losses, have no loss before them to compare with.
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

    /// Keeps the sample's value of one parameter if its loss is the smallest in this iteration.
    fn consider(&mut self, parameter: usize, losses: &[f32]) {
        let loss = self.weighing.loss(losses, parameter);
        if loss < self.best_loss[parameter] {
            self.best_loss[parameter] = loss;
            self.best[parameter] = self.asked[parameter];
        }
    }
}
