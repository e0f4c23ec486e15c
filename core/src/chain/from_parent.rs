//! Transformation of displacements from a link to the next.

use nalgebra::{Matrix3, Matrix6, SMatrix};

/// `X` transforms a displacement of the link before (the parent) to the frame of this joint, as Featherstone's `ⁱX_λ(i)` (_Rigid
/// Body Dynamics Algorithms_, 2008, section 2.8), but translation first, and rotations as turns of the bushings:
///
/// ```text
/// X = [[rotation, lever], [0, turns]]
/// ```
///
/// `ToParent` of the receptance is its inverse, in the precision of the recursion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FromParent {
    /// Translation here by the parent's translation.
    pub(crate) rotation: Matrix3<f64>,
    /// Translation here by the parent's turns, m.
    pub(crate) lever: Matrix3<f64>,
    /// Turns here by the parent's turns.
    pub(crate) turns: Matrix3<f64>,
    /// Inverse of `turns`.
    pub(crate) turns_inverse: Matrix3<f64>,
}

impl FromParent {
    /// X, 6×6: rows are the displacement here, columns that of the parent; each is translation (m), then turns (rad).
    pub fn matrix(&self) -> Matrix6<f64> {
        let mut matrix = Matrix6::zeros();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.rotation);
        matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&self.lever);
        matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.turns);
        matrix
    }

    /// `Xᵀ f`: the loads on the parent that are equivalent to the loads f on this link, one load per column, N and Nm.
    pub(crate) fn loads_on_parent(&self, loads: &SMatrix<f64, 6, 3>) -> SMatrix<f64, 6, 3> {
        let (force, torque) = (loads.fixed_rows::<3>(0), loads.fixed_rows::<3>(3));
        let mut on_parent = SMatrix::<f64, 6, 3>::zeros();
        on_parent.fixed_rows_mut::<3>(0).copy_from(&(self.rotation.transpose() * force));
        on_parent
            .fixed_rows_mut::<3>(3)
            .copy_from(&(self.lever.transpose() * force + self.turns.transpose() * torque));
        on_parent
    }
}
