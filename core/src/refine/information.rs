//! Fisher information of the unknowns: what experiments tell of them, whether done or only thought of.

use super::normal::Normal;
use super::{ParameterNormal, Problem};
use crate::unknowns::{MAX_UNKNOWNS, Sought};
use crate::verdict::Covariance;

/// Inverse covariance of the unknowns of a fit, in the order of [`Sought`].
#[derive(Clone, Debug)]
pub struct Information {
    normal: ParameterNormal,
}

impl Information {
    /// Of no experiment, about so many unknowns.
    pub fn none(unknowns: usize) -> Self {
        let mut normal = Normal::new();
        normal.reset(unknowns);
        Self { normal }
    }

    /// What is known before any experiment: each parameter lies between its bounds, its logarithm anywhere
    /// (`ln(upper / lower)² / 12` is the variance of that), and each nuisance about its prior.
    pub fn prior(problem: &Problem<'_>) -> Self {
        let sought = problem.sought;
        let mut information = Self::none(sought.unknowns());
        let ranges = sought.ranges(&[0.0; MAX_UNKNOWNS], problem.bounds);
        for (unknown, [_, lower, upper]) in ranges.into_iter().take(sought.unknowns()).enumerate() {
            let width = upper - lower;
            // A nuisance has no bounds, and is counted in standard deviations of its prior.
            let told = if width.is_finite() { 12.0 / (width * width) } else { 1.0 };
            *information.normal.entry(unknown, unknown) = told;
        }
        information
    }

    /// Of the record whose first `eliminated` unknowns are gone.
    pub(super) fn of_complement<const L: usize>(
        record: &Normal<L>,
        eliminated: usize,
        sought: &Sought,
    ) -> Self {
        let mut information = Self::none(sought.unknowns());
        information.normal.add_complement(record, eliminated);
        information
    }

    /// Adds what independent experiments tell.
    pub fn add(&mut self, other: &Self) {
        self.normal.add_complement(&other.normal, 0);
    }

    /// Adds that an unknown is known, apart from the others, with this standard deviation. No information, nor any
    /// effect, if that is not positive and finite.
    ///
    /// # Panics
    ///
    /// If there is no such unknown.
    pub fn add_known(&mut self, unknown: usize, deviation: f64) {
        if deviation > 0.0 && deviation.is_finite() {
            *self.normal.entry(unknown, unknown) += 1.0 / (deviation * deviation);
        }
    }

    /// Logarithm of the determinant; minus infinity where some combination of the unknowns is not told, NaN of numbers
    /// that are not finite.
    pub fn log_determinant(&self) -> f64 {
        let mut factor = self.normal.clone();
        let unknowns = factor.unknowns();
        factor.eliminate(unknowns);
        (0..unknowns).map(|k| 2.0 * libm::log(*factor.entry(k, k))).sum()
    }

    /// Covariance of the unknowns.
    pub fn covariance(&self) -> Covariance {
        Covariance::of(&self.normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_determinants_and_inverses() {
        let mut information = Information::none(3);
        assert_eq!(information.log_determinant(), f64::NEG_INFINITY);
        for (unknown, deviation) in [0.5, 0.1, 2.0].into_iter().enumerate() {
            information.add_known(unknown, deviation);
            information.add_known(unknown, f64::INFINITY);
        }
        let expected = -2.0 * libm::log(0.5 * 0.1 * 2.0);
        assert!((information.log_determinant() - expected).abs() < 1e-12);
        // A second experiment that tells the difference of the first two: [[20, -16], [-16, 116]].
        let mut difference = Information::none(3);
        for (i, j, value) in [(0, 0, 16.0), (1, 0, -16.0), (1, 1, 16.0)] {
            *difference.normal.entry(i, j) = value;
        }
        information.add(&difference);
        let determinant: f64 = 20.0 * 116.0 - 256.0;
        let error = information.log_determinant() - libm::log(determinant / 4.0);
        assert!(error.abs() < 1e-12);
        let covariance = information.covariance();
        assert!((covariance.deviation(0) - libm::sqrt(116.0 / determinant)).abs() < 1e-12);
        assert!((covariance.deviation(2) - 2.0).abs() < 1e-12);
    }
}
