//! The limit of the work on a set of records.
//!
//! On a plant that no model explains, no minimum is accepted, and each is fitted to the plant, its branches are refined, and another search
//! begins. The answer then is that the estimate is unsettled, and it must come in time: once the work is spent, the best minimum so far is
//! settled on. The work is counted in steps, not by the clock, so that the same records give the same estimate on any machine.

/// Bins of three records of four seconds, from 2 to 200 Hz.
const USUAL_BINS: f64 = 2433.0;
/// Most work on a set of records. Chosen: with six joints a step takes 8 to 12 ms a record of 811 bins (AVX2), so that three records take 20 s;
/// ten drawn six-joint robots, whose fits are consistent, take 60 to 213 steps, most of them with some of the bins.
const MOST: f64 = 600.0;
/// How many times more once a minimum has been accepted: its branches are all refined, and they are not endless.
const TIMES_ACCEPTED: f64 = 4.0;
/// The same of the last fit to a plant. Chosen: thirty steps with all bins; plants that it explains take eight to fifteen.
const MOST_OF_LAST_FIT: f64 = 120.0;
/// A step of a fit to a plant. Found: with six joints and all imperfections it takes 3.6 times as long.
const OF_PLANT: f64 = 4.0;
/// A step of a descent, and a sample of a random search, which take single precision and a quarter of the bins. Found: a twenty-fifth.
const OF_SEARCH: f64 = 0.04;

/// Work, in steps of the refinement with all bins of three usual records, or of all records where these have more.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Work(f64);

impl Work {
    /// Adds a step of the refinement with one out of `every` of so many bins.
    pub(super) fn add_step(&mut self, bins: usize, every: usize) {
        self.0 += part(bins) / every as f64;
    }

    /// Adds a step of a fit to a plant.
    pub(super) fn add_plant_step(&mut self, bins: usize, every: usize) {
        self.0 += OF_PLANT * part(bins) / every as f64;
    }

    /// Adds a step of a search.
    pub(super) fn add_search(&mut self, bins: usize) {
        self.0 += OF_SEARCH * part(bins);
    }

    /// Whether it is spent, where a minimum has been accepted or not.
    pub(super) fn is_spent(self, has_accepted: bool) -> bool {
        self.0 > if has_accepted { TIMES_ACCEPTED * MOST } else { MOST }
    }

    /// Whether that of the last fit to a plant is spent.
    pub(super) fn is_spent_on_last_fit(self) -> bool {
        self.0 > MOST_OF_LAST_FIT
    }
}

/// A step with so many bins.
fn part(bins: usize) -> f64 {
    (bins as f64 / USUAL_BINS).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Some of the bins, short records and searches cost as much less as they take; more records do not.
    #[test]
    fn a_step_costs_what_it_takes() {
        let spent_after = |add: fn(&mut Work)| {
            let mut work = Work::default();
            let ends = (0..100_000).position(|_| {
                add(&mut work);
                work.is_spent(false)
            });
            ends.expect("an end")
        };
        let is_about = |steps: usize, expected: usize| steps.abs_diff(expected) <= 1;
        assert!(is_about(spent_after(|work| work.add_step(2433, 1)), 600));
        assert!(is_about(spent_after(|work| work.add_step(6488, 1)), 600));
        assert!(is_about(spent_after(|work| work.add_step(2433, 4)), 2400));
        assert!(is_about(spent_after(|work| work.add_step(811, 1)), 1800));
        assert!(is_about(spent_after(|work| work.add_plant_step(2433, 4)), 600));
        assert!(is_about(spent_after(|work| work.add_search(2433)), 15_000));
    }
}
