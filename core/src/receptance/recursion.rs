//! Articulated-body recursion on the dynamic stiffness, base to tip: the receptance in O(J).
//!
//! `Z` is the dynamic stiffness that link j, held by all before it, opposes to its displacement η. The next bushing is
//! passed by eliminating x, the displacement that the link before would carry it along by:
//!
//! ```text
//! Z̃ = X⁻ᵀ Z X⁻¹       Δ = Z̃ + b − C − Cᵀ       Δ x = Bᵀ η       b = diag(k + s d) + Γ       B = b − Cᵀ
//! Z ← b − B Δ⁻¹ Bᵀ + s² I                                       at the tip:   H = pᵀ Z⁻¹ p
//! ```
//!
//! Everything is complex symmetric: transposed, never conjugated. Γ and C are gravity's
//! ([`crate::chain::linearise`]); without it B = b is diagonal. From tip to base, the order of textbooks, the loads of
//! three forces would have to be handed on beside the stiffness, half as much work again, and single precision would lose
//! half a digit more.

use seq_macro::seq;

use super::complex::Complex;
use super::lanes::Lanes;
use super::symmetric::{Factor, Symmetric, at};
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
    let tip = tip_stiffness(terms, s);
    // Halfway through the solution: L⁻¹ p, and D⁻¹ L⁻¹ p.
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
            receptance[PACKED] = receptance[PACKED].plus(loads[a][i], moved[b][i]);
        }
    });
    receptance
}

/// Rows and columns of a packed symmetric 3×3.
const LOWER: [[usize; 2]; 6] = [[0, 0], [1, 0], [1, 1], [2, 0], [2, 1], [2, 2]];

/// The dynamic stiffness of the last link, factorised.
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

/// A bushing between two links, passed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passage<V> {
    /// Of Δ.
    factor: Factor<V>,
    /// L⁻¹ Bᵀ, by columns.
    forward: [Column<V>; DOF],
}

impl<V: Lanes> Passage<V> {
    /// Through no bushing yet.
    #[inline(always)]
    pub(super) fn new(like: V) -> Self {
        let zero = Complex::zero(like);
        Self { factor: Factor::zero(like), forward: [[zero; DOF]; DOF] }
    }

