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
use super::lanes::Lanes;
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
    if terms.gravity { recurse::<V, true>(terms, s) } else { recurse::<V, false>(terms, s) }
}

#[inline(always)]
fn recurse<V: Lanes, const GRAVITY: bool>(
    terms: &Terms<V::Scalar>,
    s: Complex<V>,
) -> [Complex<V>; 6] {
    let like = s.re;
    let s2 = s * s;
    let mut stiffness: Symmetric<V> = [Complex::zero(like); PACKED];
    let mut loads = [[Complex::zero(like); DOF]; 3];
    for (load, force) in loads.iter_mut().zip(&terms.force) {
        *load = real_column(like, force);
    }
    let mut receptance = [Complex::zero(like); 6];
    let mut passed = Passed::<V, GRAVITY>::new(like);
    for (index, joint) in terms.joints.iter().enumerate().rev() {
        passed.eliminate(joint, s, s2, &stiffness);
        // Halfway through the solution: L⁻¹ p, and D⁻¹ L⁻¹ p.
        let mut moved = loads;
        for (load, moved) in loads.iter_mut().zip(&mut moved) {
            passed.factor.forward(load, 0);
            *moved = *load;
            passed.factor.scale(moved);
        }
        for (packed, [a, b]) in LOWER.into_iter().enumerate() {
            for i in 0..DOF {
                receptance[packed] = receptance[packed].plus(loads[a][i], moved[b][i]);
            }
        }
        if index > 0 {
            passed.couple();
            passed.seen_from_before(joint, &mut stiffness);
            for (load, moved) in loads.iter_mut().zip(&moved) {
                *load = load_before(joint, &passed.handed_on(moved));
            }
        }
    }
    receptance
}

/// Rows and columns of a packed symmetric 3×3.
const LOWER: [[usize; 2]; 6] = [[0, 0], [1, 0], [1, 1], [2, 0], [2, 1], [2, 2]];

/// A joint whose link has been eliminated; one for all joints in turn, for it is large.
pub(super) struct Passed<V, const GRAVITY: bool> {
    /// Of Δ.
    pub(super) factor: Factor<V>,
    /// b − Cᵀ − C.
    own: Symmetric<V>,
    /// b.
    bushing: Column<V>,
    /// B, the columns of the turns; those of the slides are b's. Without gravity B = b.
    coupled: [Column<V>; 3],
    /// L⁻¹ B, by columns.
    pub(super) forward: [Column<V>; DOF],
}

impl<V: Lanes, const GRAVITY: bool> Passed<V, GRAVITY> {
    /// No joint yet.
    #[inline(always)]
    pub(super) fn new(like: V) -> Self {
        let zero = Complex::zero(like);
        Self {
            factor: Factor::zero(like),
            own: [zero; PACKED],
            bushing: [zero; DOF],
            coupled: [[zero; DOF]; 3],
            forward: [[zero; DOF]; DOF],
        }
    }

    /// Factorises the link's inertia, the bushing, and `stiffness`, what the links beyond oppose.
    #[inline(always)]
    pub(super) fn eliminate(
        &mut self,
        joint: &JointTerms<V::Scalar>,
        s: Complex<V>,
        s2: Complex<V>,
        stiffness: &Symmetric<V>,
    ) {
        let like = s.re;
        let delta = self.factor.matrix();
        for entry in 0..PACKED {
            delta[entry] = stiffness[entry].plus_real(s2, like.fill(joint.inertia[entry]));
        }
        for i in 0..DOF {
            let (stiffness, damping) = (like.fill(joint.stiffness[i]), like.fill(joint.damping[i]));
            self.bushing[i] = Complex::new(s.re.mul_add(damping, stiffness), s.im * damping);
            self.own[at(i, i)] = self.bushing[i];
            delta[at(i, i)] = delta[at(i, i)] + self.bushing[i];
        }
        if GRAVITY {
            self.gravitate(joint);
        }
        self.factor.factorise();
    }

