//! Transformation of displacements, loads and stiffnesses between a joint and the link before, in the precision of the
//! recursion.

use nalgebra::SMatrix;
use seq_macro::seq;

use super::complex::{Column, Complex};
use super::lanes::{Lanes, Scalar};
use super::symmetric::{Symmetric, at};
use crate::DOF;
use crate::chain::from_parent::FromParent;

/// `Y` transforms a displacement in the frame of a joint to the link before (the parent): the inverse of [`FromParent`].
///
/// ```text
/// Y = [[rotation, lever], [0, turns]]
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ToParent<T> {
    /// Translation of the parent by the translation here.
    rotation: [[T; 3]; 3],
    /// Translation of the parent by the turns here, m.
    lever: [[T; 3]; 3],
    /// Turns of the parent by the turns here.
    turns: [[T; 3]; 3],
}

impl<T: Scalar> ToParent<T> {
    /// `Y = X⁻¹ = [[Rᵀ, −Rᵀ L T⁻¹], [0, T⁻¹]]` for `X = [[R, L], [0, T]]`.
    pub(super) fn inverse_of(x: &FromParent) -> Self {
        let rotation = x.rotation.transpose();
        Self {
            rotation: rows(&rotation),
            lever: rows(&(-rotation * x.lever * x.turns_inverse)),
            turns: rows(&x.turns_inverse),
        }
    }

    /// `Y x`: displacement of the parent for a displacement x here.
    #[inline(always)]
    pub(super) fn displacement<V: Lanes<Scalar = T>>(
        &self,
        here: &Column<V>,
        parent: &mut Column<V>,
    ) {
        let like = here[0].re;
        *parent = [Complex::zero(like); DOF];
        seq!(I in 0..3 {
            for k in 0..3 {
                parent[I] = parent[I]
                    .add_mul_real(here[k], like.fill(self.rotation[I][k]))
                    .add_mul_real(here[3 + k], like.fill(self.lever[I][k]));
                parent[3 + I] =
                    parent[3 + I].add_mul_real(here[3 + k], like.fill(self.turns[I][k]));
            }
        });
    }

    /// `Yᵀ f − g`: a load f on the parent, transformed to this joint, less a load g here.
    #[inline(always)]
    pub(super) fn load_less<V: Lanes<Scalar = T>>(
        &self,
        parent: &Column<V>,
        less: &Column<V>,
        here: &mut Column<V>,
    ) {
        let like = parent[0].re;
        seq!(I in 0..3 {
            here[I] = -less[I];
            here[3 + I] = -less[3 + I];
            for k in 0..3 {
                here[I] = here[I].add_mul_real(parent[k], like.fill(self.rotation[k][I]));
                here[3 + I] = here[3 + I]
                    .add_mul_real(parent[k], like.fill(self.lever[k][I]))
                    .add_mul_real(parent[3 + k], like.fill(self.turns[k][I]));
            }
        });
    }

    /// `Yᵀ Z Y`: a stiffness Z against the displacement of the parent, as one against the displacement here.
    #[inline(always)]
    pub(super) fn stiffness<V: Lanes<Scalar = T>>(
        &self,
        parent: &Symmetric<V>,
        here: &mut Symmetric<V>,
    ) {
        let z = parent;
        let like = z[0].re;
        let zero = Complex::zero(like);
        let rotation = |i: usize, j: usize| like.fill(self.rotation[i][j]);
        let lever = |i: usize, j: usize| like.fill(self.lever[i][j]);
        let turns = |i: usize, j: usize| like.fill(self.turns[i][j]);
        // Blocks of Z Y: translation rows times both columns, and turn rows times the turn column.
        let (mut tt, mut tr, mut rr) = ([[zero; 3]; 3], [[zero; 3]; 3], [[zero; 3]; 3]);
        seq!(I in 0..3 {
            for j in 0..3 {
                for k in 0..3 {
                    tt[I][j] = tt[I][j].add_mul_real(z[at(I, k)], rotation(k, j));
                    tr[I][j] = tr[I][j]
                        .add_mul_real(z[at(I, k)], lever(k, j))
                        .add_mul_real(z[at(I, 3 + k)], turns(k, j));
                    rr[I][j] = rr[I][j]
                        .add_mul_real(z[at(3 + I, k)], lever(k, j))
                        .add_mul_real(z[at(3 + I, 3 + k)], turns(k, j));
                }
            }
        });
        seq!(I in 0..3 {
            for j in 0..3 {
                if j <= I {
                    let (mut translation, mut turning) = (zero, zero);
                    for k in 0..3 {
                        translation = translation.add_mul_real(tt[k][j], rotation(k, I));
                        turning = turning
                            .add_mul_real(tr[k][j], lever(k, I))
                            .add_mul_real(rr[k][j], turns(k, I));
                    }
                    here[at(I, j)] = translation;
                    here[at(3 + I, 3 + j)] = turning;
                }
                let mut mixed = zero;
                for k in 0..3 {
                    mixed = mixed.add_mul_real(tr[k][j], rotation(k, I));
                }
                here[at(3 + j, I)] = mixed;
            }
        });
    }
}

/// Rows of a matrix in the precision of the recursion.
pub(super) fn rows<T: Scalar, const R: usize>(matrix: &SMatrix<f64, R, 3>) -> [[T; 3]; R] {
    core::array::from_fn(|i| core::array::from_fn(|j| T::from_f64(matrix[(i, j)])))
}
