//! The present branch of a minimum, and those that have been tried.

use super::screened::Screen;
use crate::identify::Acceptance;
use crate::identify::minimum::{Minimum, REACHED, RIVAL};
use crate::refine::{OF_BRANCH, Stagnation};
use crate::sought::Coordinates;

/// Factor by which the sum of squares may be larger before the first step than after it, for a branch to be worth that step. Chosen: of 48
/// branches of three six-joint robots the first step makes it 1.3 to 28 times smaller where it ends below ten times the minimum's.
const BEFORE_THE_FIRST: f64 = 30.0;

/// A branch that is refined before its minimum, the best so far, is settled on.
#[derive(Clone, Debug)]
pub(in crate::identify) struct Branch {
    /// Acceptance of the minimum; `None` while it is not accepted.
    pub(super) acceptance: Option<Acceptance>,
    /// Sum of squares that a clearly better branch reaches: the minimum's less [`RIVAL`]. The gain of a step is measured against it. A broader
    /// branch may be better above it, too.
    pub(super) better: f64,
    /// Sum of squares above which it is not worth a step.
    pub(super) most: f64,
    pub(super) stagnation: Stagnation,
}

/// Branches that have been refined since the last search, or since the records changed.
#[derive(Clone, Debug, Default)]
pub(in crate::identify) struct Tried {
    /// There was a branch.
    pub(super) any: bool,
    /// The lightly damped one is among them, if there is one.
    pub(super) light: bool,
    /// The one of typical dampings is among them.
    pub(super) typical: bool,
    /// The changes of springs in series whose place is below this one.
    pub(super) series: usize,
    /// A bit for each unknown that was made stiff.
    pub(super) stiff: u128,
    /// Searches elsewhere.
    pub(super) elsewhere: u32,
    /// The minimum as its branches are screened. `None` where they are not.
    pub(super) screen: Option<Screen>,
    /// The minimum of some bins has lain elsewhere than that of all.
    pub(super) is_screened_in_vain: bool,
    /// Branches that have replaced their minimum.
    pub(super) replaced: u32,
    /// Best branch that the model with imperfections explains worse than its minimum; a far branch is preferred to a near one.
    pub(super) runner_up: Option<RunnerUp>,
}

/// A branch of an accepted minimum in the model with imperfections. These were fitted for the minimum, which leaves some stiffness undetermined:
/// those that are fitted for the branch may explain the records better.
#[derive(Clone, Copy, Debug)]
pub(super) struct RunnerUp {
    pub(super) coordinates: Coordinates,
    pub(super) objective: f64,
    /// A stiffness that the minimum leaves undetermined has changed by more than [`FAR_STIFFNESS`](super::FAR_STIFFNESS).
    pub(super) is_far: bool,
}

impl Branch {
    /// Branch of a minimum with this sum of squares. `worth` times that is the most that is worth a step.
    pub(super) fn of(objective: f64, acceptance: Option<Acceptance>, worth: f64) -> Self {
        Self {
            acceptance,
            better: objective - RIVAL,
            most: worth * objective,
            stagnation: Stagnation::new(OF_BRANCH),
        }
    }

    /// Sum of squares above which it is not worth the first step.
    pub(in crate::identify) fn most_at_first(&self) -> f64 {
        BEFORE_THE_FIRST * self.most
    }

    /// Returns whether its minimum has been accepted.
    pub(in crate::identify) fn is_of_accepted(&self) -> bool {
        self.acceptance.is_some()
    }

    /// Returns whether the refinement may end: it stands at `objective`, not below its minimum, and could gain no more than [`REACHED`].
    pub(in crate::identify) fn is_near_its_end(
        &self,
        objective: f64,
        remaining: impl FnOnce() -> f64,
    ) -> bool {
        objective >= self.better + RIVAL && remaining() <= REACHED
    }

    /// Returns whether the branch, now at `objective`, is not worth another step.
    pub(in crate::identify) fn is_to_be_given_up(&mut self, objective: f64) -> bool {
        self.stagnation.ends_fit(objective, self.better, 0.0) || objective > self.most
    }
}

impl Tried {
    /// Remembers a branch that is worse than its minimum, if its residuals are not large and it is the best such branch so far. A far one is
    /// better than all others: from those a fit of the imperfections often leads back to the minimum.
    pub(super) fn remember_runner_up(&mut self, branch: &Minimum, is_far: bool) {
        let (coordinates, objective) = (branch.coordinates, branch.fit.objective);
        let is_better = |best: RunnerUp| match (is_far, best.is_far) {
            (true, false) => true,
            (false, true) => false,
            _ => objective < best.objective,
        };
        if branch.is_near() && self.runner_up.is_none_or(is_better) {
            self.runner_up = Some(RunnerUp { coordinates, objective, is_far });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::minimum::tests::minimum;

    #[test]
    fn the_best_of_the_near_branches_is_the_runner_up() {
        let mut tried = Tried::default();
        for (sum_of_squares, is_far, best) in [
            (1e6, true, None),
            (3000.0, false, Some(3000.0)),
            (2500.0, false, Some(2500.0)),
            (2600.0, false, Some(2500.0)),
            (2700.0, true, Some(2700.0)),
            (2400.0, false, Some(2700.0)),
            (2650.0, true, Some(2650.0)),
            (2660.0, true, Some(2650.0)),
        ] {
            tried.remember_runner_up(&minimum(sum_of_squares, 0.0), is_far);
            assert_eq!(tried.runner_up.map(|own| own.objective), best, "{sum_of_squares}");
        }
    }

    /// Against 100 to reach: stagnation ends it, a large gain starts the count anew, and what is better is never given up. More than 1e6
    /// ends it at once.
    #[test]
    fn a_branch_that_stagnates_is_given_up() {
        let steps_until_the_end = |course: &dyn Fn(u32) -> f64| {
            let mut branch = Branch {
                acceptance: None,
                better: 100.0,
                most: 1e6,
                stagnation: Stagnation::new(OF_BRANCH),
            };
            (0..50).position(|step| branch.is_to_be_given_up(course(step)))
        };
        assert_eq!(steps_until_the_end(&|_| 200.0), Some(12));
        assert_eq!(steps_until_the_end(&|step| 100.0 + 1e5 * 0.97_f64.powi(step as i32)), Some(12));
        assert_eq!(steps_until_the_end(&|step| 100.0 + 1e5 * 0.9_f64.powi(step as i32)), None);
        assert_eq!(steps_until_the_end(&|step| if step < 10 { 300.0 } else { 200.0 }), Some(22));
        assert_eq!(steps_until_the_end(&|_| 99.0), None);
        assert_eq!(steps_until_the_end(&|step| if step < 3 { 2e6 } else { 99.0 }), Some(0));
    }
}
