//! Factor by which the accuracy of one kind of imperfections was stated too well.
//!
//! Of the imperfections x of a kind, in their stated accuracies, the data say `xᵀMx − 2gᵀx`, with all else at its best values. Their
//! prior is normal, of variance u. Minus twice the logarithm of the evidence of u is, but for a constant,
//!
//! ```text
//! E(u) = −gᵀ(M + 1/u)⁻¹g + ln det(1 + uM)
//! ```
//!
//! The u where it is least is empirical Bayes' (type II maximum likelihood: MacKay, "Bayesian interpolation", Neural Computation 4,
//! 1992). Directions of x that the data do not determine cost nothing, and those that they determine cost `ln u`.

use crate::MAX_JOINTS;
use crate::chain::spread::SPREADS;
use crate::linear::normal::Normal;
use crate::linear::packed::packed;

/// Largest number of imperfections of a kind: the spreads of all links.
pub(super) const MAX_OF_KIND: usize = SPREADS * MAX_JOINTS;
/// Largest u that is tried, 2 to this power. Chosen: errors of a thousand times their accuracy, twenty times those of a plausible plant.
const DOUBLINGS: i32 = 20;
/// Halvings of the step of ln u, from ln 2 on. Chosen: E is then least to a thousandth.
const HALVINGS: u32 = 6;

/// Information of the data about the imperfections of a kind.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// M and, in the last row, g.
    normal: Normal<{ packed(MAX_OF_KIND + 1) }>,
}

/// A kind whose accuracy is restated, all others as they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Restatement {
    /// u, at least 1.
    pub(super) square: f64,
    /// E(u).
    pub(super) evidence: f64,
    /// `E(1) − E(u)`, at least 0.
    pub(super) gain: f64,
}

/// Most likely values with a prior of variance u, and their standard deviations.
#[derive(Clone, Copy, Debug)]
pub(super) struct Values {
    pub(super) values: [f64; MAX_OF_KIND],
    pub(super) deviations: [f64; MAX_OF_KIND],
}

impl Block {
    /// The equations that are left of others, whose first `eliminated` unknowns have been eliminated.
    pub(super) fn of_complement<const L: usize>(others: &Normal<L>, eliminated: usize) -> Self {
        let mut normal = Normal::new();
        normal.reset(others.unknowns() - eliminated);
        normal.add_complement(others, eliminated);
        Self { normal }
    }

    /// The u of at least 1 whose evidence is largest.
    pub(super) fn restatement(&self) -> Restatement {
        let stated = self.evidence(0.0);
        let mut best = (0.0, stated);
        let look = |best: &mut (f64, f64), doublings: f64| {
            let evidence = self.evidence(doublings);
            if doublings >= 0.0 && evidence < best.1 {
                *best = (doublings, evidence);
            }
        };
        for doublings in 1..=DOUBLINGS {
            look(&mut best, f64::from(doublings));
        }
        let mut step = 1.0;
        for _ in 0..HALVINGS {
            step *= 0.5;
            let middle = best.0;
            look(&mut best, middle - step);
            look(&mut best, middle + step);
        }
        Restatement { square: libm::exp2(best.0), evidence: best.1, gain: stated - best.1 }
    }

    /// E of `u = 2^doublings`.
    fn evidence(&self, doublings: f64) -> f64 {
        let factor = self.factor(libm::exp2(doublings));
        let size = factor.unknowns();
        let logarithm: f64 = (0..size).map(|i| libm::log(factor.row(i)[i].max(1.0))).sum();
        factor.sum_of_squares() + 2.0 * logarithm
    }

    /// Factor of `1 + uM`, the right-hand side `√u g`, and behind it `−u gᵀ(1 + uM)⁻¹g`.
    fn factor(&self, square: f64) -> Normal<{ packed(MAX_OF_KIND + 1) }> {
        let mut factor = self.normal.clone();
        let size = factor.unknowns();
        for entry in factor.entries_mut() {
            *entry *= square;
        }
        let root = libm::sqrt(square);
        for i in 0..size {
            *factor.entry(i, i) += 1.0;
            *factor.entry(size, i) /= root;
        }
        *factor.entry(size, size) = 0.0;
        factor.eliminate(size);
        factor
    }

