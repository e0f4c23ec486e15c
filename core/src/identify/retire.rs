//! Records that make room, and leave their information.

use super::{Acceptance, Estimate, Identifier, Phase, PlantEstimate};
use crate::refine::{Plant, Problem};
use crate::spectrum::Experiment;

impl<R> Identifier<R> {
    /// Adds the information of an experiment that will not be kept to that of the retired ones, if the present estimate is
    /// consistent and its model perfect; returns whether it has. Call it before the [`Identifier::renew`] without that experiment.
    pub fn retire<const B: usize>(&mut self, experiment: &Experiment<B>) -> bool {
        let believed = |estimate: &&Estimate| estimate.acceptance == Acceptance::Consistent;
        let settled = self.phase == Phase::Settled;
        let Self { chain, measurement, bounds, sought, statics, refinement, estimate, .. } = self;
        let may_retire = settled && !refinement.is_corrected();
        let Some(estimate) = estimate.as_ref().filter(believed).filter(|_| may_retire) else {
            return false;
        };
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        refinement.restart_at(&estimate.coordinates);
        refinement.retire(&problem, experiment).is_ok()
    }

    /// Retires a record as [`Identifier::retire`], on a plant: adds the information of record number `record` of the `experiments` on which `estimate`, that of
    /// `plant`, rests, if it is consistent.
    /// Each record retires once, before the [`Identifier::renew`] without it.
    ///
    /// # Panics
    /// If there is no such record, or `plant` is of other joints.
    pub fn retire_on_plant<const B: usize>(
        &mut self,
        experiments: &[Experiment<B>],
        record: usize,
        plant: &mut Plant,
        estimate: &PlantEstimate,
    ) -> bool {
        assert!(plant.is_of(&self.chain), "a plant of another robot");
        let PlantEstimate { estimate, .. } = estimate;
        let stands_there = plant.coordinates() == estimate.coordinates;
        let is_believed = estimate.acceptance == Acceptance::Consistent;
        // A single record has no imperfections of its own, which would retire with it.
        let is_one_of_several = experiments.len() > 1;
        if self.phase != Phase::Settled || !(stands_there && is_believed && is_one_of_several) {
            return false;
        }
        let Self { chain, measurement, bounds, sought, statics, refinement, .. } = self;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        refinement.follow_retired(plant);
        refinement.retire_on_plant(&problem, &experiments[record], record, plant).is_ok()
    }
}
