//! Residuals over the time in the records.
//!
//! The whitened residuals w of the bins k are Fourier coefficients of a signal over the record, of length T. Its power, smoothed by
//! Fejér's kernel of order 8, is in the middle `t = (j + ½) T/8` of each eighth
//!
//! ```text
//! P_j = Σ_l (1 − |l|/8) R_l e^(2πi l t/T)        R_l = Σ_k w_{k+l} w_k*        l = −7 … 7
//! ```
//!
//! so that the residuals need not be transformed back. The eight add up to `8 R_0`. For white w the real and the imaginary part of the R_l
//! of n bins have a variance of `n/2`, that of R_0, in units of its mean over n: P_j has a mean of n and a variance of
//! `n (1 + 2 Σ_{l>0} (1 − l/8)²) = 5.375 n`, as if it were the power of `n/5.375` bins.

use core::f64::consts::TAU;

use super::cells::Cell;

/// Parts of a record. Chosen: they tell start, middle and end apart, and the power in each is known as that of `n/5.375` bins.
pub(super) const EIGHTHS: usize = 8;
/// Variance of an eighth's power in that of a bin, `1 + 2 Σ (1 − l/8)²` for l = 1 to 7: see above.
const SPREAD: f64 = 5.375;

/// Sums over the bins of all records.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InTime {
    /// R of each lag: real and imaginary part.
    lags: [[f64; 2]; EIGHTHS],
    /// The last residuals of the present record, the newest first.
    last: [[[f64; 2]; 3]; EIGHTHS],
    /// Number of complex residuals.
    count: f64,
}

impl InTime {
    /// Begins the next record.
    pub(super) fn begin(&mut self) {
        self.last = Default::default();
    }

    /// Takes the next bin of the record.
    pub(super) fn take(&mut self, white: &[[f64; 2]; 3]) {
        self.last.rotate_right(1);
        self.last[0] = *white;
        self.count += white.iter().filter(|own| **own != [0.0; 2]).count() as f64;
        for (sum, before) in self.lags.iter_mut().zip(&self.last) {
            for ([a, b], [c, d]) in white.iter().zip(before) {
                sum[0] += a * c + b * d;
                sum[1] += b * c - a * d;
            }
        }
    }

    /// The eighths of the records.
    pub(super) fn cells(&self) -> [Cell; EIGHTHS] {
        let count = 2.0 * self.count / SPREAD;
        core::array::from_fn(|eighth| {
            let lag = |(lag, [re, im]): (usize, &[f64; 2])| {
                let weight = 1.0 - lag as f64 / EIGHTHS as f64;
                let angle = TAU * lag as f64 * (eighth as f64 + 0.5) / EIGHTHS as f64;
                let both = if lag == 0 { 1.0 } else { 2.0 };
                both * weight * (re * libm::cos(angle) - im * libm::sin(angle))
            };
            let power: f64 = self.lags.iter().enumerate().map(lag).sum();
            Cell { squares: power.max(0.0) / SPREAD, count }
        })
    }
}
