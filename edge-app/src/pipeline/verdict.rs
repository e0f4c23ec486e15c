//! How far a parameter can be trusted, by its relative standard deviation.

use flexid_core::identify::{Acceptance, Estimate};
use flexid_wire::report::Verdict;

/// Up to this relative standard deviation a parameter is identified.
const IDENTIFIED: f64 = 0.05;
/// Up to this one it is weak; beyond, the data do not tell it.
const WEAK: f64 = 0.30;

/// What the fit as a whole says of every parameter in it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trust {
    /// Standard deviations are this much larger than the noise makes them; NaN where nothing is to be trusted.
    inflation: f64,
    /// Whether the minimum is known to be the right one.
    settled: bool,
}

impl Trust {
    /// Residuals that are larger than the noise explains come from something else that moves the parameters
    /// as well: as much as a noise of their size would.
    pub(super) fn new(estimate: &Estimate) -> Self {
        let consistency = estimate.consistency;
        let sane = consistency.is_finite() && consistency >= 0.0;
        Self {
            inflation: if sane { consistency.max(1.0).sqrt() } else { f64::NAN },
            settled: estimate.acceptance != Acceptance::Unsettled,
        }
    }

    /// The verdict on a parameter, and its standard deviation where there is one to speak of.
    pub(super) fn verdict(&self, value: f64, standard_deviation: f64) -> (Verdict, Option<f64>) {
        let standard_deviation = self.inflation * standard_deviation;
        let relative = standard_deviation / value;
        if !value.is_finite() || !(0.0..=WEAK).contains(&relative) {
            (Verdict::NotObservable, None)
        } else if relative <= IDENTIFIED && self.settled {
            (Verdict::Identified, Some(standard_deviation))
        } else {
            (Verdict::Weak, Some(standard_deviation))
        }
    }
}

#[cfg(test)]
mod tests {
    use flexid_core::parameters::Bushings;

    use super::*;

    const SOUND: Trust = Trust { inflation: 1.0, settled: true };

    #[test]
    fn no_confident_number_without_data() {
        assert_eq!(SOUND.verdict(1e7, 5e5), (Verdict::Identified, Some(5e5)));
        assert_eq!(SOUND.verdict(1e7, 5.1e5), (Verdict::Weak, Some(5.1e5)));
        assert_eq!(SOUND.verdict(1e7, 3.1e6), (Verdict::NotObservable, None));
        for nothing in [f64::INFINITY, f64::NAN, -1.0] {
            assert_eq!(SOUND.verdict(1e7, nothing), (Verdict::NotObservable, None));
            assert_eq!(SOUND.verdict(nothing, 1.0), (Verdict::NotObservable, None));
        }
    }

    #[test]
    fn no_confident_number_from_a_bad_fit() {
        let trust = |consistency, acceptance| {
            let bushings = Bushings::new();
            let standard_deviations = Bushings::new();
            Trust::new(&Estimate {
                bushings,
                standard_deviations,
                ssp_median: 0.0,
                ssp_max: 0.0,
                consistency,
                acceptance,
            })
        };
        let verdict = |consistency, acceptance| trust(consistency, acceptance).verdict(1e7, 1e5);
        assert_eq!(verdict(0.5, Acceptance::Consistent), (Verdict::Identified, Some(1e5)));
        let suspect = Acceptance::ModelSuspect;
        assert_eq!(verdict(4.0, suspect), (Verdict::Identified, Some(2e5)));
        assert_eq!(verdict(100.0, suspect), (Verdict::Weak, Some(1e6)));
        assert_eq!(verdict(1e4, suspect), (Verdict::NotObservable, None));
        assert_eq!(verdict(1.0, Acceptance::Unsettled), (Verdict::Weak, Some(1e5)));
        for broken in [f64::NAN, f64::INFINITY, -1.0] {
            let acceptance = Acceptance::Consistent;
            assert_eq!(verdict(broken, acceptance), (Verdict::NotObservable, None));
        }
    }
}
