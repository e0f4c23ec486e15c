//! Unknowns, and combinations of them, that the data determine at all.

use crate::MAX_UNKNOWNS;
use crate::linear::normal::Normal;

/// Part of its diagonal's information below which a combination of unknowns has none.
///
/// Rounding leaves some 1e-14 of an exact dependence among a hundred unknowns; the limit stays a hundredfold above. A combination
/// below it is determined a million times worse than if the other unknowns were known. Few are then known better than to 1e-5, so
/// that no determined combination is lost.
pub(super) const RANK: f64 = 1e-12;

/// Information up to which an unknown is undetermined, and takes no part in the covariance of the others.
///
/// If its logarithm moves by 10, a factor of 22,000, the residuals then move by a thousandth of their noise. Its column may be
/// rounding errors, whose correlation with other columns means nothing.
pub(super) const NOTHING: f64 = 1e-8;

/// The unknowns that the data determine at all; none if the matrix has an entry that is not finite.
pub(super) fn determined_of<const L: usize>(information: &Normal<L>) -> [bool; MAX_UNKNOWNS] {
    let unknowns = information.unknowns();
    let sound = (0..unknowns).all(|i| information.row(i).iter().all(|entry| entry.is_finite()));
    core::array::from_fn(|i| sound && i < unknowns && information.row(i)[i] > NOTHING)
}

#[cfg(test)]
pub(crate) mod testing {
    use nalgebra::DMatrix;

    use super::*;
    use crate::linear::packed::packed;

    pub(crate) type Information = Normal<{ packed(MAX_UNKNOWNS + 1) }>;

    /// The information matrix of a fit.
    pub(crate) fn information(matrix: &DMatrix<f64>) -> Information {
        let mut information = Normal::new();
        information.reset(matrix.nrows());
        for i in 0..matrix.nrows() {
            for j in 0..=i {
                *information.entry(i, j) = matrix[(i, j)];
            }
        }
        information
    }

    /// Rows of `columns` values, column `i` scaled by `10^magnitudes[i]`.
    pub(crate) fn jacobian(columns: usize, values: &[f64], magnitudes: &[f64]) -> DMatrix<f64> {
        let mut jacobian = DMatrix::from_row_slice(values.len() / columns, columns, values);
        for (mut column, magnitude) in jacobian.column_iter_mut().zip(magnitudes) {
            column *= 10_f64.powf(*magnitude);
        }
        jacobian
    }
}
