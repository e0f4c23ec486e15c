//! How far an estimate can be trusted, from the information matrix of its fit: covariance, and a verdict on each parameter. The verdict
//! on the whole fit, its acceptance, is made in `identify::decision`.
//!
//! The information matrix `N` is the inverse covariance of the unknowns, which are all dimensionless: logarithms of
//! parameters, imperfections in units of their prior. [`Covariance`] is its inverse where it has one, [`Direction`]s are
//! its eigenvectors that the data determine badly, and [`Trust`] makes a verdict of a standard deviation.

mod covariance;
mod directions;
mod fisher;
mod rank;

pub use covariance::Covariance;
pub(crate) use directions::weak_directions;
pub use directions::{Direction, MAX_DIRECTIONS};
pub(crate) use fisher::fisher_exceeds;
#[cfg(test)]
pub(crate) use rank::testing;

/// Relative standard deviation up to which a parameter is identified. Chosen: its 95 % interval is then ± 10 %.
const IDENTIFIED: f64 = 0.05;
/// χ² per degree of freedom above which nothing is identified. Chosen: noise then explains less than half of the residuals. The cause of the rest
/// may have moved the parameters, or the minimum may be a wrong one.
const SUSPECT: f64 = 2.0;
/// χ² per degree of freedom above which no standard deviation can be trusted. Chosen: the residuals are then three times as large as the noise,
/// and the other errors of the model are unknown.
pub const FOREIGN: f64 = 10.0;
/// Relative standard deviation up to which a parameter is weak; beyond, the data do not determine it. Chosen: its 95 % interval then reaches to a
/// factor of 1.8 either way.
pub const WEAK: f64 = 0.30;

/// How far a parameter can be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The data determine it: its standard deviation is at most 5 % of its value.
    Identified,
    /// The data determine it roughly: to at most 30 %, or in a fit that may have missed the right minimum.
    Weak,
    /// The data do not determine it.
    NotObservable,
}

/// How far the fit as a whole can be trusted: the same for all its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trust {
    /// Factor on the standard deviations that follow from the noise: √(χ²/dof), at least 1; NaN if χ² is not a number.
    inflation: f64,
    /// The minimum is the right one, and χ²/dof is not suspect.
    sound: bool,
}

impl Trust {
    /// Trust by χ² per degree of freedom of the fit, and whether the fit is sound: its minimum is known to be the right one, and no static test
    /// contradicts it.
    ///
    /// Residuals that are larger than the noise have another cause, which moves the parameters as well. Standard deviations grow
    /// as if the noise were of the residuals' size.
    pub fn new(consistency: f64, sound: bool) -> Self {
        let sane = consistency.is_finite() && consistency >= 0.0;
        let inflation = if sane { libm::sqrt(consistency.max(1.0)) } else { f64::NAN };
        Self { inflation, sound: sound && consistency <= SUSPECT }
    }

    /// [`Trust::new`] for standard deviations that hold also where the residuals are not those of noise. The right minimum is known
    /// otherwise: the imperfections there are those of a plausible plant.
    pub fn robust(consistency: f64, sound: bool) -> Self {
        let sound = sound && consistency <= FOREIGN;
        Self { sound, ..Self::new(consistency, sound) }
    }

    /// The verdict on a parameter, and its standard deviation, in the unit of the value; none for a parameter that is not observable.
    pub fn verdict(&self, value: f64, standard_deviation: f64) -> (Verdict, Option<f64>) {
        let standard_deviation = self.inflation * standard_deviation;
        let relative = standard_deviation / value;
        if !value.is_finite() || !(0.0..=WEAK).contains(&relative) {
            (Verdict::NotObservable, None)
        } else if relative <= IDENTIFIED && self.sound {
            (Verdict::Identified, Some(standard_deviation))
        } else {
            (Verdict::Weak, Some(standard_deviation))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_confident_number_without_data() {
        let sound = Trust::new(1.0, true);
        assert_eq!(sound.verdict(1e7, 5e5), (Verdict::Identified, Some(5e5)));
        assert_eq!(sound.verdict(1e7, 5.1e5), (Verdict::Weak, Some(5.1e5)));
        assert_eq!(sound.verdict(1e7, 3.1e6), (Verdict::NotObservable, None));
        for nothing in [f64::INFINITY, f64::NAN, -1.0] {
            assert_eq!(sound.verdict(1e7, nothing), (Verdict::NotObservable, None));
            assert_eq!(sound.verdict(nothing, 1.0), (Verdict::NotObservable, None));
        }
    }

    #[test]
    fn robust_deviations_are_believed_in_a_worse_fit() {
        let verdict = |consistency, sound| Trust::robust(consistency, sound).verdict(1e7, 1e5);
        assert_eq!(verdict(4.0, true), (Verdict::Identified, Some(2e5)));
        assert_eq!(verdict(9.9, true).0, Verdict::Identified);
        assert_eq!(verdict(10.1, true).0, Verdict::Weak);
        assert_eq!(verdict(4.0, false).0, Verdict::Weak);
        assert_eq!(verdict(f64::NAN, true), (Verdict::NotObservable, None));
    }

    #[test]
    fn no_confident_number_from_a_bad_fit() {
        let verdict = |consistency, sound| Trust::new(consistency, sound).verdict(1e7, 1e5);
        assert_eq!(verdict(0.5, true), (Verdict::Identified, Some(1e5)));
        assert_eq!(verdict(1.96, true), (Verdict::Identified, Some(1.4e5)));
        assert_eq!(verdict(2.01, true).0, Verdict::Weak);
        assert_eq!(verdict(100.0, true), (Verdict::Weak, Some(1e6)));
        assert_eq!(verdict(1e4, true), (Verdict::NotObservable, None));
        assert_eq!(verdict(1.0, false), (Verdict::Weak, Some(1e5)));
        for broken in [f64::NAN, f64::INFINITY, -1.0] {
            assert_eq!(verdict(broken, true), (Verdict::NotObservable, None));
        }
    }
}
