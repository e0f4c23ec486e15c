//! The descents of one start, the best of which is refined.
//!
//! The basin in which a descent ends depends on where it begins, and its end hardly shows whether that basin is the right one: the
//! mean squares of right and wrong ends may differ by a hundredth. So the first start makes one descent, and later starts compare
//! several, each from another place.

use crate::continuation::{Continuation, LEVELS};
use crate::refine::{ParameterNormal, Problem};
use crate::sought::Coordinates;
use crate::spectrum::Experiment;

/// Mean square of the residuals up to which an end fits. Noise alone leaves a half; that of two thousand residuals has a standard deviation of
/// 0.016, a sixth of the margin.
const FITS: f64 = 0.6;
/// Descents that one start may cost. Chosen: of a single pose one in three to one in twenty fits, of three poses most do.
const MAX_DESCENTS: u32 = 16;
/// Ends that fit, of which a later start takes the best. Chosen: an end that fits may lie in a wrong basin, and more ends cost more descents.
const COMPARED: u32 = 3;
/// Numbers of lowest levels that later descents skip, in turn. Chosen: a robot that is found with one of them may be missed with all others.
const LEFT_OUT: [u32; 6] = [2, 3, 4, 5, 6, 7];
/// Level from which on, a quarter of the band, the mean square distinguishes basins. Chosen: there it is below a third in descents that came to
/// fit, above a half in most others.
const FIRST_DISTINGUISHING: usize = 10;

/// The descents of one start.
#[derive(Clone, Debug)]
pub(super) struct Descent {
    present: Continuation,
    /// Descents that may follow.
    left: u32,
    /// Ends that fit and are still wanted.
    wanted: u32,
    best: Option<End>,
}

/// End of a descent.
#[derive(Clone, Copy, Debug)]
struct End {
    coordinates: Coordinates,
    /// Mean square of the residuals on each level.
    misfits: [f64; LEVELS],
}

impl End {
    fn misfit(&self) -> f64 {
        self.misfits[LEVELS - 1]
    }
}

impl Descent {
    /// Descents of the first start: one alone, from the lowest frequencies upward.
    pub(super) fn first(start: Coordinates) -> Self {
        Self { present: Continuation::new(start), left: 0, wanted: 1, best: None }
    }

    /// Descents of a later start.
    pub(super) fn elsewhere(start: Coordinates) -> Self {
        let present = Continuation::from_level(start, LEFT_OUT[0]);
        Self { present, left: MAX_DESCENTS - 1, wanted: COMPARED, best: None }
    }

    /// A few descents, whether they fit or not: in search of a rival.
    pub(super) fn few(start: Coordinates) -> Self {
        Self { left: COMPARED - 1, ..Self::elsewhere(start) }
    }

    /// Begins again after a change of the records: one descent, from the best end if there is one.
    pub(super) fn renew(&mut self) {
        *self = Self::first(self.best.map_or(*self.present.coordinates(), |best| best.coordinates));
    }

    /// Part of the present descent that is done, 0 to 1.
    pub(super) fn fraction(&self) -> f32 {
        self.present.fraction()
    }

    /// Tries one step. Returns the best end once all descents are done. Further descents begin at a `next` start. The caller leaves
    /// `room` as it is between the steps.
    pub(super) fn step<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        room: &mut ParameterNormal,
        next: impl FnOnce() -> Coordinates,
    ) -> Option<Coordinates> {
        self.present.step(problem, experiments, room);
        let misfits = self.present.misfits();
        if let Ok(misfits) = misfits.try_into() {
            self.compare(End { coordinates: *self.present.coordinates(), misfits });
        } else if !self.is_worse(misfits) {
            return None;
        }
        if let Some(best) = self.best.filter(|_| self.wanted == 0 || self.left == 0) {
            return Some(best.coordinates);
        }
        let left_out = LEFT_OUT[self.left as usize % LEFT_OUT.len()];
        self.present = Continuation::from_level(next(), left_out);
        self.left -= 1;
        None
    }

    fn compare(&mut self, end: End) {
        if end.misfit() <= FITS {
            self.wanted = self.wanted.saturating_sub(1);
        }
        if self.best.is_none_or(|best| end.misfit().total_cmp(&best.misfit()).is_lt()) {
            self.best = Some(end);
        }
    }

    /// Returns whether a descent with these mean squares on the levels that have ended exceeds, on one that distinguishes, both noise and the
    /// best descent.
    fn is_worse(&self, misfits: &[f64]) -> bool {
        let best = self.best.iter().flat_map(|best| &best.misfits);
        misfits.iter().zip(best).skip(FIRST_DISTINGUISHING).any(|(own, best)| *own > best.max(FITS))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::start::{middle, tests::two_joints};

    /// One that has ended with the same mean square on each level.
    fn end(misfit: f64) -> End {
        let (sought, bounds) = two_joints();
        End { coordinates: middle(&bounds, &sought), misfits: [misfit; LEVELS] }
    }

    /// The best counts, whether it fits or not; those that fit are counted.
    #[test]
    fn the_best_of_several_ends_is_taken() {
        for (ends, wanted, best) in
            [(&[0.7, 0.5, 0.3][..], 1, 0.3), (&[0.3, 0.5, 0.4], 0, 0.3), (&[3.0, 2.0, 5.0], 3, 2.0)]
        {
            let mut descents = Descent::elsewhere(end(0.0).coordinates);
            ends.iter().for_each(|misfit| descents.compare(end(*misfit)));
            assert_eq!(descents.wanted, wanted, "{ends:?}");
            assert_eq!(descents.best.map(|best| best.misfit()), Some(best), "{ends:?}");
        }
    }

    /// Hopeless is what has ended a level that distinguishes worse than the best one did, if noise does not let it.
    #[test]
    fn what_does_worse_than_the_best_is_abandoned() {
        let worse = |misfit: f64, level: usize, best: Option<f64>| {
            let mut misfits = [0.1; LEVELS];
            misfits[level] = misfit;
            let mut descents = Descent::elsewhere(end(0.0).coordinates);
            descents.best = best.map(end);
            descents.is_worse(&misfits[..=level])
        };
        assert!(worse(0.7, FIRST_DISTINGUISHING, Some(0.3)));
        assert!(worse(3.0, FIRST_DISTINGUISHING, Some(2.0)));
        assert!(!worse(0.5, FIRST_DISTINGUISHING, Some(0.3)));
        assert!(!worse(1.0, FIRST_DISTINGUISHING, Some(2.0)));
        assert!(!worse(0.7, FIRST_DISTINGUISHING - 1, Some(0.3)));
        assert!(!worse(0.7, FIRST_DISTINGUISHING, None));
    }
}
