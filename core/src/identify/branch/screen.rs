//! Screening: a branch is first refined on some of the bins, and compared with its minimum refined on the same bins.
//!
//! The minimum of some of the bins lies elsewhere than that of all, and lower there. A branch that leads to the same place is back, one
//! that ends far above is worse; both end there. Any other goes on with all bins, by which alone it may replace its minimum or be its
//! rival.

use rand_core::Rng;

use super::screened::Screen;
use super::tried::Branch;
use super::{Identifier, Minimum, Purpose};
use crate::chi_square::rarely_exceeded;
use crate::refine::{Outcome, Problem, thinning};
use crate::sought::Coordinates;
use crate::spectrum::Experiment;

/// Most steps from the minimum of all bins to that of some. Chosen: two or three suffice, but in a flat valley, where branches are not
/// screened.
const MAX_STEPS: u32 = 5;
/// Excess of the sum of squares of some bins, in χ² per degree of freedom, from which on a branch is worse by all bins beyond doubt. Two models
/// that differ by the norm S² in all whitened residuals have sums of squares that differ by `S² ± 2 S`. With three standard deviations, a
/// difference of all bins below [`RIVAL`](super::super::minimum::RIVAL) leaves S² at 54 or less; of half the bins these have 27, and their sums
/// then differ by less than 27 + 6 √27 = 58, of a quarter by 36, of a sixth by 27.
const BEYOND_DOUBT: f64 = 60.0;

impl<R: Rng> Identifier<R> {
    /// Prepares the screening of the branches of a minimum, unless that has been done. There is none where too few bins would count, where a
    /// branch that is worse may be the runner-up, and once the minimum of some bins has lain elsewhere. The refinement does not stay where it
    /// is.
    pub(super) fn prepare_screen<const B: usize>(
        &mut self,
        minimum: &Minimum,
        experiments: &[Experiment<B>],
    ) {
        if self.tried.screen.is_some_and(|own| own.of == minimum.coordinates) {
            return;
        }
        self.tried.screen = None;
        let every = thinning::distance(experiments);
        let may_be_runner_up =
            self.corrected.is_some() && self.leaves_stiffness_undetermined(minimum);
        if every == 1 || may_be_runner_up || self.tried.is_screened_in_vain {
            return;
        }
        let Self { chain, measurement, bounds, sought, statics, refinement, effort, .. } = self;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        refinement.restart_thinned(&minimum.coordinates, every);
        for _ in 0..MAX_STEPS {
            effort.refine_iterations += 1;
            if refinement.step(&problem, experiments) != Outcome::Improving {
                break;
            }
        }
        let (coordinates, objective) = (*refinement.coordinates(), refinement.objective());
        // By the information of these bins the two minima are no farther apart than noise of the other bins makes them.
        let apart = refinement.distance(sought, &minimum.coordinates);
        let rank = minimum.fit.covariance.rank() as f64;
        let is_beside = apart <= rarely_exceeded(rank) * minimum.inflation();
        self.tried.is_screened_in_vain = !(is_beside && objective.is_finite());
        if !self.tried.is_screened_in_vain {
            let of = minimum.coordinates;
            self.tried.screen = Some(Screen { of, coordinates, objective, every });
        }
    }

    /// Starts the refinement of a branch, on some of the bins if it is screened.
    pub(in crate::identify) fn restart_branch(&mut self, from: &Coordinates) {
        let every = self.tried.screen.map_or(1, |screen| screen.every);
        self.refinement.restart_thinned(from, every);
    }

    /// Returns whether the present branch, whose screening has ended, goes on with all bins: it is not back, and not worse beyond doubt.
    pub(in crate::identify) fn passes_screen(&mut self) -> bool {
        let (Purpose::Branch(branch), Some(minimum), Some(screen)) =
            (&mut self.purpose, &self.best, &self.tried.screen)
        else {
            return false;
        };
        let above = self.refinement.objective() - screen.objective;
        // What has not been evaluated is far above.
        let is_worse = above.is_nan() || above > BEYOND_DOUBT * minimum.inflation();
        let distance = self.refinement.distance(&self.sought, &screen.coordinates);
        let is_back = minimum.is_same_place(distance * screen.every as f64);
        if is_worse || is_back {
            return false;
        }
        *branch = Branch::of(minimum.fit.objective, branch.acceptance, f64::INFINITY);
        true
    }
}
