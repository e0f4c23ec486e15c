//! The direction of the force of a cut, between the frequencies at which it was measured.

use nalgebra::Complex;

use crate::evidence::MeasuredPoint;

/// Relative distance of two frequencies that are the same: a result keeps five digits of those that were measured.
const SAME: f64 = 1e-4;

/// Direction of the force at a frequency, Hz, within those that were measured: between two of them their mean, weighted by its distance
/// from each, or that of the nearer one if their largest components are different ones, whose phases are the origins.
pub(super) fn direction_at(points: &[MeasuredPoint], hz: f64) -> Option<[Complex<f64>; 3]> {
    let next = points.iter().position(|own| own.frequency_hz >= hz);
    // Rounding may have moved the ends.
    let is_same = |own: &&MeasuredPoint| (own.frequency_hz - hz).abs() <= SAME * hz;
    let [before, after] = match next {
        Some(0) => [points.first().filter(is_same)?; 2],
        Some(next) => [&points[next - 1], &points[next]],
        None => [points.last().filter(is_same)?; 2],
    };
    let width = after.frequency_hz - before.frequency_hz;
    let part = if width > 0.0 { (hz - before.frequency_hz) / width } else { 1.0 };
    let [one, other] = [before, after].map(|own| own.direction.map(complex));
    let part = if largest(&one) == largest(&other) { part } else { part.round() };
    let mean: [Complex<f64>; 3] =
        std::array::from_fn(|axis| one[axis] * (1.0 - part) + other[axis] * part);
    let norm = mean.iter().map(Complex::norm_sqr).sum::<f64>().sqrt();
    (norm > 0.0).then(|| mean.map(|own| own / norm))
}

/// Number of the largest component.
fn largest(direction: &[Complex<f64>; 3]) -> Option<usize> {
    (0..3).max_by(|one, other| direction[*one].norm().total_cmp(&direction[*other].norm()))
}

/// A number from its real and its imaginary part.
pub(super) fn complex([re, im]: [f64; 2]) -> Complex<f64> {
    Complex::new(re, im)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(frequency_hz: f64, x: f64) -> MeasuredPoint {
        MeasuredPoint {
            frequency_hz,
            measured: [[None; 3]; 3],
            modelled: [[None; 3]; 3],
            direction: [[x, 0.0], [0.0, 0.0], [0.0, (1.0 - x * x).sqrt()]],
            measured_along: [[0.0; 2]; 3],
            modelled_along: [[0.0; 2]; 3],
            coherence: [0.9; 3],
        }
    }

    #[test]
    fn the_direction_ends_with_the_measured_frequencies_whatever_the_rounding() {
        let points = [point(2.0, 1.0), point(4.0, 0.8)];
        let x = |hz: f64| direction_at(&points, hz).map(|direction| direction[0].re);
        for (hz, expected) in [
            (1.9, None),
            (1.9999, Some(1.0)),
            (2.0, Some(1.0)),
            (4.0, Some(0.8)),
            (4.0001, Some(0.8)),
            (4.1, None),
        ] {
            assert_eq!(x(hz).is_some(), expected.is_some(), "{hz}");
            assert!((x(hz).unwrap_or(0.0) - expected.unwrap_or(0.0)).abs() < 1e-9, "{hz}");
        }
        assert!(x(3.0).is_some_and(|x| x > 0.9 && x < 1.0));
        assert_eq!(direction_at(&[], 3.0), None);
    }
}
