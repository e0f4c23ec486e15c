//! A tool beyond the force sensor: the measured force is not the whole force that cuts.
//!
//! `Wᵀ η` is the force that the inertia and the turning weight of the tool take at a displacement η of the last link.
//! `U = Z⁻¹ P` are the displacements per unit force, and γ is the load of the seam:
//!
//! ```text
//! F = F_m + Wᵀ η,   η = Z⁻¹ (P F + γ)      ⇒      F − F_m = M Wᵀ Z⁻¹ (P F_m + γ),   M = (I − Wᵀ U)⁻¹
//! ```
//!
//! The observation r per measured force is therefore `G = rᵀ U M`, and its adjoint is `Z⁻¹ (r + W Gᵀ)`. With this adjoint and the
//! force that cuts, all derivatives have the same form as without a tool.

use super::complex::{Column, Complex};
use super::lanes::{Lanes, Scalar};
use super::symmetric::Factor;
use crate::DOF;

/// A 3×3 matrix, row by row.
pub(super) type Square<V> = [[Complex<V>; 3]; 3];

/// Part of the force that a tool takes, per axis of the force sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ToolTerms<T> {
    /// Mass of the tool times the loads whose displacements are those of its centre of mass, kg.
    pub(crate) inertia: [[T; DOF]; 3],
    /// Mass of the tool times the loads whose displacements are the changes of gravity along each axis, N.
    pub(crate) weight: [[T; DOF]; 3],
}

/// Reaction of a tool in one bin.
#[derive(Clone, Debug)]
pub(super) struct ToolReaction<V> {
    /// W, by columns: loads whose displacements are the force that the tool takes along each axis.
    loads: [Column<V>; 3],
    /// M: force that cuts per measured force, without the seam.
    amplification: Square<V>,
}

impl<V: Lanes> ToolReaction<V> {
    /// A reaction in no bin yet.
    #[inline(always)]
    pub(super) fn new(like: V) -> Self {
        let zero = Complex::zero(like);
        Self { loads: [[zero; DOF]; 3], amplification: [[zero; 3]; 3] }
    }

    /// Computes the reaction of `tool` at the displacements U.
    #[inline(always)]
    pub(super) fn evaluate(
        &mut self,
        tool: &ToolTerms<V::Scalar>,
        s2: Complex<V>,
        displacements: &[Column<V>; 3],
    ) {
        for axis in 0..3 {
            for i in 0..DOF {
                let (inertia, weight) =
                    (s2.re.fill(tool.inertia[axis][i]), s2.re.fill(tool.weight[axis][i]));
                self.loads[axis][i] = Complex::new(s2.re.mul_add(inertia, weight), s2.im * inertia);
            }
        }
        // I − Wᵀ U
        let mut remaining = products(&self.loads, displacements);
        let one = s2.re.fill(V::Scalar::from_f64(1.0));
        for row in 0..3 {
            for column in 0..3 {
                remaining[row][column] = -remaining[row][column];
            }
            remaining[row][row].re = remaining[row][row].re + one;
        }
        self.amplification = inverse(&remaining);
    }

    /// `G = G_c M`: observation per measured force, from the observation G_c per force that cuts.
    #[inline(always)]
    pub(super) fn per_measured_force(&self, per_cutting_force: &Square<V>) -> Square<V> {
        let (g, m) = (per_cutting_force, &self.amplification);
        let mut per_measured_force = *g;
        for row in 0..3 {
            for column in 0..3 {
                per_measured_force[row][column] = (g[row][0] * m[0][column])
                    .add_mul(g[row][1], m[1][column])
                    .add_mul(g[row][2], m[2][column]);
            }
        }
        per_measured_force
    }

    /// `r ← r + W Gᵀ`: adds the reaction to the loads of the observations. `displacements` are U.
    #[inline(always)]
    pub(super) fn add_to_observations(
        &self,
        displacements: &[Column<V>; 3],
        observations: &mut [Column<V>; 3],
    ) {
        let per_force = self.per_measured_force(&products(observations, displacements));
        for axis in 0..3 {
            for force in 0..3 {
                for i in 0..DOF {
                    let load = &mut observations[axis][i];
                    *load = load.add_mul(per_force[axis][force], self.loads[force][i]);
                }
            }
        }
    }

    /// `f ← f + P M Wᵀ Z⁻¹ f`: adds the force that the tool takes to the load of a record, which holds the measured force.
    /// `force_loads` is P.
    #[inline(always)]
    pub(super) fn add_to_load(
        &self,
        force_loads: &[[V::Scalar; DOF]; 3],
        tip: &Factor<V>,
        load: &mut Column<V>,
    ) {
        let like = load[0].re;
        let mut displacement = *load;
        tip.solve(&mut displacement);
        let mut taken = [Complex::zero(like); 3];
        for axis in 0..3 {
            for i in 0..DOF {
                taken[axis] = taken[axis].add_mul(self.loads[axis][i], displacement[i]);
            }
        }
        for axis in 0..3 {
            let mut force = Complex::zero(like);
            for other in 0..3 {
                force = force.add_mul(self.amplification[axis][other], taken[other]);
            }
            for i in 0..DOF {
                load[i] = load[i].add_mul_real(force, like.fill(force_loads[axis][i]));
            }
        }
    }
}

/// `U = Z⁻¹ P`: displacements of the last link due to unit forces along each axis.
#[inline(always)]
pub(super) fn tip_displacements<V: Lanes>(
    force_loads: &[[V::Scalar; DOF]; 3],
    tip: &Factor<V>,
    like: V,
) -> [Column<V>; 3] {
    let mut displacements = [[Complex::zero(like); DOF]; 3];
    for axis in 0..3 {
        for i in 0..DOF {
            displacements[axis][i].re = like.fill(force_loads[axis][i]);
        }
    }
    for column in &mut displacements {
        tip.solve(column);
    }
    displacements
}

/// `Aᵀ B` of matrices by columns.
#[inline(always)]
pub(super) fn products<V: Lanes>(a: &[Column<V>; 3], b: &[Column<V>; 3]) -> Square<V> {
    let mut products = [[Complex::zero(a[0][0].re); 3]; 3];
    for row in 0..3 {
        for column in 0..3 {
            products[row][column] = a[row][0] * b[column][0];
            for i in 1..DOF {
                products[row][column] = products[row][column].add_mul(a[row][i], b[column][i]);
            }
        }
    }
    products
}

/// Inverse by cofactors. Cyclic indices give the cofactors their signs.
#[inline(always)]
fn inverse<V: Lanes>(matrix: &Square<V>) -> Square<V> {
    let mut inverse = *matrix;
    for row in 0..3 {
        for column in 0..3 {
            let (a, b) = ((column + 1) % 3, (column + 2) % 3);
            let (c, d) = ((row + 1) % 3, (row + 2) % 3);
            inverse[row][column] =
                (matrix[a][c] * matrix[b][d]).sub_mul(matrix[a][d], matrix[b][c]);
        }
    }
    let determinant = (matrix[0][0] * inverse[0][0])
        .add_mul(matrix[0][1], inverse[1][0])
        .add_mul(matrix[0][2], inverse[2][0]);
    let reciprocal = determinant.reciprocal();
    for row in 0..3 {
        for column in 0..3 {
            inverse[row][column] = inverse[row][column] * reciprocal;
        }
    }
    inverse
}
