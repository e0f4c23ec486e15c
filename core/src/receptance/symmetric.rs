//! Complex symmetric 6×6 matrices in lanes, lower triangle packed by rows, and their factorisation `L D Lᵀ`.

use seq_macro::seq;

use super::complex::Complex;
use super::lanes::Lanes;
use crate::DOF;

/// Number of entries of the lower triangle.
pub(crate) const PACKED: usize = DOF * (DOF + 1) / 2;

/// A complex symmetric 6×6 matrix: entry (i, j ≤ i) at `i(i+1)/2 + j`.
pub(super) type Symmetric<V> = [Complex<V>; PACKED];

/// Index of entry (i, j) of a packed symmetric matrix.
#[inline(always)]
pub(crate) const fn at(i: usize, j: usize) -> usize {
    if i >= j { i * (i + 1) / 2 + j } else { j * (j + 1) / 2 + i }
}

/// `L D Lᵀ` of a symmetric matrix, without pivoting. Away from its undamped poles, a sum of dynamic stiffnesses of a passive
/// mechanism has no pivot that vanishes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Factor<V> {
    /// L below the diagonal, 1/D on the diagonal. The diagonal of L is 1.
    packed: Symmetric<V>,
}

impl<V: Lanes> Factor<V> {
    /// A factor of no matrix yet.
    #[inline(always)]
    pub(super) fn zero(like: V) -> Self {
        Self { packed: [Complex::zero(like); PACKED] }
    }

    /// Storage of the matrix that [`Factor::factorise`] factorises.
    #[inline(always)]
    pub(super) fn matrix(&mut self) -> &mut Symmetric<V> {
        &mut self.packed
    }

    /// Factorises the matrix in place, row by row.
    #[inline(always)]
    pub(super) fn factorise(&mut self) {
        let packed = &mut self.packed;
        seq!(I in 0..6 {
            // Row I of L·D, from left to right.
            for j in 0..I {
                let mut entry = packed[at(I, j)];
                for k in 0..j {
                    entry = entry.sub_mul(packed[at(I, k)], packed[at(j, k)]);
                }
                packed[at(I, j)] = entry;
            }
            let mut pivot = packed[at(I, I)];
            for j in 0..I {
                let scaled = packed[at(I, j)];
                packed[at(I, j)] = scaled * packed[at(j, j)];
                pivot = pivot.sub_mul(scaled, packed[at(I, j)]);
            }
            packed[at(I, I)] = pivot.reciprocal();
        });
    }

    /// `x ← L⁻¹ x` for each column x.
    #[inline(always)]
    pub(super) fn forward<const N: usize>(&self, columns: &mut [[Complex<V>; DOF]; N]) {
        seq!(I in 1..6 {
            for x in columns.iter_mut() {
                let mut sum = x[I];
                for j in 0..I {
                    sum = sum.sub_mul(self.packed[at(I, j)], x[j]);
                }
                x[I] = sum;
            }
        });
    }

    /// Entry (i, j < i) of L.
    #[inline(always)]
    pub(super) fn below(&self, i: usize, j: usize) -> Complex<V> {
        self.packed[at(i, j)]
    }

    /// `x ← D⁻¹ x` for each column x.
    #[inline(always)]
    pub(super) fn scale<const N: usize>(&self, columns: &mut [[Complex<V>; DOF]; N]) {
        seq!(I in 0..6 {
            for x in columns.iter_mut() {
                x[I] = x[I] * self.packed[at(I, I)];
            }
        });
    }

    /// `x ← L⁻ᵀ x`.
    #[inline(always)]
    pub(super) fn backward(&self, x: &mut [Complex<V>; DOF]) {
        seq!(I in 1..6 {
            let mut sum = x[5 - I];
            // The entry that was computed last enters last, so that the other products do not wait for it.
            for j in (6 - I..DOF).rev() {
                sum = sum.sub_mul(self.packed[at(j, 5 - I)], x[j]);
            }
            x[5 - I] = sum;
        });
    }

    /// `x ← Z⁻¹ x` for the factorised matrix Z.
    #[inline(always)]
    pub(super) fn solve(&self, x: &mut [Complex<V>; DOF]) {
        let column = core::array::from_mut(x);
        self.forward(column);
        self.scale(column);
        self.backward(x);
    }

    /// Entry i of 1/D.
    #[inline(always)]
    pub(super) fn reciprocal(&self, i: usize) -> Complex<V> {
        self.packed[at(i, i)]
    }
}