    /// The values `(M + 1/u)⁻¹g`.
    pub(super) fn values(&self, square: f64) -> Values {
        let factor = self.factor(square);
        let size = factor.unknowns();
        let root = libm::sqrt(square);
        let (mut values, mut deviations) = ([0.0; MAX_OF_KIND], [0.0; MAX_OF_KIND]);
        factor.substitute(size, &mut values);
        values.iter_mut().for_each(|value| *value *= root);
        for (index, deviation) in deviations.iter_mut().enumerate().take(size) {
            *deviation = root * length_of_inverse(&factor, index);
        }
        Values { values, deviations }
    }

    /// Returns the decrease of the sum of squares by the imperfections without a prior.
    pub(super) fn gain_without_prior(mut self) -> f64 {
        let standing = self.normal.sum_of_squares();
        self.normal.eliminate(self.normal.unknowns());
        standing - self.normal.sum_of_squares()
    }
}

/// `|u|` with `L u = e`, L the factor and e the unit vector of an unknown: the root of its diagonal entry of the inverse.
fn length_of_inverse<const L: usize>(factor: &Normal<L>, index: usize) -> f64 {
    let mut u = [0.0; MAX_OF_KIND];
    for i in index..factor.unknowns() {
        let row = factor.row(i);
        let known: f64 = row[index..i].iter().zip(&u[index..i]).map(|(l, u)| l * u).sum();
        let own = if i == index { 1.0 } else { 0.0 };
        u[i] = if row[i] > 0.0 { (own - known) / row[i] } else { 0.0 };
    }
    libm::sqrt(u.iter().map(|u| u * u).sum())
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use proptest::collection::vec;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    use super::*;

    const SIZE: usize = 6;

    fn block(m: &DMatrix<f64>, g: &DVector<f64>) -> Block {
        let mut normal = Normal::new();
        normal.reset(SIZE);
        for i in 0..SIZE {
            for j in 0..=i {
                *normal.entry(i, j) = m[(i, j)];
            }
            *normal.entry(SIZE, i) = g[i];
        }
        Block { normal }
    }

    /// −2 ln of the density of `r = J x + noise` where x is normal of variance u and the noise of variance 1, but for a constant.
    fn evidence(jacobian: &DMatrix<f64>, r: &DVector<f64>, u: f64) -> f64 {
        let rows = r.len();
        let covariance = DMatrix::identity(rows, rows) + jacobian * jacobian.transpose() * u;
        let cholesky = covariance.cholesky().unwrap();
        let logarithm: f64 = cholesky.l().diagonal().iter().map(|pivot| 2.0 * pivot.ln()).sum();
        r.dot(&cholesky.solve(r)) + logarithm
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(11), ..ProptestConfig::with_cases(64) })]

        /// Rows of data, of which some determine all imperfections and others half of them. The density is that of the rows, whose
        /// covariance is dense.
        #[test]
        fn restated_as_by_the_density_of_the_rows(
            entries in vec(-1.0_f64..1.0, 8 * SIZE),
            noise in vec(-1.7_f64..1.7, 8),
            truth in vec(-1.0_f64..1.0, SIZE),
            far in prop_oneof![Just(0.3), Just(5.0), Just(50.0)],
            rows in prop_oneof![Just(3_usize), Just(8)],
        ) {
            let jacobian = DMatrix::from_row_slice(8, SIZE, &entries).rows(0, rows).into_owned() * 3.0;
            let r = &jacobian * DVector::from_vec(truth) * far + DVector::from_vec(noise).rows(0, rows);
            let (m, g) = (jacobian.transpose() * &jacobian, jacobian.transpose() * &r);
            let block = block(&m, &g);
            let Restatement { square, evidence: own, gain } = block.restatement();
            let at = |u: f64| evidence(&jacobian, &r, u);
            prop_assert!((at(1.0) - at(square) - gain).abs() < 1e-6 * (1.0 + gain));
            prop_assert!((at(square) - r.norm_squared() - own).abs() < 1e-6 * (1.0 + r.norm_squared()));
            let least = (0..400).map(|step| at((step as f64 * 0.03).exp())).fold(f64::INFINITY, f64::min);
            prop_assert!(at(square) < least + 0.01, "{square}: {} over {least}", at(square));

            let inverse = (m + DMatrix::identity(SIZE, SIZE) / square).try_inverse().unwrap();
            let expected = &inverse * g;
            let Values { values, deviations } = block.values(square);
            for i in 0..SIZE {
                prop_assert!((values[i] - expected[i]).abs() < 1e-6 * (1.0 + expected.norm()));
                prop_assert!((deviations[i] / inverse[(i, i)].sqrt() - 1.0).abs() < 1e-6);
            }
        }
    }
}
