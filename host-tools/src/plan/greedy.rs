//! The choice of one experiment after the other, each the best in addition to those before it.

use flexid_core::refine::Information;
use rayon::iter::{IntoParallelRefIterator as _, ParallelIterator as _};
use serde::Serialize;

/// The criterion that makes one experiment better than another (Atkinson, Donev and Tobias, "Optimum Experimental Designs", 2007).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Criterion {
    /// The volume of the parameters' confidence ellipsoid: the determinant of their covariance
    D,
    /// The parameters' mean variance: the trace of their covariance
    A,
}

impl Criterion {
    /// Uncertainty of the first `parameters` unknowns as one relative standard deviation; less is better. D takes the
    /// geometric mean over the axes of the confidence ellipsoid, A the root mean square over the parameters. The
    /// other unknowns, the nuisances, count by the uncertainty that they leave in these. The result is infinite where
    /// the information determines none.
    pub fn uncertainty(self, information: &Information, parameters: usize) -> f64 {
        let count = parameters as f64;
        let size = match self {
            Self::D => (-information.log_determinant(parameters) / (2.0 * count)).exp(),
            Self::A => {
                let covariance = information.covariance();
                let squares = (0..parameters).map(|i| covariance.deviation(i).powi(2));
                (squares.sum::<f64>() / count).sqrt()
            }
        };
        if size.is_nan() { f64::INFINITY } else { size }
    }
}

/// Indices of the candidates, the best in addition to what is `known` first, without those that leave an infinite uncertainty.
pub fn ranked(
    criterion: Criterion,
    known: &Information,
    candidates: &[&Information],
    parameters: usize,
) -> Vec<usize> {
    let size = |candidate: &&Information| {
        let mut with = known.clone();
        with.add(candidate);
        criterion.uncertainty(&with, parameters)
    };
    let sizes: Vec<f64> = candidates.par_iter().map(size).collect();
    let mut ranked: Vec<usize> = (0..sizes.len()).filter(|&one| sizes[one].is_finite()).collect();
    ranked.sort_by(|&a, &b| sizes[a].total_cmp(&sizes[b]));
    ranked
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Information of three unknowns, each known alone to these standard deviations.
    fn known(deviations: [f64; 3]) -> Information {
        let mut information = Information::none(3);
        for (unknown, deviation) in deviations.into_iter().enumerate() {
            information.add_known(unknown, deviation);
        }
        information
    }

    const NO: f64 = f64::INFINITY;

    /// Indices of the best candidates, one after the other.
    fn choose(
        criterion: Criterion,
        known: &Information,
        all: &[&Information],
        count: usize,
    ) -> Vec<usize> {
        let mut known = known.clone();
        let next = || {
            let best = *ranked(criterion, &known, all, 3).first()?;
            known.add(all[best]);
            Some(best)
        };
        std::iter::from_fn(next).take(count).collect()
    }

    #[test]
    fn each_choice_fills_what_those_before_it_left() {
        let prior = known([1.0; 3]);
        // The candidates determine one unknown precisely, both others roughly, all three badly, and none.
        let all = [known([1e-3, NO, NO]), known([NO, 0.1, 0.2]), known([0.5; 3]), known([NO; 3])];
        let all: Vec<_> = all.iter().collect();
        // The volumes after one choice are 1e-3, 1/51, 0.09; the mean squares are 0.67, 0.35, 0.2.
        assert_eq!(choose(Criterion::D, &prior, &all, 2), [0, 1]);
        assert_eq!(choose(Criterion::A, &prior, &all, 3), [2, 1, 0]);
    }

    #[test]
    fn a_number_that_is_none_is_never_chosen() {
        let mut broken = known([1e-3; 3]);
        broken.add_known(1, f64::MIN_POSITIVE);
        let sound = known([0.9; 3]);
        for criterion in [Criterion::D, Criterion::A] {
            assert_eq!(choose(criterion, &known([1.0; 3]), &[&broken, &sound], 1), [1]);
            assert_eq!(choose(criterion, &known([1.0; 3]), &[&broken], 1), [0; 0]);
        }
    }

    #[test]
    fn uncertainty_is_a_standard_deviation() {
        let information = known([0.1, 0.2, 0.4]);
        assert!((Criterion::D.uncertainty(&information, 3) - 0.2).abs() < 1e-12);
        let mean_square = (0.01 + 0.04 + 0.16) / 3.0_f64;
        assert!((Criterion::A.uncertainty(&information, 3) - mean_square.sqrt()).abs() < 1e-12);
        // The third unknown is a nuisance.
        assert!((Criterion::D.uncertainty(&information, 2) - 0.02_f64.sqrt()).abs() < 1e-12);
        assert!((Criterion::A.uncertainty(&information, 2) - 0.025_f64.sqrt()).abs() < 1e-12);
    }
}
