//! Covariance of the unknowns: the inverse of the information matrix, where it has one.
//!
//! The matrix is scaled to unit diagonal and swept in place (Goodnight, "A tutorial on the SWEEP operator", 1979), the
//! largest pivot first. With the independent unknowns S swept and the rest T dependent on them it holds
//!
//! ```text
//!     [ −N_SS⁻¹       N_SS⁻¹ N_ST            ]
//!     [     ·         N_TT − N_TS N_SS⁻¹ N_ST ]    ≈ 0 in the last corner
//! ```
//!
//! When an unknown of T moves, the unknowns of S can move by `−N_SS⁻¹ N_ST` and leave the residuals as they are: those that do have
//! no finite variance. For the others `N_SS⁻¹` is the covariance.

use super::rank::{RANK, determined_of};
use crate::MAX_UNKNOWNS;
use crate::linear::normal::Normal;
use crate::linear::packed::packed;

/// Move of a dependent unknown, in the standard deviations that it would have if the others were known. Chosen: it is beyond any bounds.
///
/// Another unknown is determined nevertheless if it moves along by less than its own standard deviation. Rounding moves one by a
/// thousandth of that; information just below [`RANK`], by a tenth.
const FAR: f64 = 1e5;
/// Cap on the standard deviation in that comparison, in the same unit. Chosen: a hundredth of [`FAR`], so that a poorly determined unknown
/// does not count as determined.
const WIDE: f64 = 1e3;

/// Covariance of the unknowns of a fit, lower triangle packed by rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Covariance {
    unknowns: usize,
    rank: usize,
    /// Variance infinite and covariances zero where the data do not determine an unknown.
    entries: [f64; packed(MAX_UNKNOWNS)],
}

impl Covariance {
    /// Inverts an information matrix from which no unknown has been eliminated.
    pub(crate) fn of<const L: usize>(information: &Normal<L>) -> Self {
        let unknowns = information.unknowns();
        let determined = determined_of(information);
        let scale: [f64; MAX_UNKNOWNS] = core::array::from_fn(|i| {
            if determined[i] { 1.0 / libm::sqrt(information.row(i)[i]) } else { 0.0 }
        });
        let mut covariance = Self { unknowns, rank: 0, entries: [0.0; packed(MAX_UNKNOWNS)] };
        for i in (0..unknowns).filter(|&i| determined[i]) {
            for j in (0..=i).filter(|&j| determined[j]) {
                *covariance.entry(i, j) = information.row(i)[j] * scale[i] * scale[j];
            }
        }
        let independent = covariance.sweep_all();
        covariance.rank = independent.iter().filter(|own| **own).count();
        covariance.unscale(&scale, &independent);
        covariance
    }

    /// Sweeps every unknown that does not depend on those swept before it; returns which were swept.
    fn sweep_all(&mut self) -> [bool; MAX_UNKNOWNS] {
        let mut swept = [false; MAX_UNKNOWNS];
        loop {
            let left = (0..self.unknowns).filter(|&i| !swept[i] && self.get(i, i) > RANK);
            let pivot = left.max_by(|&i, &j| self.get(i, i).total_cmp(&self.get(j, j)));
            let Some(pivot) = pivot else { return swept };
            self.sweep(pivot);
            swept[pivot] = true;
        }
    }

    /// Solves the equation of unknown `k` for it, and puts that into the others.
    fn sweep(&mut self, k: usize) {
        let inverse = 1.0 / self.get(k, k);
        let column: [f64; MAX_UNKNOWNS] =
            core::array::from_fn(|i| if i < self.unknowns { self.get(i, k) } else { 0.0 });
        for i in 0..self.unknowns {
            let factor = column[i] * inverse;
            let row = &mut self.entries[packed(i)..packed(i + 1)];
            for (entry, other) in row.iter_mut().zip(&column) {
                *entry -= factor * other;
            }
        }
        for i in 0..self.unknowns {
            *self.entry(i, k) = column[i] * inverse;
        }
        *self.entry(k, k) = -inverse;
    }

