//! Carries out the decision on the minimum where a refinement has ended.

use core::mem;

use rand_core::Rng;

use super::decision::{self, Circumstances, OfBest, OfFound, Searches, TIMES_CONSISTENT};
use super::minimum::{Minimum, structure_is_beyond_noise};
use super::on_plant::may_be_mended;
use super::{Acceptance, FitStart, Identifier, Phase, Purpose};
use crate::refine::Plant;
use crate::spectrum::Experiment;

impl<R: Rng> Identifier<R> {
    /// Accepts the minimum where a refinement has ended, or goes on. One that noise does not explain is judged by the residuals that the
    /// imperfections of the plant leave, if there is a plant.
    pub(super) fn judge<const B: usize>(
        &mut self,
        experiments: &[Experiment<B>],
        mut plant: Option<&mut Plant>,
    ) {
        let Some(mut found) = self.come_to(experiments, plant.as_deref_mut()) else { return };
        self.inherit_judgement(&mut found);
        let from = if self.is_to_be_judged_on_plant(&found, experiments) {
            let begins_at_descent = self.descent_end.is_some() && !self.refinement.is_corrected();
            Some(if begins_at_descent { FitStart::Descent } else { FitStart::Minimum })
        } else if self.is_to_be_judged_from_descent(&found) {
            Some(FitStart::Descent)
        } else {
            None
        };
        if let (Some(from), Some(plant)) = (from, plant.as_deref_mut()) {
            return self.fit_to_plant(found, from, experiments, plant);
        }
        self.decide(found, experiments, plant);
    }

    /// Counts the visits of the settled minimum for the one that the refinement has come to from there, if that explains the new records, too.
    fn confirm(&mut self, found: &mut Minimum) {
        let confirmations = mem::take(&mut self.confirmations);
        if found.is_consistent() && !structure_is_beyond_noise(&found.judged().structure) {
            found.times += confirmations;
        }
    }

    /// Carries out the decision on a minimum, at which the refinement stands.
    #[inline(never)]
    pub(super) fn decide<const B: usize>(
        &mut self,
        mut found: Minimum,
        experiments: &[Experiment<B>],
        plant: Option<&mut Plant>,
    ) {
        self.confirm(&mut found);
        let tried_alone = matches!(self.purpose, Purpose::Alone(_));
        if tried_alone {
            self.reconcile(&mut found);
            self.stand_at(&found, experiments);
        }
        let best = self.best.as_ref();
        let circumstances = Circumstances {
            has_records: !experiments.is_empty(),
            tried_alone,
            best_agrees: best.is_some_and(Minimum::agrees),
            has_best: best.is_some(),
            is_outdone: best.is_some_and(|best| best.is_clearly_better_than(&found)),
            leaves_stiffness_undetermined: self.leaves_stiffness_undetermined(&found),
            prolongations: self.prolongations,
        };
        match decision::of_found(&found, &circumstances) {
            OfFound::Settle(acceptance) => self.settle(&mut found, acceptance, experiments),
            OfFound::Conclude(acceptance) => {
                if !self.believes_deferred(&found, acceptance) {
                    self.conclude(&mut found, acceptance, experiments);
                }
            }
            OfFound::TryAlone => self.try_alone(found),
            OfFound::Prolong => {
                self.prolongations += 1;
                self.refinement.restart_at(&found.coordinates);
            }
            OfFound::Compare { branch } => {
                if !(branch && self.branch_off(&found, None, experiments)) {
                    self.compare(found, experiments, plant);
                }
            }
        }
    }

    /// Accepts the better of `found` and the best minimum so far, or searches again.
    // A minimum is large: inlined, those here would take room on the stack of the caller.
    #[inline(never)]
    fn compare<const B: usize>(
        &mut self,
        found: Minimum,
        experiments: &[Experiment<B>],
        plant: Option<&mut Plant>,
    ) {
        let mut best = match self.best.take() {
            Some(mut best) => {
                let distance = self.distance(&best.coordinates, [&found, &best]);
                best.compete(found, distance);
                best
            }
            None => found,
        };
        let searches = Searches {
            starts: self.starts,
            is_explained_implausibly: self.is_explained_implausibly,
            is_corrected: self.refinement.is_corrected(),
        };
        match decision::of_best(&best, searches) {
            OfBest::Conclude(acceptance) => {
                if !self.believes_deferred(&best, acceptance) {
                    self.conclude(&mut best, acceptance, experiments);
                }
            }
            OfBest::TryAlone => self.try_alone(best),
            OfBest::GoOn { branch, search } => {
                if branch && self.branch_off(&best, None, experiments) {
                    return;
                }
                if !search {
                    return self.end_searches(best, experiments, plant);
                }
                best.is_branched |= branch && !self.excludes_branches();
                self.best = Some(best);
                self.start_search(experiments);
            }
        }
    }

    /// Settles on the best minimum, which noise does not explain, after the imperfections of the plant have been fitted from there to the
    /// end: a fit that stagnates is given up before. If they explain the records, they become part of the model instead.
    #[inline(never)]
    fn end_searches<const B: usize>(
        &mut self,
        mut best: Minimum,
        experiments: &[Experiment<B>],
        plant: Option<&mut Plant>,
    ) {
        if self.believes_deferred(&best, Acceptance::Unsettled) {
            return;
        }
        let may_be_corrected = may_be_mended(&best) && !self.refinement.is_corrected();
        match plant {
            Some(plant) if may_be_corrected => {
                self.stand_at(&best, experiments);
                self.refinement.restart_plant_to(plant, experiments);
                self.purpose = Purpose::Plant { found: best, from: FitStart::Best };
                self.phase = Phase::Refining;
            }
            _ => self.settle(&mut best, Acceptance::Unsettled, experiments),
        }
    }

    /// Refines the kept records alone, where they contradict the retired ones.
    #[inline(never)]
    fn try_alone(&mut self, together: Minimum) {
        self.refinement.set_retired_aside(&self.sought);
        self.refinement.restart_at(&together.coordinates);
        self.purpose = Purpose::Alone(together);
        self.phase = Phase::Refining;
    }

    /// Drops the retired records if the kept ones are consistent alone, in `found`, and their noise cannot hide a wrong minimum; else
    /// returns to the minimum of both.
    #[inline(never)]
    fn reconcile(&mut self, found: &mut Minimum) {
        let Purpose::Alone(mut together) = mem::take(&mut self.purpose) else { return };
        if found.is_reached() {
            together.contradicted = together.is_contradicted_beyond(found);
        }
        let sure = found.stands_clear() || together.times >= TIMES_CONSISTENT;
        let forget = together.contradicted && found.is_reached() && found.is_consistent() && sure;
        self.forgotten += self.refinement.end_setting_aside(!forget);
        if forget {
            // It was found with the records that are forgotten.
            self.best = None;
        } else {
            *found = together;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::deferred::tests::identifier;
    use super::super::minimum::tests::minimum;

    /// Residuals as noise makes them, and of twice its power.
    #[test]
    fn records_that_are_explained_confirm_a_minimum() {
        for (sum_of_squares, expected) in [(2000.0, 3), (4000.0, 1)] {
            let mut identifier = identifier();
            identifier.confirmations = 2;
            let mut found = minimum(sum_of_squares, 0.0);
            identifier.confirm(&mut found);
            assert_eq!((found.times, identifier.confirmations), (expected, 0));
        }
    }
}
