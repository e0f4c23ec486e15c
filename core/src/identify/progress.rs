//! Progress of an identifier.

use super::phase::Phase;
use super::start::Method;
use super::{Effort, Identifier};

/// Typical number of steps of a refinement that starts in the right basin. Chosen: an eighth of the limit; it scales the progress alone.
const TYPICAL_ITERATIONS: f32 = 12.0;

/// Progress of the work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Present work.
    pub phase: Phase,
    /// Part of the present search or refinement that is done, 0 to 1.
    pub fraction: f32,
    /// Total cost so far.
    pub effort: Effort,
    /// Smallest loss of the present search (SSP).
    pub search_loss: f32,
    /// Sum of squares of the whitened residuals and priors where the present refinement stands; NaN where none has been evaluated.
    pub objective: f64,
}

impl<R> Identifier<R> {
    /// Returns the progress of the work.
    pub fn progress(&self) -> Progress {
        let (done, of) = self.search.iterations();
        Progress {
            phase: self.phase,
            fraction: match self.phase {
                Phase::Waiting => 0.0,
                Phase::Searching => match self.method {
                    Method::Descent => self.descent.fraction(),
                    Method::RandomSearch => done as f32 / of as f32,
                },
                Phase::Refining => self.refinement.iterations() as f32 / TYPICAL_ITERATIONS,
                Phase::Settled => 1.0,
            }
            .min(1.0),
            effort: self.effort,
            search_loss: self.search.loss(),
            // As all bins would show it.
            objective: self.refinement.every() as f64 * self.refinement.objective(),
        }
    }
}