    /// `Z ← b − B Δ⁻¹ Bᵀ + s² I`: from the stiffness of the link before to that of the link beyond.
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
        congruence(joint, stiffness, delta);
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
                    entry = entry.minus(scaled[k], self.forward[j][k]);
                }
                stiffness[at(I, j)] = entry.plus_real(s2, s.re.fill(joint.inertia[at(I, j)]));
            }
            stiffness[at(I, I)] = stiffness[at(I, I)] + bushing[I];
        });
        if GRAVITY {
            gravitate(joint, stiffness);
        }
    }

    /// `L⁻¹ Bᵀ`.
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
                    entry = entry.minus(self.factor.below(i, j), self.forward[K][j]);
                }
                self.forward[K][i] = entry;
            }
        });
    }

    /// `D⁻¹ L⁻¹ f` of a load on x, in place.
    #[inline(always)]
    pub(super) fn halfway(&self, load: &mut Column<V>) {
        let columns = core::array::from_mut(load);
        self.factor.forward(columns);
        self.factor.scale(columns);
    }

    /// `f ← f + B Δ⁻¹ g`: what the bushing hands on of a load g on x, from [`Passage::halfway`].
    #[inline(always)]
    pub(super) fn hand_on<const GRAVITY: bool>(&self, halfway: &Column<V>, load: &mut Column<V>) {
        seq!(I in 0..6 {
            for k in first::<GRAVITY>(I)..DOF {
                load[I] = load[I].plus(self.forward[I][k], halfway[k]);
            }
        });
    }

    /// `x = Δ⁻¹ (Bᵀ η + f)` of a displacement η; a load f from [`Passage::halfway`].
    #[inline(always)]
    pub(super) fn carry<const GRAVITY: bool>(
        &self,
        displacement: &Column<V>,
        halfway: Option<&Column<V>>,
        carried: &mut Column<V>,
    ) {
        seq!(I in 0..6 {
            let mut sum = self.forward[0][I] * displacement[0];
            for k in 1..DOF {
                if first::<GRAVITY>(k) <= I {
                    sum = sum.plus(self.forward[k][I], displacement[k]);
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

/// First row of a column of Bᵀ that is not zero.
#[inline(always)]
const fn first<const GRAVITY: bool>(column: usize) -> usize {
    if GRAVITY && column >= 3 { 3 } else { column }
}

/// k + s d.
#[inline(always)]
fn bushing<V: Lanes>(joint: &JointTerms<V::Scalar>, s: Complex<V>) -> Column<V> {
    let mut bushing = [Complex::zero(s.re); DOF];
    for i in 0..DOF {
        let (stiffness, damping) = (s.re.fill(joint.stiffness[i]), s.re.fill(joint.damping[i]));
        bushing[i] = Complex::new(s.re.mul_add(damping, stiffness), s.im * damping);
    }
    bushing
}

/// `Z ← b + s² I`: held by the bushing alone.
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
            // The symmetric sum has each off-diagonal entry of the turns twice.
            *entry = *entry - if i == 3 + j { coupling + coupling } else { coupling };
        }
    }
}

/// `X⁻ᵀ f − g`: a load f on the link before as this bushing feels it, and −g on the bushing itself.
#[inline(always)]
pub(super) fn load_here<V: Lanes>(
    joint: &JointTerms<V::Scalar>,
    load: &Column<V>,
    own: &Column<V>,
    here: &mut Column<V>,
) {
    let like = load[0].re;
    seq!(I in 0..3 {
        here[I] = -own[I];
        here[3 + I] = -own[3 + I];
        for k in 0..3 {
            here[I] = here[I].plus_real(load[k], like.fill(joint.rotate[k][I]));
            here[3 + I] = here[3 + I]
                .plus_real(load[k], like.fill(joint.lever[k][I]))
                .plus_real(load[3 + k], like.fill(joint.turn[k][I]));
        }
    });
}

/// `X⁻¹ x`: the displacement of the link before that carries this bushing by x.
#[inline(always)]
pub(super) fn before<V: Lanes>(
    joint: &JointTerms<V::Scalar>,
    carried: &Column<V>,
    before: &mut Column<V>,
) {
    let like = carried[0].re;
    *before = [Complex::zero(like); DOF];
    seq!(I in 0..3 {
        for k in 0..3 {
            before[I] = before[I]
                .plus_real(carried[k], like.fill(joint.rotate[I][k]))
                .plus_real(carried[3 + k], like.fill(joint.lever[I][k]));
            before[3 + I] =
                before[3 + I].plus_real(carried[3 + k], like.fill(joint.turn[I][k]));
        }
    });
}

/// `X⁻ᵀ M X⁻¹`.
#[inline(always)]
fn congruence<V: Lanes>(
    joint: &JointTerms<V::Scalar>,
    m: &Symmetric<V>,
    result: &mut Symmetric<V>,
) {
    let like = m[0].re;
    let zero = Complex::zero(like);
    let rotate = |i: usize, j: usize| like.fill(joint.rotate[i][j]);
    let lever = |i: usize, j: usize| like.fill(joint.lever[i][j]);
    let turn = |i: usize, j: usize| like.fill(joint.turn[i][j]);
    // M X⁻¹ by its blocks: translation rows times both columns, turn rows times the turn column.
    let (mut tt, mut tr, mut rr) = ([[zero; 3]; 3], [[zero; 3]; 3], [[zero; 3]; 3]);
    seq!(I in 0..3 {
        for j in 0..3 {
            for k in 0..3 {
                tt[I][j] = tt[I][j].plus_real(m[at(I, k)], rotate(k, j));
                tr[I][j] = tr[I][j]
                    .plus_real(m[at(I, k)], lever(k, j))
                    .plus_real(m[at(I, 3 + k)], turn(k, j));
                rr[I][j] = rr[I][j]
                    .plus_real(m[at(3 + I, k)], lever(k, j))
                    .plus_real(m[at(3 + I, 3 + k)], turn(k, j));
            }
        }
    });
    seq!(I in 0..3 {
        for j in 0..3 {
            if j <= I {
                let (mut translation, mut turning) = (zero, zero);
                for k in 0..3 {
                    translation = translation.plus_real(tt[k][j], rotate(k, I));
                    turning =
                        turning.plus_real(tr[k][j], lever(k, I)).plus_real(rr[k][j], turn(k, I));
                }
                result[at(I, j)] = translation;
                result[at(3 + I, 3 + j)] = turning;
            }
            let mut mixed = zero;
            for k in 0..3 {
                mixed = mixed.plus_real(tr[k][j], rotate(k, I));
            }
            result[at(3 + j, I)] = mixed;
        }
    });
}
