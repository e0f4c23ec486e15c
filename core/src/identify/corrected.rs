//! When the search goes on in the model with the imperfections that a fit to the plant has found.
//!
//! Minima are compared in one model. If the perfect one leaves residuals that are many times the noise, it says little about which of two
//! minima is right. The imperfections of a fit that has explained most of these residuals make a better one, also where a few bushings
//! are still wrong: branches of the minimum then find these.

use super::judged::Judged;
use super::minimum::{Minimum, NEAR, RIVAL, structure_is_beyond_noise};
use crate::chi_square::noise_explains;
use crate::imperfection::Correction;
use crate::refine::Fit;
use crate::sought::Coordinates;

/// Part of what noise does not explain that imperfections may leave. Chosen: it says that they explain more than they leave.
const LEFT: f64 = 0.5;
/// Most replacements of the imperfections of a model. Chosen: as many as searches; each needs a fit that is better beyond doubt.
const MAX_REPLACED: u32 = 8;

/// End of a fit to a plant.
#[derive(Clone, Copy, Debug)]
pub(super) struct OnPlant {
    pub(super) judged: Judged,
    /// It has come to a minimum.
    pub(super) is_reached: bool,
    /// Its imperfections are no larger than those of a plausible plant.
    pub(super) is_plausible: bool,
}

/// Fit to the plant whose imperfections the model has.
#[derive(Clone, Debug)]
pub(super) struct Corrected {
    pub(super) judged: Judged,
    /// Coordinates at its end.
    pub(super) coordinates: Coordinates,
    /// Minimum from which the latest fit to the plant has found no better imperfections.
    pub(super) fitted_in_vain: Option<Coordinates>,
    /// How often the imperfections of the model have been replaced.
    pub(super) replaced: u32,
}

/// End of a fit that needs an error far beyond its accuracy.
#[derive(Clone, Debug)]
pub(super) struct Deferred {
    pub(super) judged: Judged,
    pub(super) coordinates: Coordinates,
    pub(super) correction: Correction,
}

impl Corrected {
    /// The first fit that explains the records.
    pub(super) fn first(judged: Judged, coordinates: Coordinates) -> Self {
        Self { judged, coordinates, fitted_in_vain: None, replaced: 0 }
    }

    /// A better one.
    pub(super) fn replaced_by(self, judged: Judged, coordinates: Coordinates) -> Self {
        Self { replaced: self.replaced + 1, ..Self::first(judged, coordinates) }
    }
}

impl OnPlant {
    /// Returns whether the search goes on in the model with the imperfections of this fit, after which the minimum `found` is judged. They
    /// explain the records, but for a little structure: where a cut passes a resonance, the arm moves so far that its geometry adds second
    /// harmonics, which no linear model has. Or they explain most of them, and the rest may be a few wrong bushings, which a branch finds. The
    /// imperfections of an earlier fit give way to better ones alone.
    pub(super) fn corrects(&self, found: &Minimum, corrected: Option<&Corrected>) -> bool {
        let Self { judged, is_reached, is_plausible } = self;
        let is_better = match corrected {
            None => {
                let explains = *is_reached && found.is_explained();
                explains && !structure_is_beyond_noise(&judged.structure)
                    || judged.explains_most_of(&found.fit)
            }
            Some(corrected) => {
                corrected.replaced < MAX_REPLACED
                    && judged.is_clearly_better_than(&corrected.judged)
            }
        };
        *is_plausible && is_better
    }

    /// Returns whether noise explains the residuals that implausible imperfections leave.
    pub(super) fn explains_implausibly(&self) -> bool {
        let Judged { sum_of_squares, degrees_of_freedom, .. } = self.judged;
        !self.is_plausible && noise_explains(sum_of_squares, degrees_of_freedom)
    }
}

