//! Steady oscillations of an accelerometer that no force has caused: hum, and the lines of spindle and bearings.
//!
//! Over a record of length T, an oscillation `Re(a e^(2πi f t/T))` of f periods has the spectrum
//!
//! ```text
//! X(k) = T/2 (a E(f − k) + a* E(−f − k))          E(u) = (e^(2πiu) − 1) / 2πiu          at bin k
//! ```
//!
//! It leaks into all bins. So it is subtracted, and only the bins of its main lobe lose their weight. What sampling folds back differs
//! little from bin to bin, and is taken by the seam of the record.

use core::f64::consts::PI;

/// Most tones of a record. Chosen: mains and spindle with two harmonics each, and two lines of bearings.
pub const MAX_TONES: usize = 8;
/// Half the width of the main lobe, bins. The lobe of a record without a window ends one bin from its middle; another bin has the largest
/// sidelobe.
const LOBE: f64 = 2.0;
/// Step of a difference, bins. Chosen: the curvature of E changes the difference by less than 1e-5 of it.
const STEP: f64 = 1e-3;
/// Below this, E is `1 + πiu` to 1e-8.
const SMALL: f64 = 1e-4;

/// A steady oscillation along the axes of the accelerometer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tone {
    /// Periods in a record.
    pub periods: f64,
    /// Real and imaginary part of the amplitude along each axis, m/s².
    pub amplitude: [[f64; 2]; 3],
    /// Part of its power by which it is not steady.
    pub unsteadiness: f64,
}

impl Tone {
    /// The spectrum of an amplitude of 1 and of one of i at a bin of a record of this length, s: `[real, imaginary]` of each, s.
    pub(crate) fn basis(periods: f64, bin: usize, length: f64) -> [[f64; 2]; 2] {
        let [near, image] = [periods, -periods].map(|own| leakage(own - bin as f64));
        let half = 0.5 * length;
        [
            [half * (near[0] + image[0]), half * (near[1] + image[1])],
            [half * (image[1] - near[1]), half * (near[0] - image[0])],
        ]
    }

    /// Its spectrum at a bin of a record of this length, s: `[real, imaginary]` along each axis, m/s.
    pub(crate) fn at(&self, bin: usize, length: f64) -> [[f64; 2]; 3] {
        let [one, i] = Self::basis(self.periods, bin, length);
        self.amplitude.map(|[re, im]| core::array::from_fn(|part| re * one[part] + im * i[part]))
    }

    /// Derivative of its spectrum at a bin by a delay that grows with time, which makes it slower: −f ∂X/∂f.
    pub(super) fn drift_at(&self, bin: usize, length: f64) -> [[f64; 2]; 3] {
        let near = |periods: f64| Self { periods, ..*self }.at(bin, length);
        let (above, below) = (near(self.periods + STEP), near(self.periods - STEP));
        core::array::from_fn(|axis| {
            core::array::from_fn(|part| {
                -self.periods * (above[axis][part] - below[axis][part]) / (2.0 * STEP)
            })
        })
    }

    /// Part of its power at a bin that counts as noise once the tone is subtracted: all of it in the main lobe, where the amplitude was
    /// read.
    pub(super) fn uncertainty(&self, bin: usize) -> f64 {
        if (self.periods - bin as f64).abs() < LOBE { 1.0 } else { self.unsteadiness }
    }
}

/// `E(u) = (e^(2πiu) − 1) / 2πiu`, real and imaginary part.
fn leakage(u: f64) -> [f64; 2] {
    let angle = PI * u;
    if u.abs() < SMALL {
        return [1.0, angle];
    }
    let size = libm::sin(angle) / angle;
    [size * libm::cos(angle), size * libm::sin(angle)]
}
