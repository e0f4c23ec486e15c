//! Judges a minimum by the residuals that the imperfections of the plant leave.

use core::mem;

use rand_core::Rng;

use super::branch::Tried;
use super::corrected::{Corrected, OnPlant};
use super::judged::Judged;
use super::minimum::{Minimum, REACHED, SAME_PLACE};
use super::{Acceptance, FitStart, Identifier, Phase, Purpose};
use crate::imperfection::Correction;
use crate::refine::{Plant, Problem};
use crate::sought::Coordinates;
use crate::spectrum::Experiment;

impl<R: Rng> Identifier<R> {
    /// Takes over the judgement on the plant from the best minimum, if `found` is the same.
    pub(super) fn inherit_judgement(&self, found: &mut Minimum) {
        if let Some(best) = &self.best
            && found.is_as_good_as(best)
            && found.is_same_place(self.distance(&best.coordinates, [found, best]))
        {
            found.of_plant = found.of_plant.or(best.of_plant);
        }
    }

    /// Returns whether the imperfections of the plant are to be fitted before this minimum is judged.
    pub(super) fn is_to_be_judged_on_plant<const B: usize>(
        &self,
        found: &Minimum,
        experiments: &[Experiment<B>],
    ) -> bool {
        let is_alone = matches!(self.purpose, Purpose::Alone(_));
        let is_judged = found.of_plant.is_some();
        may_be_mended(found)
            && !(experiments.is_empty() || is_alone || is_judged || self.is_of_correction(found))
    }

    /// Returns whether a fit to the plant would lead to no better imperfections than the model has.
    fn is_of_correction(&self, found: &Minimum) -> bool {
        match &self.corrected {
            Some(Corrected { coordinates, fitted_in_vain, .. }) => {
                let mut places = fitted_in_vain.iter().chain([coordinates]);
                places.any(|place| found.is_same_place(self.distance(place, [found; 2])))
            }
            // A resumed identifier keeps the imperfections that it had.
            None => self.refinement.is_corrected(),
        }
    }

    /// Returns whether imperfections that have explained too little of this minimum may explain more from the end of another descent to it.
    pub(super) fn is_to_be_judged_from_descent(&self, found: &Minimum) -> bool {
        let is_judged = found.of_plant.is_some() && may_be_mended(found);
        is_judged && !self.refinement.is_corrected() && self.descent_end.is_some()
    }

    /// Begins a fit to the plant.
    #[inline(never)]
    pub(super) fn fit_to_plant<const B: usize>(
        &mut self,
        found: Minimum,
        from: FitStart,
        experiments: &[Experiment<B>],
        plant: &mut Plant,
    ) {
        let end = if from == FitStart::Descent { self.descent_end.take() } else { None };
        match end {
            Some(end) => {
                self.refinement.restart_at(&end);
                self.refinement.restart_plant_from_descent(plant, experiments);
            }
            None => self.refinement.restart_plant_thinned(plant, experiments),
        }
        self.purpose = Purpose::Plant { found, from };
        self.phase = Phase::Refining;
    }

