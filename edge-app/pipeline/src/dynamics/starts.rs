//! The starts of the search for the modes: the modes of a robot whose springs and dampers do not depend on the frequency.

use std::f64::consts::TAU;

use flexid_core::receptance;
use nalgebra::{Complex, DMatrix, DVector, Schur};

use super::assembly::Matrices;
use super::at_pose::Dynamics;
use super::place::Place;

/// Most iterations for the starts. Chosen: a few for each of eighty-four.
const SCHUR_ITERATIONS: usize = 10_000;
/// Inverse iterations for φ at a λ. Chosen: each makes what is not along the mode smaller by the distance of λ over that of the next mode.
const ALIGNING: usize = 2;
/// Distance from λ, relative, at which Z has an inverse that shows φ.
const NEAR: f64 = 1e-6;
/// Radius of gyration of the base in the starts, m; the base is a point. Chosen: small, so that its turns are above a kilohertz.
const GYRATION_M: f64 = 0.01;

/// λ and φ of a mode.
pub(crate) type Solution = (Complex<f64>, DVector<Complex<f64>>);

impl Dynamics<'_> {
    /// λ, up to this size and with a positive imaginary part, and φ of the modes whose springs and dampers are those at the middle of the band.
    /// λ are eigenvalues of the first-order form, with time in units of 1/ω₀:
    ///
    /// ```text
    /// [        0           1         ]
    /// [ −M⁻¹ K/ω₀²   −M⁻¹ D/ω₀ ] (x, v)ᵀ = λ/ω₀ (x, v)ᵀ
    /// ```
    pub(crate) fn starts(&self, highest: f64) -> Vec<Solution> {
        let [lower, upper] = self.robot().band_hz();
        let omega = TAU * (lower * upper).sqrt();
        let [mass, stiffness, damping] = self.with_base(omega);
        // Links have mass and inertia, so that M is positive.
        let Some(inverse) = mass.clone().cholesky() else { return Vec::new() };
        let n = stiffness.nrows();
        let mut first_order = DMatrix::zeros(2 * n, 2 * n);
        first_order.view_mut((0, n), (n, n)).fill_diagonal(1.0);
        let scaled = [&stiffness / -(omega * omega), &damping / -omega];
        first_order.view_mut((n, 0), (n, n)).copy_from(&inverse.solve(&scaled[0]));
        first_order.view_mut((n, n), (n, n)).copy_from(&inverse.solve(&scaled[1]));
        if !first_order.iter().all(|entry| entry.is_finite()) {
            return Vec::new();
        }
        let Some(schur) = Schur::try_new(first_order, f64::EPSILON, SCHUR_ITERATIONS) else {
            return Vec::new();
        };
        let eigenvalues = schur.complex_eigenvalues();
        let eigenvalues = eigenvalues.iter().map(|own| own * omega);
        let wanted = eigenvalues.filter(|own| own.im > 0.0 && own.norm() <= highest);
        let with_shape = |lambda: Complex<f64>| {
            let near = lambda * (1.0 + NEAR);
            let shape = aligned(DMatrix::from_fn(n, n, |i, j| {
                near * near * mass[(i, j)] + near * damping[(i, j)] + stiffness[(i, j)]
            }))?;
            Some((lambda, shape.rows(0, self.size()).into_owned()))
        };
        wanted.filter_map(with_shape).collect()
    }

    /// M, K and D with springs and dampers as they are at ω. On ground that gives way the displacements u of the base follow the elongations:
    ///
    /// ```text
    /// Z = [ Z_e + z      −z X     ]        z, X of the first joint        K_g = 1/c + s² m
    ///     [ −Xᵀ z    Xᵀ z X + K_g ]
    /// ```
    fn with_base(&self, omega: f64) -> [DMatrix<f64>; 3] {
        let n = self.size();
        let Matrices { mass, stiffness, damping, .. } = self.matrices();
        let bushings = self.bushings(Place::At(Complex::new(0.0, omega)));
        let z = bushings.springs + bushings.dampers;
        let parts = [z.map(|own| own.re), z.map(|own| own.im / omega)];
        let mechanics = self.mechanics();
        let still = receptance::Complex { re: 0.0, im: 0.0 };
        let ground = mechanics.ground(still).zip(mechanics.base_mass());
        let size = n + if ground.is_some() { 6 } else { 0 };
        let mut all = [mass, stiffness, damping].map(|own| own.clone().resize(size, size, 0.0));
        let [mass, forces @ ..] = &mut all;
        let x = mechanics.chain().joints[0].from_parent.matrix();
        for (own, z) in forces.iter_mut().zip(&parts) {
            for i in 0..n {
                own[(i, i)] += z[i];
            }
            for dof in 0..size - n {
                for i in 0..6 {
                    own[(i, n + dof)] -= z[i] * x[(i, dof)];
                    own[(n + dof, i)] -= z[i] * x[(i, dof)];
                    for other in 0..6 {
                        own[(n + dof, n + other)] += x[(i, dof)] * z[i] * x[(i, other)];
                    }
                }
            }
        }
        if let Some((compliance, base)) = ground {
            for dof in 0..6 {
                let gyration = if dof < 3 { 1.0 } else { GYRATION_M };
                mass[(n + dof, n + dof)] = base * gyration * gyration;
                forces[0][(n + dof, n + dof)] += 1.0 / compliance[dof].re;
            }
        }
        all
    }
}

/// φ by inverse iterations with this Z. `None` if Z has no inverse.
pub(crate) fn aligned(z: DMatrix<Complex<f64>>) -> Option<DVector<Complex<f64>>> {
    let size = z.nrows();
    let inverse = z.lu();
    // Any vector has a part along the mode. The phases keep it from being at right angles to one by symmetry.
    let mut shape = DVector::from_fn(size, |i, _| Complex::cis(i as f64));
    for _ in 0..ALIGNING {
        shape = inverse.solve(&shape)?;
        let norm = shape.norm();
        shape.unscale_mut(norm);
    }
    Some(shape)
}
