//! One step of the recursion: the elimination of a bushing between two links. The formulas are those of
//! [`recursion`](super::recursion).

use seq_macro::seq;

use super::complex::{Column, Complex};
use super::lanes::Lanes;
use super::law::Rates;
use super::symmetric::{Factor, Symmetric, at};
use super::terms::{Growth, JointTerms};
use crate::DOF;

/// Elimination of x, the displacement by which the link before carries a bushing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Elimination<V> {
    /// Factor of Δ.
    factor: Factor<V>,
    /// `L⁻¹ Bᵀ`, by columns.
    forward: [Column<V>; DOF],
}

impl<V: Lanes> Elimination<V> {
    /// An elimination of no bushing yet.
    #[inline(always)]
    pub(super) fn new(like: V) -> Self {
        let zero = Complex::zero(like);
        Self { factor: Factor::zero(like), forward: [[zero; DOF]; DOF] }
    }

    /// `Z ← b − B Δ⁻¹ Bᵀ + s² I`: replaces the stiffness of the link before by that of the link beyond.
    #[inline(always)]
    pub(super) fn eliminate<const GRAVITY: bool>(
        &mut self,
        joint: &JointTerms<V::Scalar>,
        rates: &Rates<V>,
        s2: Complex<V>,
        stiffness: &mut Symmetric<V>,
    ) {
        let like = s2.re;
        let bushing = bushing(joint, rates);
        let delta = self.factor.matrix();
        joint.to_parent.stiffness(stiffness, delta);
        for i in 0..DOF {
            delta[at(i, i)] = delta[at(i, i)] + bushing[i];
        }
        if GRAVITY {
            add_gravity_turns(joint, delta);
            subtract_gravity_coupling(joint, delta);
        }
        self.factor.factorise();
        self.solve_coupling::<GRAVITY>(joint, &bushing);
        seq!(I in 0..6 {
            let mut scaled = [Complex::zero(like); DOF];
            for k in first::<GRAVITY>(I)..DOF {
                scaled[k] = self.forward[I][k] * self.factor.reciprocal(k);
            }
            for j in 0..=I {
                let mut entry = Complex::zero(like);
                for k in first::<GRAVITY>(I)..DOF {
                    entry = entry.sub_mul(scaled[k], self.forward[j][k]);
                }
                stiffness[at(I, j)] = entry.add_mul_real(s2, like.fill(joint.inertia[at(I, j)]));
            }
            stiffness[at(I, I)] = stiffness[at(I, I)] + bushing[I];
        });
        if GRAVITY {
            add_gravity_turns(joint, stiffness);
        }
    }

    /// Computes `L⁻¹ Bᵀ`.
    #[inline(always)]
    fn solve_coupling<const GRAVITY: bool>(
        &mut self,
        joint: &JointTerms<V::Scalar>,
        bushing: &Column<V>,
    ) {
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

    /// `f ← D⁻¹ L⁻¹ f` for a load f on x: the first half of a solution by Δ.
    #[inline(always)]
    pub(super) fn half_solve(&self, load: &mut Column<V>) {
        let columns = core::array::from_mut(load);
        self.factor.forward(columns);
        self.factor.scale(columns);
    }

    /// `f ← f + B Δ⁻¹ g`: adds the part of a load g on x that the bushing transmits. `half` is g after
    /// [`Elimination::half_solve`].
    #[inline(always)]
    pub(super) fn transmit<const GRAVITY: bool>(&self, half: &Column<V>, load: &mut Column<V>) {
        seq!(I in 0..6 {
            for k in first::<GRAVITY>(I)..DOF {
                load[I] = load[I].add_mul(self.forward[I][k], half[k]);
            }
        });
    }

    /// `x = Δ⁻¹ (Bᵀ η + f)` for a displacement η of the link beyond and a load f on x. `half` is f after
    /// [`Elimination::half_solve`].
    #[inline(always)]
    pub(super) fn recover<const GRAVITY: bool>(
        &self,
        beyond: &Column<V>,
        half: Option<&Column<V>>,
        x: &mut Column<V>,
    ) {
        seq!(I in 0..6 {
            let mut sum = self.forward[0][I] * beyond[0];
            for k in 1..DOF {
                if first::<GRAVITY>(k) <= I {
                    sum = sum.add_mul(self.forward[k][I], beyond[k]);
                }
            }
            x[I] = sum * self.factor.reciprocal(I);
        });
        if let Some(half) = half {
            for i in 0..DOF {
                x[i] = x[i] + half[i];
            }
        }
        self.factor.backward(x);
    }
}

/// `Z ← b + s² I`: stiffness of the first link, whose bushing stands on the base.
#[inline(always)]
pub(super) fn first_link<V: Lanes, const GRAVITY: bool>(
    joint: &JointTerms<V::Scalar>,
    rates: &Rates<V>,
    s2: Complex<V>,
    stiffness: &mut Symmetric<V>,
) {
    for (entry, &inertia) in stiffness.iter_mut().zip(&joint.inertia) {
        *entry = s2.scale(s2.re.fill(inertia));
    }
    let bushing = bushing(joint, rates);
    for i in 0..DOF {
        stiffness[at(i, i)] = stiffness[at(i, i)] + bushing[i];
    }
    if GRAVITY {
        add_gravity_turns(joint, stiffness);
    }
}

/// Row of the first entry of a column of Bᵀ that is not zero.
#[inline(always)]
const fn first<const GRAVITY: bool>(column: usize) -> usize {
    if GRAVITY && column >= 3 { 3 } else { column }
}

/// Diagonal `k (1 + g ψ) + d σ` of a bushing.
#[inline(always)]
pub(crate) fn bushing<V: Lanes>(joint: &JointTerms<V::Scalar>, rates: &Rates<V>) -> Column<V> {
    let Rates { damper, drive } = rates;
    let like = damper.re;
    let mut bushing = [Complex::zero(like); DOF];
    for i in 0..DOF {
        let (stiffness, damping) = (like.fill(joint.stiffness[i]), like.fill(joint.damping[i]));
        bushing[i] = Complex::new(damper.re.mul_add(damping, stiffness), damper.im * damping);
    }
    if let Some(drive) = drive
        && let Some(Growth { dof, part }) = joint.growth
    {
        let stiffness = like.fill(joint.stiffness[dof]) * like.fill(part);
        bushing[dof] = bushing[dof].add_mul_real(*drive, stiffness);
    }
    bushing
}

/// `Z ← Z + Γ`.
#[inline(always)]
fn add_gravity_turns<V: Lanes>(joint: &JointTerms<V::Scalar>, stiffness: &mut Symmetric<V>) {
    for i in 0..3 {
        for j in 0..=i {
            let entry = &mut stiffness[at(3 + i, 3 + j)].re;
            *entry = *entry + entry.fill(joint.gravity_turns[i][j]);
        }
    }
}

/// `Z ← Z − C − Cᵀ`.
#[inline(always)]
fn subtract_gravity_coupling<V: Lanes>(
    joint: &JointTerms<V::Scalar>,
    stiffness: &mut Symmetric<V>,
) {
    for j in 0..3 {
        for i in 0..DOF {
            let entry = &mut stiffness[at(i, 3 + j)].re;
            let coupling = entry.fill(joint.gravity_coupling[i][j]);
            // The loop visits each entry off the diagonal of the turns twice, and each entry on this diagonal once.
            *entry = *entry - if i == 3 + j { coupling + coupling } else { coupling };
        }
    }
}
