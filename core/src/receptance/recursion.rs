//! Articulated-body recursion on the dynamic stiffness, base to tip: the receptance in O(J).
//!
//! `Z` is the dynamic stiffness of link j and all before it against the displacement η of link j. The recursion passes the
//! next bushing by eliminating x, the displacement by which the link before carries this bushing. Y, the inverse of
//! [`FromParent`](crate::chain::from_parent::FromParent), transforms x to the link before:
//!
//! ```text
//! Z̃ = Yᵀ Z Y       Δ = Z̃ + b − C − Cᵀ       Δ x = Bᵀ η       b = diag(k + s d) + Γ       B = b − Cᵀ
//! Z ← b − B Δ⁻¹ Bᵀ + s² I                                       at the tip:   H = pᵀ Z⁻¹ p
//! ```
//!
//! All matrices are complex symmetric: they are transposed, never conjugated. Γ and C are the terms of gravity
//! ([`crate::chain::linearise`]); without gravity B = b is diagonal. Textbooks recurse from tip to base. In that order the
//! recursion would also pass the loads of three forces from joint to joint, which is half as much work again, and single
//! precision would lose half a digit more.

use seq_macro::seq;

use super::complex::{Column, Complex};
use super::lanes::Lanes;
use super::symmetric::{Factor, Symmetric, at};
use super::terms::{JointTerms, Terms};
use crate::DOF;

/// Receptance at one complex frequency per lane, TCP axes, m/N, packed as `xx yx yy zx zy zz`.
///
/// `s` is `iω`, or `α + iω`, rad/s.
#[inline(always)]
pub fn receptance<V: Lanes>(terms: &Terms<V::Scalar>, s: Complex<V>) -> [Complex<V>; 6] {
    let like = s.re;
    let tip = tip_stiffness(terms, s);
    // `loads` becomes L⁻¹ p, and `moved` becomes D⁻¹ L⁻¹ p.
    let mut loads = [[Complex::zero(like); DOF]; 3];
    for axis in 0..3 {
        for i in 0..DOF {
            loads[axis][i].re = like.fill(terms.force[axis][i]);
        }
    }
    tip.forward(&mut loads);
    let mut moved = loads;
    tip.scale(&mut moved);
    let mut receptance = [Complex::zero(like); 6];
    seq!(PACKED in 0..6 {
        let [a, b] = LOWER[PACKED];
        for i in 0..DOF {
            receptance[PACKED] = receptance[PACKED].add_mul(loads[a][i], moved[b][i]);
        }
    });
    receptance
}

/// Row and column of each entry of a packed symmetric 3×3 matrix.
const LOWER: [[usize; 2]; 6] = [[0, 0], [1, 0], [1, 1], [2, 0], [2, 1], [2, 2]];

/// Dynamic stiffness of the last link, factorised.
#[inline(always)]
pub(super) fn tip_stiffness<V: Lanes>(terms: &Terms<V::Scalar>, s: Complex<V>) -> Factor<V> {
    if terms.gravity { reach::<V, true>(terms, s) } else { reach::<V, false>(terms, s) }
}

#[inline(always)]
fn reach<V: Lanes, const GRAVITY: bool>(terms: &Terms<V::Scalar>, s: Complex<V>) -> Factor<V> {
    let s2 = s * s;
    let mut tip = Factor::zero(s.re);
    let mut passage = Passage::new(s.re);
    for (index, joint) in terms.joints.iter().enumerate() {
        if index > 0 {
            passage.pass::<GRAVITY>(joint, s, s2, tip.matrix());
        } else {
            hold::<V, GRAVITY>(joint, s, s2, tip.matrix());
        }
    }
    tip.factorise();
    tip
}

/// Elimination of a bushing between two links.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passage<V> {
    /// Factor of Δ.
    factor: Factor<V>,
    /// `L⁻¹ Bᵀ`, by columns.
    forward: [Column<V>; DOF],
}

impl<V: Lanes> Passage<V> {
    /// An elimination of no bushing yet.
    #[inline(always)]
    pub(super) fn new(like: V) -> Self {
        let zero = Complex::zero(like);
        Self { factor: Factor::zero(like), forward: [[zero; DOF]; DOF] }
    }

    /// `Z ← b − B Δ⁻¹ Bᵀ + s² I`: replaces the stiffness of the link before by that of the link beyond.
    #[inline(always)]
    pub(super) fn pass<const GRAVITY: bool>(
        &mut self,
        joint: &JointTerms<V::Scalar>,
        s: Complex<V>,
        s2: Complex<V>,
        stiffness: &mut Symmetric<V>,
    ) {
        let bushing = bushing(joint, s);
        let delta = self.factor.matrix();
        joint.to_parent.stiffness(stiffness, delta);
        for i in 0..DOF {
            delta[at(i, i)] = delta[at(i, i)] + bushing[i];
        }
        if GRAVITY {
            gravitate(joint, delta);
            couple(joint, delta);
        }
        self.factor.factorise();
        self.couple::<GRAVITY>(joint, &bushing);
        seq!(I in 0..6 {
            let mut scaled = [Complex::zero(s.re); DOF];
            for k in first::<GRAVITY>(I)..DOF {
                scaled[k] = self.forward[I][k] * self.factor.reciprocal(k);
            }
            for j in 0..=I {
                let mut entry = Complex::zero(s.re);
                for k in first::<GRAVITY>(I)..DOF {
                    entry = entry.sub_mul(scaled[k], self.forward[j][k]);
                }
                stiffness[at(I, j)] = entry.add_mul_real(s2, s.re.fill(joint.inertia[at(I, j)]));
            }
            stiffness[at(I, I)] = stiffness[at(I, I)] + bushing[I];
        });
        if GRAVITY {
            gravitate(joint, stiffness);
        }
    }

