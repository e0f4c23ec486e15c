//! The measured acceleration of one record and its exact derivatives, by the recursion's way back.
//!
//! With the elongations e_out of a unit load along each measured direction, and q those of the record itself
//! (its force and its seam), reciprocity gives every derivative as a product of two elongations:
//!
//! ```text
//! ∂A_a/∂ln k_i = −k_i e_out,ia q_i       ∂A_a/∂ln d_i = −s d_i e_out,ia q_i       ∂A_a/∂γ_i = e_out,ia
//! ```

use super::complex::Complex;
use super::lanes::{Lanes, Scalar};
use super::recursion::{Column, Passed, carried, load_before, real_column};
use super::symmetric::{PACKED, Symmetric};
use super::terms::Terms;
use crate::{DOF, MAX_JOINTS};

/// One value per degree of freedom, joint by joint.
pub type PerDof<V> = [[Complex<V>; DOF]; MAX_JOINTS];

/// What one bin of a record says, one bin per lane.
#[derive(Clone, Copy, Debug)]
pub struct Response<V> {
    /// What the accelerometer would read, without c₀ and c₁, TCP axes, m/s² (times seconds).
    pub acceleration: [Complex<V>; 3],
    /// Accelerance: reading along `[row]` per force along `[column]`, TCP axes, m/s²/N.
    pub accelerance: [[Complex<V>; 3]; 3],
    /// e_out: reading along `[axis]` per unit load on the bushing of joint `[j]`, DOF `[i]`.
    pub per_load: [PerDof<V>; 3],
    /// q: elongations in this record, m and rad (times seconds).
    pub elongation: PerDof<V>,
}

/// Response at complex frequency `s` (rad/s) to the record's `force` (TCP axes, N) and `seam`, the load on every
/// bushing that mends the record's end: `γ = g + h/s`, N and Nm (both times seconds, as spectra are).
#[inline(always)]
pub fn response<V: Lanes>(
    terms: &Terms<V::Scalar>,
    s: Complex<V>,
    force: &[Complex<V>; 3],
    seam: &PerDof<V>,
) -> Response<V> {
    if terms.gravity {
        respond::<V, true>(terms, s, force, seam)
    } else {
        respond::<V, false>(terms, s, force, seam)
    }
}

#[inline(always)]
fn respond<V: Lanes, const GRAVITY: bool>(
    terms: &Terms<V::Scalar>,
    s: Complex<V>,
    force: &[Complex<V>; 3],
    seam: &PerDof<V>,
) -> Response<V> {
    let like = s.re;
    let zero = Complex::zero(like);
    let s2 = s * s;
    let joints = &terms.joints;
    let loads_count = if terms.strapdown { 6 } else { 3 };

    // Tip to base. Loads: three unit forces, three tilts (strapdown only), last the seam.
    let mut stiffness: Symmetric<V> = [zero; PACKED];
    let mut loads = [[zero; DOF]; 7];
    for axis in 0..3 {
        loads[axis] = real_column(like, &terms.force[axis]);
        loads[3 + axis] = real_column(like, &terms.tilt[axis]);
    }
    // Of each joint: Δ⁻¹ B by columns, and the displacements of the three readings and of the record.
    let mut gain = [[[zero; DOF]; DOF]; MAX_JOINTS];
    let mut moved = [[[zero; DOF]; 4]; MAX_JOINTS];
    let mut passed = Passed::<V, GRAVITY>::new(like);
    for (index, joint) in joints.iter().enumerate().rev() {
        passed.eliminate(joint, s, s2, &stiffness);
        passed.couple();
        for i in 0..DOF {
            loads[6][i] = loads[6][i] + seam[index][i];
        }
        let mut solved = loads;
        for (column, load) in loads.iter_mut().enumerate() {
            if column < loads_count || column == 6 {
                let solved = &mut solved[column];
                passed.factor.forward(solved, 0);
                passed.factor.scale(solved);
                if index > 0 {
                    let mut handed_on = passed.handed_on(solved);
                    if column == 6 {
                        for i in 0..DOF {
                            handed_on[i] = handed_on[i] - seam[index][i];
                        }
                    }
                    *load = load_before(joint, &handed_on);
                }
                passed.factor.backward(solved);
            }
        }
        moved[index] = combine(&solved, s2, force, terms.strapdown);
        gain[index] = passed.forward;
        for column in &mut gain[index] {
            passed.factor.scale(column);
            passed.factor.backward(column);
        }
        if index > 0 {
            passed.seen_from_before(joint, &mut stiffness);
        }
    }

    // Base to tip.
    let mut per_load = [[[zero; DOF]; MAX_JOINTS]; 3];
    let mut elongation = [[zero; DOF]; MAX_JOINTS];
    let mut before = [[zero; DOF]; 4];
    for (index, joint) in joints.iter().enumerate() {
        for (column, before) in before.iter_mut().enumerate() {
            let carried = carried(joint, before);
            let mut displacement: Column<V> = moved[index][column];
            for (gain, &x) in gain[index].iter().zip(&carried) {
                for (displacement, &gain) in displacement.iter_mut().zip(gain) {
                    *displacement = displacement.plus(gain, x);
                }
            }
            let stretched: Column<V> = core::array::from_fn(|i| displacement[i] - carried[i]);
            match per_load.get_mut(column) {
                Some(reading) => reading[index] = stretched,
                None => elongation[index] = stretched,
            }
            *before = displacement;
        }
    }

    // At the tip: the readings' own displacements give the accelerance, the record's its acceleration.
    let along = |load: &[V::Scalar; DOF], displacement: &Column<V>| {
        (0..DOF).fold(zero, |sum, i| sum.plus_real(displacement[i], like.fill(load[i])))
    };
    let accelerance = core::array::from_fn(|reading| {
        core::array::from_fn(|axis| along(&terms.force[axis], &before[reading]))
    });
    let acceleration = core::array::from_fn(|axis| {
        let reading = along(&terms.force[axis], &before[3]) * s2;
        if terms.strapdown { reading + along(&terms.tilt[axis], &before[3]) } else { reading }
    });
    Response { acceleration, accelerance, per_load, elongation }
}

/// The three readings' loads (`s²` force + tilt) and the record's (force·F + seam), from the seven.
#[inline(always)]
fn combine<V: Lanes>(
    solved: &[Column<V>; 7],
    s2: Complex<V>,
    force: &[Complex<V>; 3],
    strapdown: bool,
) -> [Column<V>; 4] {
    core::array::from_fn(|column| {
        core::array::from_fn(|i| {
            if column == 3 {
                (0..3).fold(solved[6][i], |sum, axis| sum.plus(solved[axis][i], force[axis]))
            } else if strapdown {
                solved[3 + column][i].plus(solved[column][i], s2)
            } else {
                solved[column][i] * s2
            }
        })
    })
}

impl<V: Lanes> Response<V> {
    /// `∂A/∂ln k` and `∂A/∂ln d` of joint `joint`, DOF `dof`, along `axis`.
    #[inline(always)]
    pub fn derivatives(
        &self,
        terms: &Terms<V::Scalar>,
        s: Complex<V>,
        joint: usize,
        dof: usize,
        axis: usize,
    ) -> [Complex<V>; 2] {
        let product = self.per_load[axis][joint][dof] * self.elongation[joint][dof];
        let minus = |value: V::Scalar| s.re.fill(V::Scalar::from_f64(-value.to_f64()));
        let joint = &terms.joints[joint];
        [product.scale(minus(joint.stiffness[dof])), (product * s).scale(minus(joint.damping[dof]))]
    }
}
