//! Articulated-body recursion on the dynamic stiffness, tip to base: the receptance in O(J).
//!
//! `Z` is the dynamic stiffness that link j and all beyond it oppose to a displacement of link j. A joint
//! is passed by eliminating that displacement η against the bushing, whose elongation is e = η − x:
//!
//! ```text
//! Δ = Z + b       Δ η = p + B x       b = diag(k + s d) + Γ       B = b − Cᵀ
//! Z ← Xᵀ (b − Cᵀ − C − Bᵀ Δ⁻¹ B) X        p ← Xᵀ Bᵀ Δ⁻¹ p         H ← H + pᵀ Δ⁻¹ p
//! ```
//!
//! Everything is complex symmetric: transposed, never conjugated. Γ and C are gravity's
//! ([`crate::chain::linearise`]); without it B = b is diagonal.

use super::complex::Complex;
use super::lanes::{Lanes, Scalar};
use super::symmetric::{Factor, PACKED, Symmetric, at};
use super::terms::{JointTerms, Terms};
use crate::DOF;

/// A load or a displacement of one link.
pub(super) type Column<V> = [Complex<V>; DOF];

/// Receptance at one complex frequency per lane, TCP axes, m/N, packed as `xx yx yy zx zy zz`.
///
/// `s` is `iω`, or `α + iω`, rad/s.
#[inline(always)]
pub fn receptance<V: Lanes>(terms: &Terms<V::Scalar>, s: Complex<V>) -> [Complex<V>; 6] {
    let like = s.re;
    let s2 = s * s;
    let mut stiffness: Symmetric<V> = [Complex::zero(like); PACKED];
    let mut loads: [Column<V>; 3] = terms.force.map(|load| real_column(like, &load));
    let mut receptance = [Complex::zero(like); 6];
    for (index, joint) in terms.joints.iter().enumerate().rev() {
        let passed = Passed::new(joint, terms.gravity, s, s2, &mut stiffness);
        let mut moved = loads;
        for column in &mut moved {
            passed.factor.solve(column);
        }
        let mut packed = 0;
        for a in 0..3 {
            for b in 0..=a {
                for i in 0..DOF {
                    receptance[packed] = receptance[packed].plus(loads[a][i], moved[b][i]);
                }
                packed += 1;
            }
        }
        if index > 0 {
            stiffness = passed.seen_from_before(joint, &stiffness);
            for (load, moved) in loads.iter_mut().zip(&moved) {
                *load = load_before(joint, &passed.reaction(moved));
            }
        }
    }
    receptance
}

/// A joint whose link has been eliminated.
pub(super) struct Passed<V> {
    /// Of Δ.
    pub(super) factor: Factor<V>,
    /// B, by columns.
    coupled: [Column<V>; DOF],
    /// L⁻¹ B, by columns.
    pub(super) forward: [Column<V>; DOF],
    gravity: bool,
}

impl<V: Lanes> Passed<V> {
    /// Adds the link's inertia to `stiffness` and factorises it with the bushing; `stiffness` becomes
    /// `b − Cᵀ − C`, what [`Passed::seen_from_before`] starts from.
    #[inline(always)]
    pub(super) fn new(
        joint: &JointTerms<V::Scalar>,
        gravity: bool,
        s: Complex<V>,
        s2: Complex<V>,
        stiffness: &mut Symmetric<V>,
    ) -> Self {
        let like = s.re;
        let zero = Complex::zero(like);
        let bushing: Column<V> = core::array::from_fn(|i| {
            let damping = s.scale(like.fill(joint.damping[i]));
            Complex::new(like.fill(joint.stiffness[i]) + damping.re, damping.im)
        });
        let mut own = [zero; PACKED];
        let mut coupled = [[zero; DOF]; DOF];
        for i in 0..DOF {
            own[at(i, i)] = bushing[i];
            coupled[i][i] = bushing[i];
        }
        if gravity {
            for i in 0..3 {
                for j in 0..3 {
                    let turns = like.fill(joint.gravity_turns[i][j]);
                    if j <= i {
                        own[at(3 + i, 3 + j)].re = own[at(3 + i, 3 + j)].re + turns;
                    }
                    coupled[3 + j][3 + i].re = coupled[3 + j][3 + i].re + turns;
                }
            }
        }
        let mut delta = own;
        for entry in 0..PACKED {
            let inertia = s2.scale(like.fill(joint.inertia[entry]));
            delta[entry] = own[entry] + stiffness[entry] + inertia;
        }
        if gravity {
            for i in 0..DOF {
                for j in 0..3 {
                    let coupling = like.fill(joint.gravity_coupling[i][j]);
                    let entry = &mut own[at(i, 3 + j)].re;
                    // The symmetric sum C + Cᵀ has each off-diagonal entry of the turns twice.
                    *entry = *entry - if i == 3 + j { coupling + coupling } else { coupling };
                    coupled[3 + j][i].re = coupled[3 + j][i].re - coupling;
                }
            }
        }
        *stiffness = own;
        let factor = Factor::new(&delta);
        let mut forward = coupled;
        for (j, column) in forward.iter_mut().enumerate() {
            factor.forward(column, if gravity { 0 } else { j });
        }
        Self { factor, coupled, forward, gravity }
    }

