//! The sum of squares that noise leaves: χ² of as many degrees of freedom.
//!
//! Source of the limits: Laurent and Massart, "Adaptive estimation of a quadratic functional by model selection", Annals of Statistics
//! 28, 2000, lemma 1, at a chance of e⁻¹⁰. Source of the deviate: Wilson and Hilferty, "The distribution of chi-square", Proceedings of the
//! National Academy of Sciences 17, 1931.

/// χ² per degree of freedom up to which noise explains the residuals, if they are many. The noise itself is known from a
/// few hundred quiet samples to 7 % of its power; the nearest wrong basin of the reference scenario lies at 2.
pub(crate) const CONSISTENT: f64 = 1.3;

/// Returns whether noise leaves a sum of squares of this size; none that is no number.
pub(crate) fn noise_explains(sum_of_squares: f64, degrees_of_freedom: f64) -> bool {
    let most = (CONSISTENT * degrees_of_freedom).max(rarely_exceeded(degrees_of_freedom));
    (0.0..=most).contains(&sum_of_squares)
}

/// The value that χ² of so many degrees of freedom exceeds with a chance below e⁻¹⁰.
pub(crate) fn rarely_exceeded(degrees_of_freedom: f64) -> f64 {
    degrees_of_freedom + 2.0 * libm::sqrt(10.0 * degrees_of_freedom) + 2.0 * 10.0
}

/// The value that χ² of so many degrees of freedom falls below with a chance below e⁻¹⁰.
pub(crate) fn rarely_undercut(degrees_of_freedom: f64) -> f64 {
    degrees_of_freedom - 2.0 * libm::sqrt(10.0 * degrees_of_freedom.max(0.0))
}

/// Deviate of N(0, 1) that is exceeded as rarely as this sum of squares.
pub(crate) fn deviate(sum_of_squares: f64, degrees_of_freedom: f64) -> f64 {
    let variance = 2.0 / (9.0 * degrees_of_freedom);
    let root = libm::cbrt(sum_of_squares / degrees_of_freedom);
    (root - (1.0 - variance)) / libm::sqrt(variance)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tabulated quantiles of χ², and those of N(0, 1) at the same chance: 0.5, 0.05, 0.001 and 0.0005. Without the cube root that of 3
    /// degrees of freedom would be 6.0 instead of 3.3.
    #[test]
    fn deviates_of_tabulated_quantiles() {
        for (degrees_of_freedom, quantiles) in [
            (3.0, [2.366, 7.815, 16.266, 17.730]),
            (10.0, [9.342, 18.307, 29.588, 31.420]),
            (100.0, [99.334, 124.342, 149.449, 153.167]),
        ] {
            for (quantile, expected) in quantiles.into_iter().zip([0.0, 1.645, 3.090, 3.291]) {
                let found = deviate(quantile, degrees_of_freedom);
                assert!((found - expected).abs() < 0.06, "{quantile}: {found}, not {expected}");
            }
        }
        assert!(deviate(f64::NAN, 3.0).is_nan());
    }

    /// 10 + 2 √(10 · 10) + 20 and 10 − 2 √(10 · 10); of 1000 ± 2 √(10 · 1000), and 20.
    #[test]
    fn rare_sums_of_squares() {
        for (degrees_of_freedom, most, least) in
            [(0.0, 20.0, 0.0), (10.0, 50.0, -10.0), (1000.0, 1220.0, 800.0)]
        {
            assert!((rarely_exceeded(degrees_of_freedom) - most).abs() < 1e-9);
            assert!((rarely_undercut(degrees_of_freedom) - least).abs() < 1e-9);
        }
        assert_eq!(rarely_undercut(-1.0), -1.0);
    }

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
            let found = noise_explains(sum_of_squares, degrees_of_freedom);
            assert_eq!(found, explained, "{sum_of_squares} of {degrees_of_freedom}");
        }
    }
}
