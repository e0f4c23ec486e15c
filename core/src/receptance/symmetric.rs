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
    /// Factorises.
    #[inline(always)]
    pub fn new(matrix: &Symmetric<V>) -> Self {
        let mut packed = *matrix;
        for j in 0..DOF {
            // Here column j still holds L·D; the rows above have been divided.
            let reciprocal = packed[at(j, j)].reciprocal();
            packed[at(j, j)] = reciprocal;
            let column: [Complex<V>; DOF] = core::array::from_fn(|i| packed[at(i, j)]);
            for i in j + 1..DOF {
                packed[at(i, j)] = column[i] * reciprocal;
            }
            for i in j + 1..DOF {
                for k in j + 1..=i {
                    packed[at(i, k)] = packed[at(i, k)].minus(packed[at(i, j)], column[k]);
                }
            }
        }
        Self { packed }
    }

    /// `L⁻¹ x` where the entries of x before `first` are zero.
    #[inline(always)]
    pub fn forward(&self, x: &mut [Complex<V>; DOF], first: usize) {
        for j in first..DOF {
            for i in j + 1..DOF {
                x[i] = x[i].minus(self.packed[at(i, j)], x[j]);
            }
        }
    }

    /// `L⁻ᵀ D⁻¹ x`.
    #[inline(always)]
    pub fn backward(&self, x: &mut [Complex<V>; DOF]) {
        for i in 0..DOF {
            x[i] = x[i] * self.packed[at(i, i)];
        }
        for j in (1..DOF).rev() {
            for i in 0..j {
                x[i] = x[i].minus(self.packed[at(j, i)], x[j]);
            }
        }
    }

    /// `matrix⁻¹ x`.
    #[inline(always)]
    pub fn solve(&self, x: &mut [Complex<V>; DOF]) {
        self.forward(x, 0);
        self.backward(x);
    }

    /// 1/D, entry i.
    #[inline(always)]
    pub fn reciprocal(&self, i: usize) -> Complex<V> {
        self.packed[at(i, i)]
    }
}
