//! Eigenvalues and eigenvectors of a symmetric matrix by cyclic Jacobi rotations (Golub & Van Loan, "Matrix Computations",
//! section 8.5).
//!
//! The method works in place on the packed triangle. For positive matrices it is exact to rounding relative to each
//! eigenvalue's own rows: small eigenvalues keep their precision beside large ones, even if the data determine the unknowns
//! very unequally (Demmel & Veselić, "Jacobi's method is more accurate than QR", 1992).

use super::packed::packed;
use crate::MAX_UNKNOWNS;

/// Largest number of sweeps. A hundred unknowns take about ten.
const MAX_SWEEPS: usize = 30;

/// Eigenvalues and eigenvectors of a symmetric matrix, in no order.
pub(crate) struct Eigen {
    size: usize,
    /// Lower triangle packed by rows. After the last sweep its diagonal holds the eigenvalues.
    triangle: [f64; packed(MAX_UNKNOWNS)],
    /// One eigenvector per row. Single precision is enough to name the unknowns of a direction, and takes half of 82 kB of
    /// stack.
    pub(crate) vectors: [[f32; MAX_UNKNOWNS]; MAX_UNKNOWNS],
}

impl Eigen {
    /// Eigenvalues and eigenvectors of the matrix of `size` rows with the entries `entry(i, j)`, j ≤ i, which must be finite.
    pub(crate) fn of(size: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        let mut eigen = Self {
            size,
            triangle: [0.0; packed(MAX_UNKNOWNS)],
            vectors: [[0.0; MAX_UNKNOWNS]; MAX_UNKNOWNS],
        };
        for i in 0..size {
            for j in 0..=i {
                *eigen.entry(i, j) = entry(i, j);
            }
            eigen.vectors[i][i] = 1.0;
        }
        for _ in 0..MAX_SWEEPS {
            if !eigen.sweep() {
                break;
            }
        }
        eigen
    }

    /// Eigenvalue `k`.
    pub(crate) fn value(&self, k: usize) -> f64 {
        self.get(k, k)
    }

    /// Eigenvector of eigenvalue `k`, of unit length.
    pub(crate) fn vector(&self, k: usize) -> &[f32] {
        &self.vectors[k][..self.size]
    }

    /// Rotates each pair of unknowns once where needed, and returns whether any pair was rotated.
    fn sweep(&mut self) -> bool {
        let mut rotated = false;
        for q in 1..self.size {
            for p in 0..q {
                let least = libm::sqrt(self.get(p, p).abs()) * libm::sqrt(self.get(q, q).abs());
                if self.get(p, q).abs() > f64::EPSILON * least {
                    self.rotate(p, q);
                    rotated = true;
                }
            }
        }
        rotated
    }

    /// Turns the unknowns `p` and `q` so that entry (p, q) becomes zero.
    fn rotate(&mut self, p: usize, q: usize) {
        let between = self.get(p, q);
        let cotangent = (self.get(q, q) - self.get(p, p)) / (2.0 * between);
        // Tangent of the smaller of the two angles that make this entry zero.
        let root = libm::sqrt(1.0 + cotangent * cotangent);
        let tangent = cotangent.signum() / (cotangent.abs() + root);
        let cosine = 1.0 / libm::sqrt(1.0 + tangent * tangent);
        let sine = tangent * cosine;
        for i in (0..self.size).filter(|&i| i != p && i != q) {
            let (x, y) = (self.get(i, p), self.get(i, q));
            *self.entry(i, p) = cosine * x - sine * y;
            *self.entry(i, q) = sine * x + cosine * y;
        }
        *self.entry(p, p) -= tangent * between;
        *self.entry(q, q) += tangent * between;
        *self.entry(p, q) = 0.0;
        let (cosine, sine) = (cosine as f32, sine as f32);
        let (before, from) = self.vectors.split_at_mut(q);
        for (x, y) in before[p].iter_mut().zip(&mut from[0]) {
            (*x, *y) = (cosine * *x - sine * *y, sine * *x + cosine * *y);
        }
    }

    fn get(&self, i: usize, j: usize) -> f64 {
        self.triangle[packed(i.max(j)) + i.min(j)]
    }

    fn entry(&mut self, i: usize, j: usize) -> &mut f64 {
        &mut self.triangle[packed(i.max(j)) + i.min(j)]
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector, SymmetricEigen};
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;
    use crate::verdict::testing::jacobian;

