//! Losses that compare a measured signal with the model's (paper, section 3.3): MAE and MSE in time, SSP
//! from spectra.

pub mod spectral;
pub mod target;

/// Mean absolute error of two series of the same length; in their unit.
pub fn mean_absolute_error(measured: &[f32], model: &[f32]) -> f32 {
    mean(measured, model, |x, y| (x - y).abs())
}

/// Mean squared error of two series of the same length; in their unit squared.
pub fn mean_squared_error(measured: &[f32], model: &[f32]) -> f32 {
    mean(measured, model, |x, y| (x - y) * (x - y))
}

/// One bin's term of the surface similarity parameter: `|X − X̂|² / (|X|² + |X̂|²)`, from 0 (the same) to 2 (opposite). The SSP is
/// its mean over the bins. A bin in which both are zero counts as the same.
pub fn ssp_term(measured: [f64; 2], model: [f64; 2]) -> f64 {
    let square = |[re, im]: [f64; 2]| re * re + im * im;
    let scale = square(measured) + square(model);
    if scale > 0.0 { square([measured[0] - model[0], measured[1] - model[1]]) / scale } else { 0.0 }
}

/// Surface similarity parameter of two spectra, bin by bin `[re, im]`, of the same length: 0 to 2.
pub fn surface_similarity(bins: impl ExactSizeIterator<Item = ([f64; 2], [f64; 2])>) -> f64 {
    let count = bins.len().max(1);
    bins.map(|(measured, model)| ssp_term(measured, model)).sum::<f64>() / count as f64
}

fn mean(measured: &[f32], model: &[f32], term: impl Fn(f32, f32) -> f32) -> f32 {
    let sum: f32 = measured.iter().zip(model).map(|(&x, &y)| term(x, y)).sum();
    sum / measured.len().max(1) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_a_known_pair() {
        assert_eq!(mean_absolute_error(&[1.0, -2.0, 3.0], &[0.0, 0.0, 3.0]), 1.0);
        assert_eq!(mean_squared_error(&[1.0, -2.0, 3.0], &[0.0, 0.0, 3.0]), 5.0 / 3.0);
    }

    #[test]
    fn ssp_runs_from_the_same_to_the_opposite() {
        assert_eq!(ssp_term([1.0, 2.0], [1.0, 2.0]), 0.0);
        assert_eq!(ssp_term([1.0, 2.0], [0.0, 0.0]), 1.0);
        assert_eq!(ssp_term([1.0, 2.0], [-1.0, -2.0]), 2.0);
        assert_eq!(ssp_term([0.0, 0.0], [0.0, 0.0]), 0.0);
    }
}
