//! Confidence intervals, the paired t-test, and its power.
//!
//! The methods are compared on the same robots, so that the differences between robots, which are large, drop
//! out: each comparison is one Student t-test of the differences. Distributions are those of `statrs`.

use statrs::distribution::{Chi, Continuous, ContinuousCDF, Normal, StudentsT};
use thiserror::Error;

/// Confidence of all intervals. The level of tests is one minus this.
pub const CONFIDENCE: f64 = 0.95;
/// Two-sided p below which a test is decided.
pub const SIGNIFICANT: f64 = 1.0 - CONFIDENCE;
/// Power that a test should have.
pub const POWER: f64 = 0.8;

/// Largest number of pairs that [`pairs_for_power`] considers.
pub const MAX_PAIRS: usize = 10_000;

/// Error of a statistic.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum StatisticsError {
    /// Fewer than two values, which have no spread.
    #[error("{0} values: there must be two or more")]
    TooFew(usize),
    /// The samples are not pairs.
    #[error("{0} values against {1}: there must be as many")]
    Unpaired(usize, usize),
    /// A value that is NaN or infinite.
    #[error("value {index} is {value}: must be finite")]
    NotFinite {
        /// Index of the value, from 0.
        index: usize,
        /// The value, or the difference that it gives.
        value: f64,
    },
}

/// A mean, and its confidence interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// Number of values.
    pub count: usize,
    /// Mean of the values.
    pub mean: f64,
    /// Standard deviation of the values, with count − 1.
    pub standard_deviation: f64,
    /// 95 % confidence interval of the mean, by Student's t.
    pub interval: [f64; 2],
}

/// Mean of `values`, with its confidence interval.
///
/// # Errors
/// Fewer than two values, or one that is not finite.
pub fn mean(values: &[f64]) -> Result<Mean, StatisticsError> {
    let count = values.len();
    let critical = critical(count)?;
    if let Some(index) = values.iter().position(|value| !value.is_finite()) {
        return Err(StatisticsError::NotFinite { index, value: values[index] });
    }
    let mean = values.iter().sum::<f64>() / count as f64;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let standard_deviation = (squares / (count - 1) as f64).sqrt();
    let half = critical * standard_deviation / (count as f64).sqrt();
    Ok(Mean { count, mean, standard_deviation, interval: [mean - half, mean + half] })
}

/// A paired t-test, two-sided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paired {
    /// Effect: the mean difference, first sample minus second, with its interval.
    pub difference: Mean,
    /// Probability of an effect as large if there is none. It is 0 if all differences are the same, and 1 if all are
    /// zero.
    pub p: f64,
}

/// Compares two samples whose values belong together one by one.
///
/// # Errors
/// Samples of unequal length, fewer than two pairs, or a difference that is not finite.
pub fn paired(first: &[f64], second: &[f64]) -> Result<Paired, StatisticsError> {
    if first.len() != second.len() {
        return Err(StatisticsError::Unpaired(first.len(), second.len()));
    }
    let differences: Vec<f64> = first.iter().zip(second).map(|(a, b)| a - b).collect();
    let difference = mean(&differences)?;
    let p = if difference.mean == 0.0 {
        1.0
    } else {
        let error = difference.standard_deviation / (difference.count as f64).sqrt();
        // Differences that are all the same give an infinite t, which has no probability.
        2.0 * student(difference.count)?.sf(difference.mean.abs() / error)
    };
    Ok(Paired { difference, p })
}

/// Probability that [`paired`] finds an effect (p < 0.05) with this many pairs, if `effect` is true and the
/// differences have this standard deviation. It is NaN for NaN, and 0 for fewer than two pairs.
pub fn power(effect: f64, standard_deviation: f64, pairs: usize) -> f64 {
    let size = if effect == 0.0 { 0.0 } else { (effect / standard_deviation).abs() };
    let shift = size * (pairs as f64).sqrt();
    let beyond =
        |limit: f64| Ok(noncentral_t(-limit, pairs, shift)? + noncentral_t(-limit, pairs, -shift)?);
    critical(pairs).and_then(beyond).map_or(0.0, |own| own.clamp(0.0, 1.0))
}

