//! Many tests at once: S. Holm, "A simple sequentially rejective multiple test procedure", Scandinavian Journal of Statistics 6, 1979.

use statrs::function::erf::erfc;

/// Chances of deviations as large as these, in standard deviations of a normal distribution, adjusted for their number.
pub(crate) fn holm(deviations: &[f64]) -> Vec<f64> {
    let chances = deviations.iter().map(|own| erfc(own.abs() / std::f64::consts::SQRT_2));
    adjusted(&chances.collect::<Vec<_>>())
}

/// Chances adjusted for their number.
pub(crate) fn adjusted(own: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..own.len()).collect();
    order.sort_by(|a, b| own[*a].total_cmp(&own[*b]));
    let mut adjusted = vec![0.0; own.len()];
    let mut largest = 0.0_f64;
    for (rank, place) in order.into_iter().enumerate() {
        largest = largest.max(own[place] * (own.len() - rank) as f64).min(1.0);
        adjusted[place] = largest;
    }
    adjusted
}

#[cfg(test)]
mod tests {
    use statrs::distribution::ContinuousCDF as _;

    use super::*;

    /// Chances of 0.01, 0.02, 0.03 and 1: times 4, 3 and 2, and never smaller than the one before.
    #[test]
    fn chances_are_adjusted_from_the_smallest_on() {
        let of = |chance: f64| {
            let normal = statrs::distribution::Normal::standard();
            normal.inverse_cdf(1.0 - chance / 2.0)
        };
        let adjusted = holm(&[of(0.03), -of(0.01), of(0.02), 0.0]);
        for (found, expected) in adjusted.iter().zip([0.06, 0.04, 0.06, 1.0]) {
            assert!((found - expected).abs() < 1e-9, "{adjusted:?}");
        }
    }
}
