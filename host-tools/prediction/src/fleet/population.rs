//! Mean and spread of a parameter in a population, by restricted maximum likelihood.
//!
//! ```text
//! zᵢ ~ N(μ, τ² + sᵢ)        wᵢ = 1 / (τ² + sᵢ)        μ̂ = Σ wᵢ zᵢ / Σ wᵢ
//! −2 l(τ²) = −Σ ln wᵢ + ln Σ wᵢ + Σ wᵢ (zᵢ − μ̂)²
//! ```
//!
//! The maximum over τ² ≥ 0 is found by Fisher scoring (W. Viechtbauer, "Bias and efficiency of meta-analytic variance estimators in the
//! random-effects model", Journal of Educational and Behavioral Statistics 30, 2005). The variance of μ̂ is that of J. Hartung and G. Knapp
//! ("A refined method for the meta-analysis of controlled clinical trials with binary outcome", Statistics in Medicine 20, 2001), never less
//! than 1 / Σ wᵢ.

use statrs::distribution::{ChiSquared, ContinuousCDF as _};

/// Steps of scoring, and of halving one, at most. Chosen: some ten are needed.
const STEPS: usize = 200;
/// Values of τ² above zero from which scoring may start, each half of the one before. Chosen: from all of the scatter to where it counts no more.
const STARTS: i32 = 16;
/// Change of τ², in parts of a typical variance, that counts no more. Chosen: far below what any number of robots can tell.
const RESOLVED: f64 = 1e-10;
/// Chance that τ² is beyond either end of its interval.
const TAIL: f64 = 0.025;

/// A value and the variance of its own noise.
pub(super) type Value = (f64, f64);

/// A population as some of its members show it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Normal {
    /// μ̂.
    pub(super) mean: f64,
    /// Its variance.
    pub(super) variance: f64,
    /// τ².
    pub(super) between: f64,
    /// Part of each member in the mean. The sum is 1.
    pub(super) shares: Vec<f64>,
    /// Twice the expected information on τ², and how τ² + var μ̂ grows with τ².
    information: f64,
    growth: f64,
}

/// Sums that the likelihood at a τ² needs.
struct At {
    mean: f64,
    /// Σ w, Σ w², Σ w³.
    weights: [f64; 3],
    /// Σ w r², Σ w² r², with r = z − μ̂.
    squares: [f64; 2],
    /// −2 l, but for a constant.
    loss: f64,
}

impl At {
    fn new(values: &[Value], between: f64) -> Self {
        let weighted = || values.iter().map(|(value, own)| (value, (between + own).recip()));
        let weights = [1, 2, 3].map(|power| weighted().map(|(_, w)| w.powi(power)).sum::<f64>());
        // About the first value, so that no digits are lost.
        let first = values.first().map_or(0.0, |(value, _)| *value);
        let mean = first + weighted().map(|(z, w)| w * (z - first)).sum::<f64>() / weights[0];
        let squares =
            [1, 2].map(|power| weighted().map(|(z, w)| w.powi(power) * (z - mean).powi(2)).sum());
        let logarithms: f64 = weighted().map(|(_, w)| w.ln()).sum();
        Self { mean, weights, squares, loss: weights[0].ln() - logarithms + squares[0] }
    }

    /// Step of τ² by the slope of the likelihood over its expected curvature.
    fn step(&self) -> f64 {
        let ([w, w2, _], [_, r2]) = (self.weights, self.squares);
        (r2 - w + w2 / w) / self.information()
    }

    /// Twice the expected curvature.
    fn information(&self) -> f64 {
        let [w, w2, w3] = self.weights;
        w2 - 2.0 * w3 / w + (w2 / w).powi(2)
    }
}

impl Normal {
    /// That of two values or more, whose variances are above zero.
    pub(super) fn new(values: &[Value]) -> Self {
        let between = between(values);
        let at = At::new(values, between);
        let At { mean, weights, squares, .. } = at;
        let freedoms = values.len().saturating_sub(1).max(1) as f64;
        let shares = values.iter().map(|(_, own)| (between + own).recip() / weights[0]);
        Self {
            mean,
            variance: (squares[0] / freedoms).max(1.0) / weights[0],
            between,
            shares: shares.collect(),
            information: at.information(),
            growth: 1.0 + weights[1] / weights[0].powi(2),
        }
    }

    /// Freedoms of a variance that holds τ² + var μ̂ and what is known: twice its square over its own variance (F. E. Satterthwaite, "An approximate
    /// distribution of estimates of variance components", Biometrics Bulletin 2, 1946). Of alike values, and one like them, those of a sample.
    pub(super) fn freedoms(&self, variance: f64) -> f64 {
        self.information * (variance / self.growth).powi(2)
    }
}

/// τ² at the maximum of the restricted likelihood.
fn between(values: &[Value]) -> f64 {
    let count = values.len() as f64;
    let typical = values.iter().map(|(_, own)| own).sum::<f64>() / count;
    let level = values.iter().map(|(value, _)| value).sum::<f64>() / count;
    let scatter = values.iter().map(|(value, _)| (value - level).powi(2)).sum::<f64>();
    // The likelihood may have two maxima, one of them at zero.
    let starts = (0..STARTS).map(|halvings| scatter / 2_f64.powi(halvings)).chain([0.0]);
    let starts = starts.map(|start| (start, At::new(values, start)));
    let Some(mut best) = starts.min_by(|a, b| a.1.loss.total_cmp(&b.1.loss)) else { return 0.0 };
    for _ in 0..STEPS {
        let mut step = best.1.step();
        let mut next = (best.0 + step).max(0.0);
        let mut at = At::new(values, next);
        let mut halvings = 0;
        while at.loss > best.1.loss && halvings < STEPS {
            step /= 2.0;
            next = (best.0 + step).max(0.0);
            at = At::new(values, next);
            halvings += 1;
        }
        let change = (next - best.0).abs();
        best = (next, at);
        if change <= RESOLVED * (next + typical) {
            break;
        }
    }
    best.0
}

