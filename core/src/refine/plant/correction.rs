//! Imperfections that a model has, once a fit to a plant has found them.
//!
//! Where imperfections explain the records, the perfect model leaves residuals that are many times the noise. Its minima then say
//! little about which of two is right. With the imperfections as they were found, noise explains the residuals of the right one.

use heapless::Vec;

use super::Plant;
use super::imperfect::Imperfect;
use crate::imperfection::{Imperfection, MAX_IMPERFECTIONS};

/// Imperfections and their values, in the unit of each.
#[derive(Clone, Debug)]
pub(in crate::refine) struct Correction(Vec<(Imperfection, f64), MAX_IMPERFECTIONS>);

impl Correction {
    /// Of a perfect model.
    pub(in crate::refine) const NONE: Self = Self(Vec::new());

    pub(in crate::refine) fn is_none(&self) -> bool {
        self.0.is_empty()
    }

    /// Adds the imperfections to a model.
    pub(in crate::refine) fn add_to(&self, imperfect: &mut Imperfect) {
        for (imperfection, value) in &self.0 {
            imperfect.add(*imperfection, *value);
        }
    }
}

impl Plant {
    /// The imperfections where the last fit has ended.
    pub(in crate::refine) fn correction(&self) -> Correction {
        let values = self.imperfections.all.iter().zip(&self.point.imperfections);
        Correction(values.map(|((imperfection, prior), p)| (*imperfection, prior * p)).collect())
    }
}
