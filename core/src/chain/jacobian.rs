//! Translational Jacobian of the TCP with respect to the elongations (paper, section 4.1).

use nalgebra::SMatrix;

use super::linearise::LinearChain;
use crate::{DOF, MAX_JOINTS};

/// Jacobian `[joint][degree of freedom][TCP axis]`, base first: m/m and m/rad.
pub type Jacobian = [[[f64; 3]; DOF]; MAX_JOINTS];

impl LinearChain {
    /// `∂f_i/∂q_j` (paper, equation 1): displacement of the TCP along its axes per elongation. Entries of joints beyond the
    /// chain are zero.
    pub fn jacobian(&self) -> Jacobian {
        self.jacobian_of(self.tip_force)
    }

    /// Jacobian of the displacements that belong to the loads `tip` on the last link, for example those of a sensor that
    /// does not sit at the TCP.
    pub(crate) fn jacobian_of(&self, mut tip: SMatrix<f64, 6, 3>) -> Jacobian {
        let mut jacobian = [[[0.0; 3]; DOF]; MAX_JOINTS];
        for (index, joint) in self.joints.iter().enumerate().rev() {
            for (dof, column) in jacobian[index].iter_mut().enumerate() {
                *column = core::array::from_fn(|axis| tip[(dof, axis)]);
            }
            tip = joint.from_parent.loads_on_parent(&tip);
        }
        jacobian
    }
}
