//! Branches of a minimum: other places where the sum of squares may have a minimum as good.
//!
//! | file                 | what is different on the branch                                                    |
//! | -------------------- | ---------------------------------------------------------------------------------- |
//! | `series`             | springs of two joints with parallel axes: they share or exchange their compliance  |
//! | `stiff`              | one bushing of unsure stiffness: it is stiff                                       |
//! | `typical`            | every undetermined damping: its ratio is that of the middle of the bounds          |
//! | `light`              | every heavily damped bushing: it is damped lightly                                 |
//! | [`super::descent`]   | anything: the end of descents from elsewhere, while some stiffness is undetermined |
//!
//! `screen` refines a branch on some of the bins first. `ended` compares the end of a branch with its minimum.
//!
//! A search may end in any of them, and noise can explain the residuals of the worse ones. So before a minimum is settled on, its
//! branches are refined. The best minimum counts; its errors include the others that the data do not exclude. The branches of the
//! best minimum are also refined before another search if noise nearly explains it: often only a few bushings are wrong then.

mod ended;
mod light;
mod screen;
mod screened;
mod series;
mod stiff;
mod typical;

use rand_core::Rng;

use super::descent::Descent;
use super::minimum::{Minimum, REACHED, RIVAL};
use super::start::{self, Method};
use super::{Acceptance, FoundBy, Identifier, Phase, Purpose};
use crate::refine::{OF_BRANCH, Stagnation};
use crate::sought::Coordinates;
use crate::spectrum::Experiment;
use crate::verdict::WEAK;
use screened::Screen;
pub(super) use typical::typically_damped;

/// When no branch has been a rival for so many records in a row, branches are not refined again before the next search: each record
/// makes a wrong minimum worse, on average.
const MAX_EXCLUSIONS: u32 = 3;
/// Most branches in a row that replace their minimum since the last search: sums of squares and deviances rank minima in different
/// orders, so that two could replace each other without an end. The limit is chosen, not measured.
const MAX_REPLACED: u32 = 30;
/// Searches for rivals of a minimum that leaves some stiffness undetermined. Without them four of 48 drawn six-joint arms with three
/// cuts had a wrong parameter called identified; with two searches these four are right.
const SEARCHES_ELSEWHERE: u32 = 2;
/// Change of the logarithm of an undetermined stiffness beyond which a branch is far from its minimum. Chosen: a decade. From branches of a drawn
/// six-joint arm that were up to three times stiffer the fit of the imperfections led back to the minimum, from those that were 34 and more
/// times stiffer to the right one.
const FAR_STIFFNESS: f64 = core::f64::consts::LN_10;
/// A branch of springs in series or of a stiff bushing is worth a step while its sum of squares is at most so many times the minimum's. Chosen on
/// arms 4 to 33 of the proof: 100 takes no more time than 10; without a limit they take three times as long. Of arms 40 to 99 it leaves none wrong,
/// and 10 leaves three.
const WORTH_A_STEP: f64 = 100.0;
/// How many times larger the sum of squares may be before the first step than after it, for a branch to be worth that step. Found: of 48
/// branches of three six-joint robots the first step makes it 1.3 to 28 times smaller where it ends below ten times the minimum's.
const BEFORE_THE_FIRST: f64 = 30.0;

/// A branch that is refined before its minimum, the best so far, is settled on.
#[derive(Clone, Debug)]
pub(super) struct Branch {
    /// Of the minimum; `None` while it is not accepted.
    acceptance: Option<Acceptance>,
    /// [`RIVAL`] below the minimum's sum of squares, by which the gain of a step is measured. A broader branch is better above it, too.
    better: f64,
    /// Sum of squares above which it is not worth a step.
    most: f64,
    stagnation: Stagnation,
}