/// Fewest pairs with which [`paired`] has this power, or None beyond [`MAX_PAIRS`], for example without an effect.
pub fn pairs_for_power(effect: f64, standard_deviation: f64, wanted: f64) -> Option<usize> {
    let suffices = |pairs: usize| power(effect, standard_deviation, pairs) >= wanted;
    if !suffices(MAX_PAIRS) {
        return None;
    }
    let [mut too_few, mut enough] = [1, MAX_PAIRS];
    while enough - too_few > 1 {
        let middle = too_few.midpoint(enough);
        *(if suffices(middle) { &mut enough } else { &mut too_few }) = middle;
    }
    Some(enough)
}

/// The distribution of t over `count` values, two or more.
fn student(count: usize) -> Result<StudentsT, StatisticsError> {
    StudentsT::new(0.0, 1.0, count as f64 - 1.0).map_err(|_| StatisticsError::TooFew(count))
}

/// Value that |t| over `count` values exceeds by chance in one case of twenty.
fn critical(count: usize) -> Result<f64, StatisticsError> {
    Ok(student(count)?.inverse_cdf(0.5 + 0.5 * CONFIDENCE))
}

/// Probability that the noncentral t over `count` values, two or more, shifted by `shift`, is below `t`. It integrates the
/// definition (Z + shift) / (χ / √ν) over χ by Simpson's rule. N. L. Johnson, S. Kotz, N. Balakrishnan, "Continuous
/// Univariate Distributions" 2, 2nd ed., chapter 31. `statrs` has only the central one.
fn noncentral_t(t: f64, count: usize, shift: f64) -> Result<f64, StatisticsError> {
    const STEPS: usize = 2000;
    let freedoms = count.saturating_sub(1);
    let chi = Chi::new(freedoms as u64).map_err(|_| StatisticsError::TooFew(count))?;
    let freedom = freedoms as f64;
    let normal = Normal::standard();
    // χ is at √ν ± 1/√2, with normal tails. Its density is one-sided at 0, hence 0 there.
    let [lower, upper] =
        [-10.0, 10.0].map(|tail: f64| (freedom.sqrt() + tail).max(f64::MIN_POSITIVE));
    let step = (upper - lower) / STEPS as f64;
    let ordinate = |i: usize| {
        let x = lower + i as f64 * step;
        let weight = match i {
            0 | STEPS => 1.0,
            _ => (2 + 2 * (i % 2)) as f64,
        };
        weight * chi.pdf(x) * normal.cdf(t * x / freedom.sqrt() - shift)
    };
    Ok(step / 3.0 * (0..=STEPS).map(ordinate).sum::<f64>())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Extra hours of sleep by two drugs: Student, "The probable error of a mean", Biometrika 6, 1908.
    const DEXTRO: [f64; 10] = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0];
    const LAEVO: [f64; 10] = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4];

    fn assert_near(value: f64, expected: f64, tolerance: f64) {
        assert!((value - expected).abs() < tolerance, "{value} is not {expected}");
    }

    /// `scipy.stats.t.interval(0.95, 9, numpy.mean(laevo), scipy.stats.sem(laevo))`
    #[test]
    fn the_interval_is_students() {
        let found = mean(&LAEVO).unwrap();
        assert_near(found.mean, 2.33, 1e-12);
        assert_near(found.interval[0], 0.897_677_539_376_705, 1e-9);
        assert_near(found.interval[1], 3.762_322_460_623_294, 1e-9);
        // Two values have the widest tails: t is 12.706.
        let found = mean(&[1.0, 2.0]).unwrap();
        assert_near(found.interval[0], 1.5 - 0.5 * 12.706_204_736_174_69, 1e-8);
    }

    /// `scipy.stats.ttest_rel(dextro, laevo)`; Student's own p, one-sided, was 0.0014.
    #[test]
    fn the_test_is_students() {
        let found = paired(&DEXTRO, &LAEVO).unwrap();
        assert_eq!(found.difference.count, 10);
        assert_near(found.difference.mean, -1.58, 1e-12);
        assert_near(found.difference.standard_deviation, 1.229_995_483_279_873, 1e-12);
        assert_near(found.p, 0.002_832_890_197_384, 1e-10);
        assert_near(found.difference.interval[0], -2.459_885_763_276_983, 1e-9);
        assert_near(found.difference.interval[1], -0.700_114_236_723_018, 1e-9);
        let turned = paired(&LAEVO, &DEXTRO).unwrap();
        assert_eq!(turned.p, found.p);
        assert_eq!(turned.difference.mean, -found.difference.mean);
    }

    /// With d = effect / deviation, c = t.ppf(0.975, n - 1) and t from scipy.stats:
    /// `nct.sf(c, n - 1, d * sqrt(n)) + nct.cdf(-c, n - 1, d * sqrt(n))`
    #[test]
    fn the_power_is_the_noncentral_one() {
        for (d, pairs, expected) in [
            (0.2, 199, 0.801_691_024_037),
            (0.5, 34, 0.807_777_501_279),
            (0.8, 15, 0.821_310_538_725),
            (1.0, 10, 0.803_096_856_633),
            (1.5, 2, 0.132_952_124_157),
            (0.3, 1000, 0.999_999_999_999_97),
        ] {
            assert_near(power(3.0 * d, 3.0, pairs), expected, 1e-8);
            assert_near(power(-3.0 * d, 3.0, pairs), expected, 1e-8);
        }
    }

    /// G*Power's and Cohen's numbers for a small, a medium and a large effect.
    #[test]
    fn the_pairs_are_those_of_the_tables() {
        for (effect, pairs) in [(0.2, 199), (0.5, 34), (0.8, 15)] {
            assert_eq!(pairs_for_power(effect, 1.0, 0.8), Some(pairs));
        }
        assert_eq!(pairs_for_power(1e6, 1.0, 0.8), Some(2));
        assert_eq!(pairs_for_power(0.0, 1.0, 0.8), None);
        assert_eq!(pairs_for_power(1e-6, 1.0, 0.8), None);
    }

    /// Without an effect the test errs in one case of twenty, whatever the number of pairs.
    #[test]
    fn without_effect_the_power_is_the_level() {
        for pairs in [2, 3, 10, 1000, MAX_PAIRS] {
            assert_near(power(0.0, 1.0, pairs), 0.05, 1e-8);
        }
    }

    #[test]
    fn differences_that_are_all_the_same_have_an_interval_of_no_width() {
        let same = paired(&[1.0, 2.0, 3.0], &[1.0, 2.0, 3.0]).unwrap();
        assert_eq!((same.p, same.difference.interval), (1.0, [0.0, 0.0]));
        let shifted = paired(&[1.5, 2.5, 3.5], &[1.0, 2.0, 3.0]).unwrap();
        assert_eq!((shifted.p, shifted.difference.interval), (0.0, [0.5, 0.5]));
        assert_eq!(power(1.0, 0.0, 2), 1.0);
        assert_near(power(0.0, 0.0, 2), 0.05, 1e-8);
        assert_eq!(pairs_for_power(1.0, 0.0, 0.8), Some(2));
    }

    #[test]
    fn what_is_no_sample_is_refused() {
        assert_eq!(mean(&[]), Err(StatisticsError::TooFew(0)));
        assert_eq!(mean(&[1.0]), Err(StatisticsError::TooFew(1)));
        assert_eq!(paired(&[1.0], &[2.0]), Err(StatisticsError::TooFew(1)));
        assert_eq!(paired(&[1.0, 2.0], &[2.0]), Err(StatisticsError::Unpaired(2, 1)));
        let nan = paired(&[1.0, f64::NAN], &[2.0, 1.0]);
        assert!(matches!(nan, Err(StatisticsError::NotFinite { index: 1, .. })), "{nan:?}");
        assert!(mean(&[f64::INFINITY, 1.0]).is_err());
        assert_eq!(power(1.0, 1.0, 1), 0.0);
        assert!(power(f64::NAN, 1.0, 10).is_nan());
        assert_eq!(pairs_for_power(f64::NAN, 1.0, 0.8), None);
    }
}