    /// Gravity's share of Δ, B and b − Cᵀ − C.
    #[inline(always)]
    fn gravitate(&mut self, joint: &JointTerms<V::Scalar>) {
        let delta = self.factor.matrix();
        let like = delta[0].re;
        for entry in 0..PACKED {
            let diagonal = (0..DOF).any(|i| at(i, i) == entry);
            if !diagonal {
                self.own[entry] = Complex::zero(like);
            }
        }
        for j in 0..3 {
            self.coupled[j] = [Complex::zero(like); DOF];
            self.coupled[j][3 + j] = self.bushing[3 + j];
            for i in 0..3 {
                let turns = like.fill(joint.gravity_turns[i][j]);
                if j <= i {
                    let entry = at(3 + i, 3 + j);
                    delta[entry].re = delta[entry].re + turns;
                    self.own[entry].re = self.own[entry].re + turns;
                }
                self.coupled[j][3 + i].re = self.coupled[j][3 + i].re + turns;
            }
            for i in 0..DOF {
                let coupling = like.fill(joint.gravity_coupling[i][j]);
                let entry = &mut self.own[at(i, 3 + j)].re;
                // The symmetric sum C + Cᵀ has each off-diagonal entry of the turns twice.
                *entry = *entry - if i == 3 + j { coupling + coupling } else { coupling };
                self.coupled[j][i].re = self.coupled[j][i].re - coupling;
            }
        }
    }

    /// First row of a column of B that is not zero.
    #[inline(always)]
    const fn first(column: usize) -> usize {
        if GRAVITY && column >= 3 { 0 } else { column }
    }

    /// `L⁻¹ B`.
    #[inline(always)]
    pub(super) fn couple(&mut self) {
        for j in 0..DOF {
            if GRAVITY && j >= 3 {
                self.forward[j] = self.coupled[j - 3];
            } else {
                let zero = Complex::zero(self.bushing[j].re);
                self.forward[j][j] = self.bushing[j];
                self.forward[j][j + 1..].fill(zero);
            }
            self.factor.forward(&mut self.forward[j], Self::first(j));
        }
    }

    /// `Xᵀ (b − Cᵀ − C − Bᵀ Δ⁻¹ B) X`: the dynamic stiffness at the link before.
    #[inline(always)]
    pub(super) fn seen_from_before(&self, joint: &JointTerms<V::Scalar>, seen: &mut Symmetric<V>) {
        *seen = self.own;
        for k in 0..DOF {
            let reciprocal = self.factor.reciprocal(k);
            for i in 0..DOF {
                if k < Self::first(i) {
                    continue;
                }
                let scaled = self.forward[i][k] * reciprocal;
                for j in 0..=i {
                    if k >= Self::first(j) {
                        seen[at(i, j)] = seen[at(i, j)].minus(scaled, self.forward[j][k]);
                    }
                }
            }
        }
        congruence(joint, seen);
    }

    /// `(L⁻¹ B)ᵀ v`: what the bushing hands on to the link before, of a load with `v = D⁻¹ L⁻¹ p`.
    #[inline(always)]
    pub(super) fn handed_on(&self, v: &Column<V>) -> Column<V> {
        let mut handed_on = [Complex::zero(v[0].re); DOF];
        for i in 0..DOF {
            let mut sum = handed_on[i];
            for k in Self::first(i)..DOF {
                sum = sum.plus(self.forward[i][k], v[k]);
            }
            handed_on[i] = sum;
        }
        handed_on
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

/// `M ← Xᵀ M X`.
#[inline(always)]
fn congruence<V: Lanes>(joint: &JointTerms<V::Scalar>, m: &mut Symmetric<V>) {
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
    *m = [zero; PACKED];
    for k in 0..3 {
        for i in 0..3 {
            let (rotate, lever, turn) = (
                like.fill(joint.rotate[k][i]),
                like.fill(joint.lever[k][i]),
                like.fill(joint.turn[k][i]),
            );
            for j in 0..3 {
                if j <= i {
                    m[at(i, j)] = m[at(i, j)].plus_real(tt[k][j], rotate);
                    m[at(3 + i, 3 + j)] =
                        m[at(3 + i, 3 + j)].plus_real(tr[k][j], lever).plus_real(rr[k][j], turn);
                }
                m[at(3 + j, i)] = m[at(3 + j, i)].plus_real(tr[k][j], rotate);
            }
        }
    }
}

/// A real load in every lane.
#[inline(always)]
pub(super) fn real_column<V: Lanes>(like: V, load: &[V::Scalar; DOF]) -> Column<V> {
    let mut column = [Complex::zero(like); DOF];
    for i in 0..DOF {
        column[i].re = like.fill(load[i]);
    }
    column
}
