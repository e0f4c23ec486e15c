//! A fit that counts some of the bins at first.
//!
//! Some of the bins suffice to see that a minimum is wrong: no plausible imperfections explain the records from there. A fit whose imperfections
//! are plausible, or that explains the records, goes on with all bins, and mostly a few steps suffice. Any other ends there, and is evaluated
//! with all bins.

use super::Plant;
use crate::chi_square::noise_explains;

/// Largest distance of the bins that count. Chosen: a resonance that lies between two of them is missed at first, and found with all
/// bins; the drawn plants and the single errors of `noise-limit` end as with all bins from the start.
const THINNING: usize = 4;

/// Least gain of a step of a fit with some of the bins that does not stagnate. Chosen: the five steps after which a fit is given up then lower
/// the sum of squares by a half at most, over all bins by two.
const LEAST_GAIN: f64 = 0.1;

impl Plant {
    /// Counts one bin out of `most` from now on, or one out of four.
    pub(super) fn thin(&mut self, most: usize) {
        self.every = most.min(THINNING);
    }

    /// Returns the least gain of a step that does not stagnate.
    pub(super) fn least_gain(&self) -> f64 {
        if self.every > 1 { LEAST_GAIN } else { 0.0 }
    }

    /// Returns whether the minimum where the fit has ended may be the right one: its imperfections are those of a plausible plant, or noise
    /// explains what they leave of so many residuals.
    pub(super) fn may_explain(&self, residuals: usize) -> bool {
        let count = self.imperfections.all.len();
        let of_priors: f64 = self.point.imperfections[..count].iter().map(|p| p * p).sum();
        let sum_of_squares = self.minimiser.normal.sum_of_squares() - of_priors;
        self.is_plausible() || noise_explains(sum_of_squares, residuals as f64)
    }

    /// Counts all bins from now on. Returns whether that changes anything; the fit then goes on from where it stands.
    pub(super) fn count_all_bins(&mut self) -> bool {
        let counted_some = self.every > 1;
        self.every = 1;
        if counted_some {
            self.minimiser.renew();
        }
        counted_some
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::plant;

    #[test]
    fn all_bins_begin_to_count_once() {
        let mut plant = plant();
        plant.thin(6);
        plant.minimiser.linearised = true;
        assert_eq!([(); 2].map(|()| plant.count_all_bins()), [true, false]);
        assert!(!plant.minimiser.linearised);
    }

    /// A plant of which every imperfection is as far off as this, where the sum of squares of a thousand residuals and of the priors is as large.
    #[test]
    fn implausible_imperfections_may_be_right_where_noise_explains_the_rest() {
        for (p, times, expected) in
            [(1.0, 5.0, true), (3.0, 1.2, true), (3.0, 1.4, false), (3.0, f64::NAN, false)]
        {
            let mut plant = plant();
            let count = plant.imperfections.all.len();
            plant.point.imperfections[..count].fill(p);
            plant.minimiser.normal.reset(0);
            *plant.minimiser.normal.entry(0, 0) = 1000.0 * times + count as f64 * p * p;
            assert_eq!(plant.may_explain(1000), expected, "{p} {times}");
        }
    }
}
