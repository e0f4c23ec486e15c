//! Complex symmetric 6×6 matrices in lanes, lower triangle packed by rows, and their `L D Lᵀ`.

use seq_macro::seq;

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
#[derive(Clone, Copy, Debug)]
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

    /// Factorises in place, row by row.
    #[inline(always)]
    pub fn factorise(&mut self) {
        let packed = &mut self.packed;
        seq!(I in 0..6 {
            // Row I of L·D, from left to right.
            for j in 0..I {
                let mut entry = packed[at(I, j)];
                for k in 0..j {
                    entry = entry.minus(packed[at(I, k)], packed[at(j, k)]);
                }
                packed[at(I, j)] = entry;
            }
            let mut pivot = packed[at(I, I)];
            for j in 0..I {
                let scaled = packed[at(I, j)];
                packed[at(I, j)] = scaled * packed[at(j, j)];
                pivot = pivot.minus(scaled, packed[at(I, j)]);
            }
            packed[at(I, I)] = pivot.reciprocal();
        });
    }

    /// `L⁻¹ x` of each column x.
    #[inline(always)]
    pub fn forward<const N: usize>(&self, columns: &mut [[Complex<V>; DOF]; N]) {
        seq!(I in 1..6 {
            for x in columns.iter_mut() {
                let mut sum = x[I];
                for j in 0..I {
                    sum = sum.minus(self.packed[at(I, j)], x[j]);
                }
                x[I] = sum;
            }
        });
    }

    /// Entry (i, j < i) of L.
    #[inline(always)]
    pub fn below(&self, i: usize, j: usize) -> Complex<V> {
        self.packed[at(i, j)]
    }

    /// `D⁻¹ x` of each column x.
    #[inline(always)]
    pub fn scale<const N: usize>(&self, columns: &mut [[Complex<V>; DOF]; N]) {
        seq!(I in 0..6 {
            for x in columns.iter_mut() {
                x[I] = x[I] * self.packed[at(I, I)];
            }
        });
    }

    /// `L⁻ᵀ x`, in place.
    #[inline(always)]
    pub fn backward(&self, x: &mut [Complex<V>; DOF]) {
        seq!(I in 1..6 {
            let mut sum = x[5 - I];
            // What has been found last comes last, or all would wait for it.
            for j in (6 - I..DOF).rev() {
                sum = sum.minus(self.packed[at(j, 5 - I)], x[j]);
            }
            x[5 - I] = sum;
        });
    }

    /// `Z⁻¹ x`, in place.
    #[inline(always)]
    pub fn solve(&self, x: &mut [Complex<V>; DOF]) {
        let column = core::array::from_mut(x);
        self.forward(column);
        self.scale(column);
        self.backward(x);
    }

    /// 1/D, entry i.
    #[inline(always)]
    pub fn reciprocal(&self, i: usize) -> Complex<V> {
        self.packed[at(i, i)]
    }
}
