//! Linear filters of a sensor: the spectrum of a series times a transfer function.
//!
//! The series is that of a band-limited signal, so that the product is what the continuous filter would give at the samples. The
//! series is followed by zeros for as long as the slowest filter rings.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;
use realfft::RealFftPlanner;

/// A linear filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// Butterworth's low-pass: `|H|² = 1 / (1 + (f/f_c)^(2n))`.
    LowPass {
        /// Corner frequency f_c, Hz.
        corner_hz: f64,
        /// Order n.
        order: u32,
    },
    /// First-order high-pass `s / (s + ω)`, as a charge amplifier or an IEPE supply has it.
    HighPass {
        /// Corner frequency, Hz.
        corner_hz: f64,
    },
    /// Resonance of the sensor on its mount: `ω² / (s² + 2 ζ ω s + ω²)`.
    Resonance {
        /// Frequency, Hz.
        hz: f64,
        /// Damping ratio ζ.
        damping: f64,
    },
}

impl Filter {
    /// Real part of the slowest pole, negated, 1/s.
    fn decay(&self) -> f64 {
        match *self {
            // The pole nearest to the imaginary axis lies a half of an n-th of 180° from it.
            Self::LowPass { corner_hz, order } => {
                TAU * corner_hz * (0.5 * PI / f64::from(order)).sin()
            }
            Self::HighPass { corner_hz } => TAU * corner_hz,
            Self::Resonance { hz, damping } if damping > 1.0 => {
                TAU * hz * (damping - (damping * damping - 1.0).sqrt())
            }
            Self::Resonance { hz, damping } => TAU * hz * damping,
        }
    }

    /// Transfer function at a frequency, Hz.
    pub fn response(&self, hz: f64) -> Complex<f64> {
        let one = Complex::new(1.0, 0.0);
        match *self {
            Self::LowPass { corner_hz, order } => {
                // Poles at equal angles on the left half of the circle of radius ω_c; s in units of ω_c.
                let s = Complex::new(0.0, hz / corner_hz);
                let pole = |k: u32| {
                    let angle = PI * f64::from(2 * k + order + 1) / f64::from(2 * order);
                    Complex::from_polar(1.0, angle)
                };
                (0..order).map(|k| -pole(k) / (s - pole(k))).product()
            }
            Self::HighPass { corner_hz } => {
                let s = Complex::new(0.0, hz / corner_hz);
                s / (s + one)
            }
            Self::Resonance { hz: own, damping } => {
                let s = Complex::new(0.0, hz / own);
                one / (s * s + s * (2.0 * damping) + one)
            }
        }
    }
}

/// Time constants after which a filter no longer rings: e⁻⁷ is a thousandth.
const RINGS: f64 = 7.0;

/// `series`, sampled at `rate_hz`, behind all `filters`, one after the other.
pub fn filtered(series: &[f64], rate_hz: f64, filters: &[Filter]) -> Vec<f64> {
    if filters.is_empty() {
        return series.to_vec();
    }
    let slowest = filters.iter().map(Filter::decay).fold(f64::INFINITY, f64::min);
    let rings = (RINGS * rate_hz / slowest).ceil() as usize;
    let length = (series.len() + rings).next_power_of_two();
    let mut planner = RealFftPlanner::new();
    let (forward, inverse) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));
    let mut padded = forward.make_input_vec();
    padded[..series.len()].copy_from_slice(series);
    let mut spectrum = forward.make_output_vec();
    // All buffers have the lengths that the plans need.
    let _ = forward.process(&mut padded, &mut spectrum);
    let last = spectrum.len() - 1;
    for (bin, value) in spectrum.iter_mut().enumerate() {
        let hz = bin as f64 * rate_hz / length as f64;
        let response: Complex<f64> = filters.iter().map(|filter| filter.response(hz)).product();
        let passed = Complex::new(value.re, value.im) * response / length as f64;
        // The spectrum of a real series is real at both ends.
        let im = if bin == 0 || bin == last { 0.0 } else { passed.im };
        (value.re, value.im) = (passed.re, im);
    }
    let _ = inverse.process(&mut spectrum, &mut padded);
    padded.truncate(series.len());
    padded
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: f64 = 8000.0;

    /// A burst of 120 Hz in the middle of a second.
    fn burst() -> Vec<f64> {
        (0..8000)
            .map(|n| {
                let time = n as f64 / RATE;
                (-(40.0 * (time - 0.3)).powi(2)).exp() * (TAU * 120.0 * time).sin()
            })
            .collect()
    }

    /// The differential equations of the filters in time, by Runge and Kutta's method in steps of a sample.
    #[test]
    fn filters_solve_their_differential_equations() {
        let input = burst();
        let at = |time: f64| (-(40.0 * (time - 0.3)).powi(2)).exp() * (TAU * 120.0 * time).sin();
        let (w, zeta) = (TAU * 300.0, 0.1);
        let resonance = [Filter::Resonance { hz: 300.0, damping: zeta }];
        let slope = |time: f64, [x, v]: [f64; 2]| [v, w * w * (at(time) - x) - 2.0 * zeta * w * v];
        let found = filtered(&input, RATE, &resonance);
        let mut state = [0.0; 2];
        let mut worst: f64 = 0.0;
        const PARTS: usize = 4;
        for (n, found) in found.iter().enumerate() {
            worst = worst.max((found - state[0]).abs());
            for part in 0..PARTS {
                let h = 1.0 / RATE / PARTS as f64;
                let time = n as f64 / RATE + part as f64 * h;
                let add = |a: [f64; 2], b: [f64; 2], f: f64| [a[0] + f * b[0], a[1] + f * b[1]];
                let k1 = slope(time, state);
                let k2 = slope(time + h / 2.0, add(state, k1, h / 2.0));
                let k3 = slope(time + h / 2.0, add(state, k2, h / 2.0));
                let k4 = slope(time + h, add(state, k3, h));
                for (k, f) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
                    state = add(state, k, f * h / 6.0);
                }
            }
        }
        assert!(worst < 1e-6, "{worst:e}");
    }

    #[test]
    fn corners_have_half_the_power() {
        for order in 1..=8 {
            let low = Filter::LowPass { corner_hz: 500.0, order }.response(500.0);
            assert!((low.norm_sqr() - 0.5).abs() < 1e-12, "order {order}");
            let low = Filter::LowPass { corner_hz: 500.0, order };
            assert!((low.response(0.0) - 1.0).norm() < 1e-12, "order {order}");
            // Butterworth's formula.
            let at = low.response(900.0).norm_sqr();
            assert!((at * (1.0 + 1.8_f64.powi(2 * order as i32)) - 1.0).abs() < 1e-9);
        }
        let high = Filter::HighPass { corner_hz: 0.16 }.response(0.16);
        assert!((high - Complex::new(0.5, 0.5)).norm() < 1e-12);
    }

    /// The rest that a high-pass leaves of a long push does not come back at the beginning.
    #[test]
    fn nothing_wraps_around() {
        let series: Vec<f64> = (0..8000).map(|n| f64::from(u8::from(n > 2000))).collect();
        let found = filtered(&series, RATE, &[Filter::HighPass { corner_hz: 0.16 }]);
        assert!(found[..1900].iter().all(|value| value.abs() < 2e-3), "{:?}", &found[..4]);
        assert_eq!(filtered(&series, RATE, &[]), series);
    }
}
