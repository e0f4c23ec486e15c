//! The distribution of Fisher, of the ratio of two mean squares.

/// Terms of the continued fraction. It converges in some √max(a, b) of them: enough for a million degrees of freedom.
const TERMS: usize = 1000;
/// Relative change at which it has converged: some fifty rounding errors.
const CONVERGED: f64 = 1e-14;
/// Value for a denominator that vanishes (Thompson and Barnett, 1986). It is far below any that does not.
const TINY: f64 = 1e-300;

/// Probability that the ratio of two mean squares of the same noise, of m and of n degrees of freedom, exceeds `ratio`; 1 of what is no
/// ratio.
///
/// ```text
/// P(F > f) = I_x(n/2, m/2),   x = n / (n + m f)          (DLMF 8.17)
/// ```
pub(crate) fn fisher_exceeds(ratio: f64, m: f64, n: f64) -> f64 {
    if ratio.is_nan() || ratio <= 0.0 || !(m > 0.0 && n > 0.0) {
        return 1.0;
    }
    if ratio.is_infinite() {
        return 0.0;
    }
    incomplete_beta(0.5 * n, 0.5 * m, n / (n + m * ratio), m * ratio / (n + m * ratio))
}

/// `I_x(a, b)`, with y = 1 − x, by the side on which the continued fraction converges.
fn incomplete_beta(a: f64, b: f64, x: f64, y: f64) -> f64 {
    let logarithm = a * libm::log(x) + b * libm::log(y);
    let front = libm::exp(logarithm + libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b));
    let value = if x < (a + 1.0) / (a + b + 2.0) {
        front * fraction(a, b, x) / a
    } else {
        1.0 - front * fraction(b, a, y) / b
    };
    value.clamp(0.0, 1.0)
}

/// The continued fraction of DLMF 8.17.22, by the method of Lentz (1976) with Thompson and Barnett's modification (1986).
fn fraction(a: f64, b: f64, x: f64) -> f64 {
    let apart = |value: f64| if value.abs() < TINY { TINY } else { value };
    let mut c = 1.0;
    let mut d = 1.0 / apart(1.0 - (a + b) * x / (a + 1.0));
    let mut fraction = d;
    for term in 1..TERMS {
        let m = term as f64;
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let before = fraction;
        for step in [even, odd] {
            d = 1.0 / apart(1.0 + step * d);
            c = apart(1.0 + step / c);
            fraction *= c * d;
        }
        if (fraction / before - 1.0).abs() < CONVERGED {
            break;
        }
    }
    fraction
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The published tables of the distribution (Abramowitz and Stegun, table 26.9).
    #[test]
    fn published_quantiles_are_exceeded_as_often_as_they_say() {
        for (ratio, m, n, chance) in [
            (4.965, 1.0, 10.0, 0.05),
            (5.786, 2.0, 5.0, 0.05),
            (3.098, 3.0, 20.0, 0.05),
            (8.451, 3.0, 7.0, 0.01),
            (21.04, 1.0, 10.0, 0.001),
            (3.841, 1.0, 1e6, 0.05),
        ] {
            let found = fisher_exceeds(ratio, m, n);
            assert!((found / chance - 1.0).abs() < 2e-3, "{ratio} {m} {n}: {found}");
        }
    }

    /// With two degrees of freedom in the numerator it is `(1 + 2f/n)^(−n/2)`.
    #[test]
    fn two_degrees_of_freedom_have_a_closed_form() {
        for n in [1.0_f64, 4.0, 33.0, 500.0] {
            for ratio in [1e-6_f64, 0.3, 1.0, 7.0, 90.0, 1e4] {
                let exact = (1.0 + 2.0 * ratio / n).powf(-0.5 * n);
                let found = fisher_exceeds(ratio, 2.0, n);
                assert!((found - exact).abs() <= 1e-11 * exact + 1e-250, "{ratio} {n}: {found:e}");
            }
        }
    }

    #[test]
    fn what_is_no_ratio_says_nothing() {
        for (ratio, m, n) in
            [(f64::NAN, 1.0, 1.0), (-1.0, 1.0, 1.0), (2.0, 0.0, 5.0), (2.0, 1.0, f64::NAN)]
        {
            assert_eq!(fisher_exceeds(ratio, m, n), 1.0);
        }
        assert_eq!(fisher_exceeds(f64::INFINITY, 3.0, 5.0), 0.0);
    }
}
