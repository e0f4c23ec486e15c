//! Imperfections that a model has, once a fit to a plant has found them.
//!
//! Where imperfections explain the records, the perfect model leaves residuals that are many times the noise. Its minima then say
//! little about which of two is right. With the imperfections as they were found, noise explains the residuals of the right one.

use heapless::Vec;

use super::{Accuracies, Imperfection, MAX_IMPERFECTIONS, all, of_low_pass};
use crate::chain::JointKind;
use crate::search::MAX_EXPERIMENTS;

/// Imperfections and their values, in the unit of each.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Correction(pub(crate) Vec<(Imperfection, f64), MAX_IMPERFECTIONS>);

impl Correction {
    /// Correction of a perfect model.
    pub(crate) const NONE: Self = Self(Vec::new());

    pub(crate) fn is_none(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns whether a robot with these joints can have these imperfections.
    pub(crate) fn is_of(&self, joints: &[JointKind]) -> bool {
        let known = all(&Accuracies::typical(), joints, MAX_EXPERIMENTS);
        let of_low_pass = of_low_pass(1.0);
        let is_known = |own: &Imperfection| {
            known.iter().chain(&of_low_pass).any(|(imperfection, _)| imperfection == own)
        };
        self.0.iter().all(|(imperfection, value)| is_known(imperfection) && value.is_finite())
    }

    /// Each imperfection, with its value.
    pub(crate) fn values(&self) -> &[(Imperfection, f64)] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imperfection::Sensor;

    #[test]
    fn a_correction_is_of_a_robot() {
        let of = |imperfection, value| Correction([(imperfection, value)].into_iter().collect());
        let joints = &[JointKind::Fixed, JointKind::Revolute];
        assert!(Correction::NONE.is_of(joints));
        for (imperfection, value, is_of) in [
            (Imperfection::Gain(Sensor::Force, 2), 0.1, true),
            (Imperfection::Gain(Sensor::Force, 3), 0.1, false),
            (Imperfection::Gain(Sensor::Force, 2), f64::NAN, false),
            (Imperfection::Mass(1), 0.1, true),
            (Imperfection::Mass(2), 0.1, false),
            (Imperfection::JointAngle(1), 0.1, true),
            (Imperfection::JointAngle(0), 0.1, false),
        ] {
            assert_eq!(of(imperfection, value).is_of(joints), is_of, "{imperfection:?} {value}");
        }
    }
}
