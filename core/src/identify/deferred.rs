//! A fit to the plant that is not believed at once, since it needs an error far beyond its accuracy.
//!
//! Such an error may make up for a few wrong bushings. The search therefore goes on in the perfect model, with the branches of its minima
//! and from other starts. The fit is believed once these have ended in a minimum that noise does not explain, or that is clearly worse.

use rand_core::Rng;

use super::corrected::{Corrected, Deferred};
use super::judged::Judged;
use super::minimum::Minimum;
use super::{Acceptance, FitStart, Identifier, Phase, Purpose};
use crate::refine::Plant;

/// Factor on an accuracy beyond which a fit that needs it is deferred. Chosen: a single error of its kind is then seven times its accuracy,
/// which of normal errors one in 4e11 is.
const FAR: f64 = 3.0;

impl<R: Rng> Identifier<R> {
    /// Returns whether a fit to the plant that would correct the model is to be deferred.
    pub(super) fn is_to_be_deferred(&self, plant: &Plant, from: FitStart) -> bool {
        let may_go_on = matches!(from, FitStart::Descent | FitStart::Minimum);
        may_go_on && self.corrected.is_none() && plant.largest_factor() > FAR
    }

    /// Keeps a fit to the plant, if it is the best of those that are deferred.
    pub(super) fn defer(&mut self, plant: &Plant, judged: Judged) {
        let is_best =
            self.deferred.as_ref().is_none_or(|own| judged.objective < own.judged.objective);
        if is_best {
            let (coordinates, correction) = (plant.coordinates(), plant.correction());
            self.deferred = Some(Deferred { judged, coordinates, correction });
        }
    }

    /// Goes on in the model of the deferred fit, if there is one, and the best minimum of the perfect model is not accepted as consistent, or is
    /// clearly worse. Returns whether it does.
    pub(super) fn believes_deferred(&mut self, best: &Minimum, acceptance: Acceptance) -> bool {
        self.believes_deferred_beside(&best.judged(), acceptance == Acceptance::Consistent)
    }

    /// Decides as [`Identifier::believes_deferred`], beside another fit, `other`, that explains the records or not.
    pub(super) fn believes_deferred_beside(&mut self, other: &Judged, explains: bool) -> bool {
        let Some(deferred) = self.deferred.take() else { return false };
        if explains && !deferred.judged.explains_clearly_more_than(other) {
            return false;
        }
        let Deferred { judged, coordinates, correction } = deferred;
        // Searches in another model have a budget of their own.
        self.starts = 0;
        self.times = 1;
        self.purpose = Purpose::Start;
        self.phase = Phase::Refining;
        self.correct_by(&correction, Corrected::first(judged, coordinates));
        true
    }
}

#[cfg(test)]
pub(super) mod tests {
    use std::boxed::Box;

    use fearless_simd::Level;
    use rand_core::SeedableRng as _;
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::super::minimum::tests::minimum;
    use super::*;
    use crate::imperfection::Correction;
    use crate::mounting::Mounting;
    use crate::refine::tests::{bounds, chain};
    use crate::sensors::Accelerometer;
    use crate::spectrum::Measurement;

    /// A fit with two thousand residuals.
    fn judged(objective: f64) -> Judged {
        Judged { objective, ..Judged::of(&minimum(2000.0, 0.0).fit) }
    }

    pub(in crate::identify) fn identifier() -> Box<Identifier<Xoshiro256PlusPlus>> {
        let measurement = Measurement {
            band_hz: [5.0, 60.0],
            gravity: [0.0, 0.0, -9.8],
            accelerometer: Accelerometer::Strapdown,
            mounting: Mounting::default(),
        };
        let random = Xoshiro256PlusPlus::seed_from_u64(1);
        Box::new(Identifier::new(chain(), bounds(), measurement, Level::baseline(), random))
    }

    /// It is believed where nothing else explains the records, or explains them clearly worse; else it is dropped.
    #[test]
    fn a_deferred_fit_is_the_last_resort() {
        for (of_deferred, other, explains, expected) in [
            (2000.0, 2000.0, false, true),
            (2000.0, 1000.0, false, true),
            (2000.0, 2000.0, true, false),
            (2000.0, 2009.0, true, false),
            (2000.0, 2011.0, true, true),
        ] {
            let mut identifier = identifier();
            identifier.starts = 5;
            assert!(!identifier.believes_deferred_beside(&judged(other), explains));
            let coordinates = identifier.sought.coordinates(&bounds().middle(2));
            let judged_so = judged(of_deferred);
            let correction = Correction::NONE;
            identifier.deferred = Some(Deferred { judged: judged_so, coordinates, correction });
            let believes = identifier.believes_deferred_beside(&judged(other), explains);
            assert_eq!(believes, expected, "{of_deferred} {other} {explains}");
            assert!(identifier.deferred.is_none());
            assert_eq!(identifier.corrected.is_some(), expected);
            assert_eq!(identifier.starts, if expected { 0 } else { 5 });
            assert_eq!(identifier.phase == Phase::Refining, expected);
            assert_eq!(*identifier.refinement.coordinates() == coordinates, expected);
        }
    }
}
