//! What an estimate leaves of the records: bin by bin, and where that is more than elsewhere.

use heapless::Vec;

use super::{Acceptance, Estimate, Identifier, Phase};
use crate::chain::linearise::LinearisationError;
use crate::refine::{BinLeft, LeftOver, MAX_LEFT_OVER, Plant, Problem};
use crate::spectrum::Experiment;

impl<R> Identifier<R> {
    /// Calls `take` with what a settled `estimate` leaves of the acceleration in each bin, record by record from
    /// number `first` on. It is that of `plant` where its last fit has ended, if there is one, or else the identifier's own.
    ///
    /// # Errors
    /// Gravity leaves the robot no equilibrium.
    #[inline(never)]
    pub fn each_bin<const B: usize>(
        &mut self,
        experiments: &[Experiment<B>],
        plant: Option<&Plant>,
        estimate: &Estimate,
        first: usize,
        take: &mut dyn FnMut(&BinLeft),
    ) -> Result<(), LinearisationError> {
        let Self { chain, measurement, bounds, sought, statics, refinement, .. } = self;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        refinement.each_bin(&problem, &estimate.coordinates, plant, experiments, first, take)
    }

    /// Where the residuals of a settled `estimate` are larger than elsewhere. It is that of `plant` where its last fit has ended, if there is
    /// one, or else the identifier's own. Nothing where noise explains the residuals, or where the minimum may be a wrong one.
    #[inline(never)]
    pub fn left_over<const B: usize>(
        &mut self,
        experiments: &[Experiment<B>],
        plant: Option<&Plant>,
        estimate: &Estimate,
    ) -> Vec<LeftOver, MAX_LEFT_OVER> {
        let objects = estimate.size_objects || estimate.whiteness_objects;
        let is_believed = self.phase == Phase::Settled
            && estimate.acceptance != Acceptance::Unsettled
            && !estimate.noise_too_loud;
        if !(objects && is_believed) {
            return Vec::new();
        }
        let Self { chain, measurement, bounds, sought, statics, refinement, .. } = self;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        refinement.left_over(&problem, &estimate.coordinates, plant, experiments)
    }
}