/// Branches that have been refined since the last search, or since the records changed.
#[derive(Clone, Debug, Default)]
pub(super) struct Tried {
    /// There was a branch.
    any: bool,
    /// The lightly damped one is among them, if there is one.
    light: bool,
    /// The one of typical dampings is among them.
    typical: bool,
    /// The changes of springs in series whose place is below this one.
    series: usize,
    /// A bit for each unknown that was made stiff.
    stiff: u128,
    /// Searches elsewhere.
    elsewhere: u32,
    /// The minimum as its branches are screened. `None` where they are not.
    screen: Option<Screen>,
    /// The minimum of some bins has lain elsewhere than that of all.
    is_screened_in_vain: bool,
    /// Branches that have replaced their minimum.
    replaced: u32,
    /// The best of the branches that the model with imperfections explains worse than their minimum; of the far ones, if there are any.
    runner_up: Option<RunnerUp>,
}

/// A branch of an accepted minimum in the model with imperfections. These were fitted for the minimum, which leaves some stiffness undetermined:
/// those that are fitted for the branch may explain the records better.
#[derive(Clone, Copy, Debug)]
struct RunnerUp {
    coordinates: Coordinates,
    objective: f64,
    /// A stiffness that the minimum leaves undetermined has changed by more than [`FAR_STIFFNESS`].
    is_far: bool,
}

impl Branch {
    /// Of a minimum with this sum of squares. `worth` times that is the most that is worth a step.
    fn of(objective: f64, acceptance: Option<Acceptance>, worth: f64) -> Self {
        Self {
            acceptance,
            better: objective - RIVAL,
            most: worth * objective,
            stagnation: Stagnation::new(OF_BRANCH),
        }
    }

    /// Sum of squares above which it is not worth the first step.
    pub(super) fn most_at_first(&self) -> f64 {
        BEFORE_THE_FIRST * self.most
    }

    /// Whether its minimum has been accepted.
    pub(super) fn is_of_accepted(&self) -> bool {
        self.acceptance.is_some()
    }

    /// Whether the refinement may end: it stands at `objective`, not below its minimum, and could gain no more than [`REACHED`].
    pub(super) fn is_near_its_end(&self, objective: f64, remaining: impl FnOnce() -> f64) -> bool {
        objective >= self.better + RIVAL && remaining() <= REACHED
    }

    /// Whether the branch, now at `objective`, is not worth another step.
    pub(super) fn is_to_be_given_up(&mut self, objective: f64) -> bool {
        self.stagnation.ends_fit(objective, self.better, 0.0) || objective > self.most
    }
}

