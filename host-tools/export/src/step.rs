//! A step of time that resolves the fastest mode.
//!
//! The elongation of a bushing is `e_j = y_j − X_j y_{j−1}`, y the displacements of the links. Of each quadratic form
//! `k (a − b)² ≤ 2 k a² + 2 k b²`, so the potential of all bushings is at most that of uncoupled links:
//!
//! ```text
//! ω² ≤ 2 max_j λ_max( I_j⁻¹ (k_j + X_{j+1}ᵀ k_{j+1} X_{j+1}) )
//! ```

use nalgebra::{Matrix3, Matrix6, Vector6};

use crate::assembly::Assembly;
use crate::body::Body;

/// Longest step, s. It gives 100 steps in a period of 200 Hz, the upper end of the usual band.
const LONGEST_S: f64 = 5e-5;
/// Largest product of the step and the highest natural frequency, rad. It gives 12 steps in a period. The semi-implicit Euler
/// method is stable below 2.
const LARGEST_ANGLE: f64 = 0.5;

/// Returns the step of time for an integrator of first order, s.
pub(crate) fn step_s(assembly: &Assembly) -> f64 {
    LONGEST_S.min(LARGEST_ANGLE / highest_frequency(&assembly.bodies))
}

/// Returns an upper bound of the natural frequencies without gravity, rad/s. It is 0 without springs.
fn highest_frequency(bodies: &[Body]) -> f64 {
    let square = |(index, body): (usize, &Body)| {
        let mut stiffness = diagonal(body);
        if let Some(next) = bodies.get(index + 1) {
            let to_next = from_parent(next);
            stiffness += to_next.transpose() * diagonal(next) * to_next;
        }
        // A link's inertia is positive definite, as the check of the chain has ensured.
        let factor = spatial_inertia(body).cholesky()?;
        let half = factor.l().solve_lower_triangular(&stiffness)?;
        let whole = factor.l().solve_lower_triangular(&half.transpose())?;
        Some(2.0 * whole.symmetric_eigenvalues().max())
    };
    bodies.iter().enumerate().filter_map(square).fold(0.0, f64::max).sqrt()
}

/// An infinite stiffness is a degree of freedom that does not exist.
fn diagonal(body: &Body) -> Matrix6<f64> {
    let stiffness = body.bushing.stiffness.map(|own| if own.is_finite() { own } else { 0.0 });
    Matrix6::from_diagonal(&Vector6::from(stiffness))
}

/// Returns X, which transforms a displacement (translation, rotation) of the link before to the frame of this joint.
fn from_parent(body: &Body) -> Matrix6<f64> {
    let back: Matrix3<f64> = body.frame.rotation.to_rotation_matrix().matrix().transpose();
    let mut transform = Matrix6::zeros();
    transform.fixed_view_mut::<3, 3>(0, 0).copy_from(&back);
    let lever = -back * body.frame.translation.vector.cross_matrix();
    transform.fixed_view_mut::<3, 3>(0, 3).copy_from(&lever);
    transform.fixed_view_mut::<3, 3>(3, 3).copy_from(&back);
    transform
}

/// Returns the inertia of the link about the origin of its joint frame, on (translation, rotation).
fn spatial_inertia(body: &Body) -> Matrix6<f64> {
    let centre = body.link.centre_of_mass.cross_matrix();
    let moment = centre * body.link.mass;
    let mut inertia = Matrix6::zeros();
    inertia.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(body.link.mass);
    inertia.fixed_view_mut::<3, 3>(0, 3).copy_from(&-moment);
    inertia.fixed_view_mut::<3, 3>(3, 0).copy_from(&moment);
    inertia.fixed_view_mut::<3, 3>(3, 3).copy_from(&(body.link.inertia - moment * centre));
    inertia
}
