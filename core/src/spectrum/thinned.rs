//! Thinned spectra of a record, which its end hardly affects: the data of the search, in single precision.

use core::f64::consts::TAU;
use core::ops::Range;

use heapless::Vec;

use super::{Spectrum, SpectrumError, fft};
use crate::stream::Record;

/// αT: the damping of a record's end. Every resonance is then as wide as the distance of the bins that are kept, 8π/T, or hardly
/// less. No resonance lies hidden between two of them, and descents lose the basin less often than with 7 or 15.
const DECAY: f64 = 20.0;
/// One bin in this many is kept: neighbouring bins on the line `s = α + iω` are nearly the same.
pub(crate) const THINNING: usize = 4;
/// Bins come in groups of this many, the widest vector; the last group is filled with zeros.
const GROUP: usize = 16;

/// Every fourth bin of one record, weighted so that its end hardly matters.
#[derive(Clone, Debug)]
pub struct ThinnedSpectra<const B: usize> {
    /// Real part of the complex frequencies, 1/s: 20/T of a record of length T that starts at rest, else 0.
    pub alpha: f32,
    /// Imaginary parts of the complex frequencies, rad/s.
    pub omega: Vec<f32, B>,
    /// Force, along the force sensor's axes, Ns.
    pub force: Spectrum<B>,
    /// Acceleration, along the accelerometer's axes, m/s.
    pub acceleration: Spectrum<B>,
    /// Number of bins without the filling.
    pub bins: usize,
}

impl<const B: usize> ThinnedSpectra<B> {
    pub(super) fn new<const N: usize>(
        record: &Record<N>,
        band: Range<usize>,
        buffer: &mut [f32; N],
    ) -> Result<Self, SpectrumError> {
        let samples = record.force[0].len();
        let duration = samples as f64 / record.rate_hz;
        let alpha = if record.starts_at_rest { DECAY / duration } else { 0.0 };
        let thinned = band.len().div_ceil(THINNING);
        if thinned.next_multiple_of(GROUP) > B {
            return Err(SpectrumError::Bins(band.len()));
        }
        let mut omega = Vec::new();
        for bin in band.clone().step_by(THINNING) {
            let _ = omega.push((bin as f64 * TAU / duration) as f32);
        }
        let mut transform = |signals: &[Vec<f32, N>; 3]| {
            let mut spectrum = Spectrum::EMPTY;
            for (axis, signal) in signals.iter().enumerate() {
                let buffer = &mut buffer[..samples];
                weight(signal, alpha / record.rate_hz, buffer);
                let transformed =
                    fft::real_transform(buffer).ok_or(SpectrumError::Length(samples))?;
                for bin in band.clone().step_by(THINNING) {
                    let value = if record.starts_at_rest {
                        transformed[bin]
                    } else {
                        // Hann's window: a convolution over three bins.
                        let before = if bin > 1 { transformed[bin - 1] } else { transformed[bin] };
                        let after = *transformed.get(bin + 1).unwrap_or(&transformed[bin]);
                        transformed[bin] * 0.5 - (before + after) * 0.25
                    };
                    let _ = spectrum.re[axis].push(value.re / record.rate_hz as f32);
                    let _ = spectrum.im[axis].push(value.im / record.rate_hz as f32);
                }
            }
            fill(&mut spectrum);
            Ok(spectrum)
        };
        let force = transform(&record.force)?;
        let acceleration = transform(&record.acceleration)?;
        let last = omega.last().copied().unwrap_or_default();
        while omega.len() % GROUP != 0 {
            let _ = omega.push(last);
        }
        Ok(Self { alpha: alpha as f32, omega, force, acceleration, bins: thinned })
    }

    /// Part of a record's noise power that is left on the line: `(1 − e^(−2αT)) / (2αT)` under the weight `e^(−αt)`, 3/8 under
    /// Hann's window. `spacing` is 2π/T, rad/s.
    pub(crate) fn noise_left(&self, spacing: f64) -> f64 {
        if self.alpha > 0.0 {
            let decay = 2.0 * f64::from(self.alpha) * TAU / spacing;
            (1.0 - libm::exp(-decay)) / decay
        } else {
            3.0 / 8.0
        }
    }
}

/// `x_n e^(−αn)`; the mean of the rest before the cut is the zero of the sensor.
fn weight(signal: &[f32], alpha: f64, weighted: &mut [f32]) {
    let decay = libm::exp(-alpha);
    let offset = if alpha > 0.0 { signal[..REST].iter().sum::<f32>() / REST as f32 } else { 0.0 };
    let mut factor = 1.0_f64;
    for (weighted, &value) in weighted.iter_mut().zip(signal) {
        *weighted = (value - offset) * factor as f32;
        factor *= decay;
    }
}

/// Samples at the start of a record from which the sensors' zero is read.
const REST: usize = 64;

fn fill<const B: usize>(spectrum: &mut Spectrum<B>) {
    for part in spectrum.re.iter_mut().chain(&mut spectrum.im) {
        while part.len() % GROUP != 0 {
            let _ = part.push(0.0);
        }
    }
}
