//! A fit that counts some of the bins at first.
//!
//! From a wrong minimum no imperfections explain the records, which some of the bins show as well as all. A fit that has come to its
//! end with these has a few steps left with all.

use super::Plant;
use crate::spectrum::thinned::THINNING;

/// Least number of bins of a record that count. Chosen: their 768 residuals are eight times the unknowns of the seam of seven joints.
const LEAST_BINS: usize = 128;

impl Plant {
    /// From now on as few of the bins count as in a descent, or as the record of the fewest allows.
    pub(super) fn thin(&mut self, fewest: usize) {
        self.every = (fewest / LEAST_BINS).clamp(1, THINNING);
    }

    /// From now on all bins count. Returns whether that changes anything; the fit then goes on from where it stands.
    pub(super) fn count_all_bins(&mut self) -> bool {
        let counted_some = self.every > 1;
        self.every = 1;
        if counted_some {
            self.minimiser.restart();
        }
        counted_some
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::plant;
    use crate::refine::Outcome;

    #[test]
    fn a_short_record_keeps_more_of_its_bins() {
        for (fewest, expected) in [(0, 1), (255, 1), (256, 2), (400, 3), (512, 4), (100_000, 4)] {
            let mut plant = plant();
            plant.thin(fewest);
            assert_eq!(plant.every, expected, "{fewest}");
        }
    }

    /// The accuracies are contradicted or not.
    #[test]
    fn a_fit_ends_with_all_bins() {
        for (outcome, are_contradicted, expected) in [
            (Outcome::Converged, false, [true, false, false]),
            (Outcome::Converged, true, [true, true, false]),
            (Outcome::Exhausted, false, [true, false, false]),
            (Outcome::Exhausted, true, [true, true, false]),
        ] {
            let mut plant = plant();
            plant.point.imperfections.fill(if are_contradicted { 10.0 } else { 0.0 });
            plant.thin(1000);
            let goes_on = [(); 3].map(|()| plant.goes_on_after(outcome));
            assert_eq!(goes_on, expected, "{outcome:?} {are_contradicted}");
            assert_eq!(plant.every, 1);
        }
    }

    /// From a minimum of some of the bins the fit goes on; from none it takes a last step.
    #[test]
    fn a_fit_that_finds_no_minimum_of_some_bins_is_given_up() {
        for (outcome, is_last) in [(Outcome::Converged, false), (Outcome::Exhausted, true)] {
            let mut plant = plant();
            plant.thin(1000);
            assert!(plant.goes_on_after(outcome));
            assert_eq!(plant.stagnation.ends_fit(900.0, 100), is_last, "{outcome:?}");
        }
    }
}
