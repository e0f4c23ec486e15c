//! A fit that counts some of the bins at first.
//!
//! From a wrong minimum no imperfections explain the records, which some of the bins show as well as all. From a minimum of these the fit
//! goes on with all bins, and a few steps suffice. Any other fit ends there, and is evaluated with all bins. Only the records have fewer
//! residuals: static tests and the priors of the imperfections keep their weight.

use super::Plant;

/// Largest distance of the bins that count. Chosen: a resonance that lies between two of them is missed at first, and found with all
/// bins; the drawn plants and the single errors of `noise-limit` end as with all bins from the start.
const THINNING: usize = 4;

/// Least number of bins of a record that count. Chosen: their 768 residuals are eight times the unknowns of the seam of seven joints.
const LEAST_BINS: usize = 128;

impl Plant {
    /// From now on one bin out of four counts, or as few as the record of the fewest allows.
    pub(super) fn thin(&mut self, fewest: usize) {
        self.every = (fewest / LEAST_BINS).clamp(1, THINNING);
    }

    /// From now on all bins count. Returns whether that changes anything; the fit then goes on from where it stands.
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
    fn a_short_record_keeps_more_of_its_bins() {
        for (fewest, expected) in [(0, 1), (255, 1), (256, 2), (400, 3), (512, 4), (100_000, 4)] {
            let mut plant = plant();
            plant.thin(fewest);
            assert_eq!(plant.every, expected, "{fewest}");
        }
    }

    #[test]
    fn all_bins_begin_to_count_once() {
        let mut plant = plant();
        plant.thin(1000);
        plant.minimiser.linearised = true;
        assert_eq!([(); 2].map(|()| plant.count_all_bins()), [true, false]);
        assert!(!plant.minimiser.linearised);
    }
}