impl Judged {
    /// Returns whether these residuals, with the imperfections fitted, exceed the noise by less than [`LEFT`] of the excess of `fit`, and are so
    /// small that a branch may be the right minimum.
    fn explains_most_of(&self, fit: &Fit) -> bool {
        let left = self.sum_of_squares - self.degrees_of_freedom;
        let all = fit.sum_of_squares - fit.degrees_of_freedom;
        left < LEFT * all && self.sum_of_squares <= NEAR * self.degrees_of_freedom
    }

    /// Returns whether its objective is smaller than another one beyond doubt, whatever the information in either model.
    pub(super) fn explains_clearly_more_than(&self, other: &Self) -> bool {
        self.objective < other.objective - RIVAL * self.inflation()
    }

    /// χ² per degree of freedom, but at least 1.
    pub(super) fn inflation(&self) -> f64 {
        (self.sum_of_squares / self.degrees_of_freedom.max(1.0)).max(1.0)
    }

    /// Returns whether it is better than another one beyond doubt. Where noise does not explain the residuals, errors of the model change
    /// deviances as noise of that size would.
    pub(super) fn is_clearly_better_than(&self, other: &Self) -> bool {
        let [own, other] = [self, other].map(|one| one.objective + one.log_information);
        own < other - RIVAL * self.inflation()
    }
}

#[cfg(test)]
mod tests {
    use super::super::minimum::tests::{minimum, of_size};
    use super::*;

    /// Of two thousand residuals.
    fn on_plant(sum_of_squares: f64, structure: f64, is_reached: bool) -> OnPlant {
        let mut minimum = minimum(sum_of_squares, 0.0);
        minimum.fit.structure = of_size(structure);
        OnPlant { judged: Judged::of(&minimum.fit), is_reached, is_plausible: true }
    }

    fn found(sum_of_squares: f64, on_plant: &OnPlant) -> Minimum {
        let mut found = minimum(sum_of_squares, 0.0);
        found.fit.ssp = [0.01; 2];
        let judged = Judged { ssp: 0.01, ..on_plant.judged };
        found.of_plant = on_plant.is_reached.then_some(judged);
        found
    }

    #[test]
    fn a_perfect_model_gives_way_to_one_that_explains_more() {
        for (before, after, structure, is_reached, expected) in [
            // Explained, but for a little structure.
            (2100.0, 2080.0, 0.0, true, true),
            (2100.0, 2080.0, 0.20, true, true),
            (2100.0, 2080.0, 0.22, true, false),
            (2100.0, 2080.0, 0.0, false, false),
            // Most of the misfit explained, near the minimum or not.
            (2e5, 5.9e4, 3.0, false, true),
            (2e5, 2000.0, 0.25, true, true),
            (1.1e5, 5.9e4, 3.0, true, false),
            // Beyond all branches.
            (2e5, 6.1e4, 3.0, false, false),
        ] {
            let on_plant = on_plant(after, structure, is_reached);
            let found = found(before, &on_plant);
            assert_eq!(on_plant.corrects(&found, None), expected, "{before} {after} {structure}");
            assert!(!on_plant.explains_implausibly());
            let implausible = OnPlant { is_plausible: false, ..on_plant };
            assert!(!implausible.corrects(&found, None));
            assert_eq!(implausible.explains_implausibly(), after < 2500.0);
        }
    }

    /// By ten times χ² per degree of freedom, and not for ever.
    #[test]
    fn imperfections_give_way_to_better_ones() {
        let judged = on_plant(4200.0, 0.0, true).judged;
        for (after, replaced, expected) in
            [(4170.0, 0, true), (4190.0, 0, false), (4170.0, 7, true), (4170.0, 8, false)]
        {
            let on_plant = on_plant(after, 0.0, false);
            let fitted_in_vain = None;
            let corrected = Corrected { judged, coordinates: [0.0; _], fitted_in_vain, replaced };
            let found = found(2e5, &on_plant);
            assert_eq!(on_plant.corrects(&found, Some(&corrected)), expected, "{after} {replaced}");
        }
    }
}
