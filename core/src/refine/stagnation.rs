//! Criterion for giving up a fit.
//!
//! From a wrong basin no parameters and no imperfections explain the records, and a branch may lead to no better minimum. The fit would
//! still gain a little with every step.

/// Stagnating steps in a row after which a fit to a plant is given up. Chosen: of 541 fits to plants with one large error (`noise-limit --only
/// deviations --robots 129`), the 371 that end below a χ² per degree of freedom of 2 stagnate for at most two steps, rejected ones included;
/// with eight steps these and the drawn plants end as with five.
pub(super) const OF_PLANT: u32 = 5;
/// Stagnating steps in a row after which a branch is given up. Chosen: it refines the parameters alone, and its first steps are hardly damped; up
/// to ten are rejected before one is good.
pub(crate) const OF_BRANCH: u32 = 12;
/// Part of the excess of the sum of squares over its target that a step must gain, or it stagnates. Chosen: the excess would else need sixty
/// steps to fall to a twentieth.
const LITTLE: f64 = 0.05;

/// Progress of the last steps of a fit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stagnation {
    sum_of_squares: f64,
    /// Steps in a row that have gained too little.
    steps: u32,
    /// Such steps after which the fit is given up.
    patience: u32,
}

impl Stagnation {
    pub(crate) const fn new(patience: u32) -> Self {
        Self { sum_of_squares: f64::INFINITY, steps: 0, patience }
    }

    /// Takes the sum of squares after a step, and returns whether the fit is to be given up. A step stagnates if it gains too little of the
    /// excess over `target`, or if it was kept and gains less than `least`. A step that was rejected without an excess leaves the count as it is.
    pub(crate) fn ends_fit(&mut self, sum_of_squares: f64, target: f64, least: f64) -> bool {
        let lacks = sum_of_squares - target;
        let gain = self.sum_of_squares - sum_of_squares;
        let was_kept = gain > 0.0;
        if gain < LITTLE * lacks || (was_kept && gain < least) {
            self.steps += 1;
        } else if was_kept {
            self.steps = 0;
        }
        self.sum_of_squares = sum_of_squares;
        self.steps >= self.patience
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps_until_the_end(course: &dyn Fn(i32) -> f64, least: f64) -> Option<usize> {
        let mut stagnation = Stagnation::new(OF_PLANT);
        (0..50).position(|step| stagnation.ends_fit(course(step), 1000.0, least))
    }

    /// The sum of squares should come down to 1000.
    #[test]
    fn a_fit_that_stagnates_is_given_up() {
        let steps_until_the_end = |course: &dyn Fn(i32) -> f64| steps_until_the_end(course, 0.0);
        assert_eq!(steps_until_the_end(&|_| 2000.0), Some(5));
        assert_eq!(steps_until_the_end(&|step| 1000.0 + 1e5 * 0.97_f64.powi(step)), Some(5));
        assert_eq!(steps_until_the_end(&|step| 1000.0 + 1e5 * 0.9_f64.powi(step)), None);
        assert_eq!(steps_until_the_end(&|step| if step < 4 { 3000.0 } else { 2000.0 }), Some(9));
        assert_eq!(steps_until_the_end(&|_| 999.0), None);
    }

    /// The sum of squares is below 1000, and falls by the same in each step. A step that was rejected does not count.
    #[test]
    fn a_fit_that_gains_less_than_the_least_is_given_up() {
        let falls_by = |gain: f64| steps_until_the_end(&|step| 900.0 - gain * f64::from(step), 0.1);
        assert_eq!([0.0, 0.09, 0.11].map(falls_by), [None, Some(5), None]);
        // Every other step is rejected.
        let halting = |step: i32| 900.0 - 0.09 * f64::from(step / 2);
        assert_eq!(steps_until_the_end(&halting, 0.1), Some(10));
    }
}