    fn eigen(matrix: &DMatrix<f64>) -> Eigen {
        Eigen::of(matrix.nrows(), |i, j| matrix[(i, j)])
    }

    fn values(eigen: &Eigen) -> std::vec::Vec<f64> {
        let mut values: std::vec::Vec<f64> = (0..eigen.size).map(|k| eigen.value(k)).collect();
        values.sort_by(f64::total_cmp);
        values
    }

    fn vectors(eigen: &Eigen) -> DMatrix<f64> {
        DMatrix::from_fn(eigen.size, eigen.size, |i, k| f64::from(eigen.vector(k)[i]))
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

        /// The result equals that of a tridiagonal QR, for matrices of any sign, with and without a null space.
        #[test]
        fn as_by_qr(entries in vec(-1.0_f64..1.0, 12 * 12), rank in 0..=12_usize) {
            let root = DMatrix::from_row_slice(12, 12, &entries);
            let root = root.columns(0, rank);
            let gram = root * root.transpose();
            let any = DMatrix::from_row_slice(12, 12, &entries);
            for matrix in [gram, &any + any.transpose()] {
                let eigen = eigen(&matrix);
                let mut expected = SymmetricEigen::new(matrix.clone()).eigenvalues;
                expected.as_mut_slice().sort_by(f64::total_cmp);
                for (value, expected) in values(&eigen).iter().zip(&expected) {
                    prop_assert!((value - expected).abs() < 1e-13 * (1.0 + matrix.norm()));
                }
                let vectors = vectors(&eigen);
                let orthonormal = vectors.transpose() * &vectors;
                prop_assert!((orthonormal - DMatrix::identity(12, 12)).amax() < 1e-5);
                let diagonal = DVector::from_fn(12, |k, _| eigen.value(k));
                let composed = &vectors * DMatrix::from_diagonal(&diagonal) * vectors.transpose();
                prop_assert!((composed - &matrix).amax() < 1e-5 * (1.0 + matrix.norm()));
            }
        }

        /// The smallest eigenvalue is the inverse of the largest one of the inverse matrix, for unknowns with very unequal
        /// information.
        #[test]
        fn small_eigenvalues_keep_their_figures(entries in vec(-1.0_f64..1.0, 24 * 6)) {
            let magnitudes = [-4.0, -3.0, 0.0, 2.0, 4.0, 6.0];
            let jacobian = jacobian(6, &entries, &magnitudes);
            // JᵀJ = RᵀR, so its inverse is R⁻¹R⁻ᵀ. Unequal scales do not reduce the precision of the triangle's inverse.
            let inverse = jacobian.clone().qr().r().solve_upper_triangular(&DMatrix::identity(6, 6));
            let inverse = inverse.ok_or(TestCaseError::reject("singular"))?;
            let largest = SymmetricEigen::new(&inverse * inverse.transpose()).eigenvalues.max();
            let smallest = values(&eigen(&(jacobian.transpose() * &jacobian)))[0];
            prop_assert!((smallest * largest - 1.0).abs() < 1e-9, "{} times", smallest * largest);
        }
    }

    /// The matrix has the largest number of unknowns, and clusters of eigenvalues.
    #[test]
    fn repeated_eigenvalues_at_full_size() {
        let values_of = |k: usize| [0.0, 0.0, 1.0, 1.0, 1.0, 1e4][k % 6];
        let entry = |i: usize, k: usize| ((i * i + 1) as f64 * (k + 1) as f64 * 0.618).sin();
        let basis = DMatrix::from_fn(MAX_UNKNOWNS, MAX_UNKNOWNS, entry).qr().q();
        let diagonal = DVector::from_fn(MAX_UNKNOWNS, |k, _| values_of(k));
        let matrix = &basis * DMatrix::from_diagonal(&diagonal) * basis.transpose();
        let eigen = eigen(&matrix);
        let mut expected = diagonal;
        expected.as_mut_slice().sort_by(f64::total_cmp);
        for (value, expected) in values(&eigen).iter().zip(&expected) {
            assert!((value - expected).abs() < 1e-9, "{value} for {expected}");
        }
        let vectors = vectors(&eigen);
        let orthonormal = vectors.transpose() * &vectors;
        assert!((orthonormal - DMatrix::identity(MAX_UNKNOWNS, MAX_UNKNOWNS)).amax() < 3e-5);
    }
}