    /// From the swept matrix to the covariance, in the unknowns' own units.
    fn unscale(&mut self, scale: &[f64; MAX_UNKNOWNS], independent: &[bool; MAX_UNKNOWNS]) {
        let finite: [bool; MAX_UNKNOWNS] = core::array::from_fn(|i| {
            i < self.unknowns && independent[i] && {
                let dependent = (0..self.unknowns).filter(|&j| !independent[j]);
                let along: f64 = dependent.map(|j| self.get(i, j) * self.get(i, j)).sum();
                along * FAR * FAR <= (-self.get(i, i)).min(WIDE * WIDE)
            }
        });
        for i in 0..self.unknowns {
            for j in 0..=i {
                let covariance = -self.get(i, j) * scale[i] * scale[j];
                *self.entry(i, j) = match (finite[i] && finite[j], i == j) {
                    (true, _) => covariance,
                    (false, true) => f64::INFINITY,
                    (false, false) => 0.0,
                };
            }
        }
    }

    /// Adds the mean square of a shift that all errors have in common; infinite variances stay infinite.
    pub(crate) fn widen(&mut self, shift: &[f64]) {
        let determined: [bool; MAX_UNKNOWNS] =
            core::array::from_fn(|i| i < self.unknowns && self.get(i, i).is_finite());
        for i in (0..self.unknowns).filter(|&i| determined[i]) {
            for j in (0..=i).filter(|&j| determined[j]) {
                *self.entry(i, j) += shift[i] * shift[j];
            }
        }
    }

    /// Each variance becomes the mean of itself and of the square of `others`, where that is larger: as if two points were equally
    /// likely. The correlations stay. An unknown of which the other deviation is infinite becomes undetermined.
    pub(crate) fn mix(&mut self, others: &[f64]) {
        let factor = |own: f64, other: f64| {
            let ratio = other / own;
            libm::sqrt(0.5 + 0.5 * ratio * ratio)
        };
        self.scale(factor, others);
    }

    /// Raises each standard deviation to that of `others`, where that is larger. The correlations stay. An unknown of which the other
    /// deviation is infinite becomes undetermined.
    pub(crate) fn raise(&mut self, others: &[f64]) {
        self.scale(|own, other| other / own, others);
    }

    /// Multiplies each standard deviation by a factor of itself and of the other one; the correlations stay. An unknown whose factor is
    /// infinite becomes undetermined.
    fn scale(&mut self, factor: impl Fn(f64, f64) -> f64, others: &[f64]) {
        let factor: [f64; MAX_UNKNOWNS] = core::array::from_fn(|i| match others.get(i) {
            Some(&other) if i < self.unknowns && other > self.deviation(i) => {
                factor(self.deviation(i), other)
            }
            _ => 1.0,
        });
        for i in 0..self.unknowns {
            for j in 0..=i {
                let both = factor[i] * factor[j];
                *self.entry(i, j) = match (both.is_finite(), i == j) {
                    (true, _) => self.get(i, j) * both,
                    (false, true) => f64::INFINITY,
                    (false, false) => 0.0,
                };
            }
        }
    }

    /// How many unknowns the fit has.
    pub fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// How many combinations of them the data determine.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Standard deviation of unknown `i`, in its unit; infinite where the data do not determine it.
    ///
    /// # Panics
    ///
    /// If `i` is not less than [`Covariance::unknowns`].
    pub fn deviation(&self, i: usize) -> f64 {
        assert!(i < self.unknowns, "unknown {i} of {}", self.unknowns);
        libm::sqrt(self.get(i, i))
    }

    /// Correlation of the unknowns `i` and `j`, −1 to 1; 0 where one of the two is undetermined.
    ///
    /// # Panics
    ///
    /// If `i` or `j` is not less than [`Covariance::unknowns`].
    pub fn correlation(&self, i: usize, j: usize) -> f64 {
        let both = self.deviation(i) * self.deviation(j);
        if both.is_finite() { (self.get(i, j) / both).clamp(-1.0, 1.0) } else { 0.0 }
    }

    fn get(&self, i: usize, j: usize) -> f64 {
        self.entries[packed(i.max(j)) + i.min(j)]
    }

