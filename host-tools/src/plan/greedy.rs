//! One experiment after the other, each the best beside those before it.

use flexid_core::refine::Information;
use rayon::iter::{IntoParallelRefIterator as _, ParallelIterator as _};
use serde::Serialize;

/// What makes one experiment better than another (Atkinson, Donev and Tobias, "Optimum Experimental Designs", 2007).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Criterion {
    /// The volume of the confidence ellipsoid: the determinant of the covariance
    D,
    /// The mean variance: the trace of the covariance
    A,
}

impl Criterion {
    /// Size of the uncertainty as one relative standard deviation, the less the better: the geometric mean over the
    /// ellipsoid's axes (D), or the root mean square over the parameters (A). Infinite where there is none.
    pub fn uncertainty(self, information: &Information, unknowns: usize) -> f64 {
        let size = match self {
            Self::D => (-information.log_determinant() / (2.0 * unknowns as f64)).exp(),
            Self::A => {
                let covariance = information.covariance();
                let squares = (0..unknowns).map(|i| covariance.deviation(i).powi(2));
                (squares.sum::<f64>() / unknowns as f64).sqrt()
            }
        };
        if size.is_nan() { f64::INFINITY } else { size }
    }
}

/// Up to `count` of the candidates, by their indices, beside what is `known`; one may come more than once. None that
/// leaves no finite uncertainty.
pub fn choose(
    criterion: Criterion,
    known: &Information,
    candidates: &[&Information],
    unknowns: usize,
    count: usize,
) -> Vec<usize> {
    let mut known = known.clone();
    let mut chosen = Vec::new();
    while chosen.len() < count {
        let sizes: Vec<f64> = candidates
            .par_iter()
            .map(|candidate| {
                let mut with = known.clone();
                with.add(candidate);
                criterion.uncertainty(&with, unknowns)
            })
            .collect();
        let best = (0..sizes.len()).min_by(|&a, &b| sizes[a].total_cmp(&sizes[b]));
        let Some(best) = best.filter(|&best| sizes[best].is_finite()) else { break };
        known.add(candidates[best]);
        chosen.push(best);
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of three unknowns, each known alone to these deviations.
    fn known(deviations: [f64; 3]) -> Information {
        let mut information = Information::none(3);
        for (unknown, deviation) in deviations.into_iter().enumerate() {
            information.add_known(unknown, deviation);
        }
        information
    }

    const NO: f64 = f64::INFINITY;

    #[test]
    fn each_choice_fills_what_those_before_it_left() {
        let prior = known([1.0; 3]);
        // Both in one unknown, both others roughly, the third badly, and nothing.
        let all = [known([1e-3, NO, NO]), known([NO, 0.1, 0.2]), known([0.5; 3]), known([NO; 3])];
        let all: Vec<_> = all.iter().collect();
        // Volumes after one: 1e-3, 1/51, 0.09; mean squares: 0.67, 0.35, 0.2.
        assert_eq!(choose(Criterion::D, &prior, &all, 3, 2), [0, 1]);
        assert_eq!(choose(Criterion::A, &prior, &all, 3, 3), [2, 1, 0]);
    }

    #[test]
    fn a_number_that_is_none_is_never_chosen() {
        let mut broken = known([1e-3; 3]);
        broken.add_known(1, f64::MIN_POSITIVE);
        let sound = known([0.9; 3]);
        for criterion in [Criterion::D, Criterion::A] {
            assert_eq!(choose(criterion, &known([1.0; 3]), &[&broken, &sound], 3, 1), [1]);
            assert_eq!(choose(criterion, &known([1.0; 3]), &[&broken], 3, 1), [0; 0]);
        }
    }

    #[test]
    fn uncertainty_is_a_standard_deviation() {
        let information = known([0.1, 0.2, 0.4]);
        assert!((Criterion::D.uncertainty(&information, 3) - 0.2).abs() < 1e-12);
        let mean_square = (0.01 + 0.04 + 0.16) / 3.0_f64;
        assert!((Criterion::A.uncertainty(&information, 3) - mean_square.sqrt()).abs() < 1e-12);
    }
}
