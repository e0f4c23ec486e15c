//! Inverse kinematics: joint angles at a place of the tool, from angles nearby.
//!
//! Newton's method on the error e of the tool's place, with the Jacobian J of the drives, damped by the error itself (Levenberg and
//! Marquardt), takes the shortest steps that joints can:
//!
//! ```text
//! δq = Jᵀ (J Jᵀ + λ² 1)⁻¹ e          λ = |e|
//! ```
//!
//! Six driven joints or more keep the tool's orientation: e has six rows, m and rad. Fewer follow its position alone.

use flexid_core::chain::Chain;
use nalgebra::{DMatrix, DVector, Isometry3, Vector3};

/// Driven joints from which on the tool's orientation is kept.
const KEEPING: usize = 6;
/// Error at which the tool is in its place, m and rad. Chosen: a hundred times what rounding leaves in a chain of metres.
const IN_PLACE: f64 = 1e-13;
/// Error of the last step that counts as in place if no further step mends it, m and rad. Chosen: far below any sensor's resolution.
const ROUNDED: f64 = 1e-11;
/// Most steps. Chosen: from a millimetre away three or four are enough.
const MOST_STEPS: usize = 20;
/// Least singular value, over the largest, of a Jacobian that can be inverted. Chosen: nearer to a singular pose joints turn a thousand times as
/// much as elsewhere.
const SINGULAR: f64 = 1e-3;

/// A robot that reaches for places.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach<'a> {
    chain: &'a Chain,
    rows: usize,
}

impl<'a> Reach<'a> {
    pub(super) fn new(chain: &'a Chain) -> Self {
        Self { chain, rows: if chain.driven() >= KEEPING { 6 } else { 3 } }
    }

    /// Angles at which the tool stands at `target`, sought from `guess`. `None` if none are found.
    pub(super) fn angles(&self, target: &Isometry3<f64>, guess: Vec<f64>) -> Option<Vec<f64>> {
        let mut angles = guess;
        for _ in 0..MOST_STEPS {
            let error = self.error(target, &angles);
            let size = error.norm();
            if size <= IN_PLACE {
                return Some(angles);
            }
            let step = self.step(&angles, &error, size)?;
            let moved: Vec<f64> = angles.iter().zip(&step).map(|(q, step)| q + step).collect();
            if size <= ROUNDED && self.error(target, &moved).norm() >= size {
                return Some(angles);
            }
            angles = moved;
        }
        None
    }

    /// Slopes dq/ds of the angles where the tool moves along the unit vector `along`, 1/m. `None` at a singular pose.
    pub(super) fn slopes(&self, angles: &[f64], along: &Vector3<f64>) -> Option<Vec<f64>> {
        let singular = self.jacobian(angles).singular_values();
        if singular.len() < self.rows || singular.min() < SINGULAR * singular.max() {
            return None;
        }
        let mut moved = DVector::zeros(self.rows);
        moved.rows_mut(0, 3).copy_from(&(self.chain.tool(angles).rotation.inverse() * along));
        Some(self.step(angles, &moved, 0.0)?.as_slice().to_vec())
    }

    /// Angles near those of the tool `distance` m further along, by the slopes half-way: close enough that what Newton's method adds does not bend the
    /// motion of joints that the tool does not need.
    pub(super) fn ahead(
        &self,
        angles: &[f64],
        along: &Vector3<f64>,
        distance: f64,
    ) -> Option<Vec<f64>> {
        let moved = |slopes: Vec<f64>, by: f64| -> Vec<f64> {
            angles.iter().zip(slopes).map(|(q, slope)| q + by * slope).collect()
        };
        let half = moved(self.slopes(angles, along)?, 0.5 * distance);
        Some(moved(self.slopes(&half, along)?, distance))
    }

    /// Jacobian of the rows that are followed, axes of the tool.
    fn jacobian(&self, angles: &[f64]) -> DMatrix<f64> {
        let all = self.chain.drive_jacobian(angles);
        DMatrix::from_fn(self.rows, angles.len(), |row, joint| all[(row, joint)])
    }

    /// Way from the tool to `target`, axes of the tool, m and rad.
    fn error(&self, target: &Isometry3<f64>, angles: &[f64]) -> DVector<f64> {
        let tool = self.chain.tool(angles);
        let Isometry3 { translation, rotation } = tool.inverse() * target;
        let (way, turn) = (translation.vector, rotation.scaled_axis());
        DVector::from_iterator(self.rows, way.iter().chain(&turn).copied().take(self.rows))
    }

    fn step(&self, angles: &[f64], error: &DVector<f64>, damping: f64) -> Option<DVector<f64>> {
        let jacobian = self.jacobian(angles);
        let mut square = &jacobian * jacobian.transpose();
        square.set_diagonal(&square.diagonal().add_scalar(damping * damping));
        Some(jacobian.transpose() * square.cholesky()?.solve(error))
    }
}
