//! Filters of a sensor whose corners lie outside the band.

use super::complex::Complex;
use super::lanes::{Lanes, Scalar};

/// Filter of a sensor: its natural frequency ω_r above the band, and a high-pass of corner frequency ω_h below it.
///
/// ```text
/// reading = signal / ((1 + s²/ω_r²) (1 + ω_h/s))
/// ```
///
/// The damping of the sensor is left out: far below the natural frequency it has no effect.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Filter<T> {
    /// `1/ω_r²`, s².
    pub(crate) resonance: T,
    /// ω_h, rad/s.
    pub(crate) high_pass: T,
}

impl<T: Scalar> Filter<T> {
    /// Whether the reading is the signal.
    pub(crate) fn is_none(&self) -> bool {
        self.resonance.to_f64() == 0.0 && self.high_pass.to_f64() == 0.0
    }

    /// `(1 + s²/ω_r²) (1 + ω_h/s)`: signal per reading.
    #[inline(always)]
    pub(crate) fn inverse<V: Lanes<Scalar = T>>(&self, s: Complex<V>) -> Complex<V> {
        self.of_resonance(s) * self.of_high_pass(s)
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
}

#[inline(always)]
fn plus_one<V: Lanes>(value: Complex<V>) -> Complex<V> {
    Complex::new(value.re + value.re.fill(V::Scalar::from_f64(1.0)), value.im)
}
