//! Damped steps of Gauss and Newton to the minimum of a sum of squares, within bounds.
//!
//! A step h from x minimises the linearised sum of squares, to which a multiple λ of its diagonal and a small floor ε are added:
//!
//! ```text
//! F(x + h) ≈ F(x) − 2 gᵀh + hᵀN h          (N + λ (diag N + ε) + ε) h = g,   h in the box
//! ```
//!
//! It is kept if F falls. λ follows the ratio of the gain to `2 gᵀh − hᵀN h` ([`Damping`]).
//!
//! Sources: Levenberg, "A method for the solution of certain non-linear problems in least squares", Quarterly of Applied Mathematics
//! 2, 1944; Marquardt, "An algorithm for least-squares estimation of nonlinear parameters", J. SIAM 11, 1963; Nocedal and Wright,
//! _Numerical Optimization_, 2006, chapters 4 and 10; Madsen, Nielsen and Tingleff, _Methods for Non-Linear Least Squares Problems_,
//! 2004, section 3.2.

use super::damping::Damping;
use super::objective::{Domain, Objective};
use super::proposal::{Step, propose};
use crate::linear::normal::Normal;
use crate::sought::MAX_UNKNOWNS;

/// Least damping. Chosen: seven rejected steps raise it to the first one.
pub(super) const LEAST_DAMPING: f64 = 1e-9;
/// Damping above which a minimisation ends. Chosen: a step then moves no unknown by more than 1e-8 of the way to its own minimum.
const LAST_DAMPING: f64 = 1e8;

/// Limits of a minimisation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Gain of a step in the sum of squares below which it is not worth while.
    pub(super) negligible: f64,
    /// Steps after which it ends wherever it is.
    pub(super) iterations: u32,
    /// Damping of its first step.
    pub(super) damping: Damping,
}

impl Limits {
    /// Limits of a refinement. Chosen: where residuals have unit variance, all unknowns together end within a hundredth of a standard
    /// deviation of the minimum; a refinement typically takes an eighth of these steps.
    pub(super) const OF_REFINEMENT: Self =
        Self { negligible: 1e-4, iterations: 100, damping: Damping::first(LEAST_DAMPING) };
}

/// Outcome of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Another step is worth while.
    Improving,
    /// No step would gain anything, however little it is damped.
    Converged,
    /// It has had its steps, or those that promise a gain are no good: it may not be at a minimum.
    Exhausted,
}

/// The way to the minimum of the quadratic that the normal equations describe.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Remaining<const N: usize = MAX_UNKNOWNS> {
    /// Change of each unknown.
    pub(crate) step: Step<N>,
    /// Decrease of the sum of squares by this step.
    pub(crate) gain: f64,
}

/// State of a minimisation beside its point.
#[derive(Clone, Debug)]
pub(crate) struct LevenbergMarquardt<const L: usize> {
    /// Normal equations at the point, if it is `linearised`.
    pub(super) normal: Normal<L>,
    pub(super) linearised: bool,
    damping: Damping,
    /// The last trial step was rejected; a less damped one goes further, and would be as well.
    refused: bool,
    /// Steps tried since the start.
    pub(super) iterations: u32,
    limits: Limits,
}

impl<const L: usize> LevenbergMarquardt<L> {
    pub(crate) const fn new(limits: Limits) -> Self {
        Self {
            normal: Normal::new(),
            linearised: false,
            damping: limits.damping,
            refused: false,
            iterations: 0,
            limits,
        }
    }

    /// Starts anew from another point.
    pub(crate) fn restart(&mut self) {
        self.linearised = false;
        self.damping = self.limits.damping;
        self.refused = false;
        self.iterations = 0;
    }

    /// Goes on from the same point with another objective.
    pub(crate) fn renew(&mut self) {
        self.linearised = false;
        self.refused = false;
        self.iterations = 0;
    }

