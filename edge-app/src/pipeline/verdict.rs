//! How far a parameter can be trusted, by its relative standard deviation.

use flexid_wire::report::Verdict;

/// Up to this relative standard deviation a parameter is identified.
const IDENTIFIED: f64 = 0.05;
/// Up to this one it is weak; beyond, the data do not tell it.
const WEAK: f64 = 0.30;

/// The verdict on a parameter, and its standard deviation where there is one to speak of.
pub(super) fn verdict(value: f64, standard_deviation: f64) -> (Verdict, Option<f64>) {
    let relative = standard_deviation / value;
    if !value.is_finite() || !(0.0..=WEAK).contains(&relative) {
        (Verdict::NotObservable, None)
    } else if relative <= IDENTIFIED {
        (Verdict::Identified, Some(standard_deviation))
    } else {
        (Verdict::Weak, Some(standard_deviation))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_confident_number_without_data() {
        assert_eq!(verdict(1e7, 5e5), (Verdict::Identified, Some(5e5)));
        assert_eq!(verdict(1e7, 5.1e5), (Verdict::Weak, Some(5.1e5)));
        assert_eq!(verdict(1e7, 3.1e6), (Verdict::NotObservable, None));
        for nothing in [f64::INFINITY, f64::NAN, -1.0] {
            assert_eq!(verdict(1e7, nothing), (Verdict::NotObservable, None));
            assert_eq!(verdict(nothing, 1.0), (Verdict::NotObservable, None));
        }
    }
}
