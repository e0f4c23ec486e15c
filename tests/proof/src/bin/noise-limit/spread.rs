//! The scatter of a right figure over a number of runs, by which a limit fits the number of runs.

/// Chance of a right figure beyond its limit, on one side. Three dozen parameters then pass in 99 of 100 proofs.
const CHANCE: f64 = 1e-4;
/// The chance in standard deviations of a normal variable.
pub(crate) const DEVIATIONS: f64 = 3.72;
/// Number of errors from which on the limits of a single parameter need not widen: the share of its intervals that
/// cover passes 92 or 98 %, and its root mean square 0.9 or 1.1, less often than [`CHANCE`].
pub(crate) const ENOUGH: usize = 863;

/// Least and largest count of successes in `trials` of probability `share` each.
pub(crate) fn counts(trials: usize, share: f64) -> [usize; 2] {
    let n = trials as f64;
    let odds = (share / (1.0 - share)).ln();
    let mut logarithm = n * (1.0 - share).ln();
    let (mut below, mut least, mut most) = (0.0, None, trials);
    for k in 0..=trials {
        below += logarithm.exp();
        if below > CHANCE && least.is_none() {
            least = Some(k);
        }
        if 1.0 - below <= CHANCE {
            most = k;
            break;
        }
        logarithm += ((n - k as f64) / (k as f64 + 1.0)).ln() + odds;
    }
    [least.unwrap_or(0), most]
}

/// Limits of the percentage of successes in `trials` of probability `share`: `[least, most]` unless the trials
/// scatter beyond.
pub(crate) fn percentages(trials: usize, share: f64, [least, most]: [f64; 2]) -> [f64; 2] {
    let percent = |count: usize| 100.0 * count as f64 / trials.max(1) as f64;
    let [fewest, largest] = counts(trials, share).map(percent);
    [least.min(fewest), most.max(largest)]
}

/// Distance of a figure from the `right` one, as a part of that of its limits.
pub(crate) fn off(value: f64, right: f64, [least, most]: [f64; 2]) -> f64 {
    if value < right {
        (right - value) / (right - least)
    } else if most >= 100.0 {
        // A share of 100 % of a few intervals is no fault.
        0.0
    } else {
        (value - right) / (most - right)
    }
}

/// Limits of the root mean square of standard normal errors, `[least, most]` (Wilson and Hilferty, 1931).
pub(crate) fn root_mean_squares(errors: usize) -> [f64; 2] {
    let variance = 2.0 / (9.0 * errors.max(1) as f64);
    [-DEVIATIONS, DEVIATIONS].map(|off| (1.0 - variance + off * variance.sqrt()).max(0.0).powf(1.5))
}

/// Limits of the root mean square: `[least, most]` unless the errors scatter beyond.
pub(crate) fn root_mean_squares_beyond(errors: usize, [least, most]: [f64; 2]) -> [f64; 2] {
    let [lowest, highest] = root_mean_squares(errors);
    [least.min(lowest), most.max(highest)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_tables() {
        assert_eq!(counts(1000, 0.95), [923, 974]);
        assert_eq!(counts(40, 0.95), [31, 40]);
        assert_eq!(counts(1, 0.95), [0, 1]);
        // χ² of 10 exceeds 35.56 with a chance of 1e-4, of 1000 exceeds 1175.
        assert!((root_mean_squares(10)[1] - 3.556_f64.sqrt()).abs() < 0.02);
        assert!((root_mean_squares(1000)[1] - 1.175_f64.sqrt()).abs() < 0.01);
        // χ² of 1000 falls below 842.2 with the same chance.
        assert!((root_mean_squares(1000)[0] - 0.8422_f64.sqrt()).abs() < 0.001);
        assert_eq!(root_mean_squares(1)[0], 0.0);
    }

    #[test]
    fn enough_leave_the_limits_alone() {
        let (shares, sizes) = ([92.0, 98.0], [0.9, 1.1]);
        for errors in ENOUGH..=1200 {
            assert_eq!(percentages(errors, 0.95, shares), shares);
            assert_eq!(root_mean_squares_beyond(errors, sizes), sizes);
        }
        assert_ne!(percentages(ENOUGH - 1, 0.95, shares), shares);
        assert_ne!(root_mean_squares_beyond(700, sizes), sizes);
    }
}
