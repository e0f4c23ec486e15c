//! Complex symmetric 6×6 matrices in lanes, lower triangle packed by rows, and their `L D Lᵀ`.

use super::complex::Complex;
use super::lanes::Lanes;
use crate::DOF;

/// Entries of the lower triangle.
pub const PACKED: usize = DOF * (DOF + 1) / 2;

/// A complex symmetric 6×6 matrix: entry (i, j ≤ i) at `i(i+1)/2 + j`.
pub type Symmetric<V> = [Complex<V>; PACKED];

/// Where entry (i, j) of a symmetric matrix is packed.
#[inline(always)]
pub const fn at(i: usize, j: usize) -> usize {
    if i >= j { i * (i + 1) / 2 + j } else { j * (j + 1) / 2 + i }
}

/// `L D Lᵀ` of a symmetric matrix, without pivots: a sum of a passive mechanism's dynamic stiffnesses
/// off its undamped poles has none that vanish.
#[derive(Clone, Copy)]
pub struct Factor<V> {
    /// L below the diagonal (which is 1), 1/D on it.
    packed: Symmetric<V>,
}

impl<V: Lanes> Factor<V> {
    /// Of no matrix yet.
    #[inline(always)]
    pub fn zero(like: V) -> Self {
        Self { packed: [Complex::zero(like); PACKED] }
    }

    /// Where the matrix is put that [`Factor::factorise`] is to factorise.
    #[inline(always)]
    pub fn matrix(&mut self) -> &mut Symmetric<V> {
        &mut self.packed
    }

    /// Factorises in place.
    #[inline(always)]
    pub fn factorise(&mut self) {
        let packed = &mut self.packed;
        for j in 0..DOF {
            let reciprocal = packed[at(j, j)].reciprocal();
            packed[at(j, j)] = reciprocal;
            // Column j still holds L·D below row i.
            for i in j + 1..DOF {
                let entry = packed[at(i, j)] * reciprocal;
                for k in j + 1..=i {
                    packed[at(i, k)] = packed[at(i, k)].minus(entry, packed[at(k, j)]);
                }
            }
            for i in j + 1..DOF {
                packed[at(i, j)] = packed[at(i, j)] * reciprocal;
            }
        }
    }

    /// `L⁻¹ x` where the entries of x before `first` are zero.
    #[inline(always)]
    pub fn forward(&self, x: &mut [Complex<V>; DOF], first: usize) {
        for i in first + 1..DOF {
            let mut sum = x[i];
            for j in first..i {
                sum = sum.minus(self.packed[at(i, j)], x[j]);
            }
            x[i] = sum;
        }
    }

    /// `D⁻¹ x`.
    #[inline(always)]
    pub fn scale(&self, x: &mut [Complex<V>; DOF]) {
        for i in 0..DOF {
            x[i] = x[i] * self.packed[at(i, i)];
        }
    }

    /// `L⁻ᵀ x`.
    #[inline(always)]
    pub fn backward(&self, x: &mut [Complex<V>; DOF]) {
        for i in (0..DOF).rev() {
            let mut sum = x[i];
            for j in i + 1..DOF {
                sum = sum.minus(self.packed[at(j, i)], x[j]);
            }
            x[i] = sum;
        }
    }

    /// 1/D, entry i.
    #[inline(always)]
    pub fn reciprocal(&self, i: usize) -> Complex<V> {
        self.packed[at(i, i)]
    }
}
