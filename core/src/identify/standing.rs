//! The state of a settled identifier: with the experiments, all that it needs to continue after a restart.

use core::error::Error;
use core::fmt;

use heapless::Vec;
use rand_core::Rng;

use super::minimum::Rival;
use super::{Acceptance, Effort, FoundBy, Identifier, Phase};
use crate::imperfection::Correction;
use crate::parameters::Bounds;
use crate::refine::Retired;
use crate::sought::{Coordinates, MAX_UNKNOWNS, Sought};
use crate::spectrum::Experiment;

/// Distance beyond its bounds at which a parameter's logarithm is rejected. Chosen: far above the rounding of a logarithm, 4e-15 at 1e10.
const ROUNDING: f64 = 1e-9;

/// A settled identifier, without its experiments and its generator of random numbers.
///
/// [`Identifier::resume`] with the same experiments gives the same estimate, to the bit at the
/// same instruction set. The robot, measurement, bounds, static tests and unknowns must be the same; the caller ensures that.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Standing {
    /// One per coordinate.
    pub(super) coordinates: Vec<f64, MAX_UNKNOWNS>,
    /// For each unknown, the farthest rival below and above the minimum; empty without one.
    pub(super) apart: Vec<[Rival; 2], MAX_UNKNOWNS>,
    /// The largest standard deviation of every unknown at other points that the data do not exclude; empty without one.
    pub(super) deviations_elsewhere: Vec<f64, MAX_UNKNOWNS>,
    /// How often in a row branches have been clearly worse since the last search.
    pub(super) exclusions: u32,
    pub(super) acceptance: Acceptance,
    pub(super) retired: Retired,
    pub(super) forgotten: u64,
    pub(super) effort: Effort,
    pub(super) found_by: FoundBy,
    /// Imperfections of the model.
    pub(super) correction: Correction,
}

/// Why no identifier can go on from a [`Standing`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StandingError {
    /// It has another number of coordinates or of unknowns, one that is not finite, a parameter outside its bounds, or imperfections of
    /// another robot.
    Coordinates,
    /// Its retired records are of another number of unknowns, or hold a number that is not finite.
    Retired,
}

impl fmt::Display for StandingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Coordinates => "the parameters are those of another robot, or outside the bounds",
            Self::Retired => "the retired records are those of another robot",
        })
    }
}

impl Error for StandingError {}

impl Standing {
    /// Records that were not kept any more, whose information is in it.
    pub fn retired(&self) -> u64 {
        self.retired.records()
    }

    /// The coordinates, if a fit of `sought` within `bounds` can stand there.
    pub(super) fn coordinates(
        &self,
        sought: &Sought,
        bounds: &Bounds,
    ) -> Result<Coordinates, StandingError> {
        let coordinates: Coordinates =
            self.coordinates.as_slice().try_into().map_err(|_| StandingError::Coordinates)?;
        let ranges = sought.ranges(&coordinates, bounds);
        let within = ranges.iter().take(sought.unknowns()).all(|[value, lower, upper]| {
            (lower - ROUNDING..=upper + ROUNDING).contains(value) && value.is_finite()
        });
        let rivals = [self.apart.len(), self.deviations_elsewhere.len()]
            .iter()
            .all(|length| [0, sought.unknowns()].contains(length));
        let finite = coordinates.iter().all(|value| value.is_finite());
        let mut of_rivals = self.apart.as_flattened().iter();
        let possible = of_rivals.all(|rival| rival.away.is_finite() && rival.gap >= 0.0);
        // Infinite where another point leaves an unknown undetermined.
        let positive = self.deviations_elsewhere.iter().all(|deviation| *deviation >= 0.0);
        let sane = within && rivals && finite && possible && positive;
        if sane { Ok(coordinates) } else { Err(StandingError::Coordinates) }
    }
}