    /// Computes `L⁻¹ Bᵀ`.
    #[inline(always)]
    fn couple<const GRAVITY: bool>(&mut self, joint: &JointTerms<V::Scalar>, bushing: &Column<V>) {
        let like = bushing[0].re;
        seq!(K in 0..6 {
            for i in first::<GRAVITY>(K)..DOF {
                let mut entry = if i == K { bushing[K] } else { Complex::zero(like) };
                if GRAVITY && i >= 3 {
                    entry.re = entry.re - like.fill(joint.gravity_coupling[K][i - 3]);
                    if K >= 3 {
                        entry.re = entry.re + like.fill(joint.gravity_turns[K - 3][i - 3]);
                    }
                }
                for j in first::<GRAVITY>(K)..i {
                    entry = entry.sub_mul(self.factor.below(i, j), self.forward[K][j]);
                }
                self.forward[K][i] = entry;
            }
        });
    }

    /// `f ← D⁻¹ L⁻¹ f` for a load f on x.
    #[inline(always)]
    pub(super) fn halfway(&self, load: &mut Column<V>) {
        let columns = core::array::from_mut(load);
        self.factor.forward(columns);
        self.factor.scale(columns);
    }

    /// `f ← f + B Δ⁻¹ g`: adds the part of a load g on x that the bushing transmits. `halfway` is g after
    /// [`Passage::halfway`].
    #[inline(always)]
    pub(super) fn pass_load<const GRAVITY: bool>(&self, halfway: &Column<V>, load: &mut Column<V>) {
        seq!(I in 0..6 {
            for k in first::<GRAVITY>(I)..DOF {
                load[I] = load[I].add_mul(self.forward[I][k], halfway[k]);
            }
        });
    }

    /// `x = Δ⁻¹ (Bᵀ η + f)` for a displacement η and a load f. `halfway` is f after [`Passage::halfway`].
    #[inline(always)]
    pub(super) fn displace<const GRAVITY: bool>(
        &self,
        displacement: &Column<V>,
        halfway: Option<&Column<V>>,
        carried: &mut Column<V>,
    ) {
        seq!(I in 0..6 {
            let mut sum = self.forward[0][I] * displacement[0];
            for k in 1..DOF {
                if first::<GRAVITY>(k) <= I {
                    sum = sum.add_mul(self.forward[k][I], displacement[k]);
                }
            }
            carried[I] = sum * self.factor.reciprocal(I);
        });
        if let Some(halfway) = halfway {
            for i in 0..DOF {
                carried[i] = carried[i] + halfway[i];
            }
        }
        self.factor.backward(carried);
    }
}

/// Row of the first entry of a column of Bᵀ that is not zero.
#[inline(always)]
const fn first<const GRAVITY: bool>(column: usize) -> usize {
    if GRAVITY && column >= 3 { 3 } else { column }
}

/// Diagonal `k + s d` of a bushing.
#[inline(always)]
fn bushing<V: Lanes>(joint: &JointTerms<V::Scalar>, s: Complex<V>) -> Column<V> {
    let mut bushing = [Complex::zero(s.re); DOF];
    for i in 0..DOF {
        let (stiffness, damping) = (s.re.fill(joint.stiffness[i]), s.re.fill(joint.damping[i]));
        bushing[i] = Complex::new(s.re.mul_add(damping, stiffness), s.im * damping);
    }
    bushing
}

/// `Z ← b + s² I`: stiffness of the first link, which only its bushing holds.
#[inline(always)]
pub(super) fn hold<V: Lanes, const GRAVITY: bool>(
    joint: &JointTerms<V::Scalar>,
    s: Complex<V>,
    s2: Complex<V>,
    stiffness: &mut Symmetric<V>,
) {
    for (entry, &inertia) in stiffness.iter_mut().zip(&joint.inertia) {
        *entry = s2.scale(s.re.fill(inertia));
    }
    let bushing = bushing(joint, s);
    for i in 0..DOF {
        stiffness[at(i, i)] = stiffness[at(i, i)] + bushing[i];
    }
    if GRAVITY {
        gravitate(joint, stiffness);
    }
}

/// `Z ← Z + Γ`.
#[inline(always)]
fn gravitate<V: Lanes>(joint: &JointTerms<V::Scalar>, stiffness: &mut Symmetric<V>) {
    for i in 0..3 {
        for j in 0..=i {
            let entry = &mut stiffness[at(3 + i, 3 + j)].re;
            *entry = *entry + entry.fill(joint.gravity_turns[i][j]);
        }
    }
}

/// `Z ← Z − C − Cᵀ`.
#[inline(always)]
fn couple<V: Lanes>(joint: &JointTerms<V::Scalar>, stiffness: &mut Symmetric<V>) {
    for j in 0..3 {
        for i in 0..DOF {
            let entry = &mut stiffness[at(i, 3 + j)].re;
            let coupling = entry.fill(joint.gravity_coupling[i][j]);
            // The loop visits each entry off the diagonal of the turns twice, and each entry on this diagonal once.
            *entry = *entry - if i == 3 + j { coupling + coupling } else { coupling };
        }
    }
}
