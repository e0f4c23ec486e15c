//! Fits that count some of the bins.
//!
//! Some of the bins suffice to see that a place is no minimum, or a worse one, at a part of the cost. They may reject, and never accept. Only the
//! records have fewer residuals then: static tests and priors keep their weight.

use super::Problem;
use crate::spectrum::Experiment;

/// Least number of bins of a record that count. Chosen: their 768 residuals are eight times the unknowns of the seam of seven joints.
const LEAST_BINS: usize = 128;

/// Distance of the bins that count, as large as the part of a record with the fewest bins allows; 1 where all must count.
pub(crate) fn distance<const B: usize>(experiments: &[Experiment<B>]) -> usize {
    let fewest = experiments.iter().map(Experiment::bins_of_part).min().unwrap_or(0);
    of_bins(fewest)
}

fn of_bins(fewest: usize) -> usize {
    (fewest / LEAST_BINS).max(1)
}

/// Number of real residuals of the static tests, and of one out of `every` bin of all records.
pub(crate) fn residuals<const B: usize>(
    problem: &Problem<'_>,
    experiments: &[Experiment<B>],
    every: usize,
) -> usize {
    let of_records = experiments.iter().map(|experiment| experiment.residuals(every));
    let of_statics = problem.statics.iter().map(|test| test.readings().count());
    of_records.chain(of_statics).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_record_keeps_more_of_its_bins() {
        for (fewest, expected) in [(0, 1), (255, 1), (256, 2), (400, 3), (811, 6)] {
            assert_eq!(of_bins(fewest), expected, "{fewest}");
        }
    }
}
