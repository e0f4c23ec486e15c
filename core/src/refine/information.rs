//! Fisher information of the unknowns in experiments, whether done or only planned.

use super::sizes::ParameterNormal;
use crate::linear::normal::Normal;
use crate::parameters::Bounds;
use crate::sought::{MAX_UNKNOWNS, Sought, deviation_between};
use crate::verdict::Covariance;

/// Inverse covariance of the unknowns of a fit, in the order of [`Sought`].
#[derive(Clone, Debug)]
pub struct Information {
    pub(super) normal: ParameterNormal,
}

impl Information {
    /// Information of no experiment, about so many unknowns.
    pub fn none(unknowns: usize) -> Self {
        let mut normal = Normal::new();
        normal.reset(unknowns);
        Self { normal }
    }

    /// Information from the entries of the lower triangle, row by row.
    pub fn of_entries(unknowns: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        let mut information = Self::none(unknowns);
        for row in 0..unknowns {
            for column in 0..=row {
                *information.normal.entry(row, column) = entry(row, column);
            }
        }
        information
    }

    /// Prior information about the parameters: the logarithm of each lies anywhere between its bounds, with the variance
    /// `ln(upper / lower)² / 12`.
    pub fn of_bounds(sought: &Sought, bounds: &Bounds) -> Self {
        let mut information = Self::none(sought.unknowns());
        let ranges = sought.ranges(&[0.0; MAX_UNKNOWNS], bounds);
        for (unknown, [_, lower, upper]) in ranges.into_iter().take(sought.unknowns()).enumerate() {
            // Infinite of an imperfection, which has no bounds.
            information.add_known(unknown, deviation_between(lower, upper));
        }
        information
    }

    /// Prior information about the imperfections that are sought, which every fit uses.
    pub fn of_priors(sought: &Sought) -> Self {
        let mut information = Self::none(sought.unknowns());
        for (unknown, value) in sought.priors(&[0.0; MAX_UNKNOWNS]) {
            information.normal.add_prior(unknown, value);
        }
        information
    }

    /// Adds the information of independent experiments.
    ///
    /// # Panics
    ///
    /// If it is of another number of unknowns.
    pub fn add(&mut self, other: &Self) {
        assert_eq!(self.normal.unknowns(), other.normal.unknowns());
        self.normal.add_complement(&other.normal, 0);
    }

    /// Adds that an unknown is known, apart from the others, with this standard deviation. No information, nor any
    /// effect, if that is not positive and finite.
    ///
    /// # Panics
    ///
    /// If there is no such unknown.
    pub fn add_known(&mut self, unknown: usize, deviation: f64) {
        let unknowns = self.normal.unknowns();
        assert!(unknown < unknowns, "unknown {unknown} of {unknowns}");
        if deviation > 0.0 && deviation.is_finite() {
            *self.normal.entry(unknown, unknown) += 1.0 / (deviation * deviation);
        }
    }

    /// Logarithm of the determinant of the information about the first `count` unknowns, the others unknown: minus that of
    /// their covariance. Minus infinity where some combination of them is undetermined; no number, or minus infinity, of
    /// entries that are not finite.
    pub fn log_determinant(&self, count: usize) -> f64 {
        let unknowns = self.normal.unknowns();
        // Last unknown first: the pivots of those that are asked for are then what the others leave of them.
        let mut factor = Self::none(unknowns).normal;
        for i in 0..unknowns {
            for j in 0..=i {
                *factor.entry(unknowns - 1 - j, unknowns - 1 - i) = self.normal.row(i)[j];
            }
        }
        factor.eliminate(unknowns);
        (0..unknowns).rev().take(count).map(|k| 2.0 * libm::log(*factor.entry(k, k))).sum()
    }

    /// Covariance of the unknowns.
    pub fn covariance(&self) -> Covariance {
        Covariance::of(&self.normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::Ranges;

    #[test]
    fn sums_determinants_and_inverses() {
        let mut information = Information::none(3);
        assert_eq!(information.log_determinant(3), f64::NEG_INFINITY);
        for (unknown, deviation) in [0.5, 0.1, 2.0].into_iter().enumerate() {
            information.add_known(unknown, deviation);
            information.add_known(unknown, f64::INFINITY);
        }
        let expected = -2.0 * libm::log(0.5 * 0.1 * 2.0);
        assert!((information.log_determinant(3) - expected).abs() < 1e-12);
        // A second experiment that determines the difference of the first two: [[20, -16], [-16, 116]].
        let mut difference = Information::none(3);
        for (i, j, value) in [(0, 0, 16.0), (1, 0, -16.0), (1, 1, 16.0)] {
            *difference.normal.entry(i, j) = value;
        }
        information.add(&difference);
        let determinant: f64 = 20.0 * 116.0 - 256.0;
        let error = information.log_determinant(3) - libm::log(determinant / 4.0);
        assert!(error.abs() < 1e-12);
        // The second and third beside it unknown.
        let error = information.log_determinant(1) - libm::log(determinant / 116.0);
        assert!(error.abs() < 1e-12);
        let covariance = information.covariance();
        assert!((covariance.deviation(0) - libm::sqrt(116.0 / determinant)).abs() < 1e-12);
        assert!((covariance.deviation(2) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn parameters_have_bounds_and_imperfections_priors() {
        let mut sought = Sought::new(1).unwrap();
        sought.seek("delay_s", 1e-3).unwrap();
        let bounds = Bounds::alike(Ranges { stiffness: [[1e6, 1e8]; 6], damping: [[1e3, 1e4]; 6] });
        let of_bounds = Information::of_bounds(&sought, &bounds);
        let deviation = |information: &Information, i| information.covariance().deviation(i);
        let uniform = |ratio: f64| libm::log(ratio) / libm::sqrt(12.0);
        assert!((deviation(&of_bounds, 0) - uniform(1e2)).abs() < 1e-12);
        assert!((deviation(&of_bounds, 11) - uniform(1e1)).abs() < 1e-12);
        assert_eq!(deviation(&of_bounds, 12), f64::INFINITY);
        let of_priors = Information::of_priors(&sought);
        assert_eq!([0, 12].map(|i| deviation(&of_priors, i)), [f64::INFINITY, 1.0]);
    }
}