/// 95 % interval of τ²: where Σ wᵢ (zᵢ − μ̂)² lies between the quantiles of its χ² (W. Viechtbauer, "Confidence intervals for the amount of
/// heterogeneity in meta-analysis", Statistics in Medicine 26, 2007). Both ends are 0 where values scatter less than their noise.
pub(super) fn interval(values: &[Value]) -> [f64; 2] {
    let Ok(of_scatter) = ChiSquared::new(values.len() as f64 - 1.0) else {
        return [0.0, f64::INFINITY];
    };
    let scatter = |between: f64| At::new(values, between).squares[0];
    [1.0 - TAIL, TAIL].map(|chance| {
        let wanted = of_scatter.inverse_cdf(chance);
        if scatter(0.0) <= wanted {
            return 0.0;
        }
        let mut low = 0.0;
        // The scatter falls towards zero as τ² grows.
        let mut high = values.iter().map(|(_, own)| *own).fold(0.0, f64::max);
        while scatter(high) > wanted {
            (low, high) = (high, 2.0 * high);
        }
        for _ in 0..f64::MANTISSA_DIGITS {
            let middle = 0.5 * (low + high);
            if scatter(middle) > wanted { low = middle } else { high = middle }
        }
        high
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    use super::*;

    /// −2 l of contrasts that the mean does not enter, by a dense covariance (D. A. Harville, "Maximum likelihood approaches to variance
    /// component estimation and to related problems", Journal of the American Statistical Association 72, 1977).
    fn dense(values: &[Value], between: f64) -> f64 {
        let count = values.len();
        let contrasts = DMatrix::from_fn(count - 1, count, |row, column| match column {
            _ if column == row => 1.0,
            _ if column == count - 1 => -1.0,
            _ => 0.0,
        });
        let own = DVector::from_iterator(count, values.iter().map(|(_, own)| own + between));
        let all = DVector::from_iterator(count, values.iter().map(|(value, _)| *value));
        let covariance = &contrasts * DMatrix::from_diagonal(&own) * contrasts.transpose();
        let off = &contrasts * all;
        covariance.determinant().ln() + off.dot(&(covariance.try_inverse().unwrap() * &off))
    }

    fn some() -> impl Strategy<Value = Vec<Value>> {
        prop::collection::vec((-3.0_f64..3.0, 0.02_f64..2.0), 3..8)
    }

    proptest! {
        #[test]
        fn no_point_of_a_grid_is_more_likely(values in some()) {
            let least = dense(&values, Normal::new(&values).between);
            for point in 0..2000 {
                let between = 40.0 * (point as f64 / 2000.0).powi(3);
                prop_assert!(least <= dense(&values, between) + 1e-6, "{} at {}", least, between);
            }
        }

        #[test]
        fn what_shifts_all_shifts_the_mean_alone(values in some(), by in -9.0_f64..9.0) {
            let shifted: Vec<Value> = values.iter().map(|(value, own)| (value + by, *own)).collect();
            let (before, after) = (Normal::new(&values), Normal::new(&shifted));
            prop_assert!((after.mean - before.mean - by).abs() < 1e-6);
            prop_assert!((after.between - before.between).abs() < 1e-6);
            prop_assert!((after.variance - before.variance).abs() < 1e-6);
        }

        #[test]
        fn units_scale_the_spread(values in some(), by in 0.01_f64..100.0) {
            let scaled: Vec<Value> = values.iter().map(|(value, own)| (value * by, own * by * by)).collect();
            let (before, after) = (Normal::new(&values), Normal::new(&scaled));
            prop_assert!((after.between / (by * by) - before.between).abs() < 1e-6);
        }

        #[test]
        fn the_interval_holds_the_scatter_that_is_likely(values in some()) {
            let [low, high] = interval(&values);
            let scatter = |between: f64| At::new(&values, between).squares[0];
            let chances = ChiSquared::new(values.len() as f64 - 1.0).unwrap();
            prop_assert!(low <= high);
            prop_assert!(low == 0.0 || (chances.sf(scatter(low)) - TAIL).abs() < 1e-6);
            prop_assert!(high == 0.0 || (chances.cdf(scatter(high)) - TAIL).abs() < 1e-6);
        }
    }

    /// By hand: alike variances s give τ² as the variance of the values less s, and none below zero.
    #[test]
    fn alike_variances_have_a_closed_form() {
        let values = [1.0, 2.0, 4.0, 9.0];
        let of = |own: f64| Normal::new(&values.map(|value| (value, own)));
        let found = of(1.5);
        assert!((found.between - (38.0 / 3.0 - 1.5)).abs() < 1e-8, "{found:?}");
        assert!((found.mean - 4.0).abs() < 1e-12 && (found.variance - 38.0 / 12.0).abs() < 1e-8);
        let found = of(20.0);
        assert_eq!((found.between, found.variance), (0.0, 5.0));
        assert_eq!(interval(&values.map(|value| (value, 200.0))), [0.0, 0.0]);
    }
}
