//! Values of a fine series between its samples.

/// Number of points of [`interpolated`]'s polynomial.
const POINTS: usize = 8;

/// Value of a `series` at `time`, in samples: Lagrange's polynomial through the eight nearest samples. It misses a sine with twenty
/// samples a period by 1e-7. The first and the last sample hold beyond the ends.
pub fn interpolated(series: &[f64], time: f64) -> f64 {
    let first = time.floor() as isize - (POINTS as isize / 2 - 1);
    let last = series.len() as isize - 1;
    (0..POINTS)
        .map(|i| {
            let others = (0..POINTS).filter(|&j| j != i);
            let weight: f64 = others
                .map(|j| (time - (first + j as isize) as f64) / (i as f64 - j as f64))
                .product();
            series[(first + i as isize).clamp(0, last) as usize] * weight
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn a_sine_is_met_between_its_samples() {
        let sine = |time: f64| (TAU * time / 20.0).sin();
        let series: Vec<_> = (0..200).map(|n| sine(n as f64)).collect();
        for k in 0..1000 {
            let time = 10.0 + 0.17 * f64::from(k);
            assert!((interpolated(&series, time) - sine(time)).abs() < 2e-7, "{time}");
        }
        assert_eq!(interpolated(&series, 7.0), series[7]);
    }
}
