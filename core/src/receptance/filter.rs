//! Filters of a sensor whose corners lie outside the band.
//!
//! A low-pass `L` above the band delays the reading, and changes its phase and magnitude beside that:
//!
//! ```text
//! −ln L = τ s + s²/ω_r² − c s³ + e s⁴ + …
//! ```
//!
//! Of a Butterworth low-pass of second order and corner ω it is `√2 s/ω − (√2/3) (s/ω)³ + (s/ω)⁴/2`, so that `c = τ³/6` and `e = τ⁴/8`.

use super::complex::Complex;
use super::lanes::{Lanes, Scalar};

/// Filter of a sensor: its natural frequency ω_r above the band, a high-pass of corner frequency ω_h below it, and what a low-pass above the
/// band does beside its delay.
///
/// ```text
/// reading = signal / ((1 + s²/ω_r²) (1 + ω_h/s) (1 − c s³ + e s⁴))
/// ```
///
/// The damping of the sensor is left out: far below the natural frequency it has no effect.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Filter<T> {
    /// `1/ω_r²`, s².
    pub(crate) resonance: T,
    /// ω_h, rad/s.
    pub(crate) high_pass: T,
    /// c, s³.
    pub(crate) dispersion: T,
    /// e, s⁴.
    pub(crate) roll_off: T,
}

impl<T: Scalar> Filter<T> {
    /// Returns whether the reading is the signal.
    pub(crate) fn is_none(&self) -> bool {
        [self.resonance, self.high_pass, self.dispersion, self.roll_off]
            .iter()
            .all(|own| own.to_f64() == 0.0)
    }

    /// `(1 + s²/ω_r²) (1 + ω_h/s) (1 − c s³ + e s⁴)`: signal per reading.
    #[inline(always)]
    pub(crate) fn inverse<V: Lanes<Scalar = T>>(&self, s: Complex<V>) -> Complex<V> {
        self.of_resonance(s) * self.of_high_pass(s) * self.of_low_pass(s)
    }

    /// `1 + s²/ω_r²`.
    #[inline(always)]
    pub(crate) fn of_resonance<V: Lanes<Scalar = T>>(&self, s: Complex<V>) -> Complex<V> {
        plus_one((s * s).scale(s.re.fill(self.resonance)))
    }

    /// `1 + ω_h/s`.
    #[inline(always)]
    pub(crate) fn of_high_pass<V: Lanes<Scalar = T>>(&self, s: Complex<V>) -> Complex<V> {
        plus_one(s.reciprocal().scale(s.re.fill(self.high_pass)))
    }

    /// `1 − c s³ + e s⁴`.
    #[inline(always)]
    pub(crate) fn of_low_pass<V: Lanes<Scalar = T>>(&self, s: Complex<V>) -> Complex<V> {
        let (c, e) = (s.re.fill(self.dispersion), s.re.fill(self.roll_off));
        plus_one((s.scale(e) - Complex::new(c, s.re.fill(T::from_f64(0.0)))) * (s * s * s))
    }
}

#[inline(always)]
fn plus_one<V: Lanes>(value: Complex<V>) -> Complex<V> {
    Complex::new(value.re + value.re.fill(V::Scalar::from_f64(1.0)), value.im)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks the series of a Butterworth low-pass of second order, at x = s/ω: `(1 + √2 x + x²) e^(−√2 x)`, but for terms of x⁵.
    #[test]
    fn a_low_pass_is_a_delay_and_what_it_does_beside() {
        let delay = 7.5e-4_f64;
        let filter = Filter {
            dispersion: delay.powi(3) / 6.0,
            roll_off: delay.powi(4) / 8.0,
            ..Filter::default()
        };
        for part in [0.05_f64, 0.1, 0.2, 0.3] {
            let corner = 2.0_f64.sqrt() / delay;
            let s = Complex::new(0.0, part * corner);
            let low_pass = Complex::new(1.0 - part * part, 2.0_f64.sqrt() * part);
            let angle = 2.0_f64.sqrt() * part;
            let expected = low_pass * Complex::new(angle.cos(), -angle.sin());
            let found = filter.inverse(s);
            let gap = (found.re - expected.re).hypot(found.im - expected.im);
            assert!(gap < part.powi(5), "{part}: {found:?} {expected:?}");
            assert!(gap < 0.5 * (expected.re - 1.0).hypot(expected.im), "{part}");
        }
        assert!(!filter.is_none() && Filter::<f64>::default().is_none());
    }
}
