//! From the imperfections that a fit has found to a model that has them, and back.

use super::Plant;
use crate::imperfection::Correction;

impl Plant {
    /// The imperfections where the last fit has ended.
    pub(crate) fn correction(&self) -> Correction {
        let values = self.imperfections.all.iter().zip(&self.point.imperfections);
        Correction(values.map(|((imperfection, prior), p)| (*imperfection, prior * p)).collect())
    }

    /// Goes to these imperfections, as far as the plant can have them.
    pub(in crate::refine) fn go_to(&mut self, correction: &Correction) {
        for (imperfection, value) in correction.values() {
            let own = self.imperfections.all.iter().position(|(own, _)| own == imperfection);
            if let Some(index) = own {
                self.point.imperfections[index] = value / self.imperfections.all[index].1;
            }
        }
    }
}
