//! Links that give way, in series with the joints.
//!
//! The data hardly tell their compliance c from that of a joint along the same degree of freedom. It is therefore not sought. It widens
//! the intervals (a _considered_ parameter): with `k ← k/(1 + k c)` and `d ← d/(1 + k c)²`, c small, they add
//!
//! ```text
//! v vᵀ        v = −k σ_c (1, 2) on (ln k, ln d)
//! ```
//!
//! to the covariance, for each degree of freedom of each joint.

use super::Plant;
use crate::DOF;
use crate::chain::JointKind;
use crate::imperfection::Accuracies;
use crate::parameters::Bushings;
use crate::refine::fit::Fit;
use crate::sought::{Coordinate, MAX_UNKNOWNS, Sought};

impl Plant {
    /// Standard deviations of the compliance in series with a joint: translation, m/N, and rotation, rad/Nm. No link is in series with a
    /// driven first joint.
    fn in_series_with(&self, joint: usize) -> [f64; 2] {
        let Accuracies { structure_translation, structure_rotation, .. } = self.accuracies;
        let stands_on_ground = joint == 0 && self.joints.first() != Some(&JointKind::Fixed);
        if stands_on_ground { [0.0; 2] } else { [structure_translation, structure_rotation] }
    }

    /// Widens the standard deviations of a fit that found `bushings`. They are later multiplied by `inflation`, the structure's part is not.
    pub(crate) fn widen_by_structure(
        &self,
        fit: &mut Fit,
        sought: &Sought,
        bushings: &Bushings,
        inflation: f64,
    ) {
        for (joint, bushing) in bushings.iter().enumerate() {
            let [translation, rotation] = self.in_series_with(joint);
            for dof in 0..DOF {
                let compliance = if dof < 3 { translation } else { rotation };
                let relative = bushing.stiffness[dof] * compliance;
                let mut shift = [0.0; MAX_UNKNOWNS];
                for (coordinate, times) in [
                    (Coordinate::Stiffness { joint, dof }, -1.0),
                    (Coordinate::Damping { joint, dof }, -2.0),
                ] {
                    if let Some(unknown) = sought.unknown(coordinate) {
                        shift[unknown] = times * relative / inflation;
                    }
                }
                if relative > 0.0 {
                    fit.widen(sought, &shift);
                }
            }
        }
    }
}