    /// `Xᵀ (own − Bᵀ Δ⁻¹ B) X`: the dynamic stiffness at the link before.
    #[inline(always)]
    pub(super) fn seen_from_before(
        &self,
        joint: &JointTerms<V::Scalar>,
        own: &Symmetric<V>,
    ) -> Symmetric<V> {
        let mut seen = *own;
        let mut scaled = self.forward;
        for (j, column) in scaled.iter_mut().enumerate() {
            for k in if self.gravity { 0 } else { j }..DOF {
                column[k] = column[k] * self.factor.reciprocal(k);
            }
        }
        for i in 0..DOF {
            for j in 0..=i {
                for k in if self.gravity { 0 } else { i }..DOF {
                    seen[at(i, j)] = seen[at(i, j)].minus(self.forward[i][k], scaled[j][k]);
                }
            }
        }
        congruence(joint, &seen)
    }

    /// `Bᵀ u`: what the bushing hands on to the link before.
    #[inline(always)]
    pub(super) fn reaction(&self, moved: &Column<V>) -> Column<V> {
        core::array::from_fn(|i| {
            let own = self.coupled[i][i] * moved[i];
            if !self.gravity || i < 3 {
                return own;
            }
            (0..DOF).filter(|&k| k != i).fold(own, |sum, k| sum.plus(self.coupled[i][k], moved[k]))
        })
    }
}

/// `Xᵀ f`: a load on this link as the link before feels it.
#[inline(always)]
pub(super) fn load_before<V: Lanes>(joint: &JointTerms<V::Scalar>, load: &Column<V>) -> Column<V> {
    let like = load[0].re;
    let mut before = [Complex::zero(like); DOF];
    for i in 0..3 {
        for k in 0..3 {
            before[i] = before[i].plus_real(load[k], like.fill(joint.rotate[k][i]));
            before[3 + i] = before[3 + i]
                .plus_real(load[k], like.fill(joint.lever[k][i]))
                .plus_real(load[3 + k], like.fill(joint.turn[k][i]));
        }
    }
    before
}

/// `X y`: a displacement of the link before, as it carries this joint along.
#[inline(always)]
pub(super) fn carried<V: Lanes>(joint: &JointTerms<V::Scalar>, before: &Column<V>) -> Column<V> {
    let like = before[0].re;
    let mut carried = [Complex::zero(like); DOF];
    for i in 0..3 {
        for k in 0..3 {
            carried[i] = carried[i]
                .plus_real(before[k], like.fill(joint.rotate[i][k]))
                .plus_real(before[3 + k], like.fill(joint.lever[i][k]));
            carried[3 + i] = carried[3 + i].plus_real(before[3 + k], like.fill(joint.turn[i][k]));
        }
    }
    carried
}

/// `Xᵀ M X`.
#[inline(always)]
fn congruence<V: Lanes>(joint: &JointTerms<V::Scalar>, m: &Symmetric<V>) -> Symmetric<V> {
    let like = m[0].re;
    let zero = Complex::zero(like);
    // M X by its blocks: translation rows times both columns, turn rows times the turn column.
    let (mut tt, mut tr, mut rr) = ([[zero; 3]; 3], [[zero; 3]; 3], [[zero; 3]; 3]);
    for k in 0..3 {
        for j in 0..3 {
            let (rotate, lever, turn) = (
                like.fill(joint.rotate[k][j]),
                like.fill(joint.lever[k][j]),
                like.fill(joint.turn[k][j]),
            );
            for i in 0..3 {
                tt[i][j] = tt[i][j].plus_real(m[at(i, k)], rotate);
                tr[i][j] = tr[i][j].plus_real(m[at(i, k)], lever).plus_real(m[at(i, 3 + k)], turn);
                rr[i][j] =
                    rr[i][j].plus_real(m[at(3 + i, k)], lever).plus_real(m[at(3 + i, 3 + k)], turn);
            }
        }
    }
    let mut result = [zero; PACKED];
    for k in 0..3 {
        for i in 0..3 {
            let (rotate, lever, turn) = (
                like.fill(joint.rotate[k][i]),
                like.fill(joint.lever[k][i]),
                like.fill(joint.turn[k][i]),
            );
            for j in 0..3 {
                if j <= i {
                    result[at(i, j)] = result[at(i, j)].plus_real(tt[k][j], rotate);
                    result[at(3 + i, 3 + j)] = result[at(3 + i, 3 + j)]
                        .plus_real(tr[k][j], lever)
                        .plus_real(rr[k][j], turn);
                }
                result[at(3 + j, i)] = result[at(3 + j, i)].plus_real(tr[k][j], rotate);
            }
        }
    }
    result
}

/// A real load in every lane.
#[inline(always)]
pub(super) fn real_column<V: Lanes>(like: V, load: &[V::Scalar; DOF]) -> Column<V> {
    let zero = like.fill(V::Scalar::from_f64(0.0));
    load.map(|value| Complex::new(like.fill(value), zero))
}
