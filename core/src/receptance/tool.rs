//! A tool beyond the force sensor: the measured force is not the whole force that cuts.
//!
//! `Wᵀ η` is the force that the inertia and the turning weight of the tool take at a displacement η of the last link.
//! `U = Z⁻¹ P` are the displacements per unit force:
//!
//! ```text
//! F = F_m + Wᵀ η,   η = Z⁻¹ (P F + γ)      ⇒      F − F_m = M Wᵀ Z⁻¹ (P F_m + γ),   M = (I − Wᵀ U)⁻¹
//! ```
//!
//! The reading r per measured force is therefore `G = rᵀ U M`, and its adjoint is `Z⁻¹ (r + W Gᵀ)`. With this adjoint and the
//! force that cuts, all derivatives have the same form as without a tool.

use super::complex::{Column, Complex};
use super::lanes::Lanes;
use super::symmetric::Factor;
use crate::DOF;

/// A 3×3 matrix, row by row.
pub(super) type Square<V> = [[Complex<V>; 3]; 3];

/// Part of the force that a tool takes, per axis of the force sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ToolTerms<T> {
    /// Mass of the tool times the loads whose displacements are those of its centre of mass, kg.
    pub(super) inertia: [[T; DOF]; 3],
    /// Mass of the tool times the loads whose displacements are the changes of gravity along each axis, N.
    pub(super) weight: [[T; DOF]; 3],
}

/// `r ← r + W Gᵀ` for the loads of the three readings: adds the part that the tool contributes.
#[inline(always)]
pub(super) fn look_beyond<V: Lanes>(
    tool: &ToolTerms<V::Scalar>,
    pushes: &[[V::Scalar; DOF]; 3],
    tip: &Factor<V>,
    s2: Complex<V>,
    readings: &mut [Column<V>; 3],
) {
    let zero = Complex::zero(s2.re);
    let mut moved = [[zero; DOF]; 3];
    move_by(pushes, tip, &mut moved);
    let mut taken = [[zero; DOF]; 3];
    take(tool, s2, &mut taken);
    let mut seen = [[zero; 3]; 3];
    see(readings, &moved, &mut seen);
    per_measured(tool, s2, &moved, &mut seen);
    for axis in 0..3 {
        for push in 0..3 {
            for i in 0..DOF {
                readings[axis][i] = readings[axis][i].add_mul(seen[axis][push], taken[push][i]);
            }
        }
    }
}

/// Adds the force that the tool has taken to the load of a record, which holds the measured force.
#[inline(always)]
pub(super) fn give_back<V: Lanes>(
    tool: &ToolTerms<V::Scalar>,
    pushes: &[[V::Scalar; DOF]; 3],
    tip: &Factor<V>,
    s2: Complex<V>,
    load: &mut Column<V>,
) {
    let zero = Complex::zero(s2.re);
    let mut moved = [[zero; DOF]; 3];
    move_by(pushes, tip, &mut moved);
    let mut taken = [[zero; DOF]; 3];
    take(tool, s2, &mut taken);
    let mut release = [[zero; 3]; 3];
    released(&taken, &moved, &mut release);
    let mut displacement = *load;
    tip.solve(&mut displacement);
    let mut known = [zero; 3];
    for axis in 0..3 {
        for i in 0..DOF {
            known[axis] = known[axis].add_mul(taken[axis][i], displacement[i]);
        }
    }
    for axis in 0..3 {
        let mut hidden = zero;
        for other in 0..3 {
            hidden = hidden.add_mul(release[axis][other], known[other]);
        }
        for i in 0..DOF {
            load[i] = load[i].add_mul_real(hidden, s2.re.fill(pushes[axis][i]));
        }
    }
}

/// `G ← G M`: turns readings per force that cuts into readings per measured force. `moved` are the displacements due to unit
/// forces at the TCP.
#[inline(always)]
pub(super) fn per_measured<V: Lanes>(
    tool: &ToolTerms<V::Scalar>,
    s2: Complex<V>,
    moved: &[Column<V>; 3],
    seen: &mut Square<V>,
) {
    let zero = Complex::zero(s2.re);
    let mut taken = [[zero; DOF]; 3];
    take(tool, s2, &mut taken);
    let mut release = [[zero; 3]; 3];
    released(&taken, moved, &mut release);
    let ideal = *seen;
    multiply(&ideal, &release, seen);
}

/// Displacements of the last link due to unit forces along each axis.
#[inline(always)]
pub(super) fn move_by<V: Lanes>(
    pushes: &[[V::Scalar; DOF]; 3],
    tip: &Factor<V>,
    moved: &mut [Column<V>; 3],
) {
    for axis in 0..3 {
        for i in 0..DOF {
            moved[axis][i].re = moved[axis][i].re.fill(pushes[axis][i]);
        }
    }
    for column in moved {
        tip.solve(column);
    }
}

/// `seen[a][b] = readings[a] · moved[b]`.
#[inline(always)]
pub(super) fn see<V: Lanes>(
    readings: &[Column<V>; 3],
    moved: &[Column<V>; 3],
    seen: &mut Square<V>,
) {
    for axis in 0..3 {
        for push in 0..3 {
            seen[axis][push] = readings[axis][0] * moved[push][0];
            for i in 1..DOF {
                seen[axis][push] = seen[axis][push].add_mul(readings[axis][i], moved[push][i]);
            }
        }
    }
}

/// Computes W.
#[inline(always)]
fn take<V: Lanes>(tool: &ToolTerms<V::Scalar>, s2: Complex<V>, taken: &mut [Column<V>; 3]) {
    for axis in 0..3 {
        for i in 0..DOF {
            let (inertia, weight) =
                (s2.re.fill(tool.inertia[axis][i]), s2.re.fill(tool.weight[axis][i]));
            taken[axis][i] = Complex::new(s2.re.mul_add(inertia, weight), s2.im * inertia);
        }
    }
}

/// Computes M.
#[inline(always)]
fn released<V: Lanes>(taken: &[Column<V>; 3], moved: &[Column<V>; 3], release: &mut Square<V>) {
    see(taken, moved, release);
    let one = release[0][0].re.fill(<V::Scalar as super::lanes::Scalar>::from_f64(1.0));
    let mut matrix = *release;
    for row in 0..3 {
        for column in 0..3 {
            matrix[row][column] = -matrix[row][column];
        }
        matrix[row][row].re = matrix[row][row].re + one;
    }
    // The inverse by cofactors. Cyclic indices give the cofactors their signs.
    for row in 0..3 {
        for column in 0..3 {
            let (a, b) = ((column + 1) % 3, (column + 2) % 3);
            let (c, d) = ((row + 1) % 3, (row + 2) % 3);
            release[row][column] =
                (matrix[a][c] * matrix[b][d]).sub_mul(matrix[a][d], matrix[b][c]);
        }
    }
    let determinant = (matrix[0][0] * release[0][0])
        .add_mul(matrix[0][1], release[1][0])
        .add_mul(matrix[0][2], release[2][0]);
    let inverse = determinant.reciprocal();
    for row in 0..3 {
        for column in 0..3 {
            release[row][column] = release[row][column] * inverse;
        }
    }
}

#[inline(always)]
fn multiply<V: Lanes>(a: &Square<V>, b: &Square<V>, product: &mut Square<V>) {
    for row in 0..3 {
        for column in 0..3 {
            product[row][column] = (a[row][0] * b[0][column])
                .add_mul(a[row][1], b[1][column])
                .add_mul(a[row][2], b[2][column]);
        }
    }
}
