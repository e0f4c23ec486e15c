//! Levels of a fit that begins at the end of a descent.
//!
//! A descent allows for relative errors η of the model. A fit that weighs by the noise alone goes from its end to a minimum nearby, in
//! which a few bushings are wrong, and imperfections make up for them. So the fit allows for errors at first, too: the variance of each
//! axis is
//!
//! ```text
//! σ² + η² (|A_x|² + |A_y|² + |A_z|²)/3
//! ```
//!
//! Other than in a descent the measured acceleration alone counts, so that the weights do not depend on the unknowns; and its mean over the
//! axes, so that no axis weighs more because the arm hardly moves along it. Each level has a smaller η, and begins at the minimum of the level
//! before.

use super::super::Outcome;
use super::super::levels::{LAST_RELATIVE, RELATIVE};
use super::super::stagnation::{OF_PLANT, Stagnation};
use super::Plant;

/// η of each level; then the noise alone weighs. Chosen: those of the descent. Of seven drawn six-joint arms the first start finds the right
/// minimum of all with these levels, and of four without.
const LEVELS: [f64; 2] = [RELATIVE, LAST_RELATIVE];

/// Relative decrease of the sum of squares in a step below which a level ends. Chosen: a level is to end in the basin of the next one, not
/// at its own minimum; with a tenth of this twice as many steps lead to the same minima.
const LEVEL_IS_OVER: f64 = 1e-2;

impl Plant {
    /// The fit begins at the end of a descent.
    pub(super) fn begin_levels(&mut self) {
        self.relative_error = LEVELS[0];
    }

    /// The fit weighs by the noise alone.
    pub(super) fn end_levels(&mut self) {
        self.relative_error = 0.0;
    }

    /// Returns whether the noise alone weighs.
    pub(super) fn is_on_last_level(&self) -> bool {
        self.relative_error == 0.0
    }

    /// Goes on to the next level if this one is over: after this outcome of a step from where the sum of squares was `before`. Returns
    /// whether it has.
    pub(super) fn go_on_to_next_level(&mut self, outcome: Outcome, before: f64) -> bool {
        let gain = before - self.minimiser.normal.sum_of_squares();
        let is_negligible = gain > 0.0 && gain < LEVEL_IS_OVER * before;
        if self.is_on_last_level() || outcome == Outcome::Improving && !is_negligible {
            return false;
        }
        let level = &mut self.relative_error;
        *level = LEVELS.into_iter().find(|next| *next < *level).unwrap_or(0.0);
        self.minimiser.restart();
        self.stagnation = Stagnation::new(OF_PLANT);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::plant;
    use super::*;

    #[test]
    fn a_level_ends_where_a_step_gains_little_or_nothing() {
        for (outcome, before, is_over) in [
            (Outcome::Improving, f64::INFINITY, false),
            (Outcome::Improving, 1100.0, false),
            (Outcome::Improving, 1009.0, true),
            // A step that was rejected.
            (Outcome::Improving, 1000.0, false),
            (Outcome::Converged, 1000.0, true),
            (Outcome::Exhausted, 1100.0, true),
        ] {
            let mut plant = plant();
            plant.minimiser.normal.reset(0);
            *plant.minimiser.normal.entry(0, 0) = 1000.0;
            plant.begin_levels();
            assert_eq!(plant.go_on_to_next_level(outcome, before), is_over, "{outcome:?} {before}");
            let expected = if is_over { 0.0125 } else { 0.05 };
            assert_eq!(plant.relative_error, expected, "{outcome:?} {before}");
            assert!(plant.go_on_to_next_level(Outcome::Converged, before));
            let went_on = plant.go_on_to_next_level(Outcome::Converged, before);
            assert_eq!([went_on, plant.is_on_last_level()], [!is_over, true]);
            assert!(!plant.go_on_to_next_level(Outcome::Converged, before));
        }
    }
}
