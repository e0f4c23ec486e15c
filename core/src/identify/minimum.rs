//! What a refinement has come to, and whether noise explains it.

use crate::refine::Fit;
use crate::unknowns::Coordinates;

/// χ² per degree of freedom up to which noise explains the residuals, if they are many. The noise itself is known from a
/// few hundred quiet samples to 7 % of its power; the nearest wrong basin of the reference scenario lies at 2.
const CONSISTENT: f64 = 1.3;
/// Whiteness up to which noise explains the residuals' structure.
const STRUCTURED: f64 = 4.0;
/// Median SSP up to which the records stand clear of the noise: with ten times the noise of the reference scenario (0.14)
/// one wrong basin in twenty has residuals that noise explains.
const CLEAR: f64 = 0.05;
/// Two minima are the same if their sums of squares differ by less than 1, and this part of them.
const SAME_MINIMUM: f64 = 1e-4;

/// Where a refinement has ended.
#[derive(Clone, Debug)]
pub(super) struct Minimum {
    pub(super) coordinates: Coordinates,
    pub(super) fit: Fit,
    pub(super) converged: bool,
    /// How often it has been reached.
    pub(super) times: u32,
    /// Retired records and those that are kept are not of the same robot.
    pub(super) contradicted: bool,
}

impl Minimum {
    pub(super) fn new(coordinates: Coordinates, fit: Fit, converged: bool) -> Self {
        let contradicted = fit.contradiction > rarely_exceeded(fit.covariance.rank() as f64);
        Self { coordinates, fit, converged, times: 1, contradicted }
    }

    /// The residuals are larger than noise explains.
    pub(super) fn size_objects(&self) -> bool {
        !noise_explains(self.fit.sum_of_squares, self.fit.degrees_of_freedom)
    }

    /// They have more structure along the band than noise explains; what is no number has.
    pub(super) fn whiteness_objects(&self) -> bool {
        self.fit.whiteness.is_nan() || self.fit.whiteness > STRUCTURED
    }

    /// The static tests' residuals by themselves are larger than their noise leaves them; what is no number is.
    pub(super) fn statics_object(&self) -> bool {
        let most = rarely_exceeded(self.fit.static_residuals as f64);
        !(0.0..=most).contains(&self.fit.static_sum_of_squares)
    }

    /// The noise is too small to hide a wrong basin.
    pub(super) fn stands_clear(&self) -> bool {
        self.fit.ssp[0] <= CLEAR
    }

    /// Noise explains the residuals, and by themselves those of the static tests, which the many of the records would
    /// outvote.
    pub(super) fn is_consistent(&self) -> bool {
        !self.size_objects() && !self.statics_object()
    }

    /// Noise explains the residuals, and hides nothing; and no older record objects.
    pub(super) fn is_beyond_doubt(&self) -> bool {
        self.converged && self.is_consistent() && self.stands_clear() && !self.contradicted
    }

    /// Becomes the better of the two; what has been reached twice has been reached as often as both.
    pub(super) fn compete(&mut self, mut other: Self) {
        let same = self.is_as_good_as(&other);
        if same && self.converged && other.converged {
            let times = self.times + other.times;
            (self.times, other.times) = (times, times);
        }
        // Of one that did not get there and the same that did, the latter.
        let better = if same && self.converged != other.converged {
            other.converged
        } else {
            other.fit.objective < self.fit.objective
        };
        if better {
            *self = other;
        }
    }

    /// It is the same minimum, by what a refinement makes least.
    fn is_as_good_as(&self, other: &Self) -> bool {
        let (own, other) = (self.fit.objective, other.fit.objective);
        (own - other).abs() <= 1.0 + SAME_MINIMUM * other
    }

    /// Whether the contradiction of retired records is more than the model's own error makes, which differs from cut to cut:
    /// that error is what noise does not explain of `alone`, the records that are kept without them.
    pub(super) fn is_contradicted_beyond(&self, alone: &Self) -> bool {
        let error = (alone.fit.sum_of_squares - alone.fit.degrees_of_freedom).max(0.0);
        self.fit.contradiction > rarely_exceeded(self.fit.covariance.rank() as f64) + error
    }

    /// There are more residuals than unknowns, so that a wrong model would show.
    pub(super) fn is_tested(&self) -> bool {
        self.fit.degrees_of_freedom >= 1.0
    }
}

/// Whether noise leaves a sum of squares of this size; none that is no number.
fn noise_explains(sum_of_squares: f64, degrees_of_freedom: f64) -> bool {
    let most = (CONSISTENT * degrees_of_freedom).max(rarely_exceeded(degrees_of_freedom));
    (0.0..=most).contains(&sum_of_squares)
}

/// What χ² of so many degrees of freedom exceeds with a chance below e⁻¹⁰ (Laurent and Massart, 2000, lemma 1).
fn rarely_exceeded(degrees_of_freedom: f64) -> f64 {
    degrees_of_freedom + 2.0 * libm::sqrt(10.0 * degrees_of_freedom) + 2.0 * 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_residuals_may_be_larger_than_many() {
        for (sum_of_squares, degrees_of_freedom, explained) in [
            (12_900.0, 10_000.0, true),
            (13_100.0, 10_000.0, false),
            (30.0, 10.0, true),
            (60.0, 10.0, false),
            (f64::NAN, 10.0, false),
            (f64::INFINITY, 10.0, false),
            (-1.0, 10.0, false),
        ] {
            let told = noise_explains(sum_of_squares, degrees_of_freedom);
            assert_eq!(told, explained, "{sum_of_squares} of {degrees_of_freedom}");
        }
    }
}
