//! Residuals of an estimate: bin by bin, where they are larger than elsewhere, and whether they are a response to the force.

use heapless::Vec;

use super::distortion::Distortion;
use super::{Acceptance, Estimate, Identifier, Phase};
use crate::chain::linearise::LinearisationError;
use crate::refine::{BinLeft, LeftOver, MAX_LEFT_OVER, Plant, Problem};
use crate::search::MAX_EXPERIMENTS;
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

    /// Returns where the residuals of a settled `estimate` are larger than elsewhere, and whether they are no response to the force. It is that
    /// of `plant` where its last fit has ended, if there is one, or else the identifier's own. The list is empty if noise explains the residuals.
    /// If the minimum may be a wrong one, the list has the distortion alone: a wrong minimum leaves a response to the force.
    #[inline(never)]
    pub fn left_over<const B: usize>(
        &mut self,
        experiments: &[Experiment<B>],
        plant: Option<&Plant>,
        estimate: &Estimate,
    ) -> Vec<LeftOver, MAX_LEFT_OVER> {
        let objects = estimate.size_objects || estimate.structure_objects;
        if self.phase != Phase::Settled || !objects || estimate.noise_too_loud {
            return Vec::new();
        }
        // What is random is noise.
        let is_structured = estimate.structure_objects;
        let distortion =
            is_structured.then(|| self.distortion(experiments, plant, estimate)).flatten();
        let Self { chain, measurement, bounds, sought, statics, refinement, .. } = self;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        let mut places = match estimate.acceptance {
            Acceptance::Unsettled => Vec::new(),
            _ => refinement.left_over(&problem, &estimate.coordinates, plant, experiments),
        };
        // There is room for all.
        places.extend(distortion);
        places
    }

    /// The part of the residuals that is no response to the force, if a wrong linear model does not leave so much.
    #[inline(never)]
    fn distortion<const B: usize>(
        &mut self,
        experiments: &[Experiment<B>],
        plant: Option<&Plant>,
        estimate: &Estimate,
    ) -> Option<LeftOver> {
        let mut distortion = Distortion::default();
        for (record, experiment) in experiments.iter().take(MAX_EXPERIMENTS).enumerate() {
            let left = self.unexplained(experiment, plant, estimate, record)?;
            distortion.add(experiment, &left);
        }
        distortion.part().map(|part| LeftOver::Distortion { part })
    }
}