impl Tried {
    /// Remembers a branch that is worse than its minimum, if its residuals are not large and it is the best such branch so far. A far one is
    /// better than all others: from those a fit of the imperfections often leads back to the minimum.
    fn remember_runner_up(&mut self, branch: &Minimum, is_far: bool) {
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

impl<R: Rng> Identifier<R> {
    /// Settles on a minimum, if need be after its branches have been refined.
    pub(super) fn conclude<const B: usize>(
        &mut self,
        minimum: &mut Minimum,
        acceptance: Acceptance,
        experiments: &[Experiment<B>],
    ) {
        if !self.branch_off(minimum, Some(acceptance), experiments) {
            self.settle_after_branches(minimum, acceptance, experiments);
        }
    }

    /// Settles on a minimum, all of whose branches have been refined.
    fn settle_after_branches<const B: usize>(
        &mut self,
        minimum: &mut Minimum,
        acceptance: Acceptance,
        experiments: &[Experiment<B>],
    ) {
        if self.tried.any {
            let is_rivalled = !minimum.apart.is_empty();
            self.exclusions = if is_rivalled { 0 } else { self.exclusions + 1 };
        }
        self.settle(minimum, acceptance, experiments);
    }

    /// Goes on from a branch of the minimum, if there is one that has not been refined.
    // A minimum is large: inlined, those here would take room on the stack of the caller.
    #[inline(never)]
    pub(super) fn branch_off<const B: usize>(
        &mut self,
        minimum: &Minimum,
        acceptance: Option<Acceptance>,
        experiments: &[Experiment<B>],
    ) -> bool {
        // Static tests do not determine dampings, and in the compliances they are linear.
        if self.excludes_branches() || experiments.is_empty() {
            return false;
        }
        let worth = if let Some((branch, worth)) = self.next_branch(minimum, experiments) {
            self.effort.branches += 1;
            self.prepare_screen(minimum, experiments);
            self.restart_branch(&branch);
            self.found_by = FoundBy::Branch;
            self.phase = Phase::Refining;
            worth
        } else if self.is_worth_a_search(minimum, acceptance) {
            self.tried.elsewhere += 1;
            self.effort.starts += 1;
            self.prepare_screen(minimum, experiments);
            let from = start::elsewhere(&self.bounds, &self.sought, &mut self.generator);
            self.descent = Descent::few(from);
            self.method = Method::Descent;
            self.phase = Phase::Searching;
            f64::INFINITY
        } else {
            return false;
        };
        self.tried.any = true;
        let objective = self.tried.screen.map_or(minimum.fit.objective, |screen| screen.objective);
        self.purpose = Purpose::Branch(Branch::of(objective, acceptance, worth));
        self.best = Some(minimum.clone());
        true
    }

    /// Whether branches have been worse so often that they are not refined before the next search.
    pub(super) fn excludes_branches(&self) -> bool {
        self.exclusions >= MAX_EXCLUSIONS
    }

    /// Whether another minimum may explain the records as well.
    fn is_worth_a_search(&self, minimum: &Minimum, acceptance: Option<Acceptance>) -> bool {
        acceptance == Some(Acceptance::Consistent)
            && self.tried.elsewhere < SEARCHES_ELSEWHERE
            && self.leaves_stiffness_undetermined(minimum)
    }

    /// Whether some stiffness is undetermined in the minimum.
    pub(super) fn leaves_stiffness_undetermined(&self, minimum: &Minimum) -> bool {
        self.undetermined_stiffnesses(minimum).next().is_some()
    }

    /// The unknowns that are undetermined stiffnesses in the minimum.
    fn undetermined_stiffnesses(&self, minimum: &Minimum) -> impl Iterator<Item = usize> {
        stiff::stiffnesses(&self.sought).filter(|unknown| minimum.deviation(*unknown) > WEAK)
    }

    /// The start of the next branch, and the multiple of the minimum's sum of squares up to which it is worth a step.
    fn next_branch<const B: usize>(
        &mut self,
        minimum: &Minimum,
        experiments: &[Experiment<B>],
    ) -> Option<(Coordinates, f64)> {
        if minimum.is_branched || self.tried.replaced >= MAX_REPLACED {
            return None;
        }
        let Self { chain, bounds, sought, tried, .. } = self;
        let untried = |unknown: &usize| tried.stiff & (1 << unknown) == 0;
        let coordinates = &minimum.coordinates;
        let deviation = |unknown| minimum.deviation(unknown);
        let mut in_series =
            series::branches(chain, sought, bounds, coordinates, experiments, tried.series);
        if let Some((place, branch)) = in_series.next() {
            tried.series = place + 1;
            return Some((branch, WORTH_A_STEP));
        }
        if let Some(unknown) = stiff::unsure(sought, deviation).find(untried) {
            tried.stiff |= 1 << unknown;
            let stiff = stiff::stiffened(sought, bounds, coordinates, unknown);
            return Some((stiff, WORTH_A_STEP));
        }
        if !core::mem::replace(&mut tried.typical, true) {
            let branch = typically_damped(sought, bounds, coordinates, deviation);
            if let Some(branch) = branch {
                return Some((branch, f64::INFINITY));
            }
        }
        if core::mem::replace(&mut tried.light, true) {
            return None;
        }
        Some((light::lightly_damped(chain, sought, bounds, coordinates)?, f64::INFINITY))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Matrix3, Unit, Vector3};

    use super::*;
    use crate::chain::{Chain, Joint, JointKind, Link};
    use crate::identify::minimum::tests::minimum;

    /// Two joints that carry 5 and 2 kg, with moments of inertia of 0.05 and 0.02 kg m².
    pub(super) fn chain() -> Chain {
        let joint = |mass| Joint {
            origin: Isometry3::identity(),
            axis: Unit::new_normalize(Vector3::z()),
            kind: JointKind::Revolute,
            link: Link {
                mass,
                centre_of_mass: Vector3::zeros(),
                inertia: Matrix3::identity() * (0.01 * mass),
            },
        };
        Chain::new(&[joint(3.0), joint(2.0)], Isometry3::identity()).unwrap()
    }

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