    /// Judges a minimum after the imperfections of the plant have been fitted, or without them if there is no plant any more.
    #[inline(never)]
    pub(super) fn judge_on_plant<const B: usize>(
        &mut self,
        experiments: &mut [Experiment<B>],
        mut plant: Option<&mut Plant>,
    ) {
        let purpose = mem::take(&mut self.purpose);
        let Purpose::Plant { mut found, from } = purpose else { return };
        let on_plant = plant
            .as_deref_mut()
            .and_then(|plant| self.fitted_to_plant(&mut found, from, experiments, plant));
        self.is_explained_implausibly |= on_plant.is_some_and(|fit| fit.explains_implausibly());
        let judged = on_plant.filter(|fit| fit.is_reached && fit.is_plausible);
        let before = found.of_plant;
        found.of_plant = Some(judged.map_or_else(|| Judged::of(&found.fit), |fit| fit.judged));
        if let (Some(plant), Some(on_plant)) = (plant.as_deref_mut(), on_plant)
            && plant.has_imperfections()
            && on_plant.corrects(&found, self.corrected.as_ref())
        {
            let judged = on_plant.judged;
            if self.is_to_be_deferred(plant, from) {
                self.defer(plant, judged);
                found.of_plant = Some(Judged::of(&found.fit));
                self.return_to(&found, experiments);
                return self.decide(found, experiments, Some(plant));
            }
            if !self.believes_deferred_beside(&judged, true) {
                let corrected = match self.corrected.take() {
                    None => Corrected::first(judged, plant.coordinates()),
                    Some(before) => before.replaced_by(judged, plant.coordinates()),
                };
                self.correct_by(&plant.correction(), corrected);
            }
            return;
        }
        if from == FitStart::Descent {
            // The minimum itself may have been judged before.
            found.of_plant = before;
            if before.is_none()
                && let Some(plant) = plant.as_deref_mut()
            {
                self.return_to(&found, experiments);
                return self.fit_to_plant(found, FitStart::Minimum, experiments, plant);
            }
        }
        if from == FitStart::Best {
            self.return_to(&found, experiments);
            self.settle(&mut found, Acceptance::Unsettled, experiments);
            self.is_fitted_to_plant = plant.is_some();
            return;
        }
        let of_search = judged.filter(|_| from == FitStart::Minimum);
        if let Some(end) = of_search.and_then(|judged| self.end_of_correction(&found, &judged)) {
            // The search has led to the same plant again: it is counted where its minimum is reached.
            if let Some(corrected) = &mut self.corrected {
                corrected.fitted_in_vain = Some(found.coordinates);
            }
            self.times = found.times;
            self.prolongations = 0;
            self.refinement.restart_at(&end);
            self.phase = Phase::Refining;
            return;
        }
        if let Some(corrected) = &mut self.corrected {
            // It compares with the others by its residuals in the model that all have.
            found.of_plant = None;
            corrected.fitted_in_vain = Some(found.coordinates);
        }
        if let FitStart::BranchOf(acceptance) = from
            && let Some(mut best) = self.best.take()
        {
            if !(found.is_beyond_doubt() && found.is_clearly_better_than(&best)) {
                self.return_to(&best, experiments);
                return self.conclude(&mut best, acceptance, experiments);
            }
            self.replace_by_branch();
        }
        self.return_to(&found, experiments);
        self.decide(found, experiments, plant);
    }

    /// Returns to a minimum from a fit to the plant, and to the movement of the model there.
    fn return_to<const B: usize>(&mut self, minimum: &Minimum, experiments: &mut [Experiment<B>]) {
        self.refinement.restart_at(&minimum.coordinates);
        self.follows_movement(experiments, None);
        self.stand_at(minimum, experiments);
    }

    /// Returns where the fit has ended whose imperfections the model has, if this fit is as good and has ended in the same place. `found` is the
    /// minimum from which it began.
    fn end_of_correction(&self, found: &Minimum, on_plant: &OnPlant) -> Option<Coordinates> {
        let Corrected { judged, coordinates, .. } = self.corrected.as_ref()?;
        let own = &on_plant.judged;
        let is_as_good = !own.is_clearly_better_than(judged) && !judged.is_clearly_better_than(own);
        let distance = self.distance(coordinates, [found; 2]);
        let is_same = is_as_good && distance <= SAME_PLACE * own.inflation();
        is_same.then_some(*coordinates)
    }

    /// Goes on where a fit to the plant has ended, in the model with its imperfections. Minima of another model do not compare.
    pub(super) fn correct_by(&mut self, correction: &Correction, corrected: Corrected) {
        self.refinement.set_correction(correction);
        self.refinement.restart_at(&corrected.coordinates);
        self.corrected = Some(corrected);
        self.is_explained_implausibly = false;
        self.best = None;
        self.tried = Tried::default();
        self.exclusions = 0;
        self.prolongations = 0;
    }

    /// Returns the end of the fit to the plant, for a minimum that was found. `None` where gravity leaves the robot no equilibrium.
    #[inline(never)]
    fn fitted_to_plant<const B: usize>(
        &mut self,
        found: &mut Minimum,
        from: FitStart,
        experiments: &[Experiment<B>],
        plant: &mut Plant,
    ) -> Option<OnPlant> {
        let Self { chain, measurement, bounds, sought, statics, refinement, .. } = self;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        let (fit, remaining) = refinement.fit_plant(&problem, experiments, plant)?;
        let is_plausible = plant.is_plausible();
        let is_reached = remaining.gain <= REACHED;
        // From the end of a descent the fit may have ended far from the minimum.
        if is_reached && is_plausible && from != FitStart::Descent {
            // What imperfections leave undetermined is so, however well the perfect model seems to determine it.
            found.remember_deviations((0..sought.unknowns()).map(|i| fit.covariance.deviation(i)));
        }
        let mut judged = Judged::of(&fit);
        // Of two minima, one that needs accuracies restated is the less plausible.
        judged.objective += plant.cost_of_restating();
        Some(OnPlant { judged, is_reached, is_plausible })
    }
}

/// Returns whether noise does not explain a minimum, and imperfections of the plant may.
pub(super) fn may_be_mended(found: &Minimum) -> bool {
    let is_explained = found.is_explained() && !found.is_structured();
    !is_explained && !found.contradicted && found.is_tested()
}
