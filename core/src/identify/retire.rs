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
    pub fn retire_on_plant<const B: usize>(
        &mut self,
        experiments: &[Experiment<B>],
        record: usize,
        plant: &mut Plant,
        estimate: &PlantEstimate,
    ) -> bool {
        let PlantEstimate { estimate, .. } = estimate;
        let stands_there = plant.coordinates() == estimate.coordinates;
        let is_believed = estimate.acceptance == Acceptance::Consistent;
        if self.phase != Phase::Settled || !stands_there || !is_believed {
            return false;
        }
        let Self { chain, measurement, bounds, sought, statics, refinement, .. } = self;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        refinement.retire_on_plant(&problem, &experiments[record], record, plant).is_ok()
    }
}
