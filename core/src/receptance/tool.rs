//! A tool beyond the force sensor: what is measured is not all of what cuts.
//!
//! With W, what the inertia and the turning weight of the tool take from the force per displacement η of the last link, and
//! U = Z⁻¹ P, the displacements per unit force:
//!
//! ```text
//! F = F_m + Wᵀ η,   η = Z⁻¹ (P F + γ)      ⇒      F − F_m = M Wᵀ Z⁻¹ (P F_m + γ),   M = (I − Wᵀ U)⁻¹
//! ```
//!
//! A reading r thus sees `G = rᵀ U M` per measured force, and its adjoint is `Z⁻¹ (r + W Gᵀ)`. With this and the true
//! force all derivatives are what they are without a tool.

use super::complex::Complex;
use super::lanes::Lanes;
use super::recursion::Column;
use super::symmetric::Factor;
use crate::DOF;

/// A 3×3 matrix, row by row.
pub(super) type Square<V> = [[Complex<V>; 3]; 3];

/// What a tool takes from the force, per axis of the force sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ToolTerms<T> {
    /// Mass times the loads whose displacements are those of its centre, kg.
    pub(super) inertia: [[T; DOF]; 3],
    /// Mass times the loads whose displacements tell how gravity turns, N.
    pub(super) weight: [[T; DOF]; 3],
}

/// Adds to the loads of the three readings what they see of the tool's: from `r` to `r + W Gᵀ`.
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
                readings[axis][i] = readings[axis][i].plus(seen[axis][push], taken[push][i]);
            }
        }
    }
}

/// Adds to the load of a record, whose force is as measured, what of the force the tool has taken.
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
            known[axis] = known[axis].plus(taken[axis][i], displacement[i]);
        }
    }
    for axis in 0..3 {
        let mut hidden = zero;
        for other in 0..3 {
            hidden = hidden.plus(release[axis][other], known[other]);
        }
        for i in 0..DOF {
            load[i] = load[i].plus_real(hidden, s2.re.fill(pushes[axis][i]));
        }
    }
}

/// From reading per force that cuts to reading per force that is measured; `moved` of unit forces at the TCP.
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

/// Displacements of the last link by unit forces along each axis.
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
                seen[axis][push] = seen[axis][push].plus(readings[axis][i], moved[push][i]);
            }
        }
    }
}

/// W.
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

/// M.
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
    // By cofactors; with the indices in turn they have their signs.
    for row in 0..3 {
        for column in 0..3 {
            let (a, b) = ((column + 1) % 3, (column + 2) % 3);
            let (c, d) = ((row + 1) % 3, (row + 2) % 3);
            release[row][column] = (matrix[a][c] * matrix[b][d]).minus(matrix[a][d], matrix[b][c]);
        }
    }
    let determinant = (matrix[0][0] * release[0][0])
        .plus(matrix[0][1], release[1][0])
        .plus(matrix[0][2], release[2][0]);
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
                .plus(a[row][1], b[1][column])
                .plus(a[row][2], b[2][column]);
        }
    }
}
