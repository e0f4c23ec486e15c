//! End of the refinement of a branch: it replaces its minimum, is its rival, or is worse.

use heapless::Vec;
use rand_core::Rng;

use super::FAR_STIFFNESS;
use super::tried::{Branch, RunnerUp, Tried};
use crate::identify::minimum::{Minimum, REACHED, SAME_PLACE};
use crate::identify::{Acceptance, FitStart, Identifier, Purpose};
use crate::refine::Plant;
use crate::sought::MAX_UNKNOWNS;
use crate::spectrum::Experiment;

impl<R: Rng> Identifier<R> {
    /// Returns whether a branch has led back to its minimum.
    pub(in crate::identify) fn is_back(&self) -> bool {
        let is_branch = matches!(self.purpose, Purpose::Branch(_));
        let minimum = self.best.as_ref().filter(|_| is_branch);
        minimum.is_some_and(|minimum| {
            let every = self.refinement.every();
            let (coordinates, objective) = match &self.tried.screen {
                Some(screen) if every > 1 => (&screen.coordinates, screen.objective),
                _ => (&minimum.coordinates, minimum.fit.objective),
            };
            // As all bins would show them.
            let above = every as f64 * (self.refinement.objective() - objective);
            let distance = || every as f64 * self.refinement.distance(&self.sought, coordinates);
            // In the same place the sum of squares is higher by no more than the squared distance.
            (-REACHED..SAME_PLACE).contains(&above) && minimum.is_same_place(distance())
        })
    }

    /// Leaves a branch that the screening has ended. Returns its minimum, to be judged as before; `None` if that has been accepted and is now settled
    /// on, or another branch is being refined.
    #[inline(never)]
    fn leave_branch<const B: usize>(
        &mut self,
        acceptance: Option<Acceptance>,
        experiments: &[Experiment<B>],
        plant: Option<&mut Plant>,
    ) -> Option<Minimum> {
        let minimum = self.best.take()?;
        match acceptance {
            Some(acceptance) => {
                self.go_on_from(minimum, acceptance, experiments, plant);
                None
            }
            None if self.branch_off(&minimum, None, experiments) => None,
            None => {
                self.stand_at(&minimum, experiments);
                Some(minimum)
            }
        }
    }

    /// The minimum to be judged after a refinement: a branch that is clearly better than its minimum, else the minimum. `None` if
    /// that has been accepted and is now settled on, or another branch is being refined.
    // A minimum is large: inlined, those here would take room on the stack of the caller.
    #[inline(never)]
    pub(in crate::identify) fn come_to<const B: usize>(
        &mut self,
        experiments: &[Experiment<B>],
        plant: Option<&mut Plant>,
    ) -> Option<Minimum> {
        let of_branch = match self.purpose {
            Purpose::Branch(Branch { acceptance, .. }) => Some(acceptance),
            _ => None,
        };
        if let Some(acceptance) = of_branch.filter(|_| self.refinement.every() > 1) {
            self.purpose = Purpose::Start;
            return self.leave_branch(acceptance, experiments, plant);
        }
        let mut ended = self.minimum_here(experiments);
        let Some(acceptance) = of_branch else { return Some(ended) };
        self.purpose = Purpose::Start;
        let Some(mut minimum) = self.best.take() else { return Some(ended) };
        ended.times = minimum.times;
        if ended.is_clearly_better_than(&minimum) {
            if let (Some(acceptance), Some(plant), Some(_)) = (acceptance, plant, minimum.of_plant)
                && self.is_to_be_judged_on_plant(&ended, experiments)
            {
                // The minimum has been accepted by its residuals on the plant: so must be what replaces it.
                self.best = Some(minimum);
                let from = FitStart::BranchOf(acceptance);
                self.fit_to_plant(ended, from, experiments, plant);
                return None;
            }
            self.replace_by_branch();
            return Some(ended);
        }
        let distance = self.distance(&minimum.coordinates, [&ended, &minimum]);
        let is_rival = ended.is_reached() && minimum.is_rivalled_by(&ended, distance);
        // An accepted minimum is replaced only by one that would be accepted as well.
        let is_as_sound = acceptance.is_none() || ended.is_beyond_doubt();
        let is_replaced = is_rival && is_as_sound && ended.deviance() < minimum.deviance();
        if is_replaced {
            ended.has_rival |= minimum.has_rival;
            core::mem::swap(&mut minimum, &mut ended);
            let away = self.away([&minimum, &ended]);
            minimum.remember_rivals_of(&ended, away.iter().copied());
        }
        if is_rival {
            let away = self.away([&minimum, &ended]);
            minimum.remember_rival(&ended, away.iter().copied());
        }
        // The residuals of what replaces a minimum are others, and are judged anew.
        match acceptance.filter(|_| !is_replaced) {
            Some(acceptance) => {
                if self.corrected.is_some()
                    && self.leaves_stiffness_undetermined(&minimum)
                    && !minimum.is_same_place(distance)
                {
                    let away = self.away([&minimum, &ended]);
                    let is_far = self
                        .undetermined_stiffnesses(&minimum)
                        .any(|unknown| away[unknown].abs() > FAR_STIFFNESS);
                    self.tried.remember_runner_up(&ended, is_far);
                }
                self.go_on_from(minimum, acceptance, experiments, plant);
                None
            }
            None => {
                self.stand_at(&minimum, experiments);
                Some(minimum)
            }
        }
    }

    /// Goes on from an accepted minimum, whose branch was no better: with its next branch, with imperfections that are fitted from the
    /// runner-up, or to the estimate.
    fn go_on_from<const B: usize>(
        &mut self,
        mut minimum: Minimum,
        acceptance: Acceptance,
        experiments: &[Experiment<B>],
        plant: Option<&mut Plant>,
    ) {
        if self.branch_off(&minimum, Some(acceptance), experiments) {
            return;
        }
        match (plant, self.tried.runner_up.take()) {
            (Some(plant), Some(RunnerUp { coordinates, .. })) => {
                self.best = Some(minimum);
                self.refinement.restart_at(&coordinates);
                let found = self.minimum_here(experiments);
                let from = FitStart::BranchOf(acceptance);
                self.fit_to_plant(found, from, experiments, plant);
            }
            _ => self.settle_after_branches(&mut minimum, acceptance, experiments),
        }
    }

    /// Each unknown of the second minimum less that of the first.
    fn away(&self, minima: [&Minimum; 2]) -> Vec<f64, MAX_UNKNOWNS> {
        let [from, to] = minima.map(|one| self.sought.values(&one.coordinates));
        (0..self.sought.unknowns()).map(|unknown| to[unknown] - from[unknown]).collect()
    }

    /// Makes the branches of a branch that replaces its minimum due for refinement.
    pub(in crate::identify) fn replace_by_branch(&mut self) {
        self.exclusions = 0;
        self.prolongations = 0;
        let Tried { elsewhere, replaced, is_screened_in_vain, .. } = self.tried;
        let replaced = replaced + 1;
        self.tried =
            Tried { any: true, elsewhere, replaced, is_screened_in_vain, ..Tried::default() };
    }
}