impl<R: Rng> Identifier<R> {
    /// Returns its standing; `None` unless it has settled on an estimate of records.
    pub fn standing(&self) -> Option<Standing> {
        let estimate = self.estimate.as_ref().filter(|_| self.phase == Phase::Settled)?;
        Some(Standing {
            coordinates: estimate.coordinates.iter().copied().collect(),
            apart: estimate.apart.clone(),
            deviations_elsewhere: estimate.deviations_elsewhere.clone(),
            exclusions: self.exclusions,
            acceptance: estimate.acceptance,
            retired: self.refinement.retired_records(),
            forgotten: self.forgotten,
            effort: self.effort,
            found_by: estimate.found_by,
            correction: self.refinement.correction().clone(),
        })
    }

    /// Continues from the state of another identifier of the same problem, which had settled on these `experiments`. Give a new
    /// identifier the other's generator, too. It costs one fit and no search.
    ///
    /// # Errors
    /// The state is that of another problem. Then nothing has changed.
    pub fn resume<const B: usize>(
        &mut self,
        standing: &Standing,
        experiments: &[Experiment<B>],
    ) -> Result<(), StandingError> {
        let coordinates = standing.coordinates(&self.sought, &self.bounds)?;
        if !standing.correction.is_of(&self.chain.kinds()) {
            return Err(StandingError::Coordinates);
        }
        self.refinement
            .resume(&self.sought, &coordinates, &standing.retired)
            .ok_or(StandingError::Retired)?;
        self.forgotten = standing.forgotten;
        self.exclusions = standing.exclusions;
        self.effort = standing.effort;
        self.found_by = standing.found_by;
        self.refinement.set_correction(&standing.correction);
        let mut minimum = self.minimum_here(experiments);
        minimum.apart = standing.apart.clone();
        minimum.deviations_elsewhere = standing.deviations_elsewhere.clone();
        self.settle(&mut minimum, standing.acceptance, experiments);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::Refinement;

    #[test]
    fn what_no_fit_can_stand_at_is_refused() {
        let sought = Sought::new(2).expect("two joints");
        let bounds = Bounds::new([1e7, 2e8], [1e6, 1e8], [1e2, 1e6], [1e1, 5e5]).expect("in order");
        let middle = bounds.middle(sought.joints());
        let mut refinement = Refinement::new(&sought, &middle);
        let good = Standing {
            coordinates: sought.coordinates(&middle).into_iter().collect(),
            apart: Vec::new(),
            deviations_elsewhere: Vec::new(),
            exclusions: 0,
            acceptance: Acceptance::Consistent,
            retired: refinement.retired_records(),
            forgotten: 0,
            effort: Effort::default(),
            found_by: FoundBy::Descent,
            correction: Correction::NONE,
        };
        assert_eq!(good.coordinates(&sought, &bounds), Ok(sought.coordinates(&middle)));
        let changed = |change: fn(&mut Standing)| {
            let mut standing = good.clone();
            change(&mut standing);
            standing.coordinates(&sought, &bounds)
        };
        let short = changed(|standing| standing.coordinates.truncate(12));
        assert_eq!(short, Err(StandingError::Coordinates));
        for change in [
            |standing: &mut Standing| standing.coordinates[3] = f64::NAN,
            |standing: &mut Standing| standing.coordinates[90] = f64::INFINITY,
            |standing: &mut Standing| standing.coordinates[3] += 10.0,
            |standing: &mut Standing| standing.apart = Vec::from([[Rival::default(); 2]; 12]),
            |standing: &mut Standing| {
                standing.apart = Vec::from([[Rival { away: f64::NAN, gap: 0.0 }; 2]; 24])
            },
            |standing: &mut Standing| standing.deviations_elsewhere = Vec::from([1.0; 12]),
            |standing: &mut Standing| standing.deviations_elsewhere = Vec::from([f64::NAN; 24]),
            |standing: &mut Standing| standing.deviations_elsewhere = Vec::from([-1.0; 24]),
        ] {
            assert_eq!(changed(change), Err(StandingError::Coordinates));
        }

        let coordinates = sought.coordinates(&middle);
        let mut resume = |joints| {
            let of = Sought::new(joints).expect("a few joints");
            refinement.resume(&of, &coordinates, &good.retired)
        };
        assert_eq!([resume(3), resume(2)], [None, Some(())]);
    }
}