    fn entry(&mut self, i: usize, j: usize) -> &mut f64 {
        &mut self.entries[packed(i.max(j)) + i.min(j)]
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::super::testing::{information, jacobian};
    use super::*;

    fn covariance(matrix: &DMatrix<f64>) -> Covariance {
        Covariance::of(&information(matrix))
    }

    /// Returns whether the unknowns `own` have the covariance `expected`, and all others an infinite one.
    fn agrees(
        covariance: &Covariance,
        own: &[usize],
        expected: &DMatrix<f64>,
        limit: f64,
    ) -> Result<(), TestCaseError> {
        for i in 0..covariance.unknowns() {
            let Some(k) = own.iter().position(|&own| own == i) else {
                prop_assert_eq!(covariance.deviation(i), f64::INFINITY, "unknown {}", i);
                continue;
            };
            let ratio = covariance.deviation(i) / expected[(k, k)].sqrt();
            prop_assert!((ratio - 1.0).abs() < limit, "unknown {}: {} times", i, ratio);
            for (l, &j) in own.iter().enumerate() {
                let scale = (expected[(k, k)] * expected[(l, l)]).sqrt();
                let error = covariance.correlation(i, j) - expected[(k, l)] / scale;
                prop_assert!(error.abs() < limit, "unknowns {}, {}: off by {}", i, j, error);
            }
        }
        Ok(())
    }

    /// The inverse of `JᵀJ` of columns of any size, scaled for the sake of the inversion.
    fn inverse(jacobian: &DMatrix<f64>) -> Result<DMatrix<f64>, TestCaseError> {
        let sizes = jacobian.column_iter().map(|column| 1.0 / column.norm());
        let sizes = DVector::from_iterator(jacobian.ncols(), sizes);
        let sizes = DMatrix::from_diagonal(&sizes);
        let scaled = jacobian * &sizes;
        let inverse = (scaled.transpose() * scaled).try_inverse();
        let inverse = inverse.ok_or(TestCaseError::reject("singular"))?;
        Ok(&sizes * inverse * sizes)
    }

    const COLUMNS: usize = 8;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(128) })]

        /// Whatever the sizes of the columns.
        #[test]
        fn inverts(
            values in vec(-1.0_f64..1.0, 24 * COLUMNS),
            magnitudes in vec(-3.0_f64..5.0, COLUMNS),
        ) {
            let jacobian = jacobian(COLUMNS, &values, &magnitudes);
            let covariance = covariance(&(jacobian.transpose() * &jacobian));
            let all: std::vec::Vec<usize> = (0..COLUMNS).collect();
            agrees(&covariance, &all, &inverse(&jacobian)?, 1e-9)?;
        }

        /// Columns 2, 5 and 7 depend on each other, 3 and 4 nearly do, 0 is empty: the others have the covariance that
        /// they have without 0 and 7, and without 4 if its difference from 3 is nearly lost in rounding.
        #[test]
        fn dependent_unknowns_are_not_determined(
            values in vec(-1.0_f64..1.0, 24 * COLUMNS),
            magnitudes in vec(-3.0_f64..5.0, COLUMNS),
            [a, b] in [0.3_f64..3.0, -3.0_f64..-0.3],
        ) {
            let cases: [(f64, &[usize], &[usize]); 3] = [
                (1e-4, &[1, 2, 3, 4, 5, 6], &[1, 3, 4, 6]),
                (1e-7, &[1, 2, 3, 5, 6], &[1, 6]),
                (1e-9, &[1, 2, 3, 5, 6], &[1, 6]),
            ];
            for (difference, independent, determined) in cases {
                let mut jacobian = jacobian(COLUMNS, &values, &[0.0; COLUMNS]);
                let combined = a * jacobian.column(2) + b * jacobian.column(5);
                jacobian.set_column(7, &combined);
                let near = jacobian.column(3) + difference * jacobian.column(4);
                jacobian.set_column(4, &near);
                jacobian.column_mut(0).fill(0.0);
                for (mut column, magnitude) in jacobian.column_iter_mut().zip(&magnitudes) {
                    column *= 10_f64.powf(*magnitude);
                }
                let covariance = covariance(&(jacobian.transpose() * &jacobian));
                let expected = inverse(&jacobian.select_columns(independent))?;
                let places: std::vec::Vec<usize> =
                    (0..independent.len()).filter(|&k| determined.contains(&independent[k])).collect();
                let expected = expected.select_rows(&places).select_columns(&places);
                agrees(&covariance, determined, &expected, 1e-5)?;
            }
        }
    }

    /// 0 is determined so badly that a part in the trade of 2 and 3 is small beside its own standard deviation.
    #[test]
    fn told_badly_does_not_hide_a_trade() {
        let mut jacobian = DMatrix::from_fn(24, 4, |row, column| {
            ((row * row + 1) as f64 * (column + 1) as f64).sin()
        });
        let near = jacobian.column(0) + 3e-6 * jacobian.column(1);
        jacobian.set_column(1, &near);
        let combined = jacobian.column(0) + jacobian.column(2);
        jacobian.set_column(3, &combined);
        let covariance = covariance(&(jacobian.transpose() * &jacobian));
        let finite = [0, 1, 2, 3].map(|i| covariance.deviation(i).is_finite());
        assert_eq!(finite, [false, true, false, false]);
    }

    /// Smaller ones change nothing; an infinite one leaves the unknown undetermined, and without a part in the others' covariances.
    #[test]
    fn variances_are_averaged_and_correlations_stay() {
        let matrix = DMatrix::from_row_slice(3, 3, &[4.0, 1.0, 1.0, 1.0, 4.0, 1.0, 1.0, 1.0, 4.0]);
        let before = covariance(&matrix);
        let [first, second, third] = [0, 1, 2].map(|i| before.deviation(i));
        let mut mixed = before.clone();
        mixed.mix(&[7.0 * first, 0.5 * second, third]);
        for (i, expected) in [5.0 * first, second, third].into_iter().enumerate() {
            assert!((mixed.deviation(i) / expected - 1.0).abs() < 1e-12, "{i}");
            for j in 0..3 {
                let error = mixed.correlation(i, j) - before.correlation(i, j);
                assert!(error.abs() < 1e-12, "{i} {j}");
            }
        }
        for _ in 0..2 {
            mixed.mix(&[f64::INFINITY]);
            assert_eq!(mixed.deviation(0), f64::INFINITY);
            assert_eq!([1, 2].map(|j| mixed.correlation(0, j)), [0.0; 2]);
            assert!((mixed.deviation(1) / second - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn equal_columns_leave_the_third_alone() {
        let matrix = DMatrix::from_row_slice(3, 3, &[4.0, 4.0, 2.0, 4.0, 4.0, 2.0, 2.0, 2.0, 5.0]);
        let covariance = covariance(&matrix);
        assert_eq!([0, 1].map(|i| covariance.deviation(i)), [f64::INFINITY; 2]);
        // Of [[4, 2], [2, 5]].
        assert!((covariance.deviation(2) - 0.25_f64.sqrt()).abs() < 1e-15);
        assert_eq!(covariance.correlation(0, 1), 0.0);
        assert_eq!(covariance.correlation(2, 2), 1.0);
    }

    /// The largest number of unknowns, the first twenty in ten pairs that differ by their size only, all of them
    /// alike to a part in a hundred.
    #[test]
    fn rank_is_found_at_full_size() -> Result<(), TestCaseError> {
        const PAIRED: usize = 20;
        let jacobian = DMatrix::from_fn(400, MAX_UNKNOWNS, |row, column| {
            let shape = if column < PAIRED { column / 2 } else { column };
            let phase = (row * row + 3) as f64 * (shape + 1) as f64 * 0.618_033_988_75;
            10_f64.powi(column as i32 % 7) * (1.0 + 0.01 * phase.sin())
        });
        let covariance = covariance(&(jacobian.transpose() * &jacobian));
        let different: std::vec::Vec<usize> =
            (1..PAIRED).step_by(2).chain(PAIRED..MAX_UNKNOWNS).collect();
        let expected = inverse(&jacobian.select_columns(&different))?;
        let expected = expected.view_range(PAIRED / 2.., PAIRED / 2..).into_owned();
        let own: std::vec::Vec<usize> = (PAIRED..MAX_UNKNOWNS).collect();
        agrees(&covariance, &own, &expected, 1e-8)
    }

    /// An unknown of which only rounding has information is not determined, and leaves the one alone that it seems to
    /// depend on.
    #[test]
    fn rounding_determines_nothing() {
        let matrix = DMatrix::from_row_slice(2, 2, &[1e6, 1e-10, 1e-10, 1e-26]);
        let covariance = covariance(&matrix);
        assert_eq!([covariance.deviation(0), covariance.deviation(1)], [1e-3, f64::INFINITY]);
    }

    #[test]
    fn no_number_without_information() {
        let broken = |value| DMatrix::from_row_slice(2, 2, &[1.0, value, value, 1.0]);
        // Nothing can be said of one unknown while it is not known how the other takes part in it.
        let beside = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, f64::NAN]);
        let broken = [f64::NAN, f64::INFINITY].map(broken);
        for matrix in
            broken.into_iter().chain([DMatrix::zeros(2, 2), -DMatrix::identity(2, 2), beside])
        {
            let covariance = covariance(&matrix);
            for i in 0..2 {
                assert_eq!(covariance.deviation(i), f64::INFINITY);
                assert_eq!([0, 1].map(|j| covariance.correlation(i, j)), [0.0; 2]);
            }
        }
        assert_eq!(covariance(&DMatrix::zeros(0, 0)).unknowns(), 0);
    }
}