    /// Goes on from the same point with another objective. Returns how much the step without damping gains; nothing where the objective has no
    /// derivatives.
    pub(crate) fn gain_anew<const N: usize, D: Domain<N>, O: Objective<D::Point, L>>(
        &mut self,
        domain: &D,
        objective: &mut O,
        point: &D::Point,
    ) -> f64 {
        self.renew();
        let has_derivatives = self.linearise(objective, point).is_ok();
        if has_derivatives { self.remaining(domain, point).gain } else { 0.0 }
    }

    /// Returns whether the last minimisation has had all its steps.
    pub(crate) fn has_run_out(&self) -> bool {
        self.iterations >= self.limits.iterations
    }

    /// Tries one step from `point`, and keeps it if the cost falls.
    ///
    /// # Errors
    ///
    /// The objective has no derivatives at `point`, which is then unchanged.
    pub(crate) fn step<const N: usize, D: Domain<N>, O: Objective<D::Point, L>>(
        &mut self,
        domain: &D,
        objective: &mut O,
        point: &mut D::Point,
    ) -> Result<Outcome, O::Error> {
        self.linearise(objective, point)?;
        self.iterations += 1;
        let standing = self.normal.sum_of_squares();
        let (step, predicted) =
            propose(domain.level(), &self.normal, &domain.room(point), self.damping.value());
        if predicted < self.limits.negligible {
            return Ok(self.look_further(domain, point));
        }
        let trial = domain.advance(point, &step);
        let reached = objective.cost(&trial);
        if reached < standing {
            *point = trial;
            self.damping.follow((standing - reached) / predicted);
            self.refused = false;
            self.linearised = objective.linearise(point, &mut self.normal).is_ok();
            if !self.linearised {
                return Ok(Outcome::Exhausted);
            }
        } else {
            self.damping.rise();
            self.refused = true;
        }
        Ok(self.unless_exhausted())
    }

    /// Assembles the normal equations at `point`, unless they are those of that point.
    ///
    /// # Errors
    ///
    /// The objective has no derivatives there.
    pub(crate) fn linearise<P, O: Objective<P, L>>(
        &mut self,
        objective: &mut O,
        point: &P,
    ) -> Result<(), O::Error> {
        self.linearise_below(f64::INFINITY, objective, point)
    }

    /// Assembles the normal equations at `point`, unless the cost there is larger than `most`.
    ///
    /// # Errors
    ///
    /// The objective has no derivatives there.
    pub(crate) fn linearise_below<P, O: Objective<P, L>>(
        &mut self,
        most: f64,
        objective: &mut O,
        point: &P,
    ) -> Result<(), O::Error> {
        if self.linearised || objective.cost(point) > most {
            return Ok(());
        }
        objective.linearise(point, &mut self.normal)?;
        self.linearised = true;
        Ok(())
    }

    /// Returns the outcome of a damped step that gains nothing: converged only if the step without damping would gain nothing either.
    fn look_further<const N: usize, D: Domain<N>>(
        &mut self,
        domain: &D,
        point: &D::Point,
    ) -> Outcome {
        if self.remaining(domain, point).gain < self.limits.negligible {
            return Outcome::Converged;
        }
        if self.refused {
            return Outcome::Exhausted;
        }
        self.damping.fall();
        self.unless_exhausted()
    }

    fn unless_exhausted(&self) -> Outcome {
        if self.damping.value() > LAST_DAMPING || self.has_run_out() {
            Outcome::Exhausted
        } else {
            Outcome::Improving
        }
    }

    /// The step without damping from `point`, where the normal equations were linearised.
    pub(crate) fn remaining<const N: usize, D: Domain<N>>(
        &self,
        domain: &D,
        point: &D::Point,
    ) -> Remaining<N> {
        let (step, gain) = propose(domain.level(), &self.normal, &domain.room(point), 0.0);
        Remaining { step, gain }
    }
}

#[cfg(test)]
mod tests;
