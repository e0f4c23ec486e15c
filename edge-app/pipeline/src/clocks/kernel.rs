//! The windowed sinc, by which a signal is taken at other instants than it was sampled.
//!
//! ```text
//! y(x) = Σ_k x_k h(x − k)        h(x) = c sinc(c x) w(x / 32)
//! ```
//!
//! x counts the samples of the input, w is Kaiser's window of β = 8 (Kaiser and Schafer, On the use of the I0-sinh window for spectrum
//! analysis, 1980). Its 64 taps are flat to 1e-4 up to 0.42 of the input's rate, and attenuate by 80 dB from 0.58 on. Where the output is
//! the slower one, c and the number of taps scale with its period, so that the low-pass ends at its own Nyquist frequency: what would fold
//! is gone.

use std::f64::consts::PI;

/// Taps on each side.
const REACH: f64 = 32.0;
/// Kaiser's β.
const BETA: f64 = 8.0;
/// Steps of the table for each tap. Between them it is linear: off by (π/512)²/8, 5e-6.
const STEPS: usize = 512;
/// An output is slower from this ratio of the periods on. Crystals differ by much less, and rates that are configured by more.
const SLOWER: f64 = 1.02;
/// Cutoff over the output's Nyquist frequency: the transition of the window ends there.
const CUTOFF: f64 = 0.92;

/// The kernel for one ratio of periods.
pub(super) struct Kernel {
    /// Samples of the input on each side.
    pub(super) reach: f64,
    /// Half a period of the output or of the input, whichever is longer, samples of the input.
    pub(super) half: f64,
    table: Vec<f64>,
    /// Steps of the table for each sample of the input.
    steps: f64,
}

impl Kernel {
    /// Makes the kernel for outputs of a period that is so many times the input's.
    pub(super) fn of(ratio: f64) -> Self {
        let (cutoff, reach) =
            if ratio > SLOWER { (CUTOFF / ratio, REACH * ratio) } else { (1.0, REACH) };
        let steps = STEPS as f64 * REACH / reach;
        let at = |step: usize| {
            let x = step as f64 / steps;
            let angle = PI * cutoff * x;
            let sinc = if angle == 0.0 { 1.0 } else { angle.sin() / angle };
            let window = bessel(BETA * (1.0 - (x / reach).powi(2)).max(0.0).sqrt()) / bessel(BETA);
            cutoff * sinc * window
        };
        let size = (STEPS as f64 * REACH) as usize;
        let half = 0.5 * ratio.max(1.0);
        Self { reach, half, table: (0..=size + 1).map(at).collect(), steps }
    }

    /// Returns h(x).
    pub(super) fn at(&self, x: f64) -> f64 {
        let step = x.abs() * self.steps;
        let index = step as usize;
        match (self.table.get(index), self.table.get(index + 1)) {
            (Some(one), Some(next)) => one + (step - index as f64) * (next - one),
            _ => 0.0,
        }
    }
}

/// The modified Bessel function of the first kind, of order 0.
fn bessel(x: f64) -> f64 {
    let square = 0.25 * x * x;
    let (mut term, mut sum) = (1.0, 1.0);
    // At 8 the terms beyond are less than 1e-16 of the sum.
    for order in 1..40 {
        term *= square / f64::from(order * order);
        sum += term;
    }
    sum
}
