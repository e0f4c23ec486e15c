//! Thinned spectra of a record, which its end hardly affects: the data of the search, in single precision.

use core::f64::consts::TAU;
use core::ops::Range;

use heapless::Vec;

use super::fft;
use super::part::{self, Pose};
use super::signals::{Spectrum, SpectrumError};
use crate::stream::Record;

/// αT: the damping of a record's end. Every resonance is then as wide as the distance of the bins that are kept, 8π/T, or hardly
/// less. No resonance lies hidden between two of them, and descents lose the basin less often than with 7 or 15.
const DECAY: f64 = 20.0;
/// One bin in this many is kept: neighbouring bins on the line `s = α + iω` are nearly the same.
pub(crate) const THINNING: usize = 4;
/// Bins come in groups of this many, the widest vector; the last group is filled with zeros.
const GROUP: usize = 16;

/// Every fourth bin of one record, weighted so that its end hardly matters. The time of both spectra of a record that starts at rest
/// begins shortly before the cut.
#[derive(Clone, Debug)]
pub struct ThinnedSpectra<const B: usize> {
    /// Joint angles where the weight of the record is, rad (m).
    pub pose: Pose,
    /// Bin number of the first bin in the spectrum of the whole record.
    pub first_bin: usize,
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
    /// Part of the noise power of a bin that is left on the line.
    pub(crate) noise_left: f64,
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
        let onset = if record.starts_at_rest { onset(record) } else { 0 };
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
                weight(signal, onset, alpha / record.rate_hz, buffer);
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
        let pose = pose(record, onset);
        let (alpha, first_bin) = (alpha as f32, band.start);
        // Under the weight `e^(−αt)`, `(1 − e^(−2αT)) / (2αT)`; a rest that is left out makes it smaller by no more than a part of `e^(−αT)`.
        // Under Hann's window 3/8.
        let noise_left = if record.starts_at_rest { 0.5 / DECAY } else { 3.0 / 8.0 };
        let bins = thinned;
        Ok(Self { pose, first_bin, alpha, omega, force, acceleration, bins, noise_left })
    }

    /// The bins of a measured receptance that are kept, as they are. `omega` is the angular frequency of a bin, rad/s.
    pub(super) fn of_receptance(
        pose: &[f64],
        first_bin: usize,
        omega: impl Fn(usize) -> f64,
        decay: f64,
        force: &Spectrum<B>,
        acceleration: &Spectrum<B>,
    ) -> Result<Self, SpectrumError> {
        let all = force.re[0].len();
        let bins = all.div_ceil(THINNING);
        if bins.next_multiple_of(GROUP) > B {
            return Err(SpectrumError::Bins(all));
        }
        let some = |signals: &[Vec<f32, B>; 3]| {
            signals.each_ref().map(|signal| signal.iter().step_by(THINNING).copied().collect())
        };
        let thinned = |spectrum: &Spectrum<B>| {
            let mut thinned = Spectrum { re: some(&spectrum.re), im: some(&spectrum.im) };
            fill(&mut thinned);
            thinned
        };
        let last = bins - 1;
        let kept = |bin: usize| omega(first_bin + bin.min(last) * THINNING) as f32;
        Ok(Self {
            pose: pose.iter().copied().collect(),
            first_bin,
            alpha: decay as f32,
            omega: (0..bins.next_multiple_of(GROUP)).map(kept).collect(),
            force: thinned(force),
            acceleration: thinned(acceleration),
            bins,
            noise_left: 1.0,
        })
    }
}

/// `x_n e^(−α(n−o))` from the onset `o` on, and zero before it. The mean of the rest before the cut is the zero of the sensor.
fn weight(signal: &[f32], onset: usize, alpha: f64, weighted: &mut [f32]) {
    let decay = libm::exp(-alpha);
    let rest = &signal[..onset.max(REST)];
    let offset = if alpha > 0.0 { rest.iter().sum::<f32>() / rest.len() as f32 } else { 0.0 };
    let mut factor = 1.0_f64;
    weighted[..onset].fill(0.0);
    for (weighted, &value) in weighted.iter_mut().zip(signal).skip(onset) {
        *weighted = (value - offset) * factor as f32;
        factor *= decay;
    }
}

/// Joint angles where the weight `e^(−α(n−o))` from the onset o on, or Hann's window, has its mean.
fn pose<const N: usize>(record: &Record<N>, onset: usize) -> Pose {
    let (samples, parts) = (record.force[0].len(), record.path.len());
    if parts < 2 {
        return record.pose.clone();
    }
    if !record.starts_at_rest {
        return part::mean(&record.path[parts / 2 - 1..=parts / 2]);
    }
    let mean = onset as f64 + samples as f64 / DECAY;
    // The weight has its mean before the last part.
    record.path[(mean / samples as f64 * parts as f64) as usize].pose.clone()
}

/// Sample at which a record that starts at rest is taken to leave it: shortly before a sensor shows more than its noise. The weight
/// `e^(−αn)` begins there. If it began at the first sample, a rest of a quarter of the record would leave a signal of `e^(−5)` beside
/// the whole noise of the rest.
fn onset<const N: usize>(record: &Record<N>) -> usize {
    let onset_of = |signal: &[f32], noise: f32| {
        let zero = signal[..REST].iter().sum::<f32>() / REST as f32;
        signal.iter().position(|value| (value - zero).abs() > AT_REST * noise)
    };
    let force = record.force.iter().zip(record.force_noise);
    let acceleration = record.acceleration.iter().zip(record.acceleration_noise);
    let onsets = force.chain(acceleration).filter_map(|(signal, noise)| onset_of(signal, noise));
    let most = record.force[0].len() / LONGEST_REST;
    onsets.min().unwrap_or(0).saturating_sub(REST).min(most)
}

/// Samples at the start of a record from which the sensors' zero is read. The weight begins as many before the onset, so that the
/// sensors may be apart by that.
const REST: usize = 64;
/// Standard deviations of the noise within which a sensor is at rest: of 1e5 normal samples one in 5,000 records exceeds them.
const AT_REST: f32 = 6.0;
/// The rest that is left out is at most this part of a record, so that the weight still ends at `e^(−10)`.
const LONGEST_REST: usize = 2;

fn fill<const B: usize>(spectrum: &mut Spectrum<B>) {
    for part in spectrum.re.iter_mut().chain(&mut spectrum.im) {
        while part.len() % GROUP != 0 {
            let _ = part.push(0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Complex;

    use super::*;

    const N: usize = 2048;
    const RATE_HZ: f64 = 500.0;
    const NOISE: f32 = 0.01;
    /// Samples by which the acceleration follows the force, and its size over that of the force.
    const LATER: usize = 5;
    const TIMES: f32 = 3.0;

    /// A decaying force that begins at this sample, and an acceleration after it. Both have alternating noise.
    fn record(onset: usize) -> Record<N> {
        let signal = |from: usize, size: f32| {
            let force = |n: usize| size * libm::expf(-0.02 * (n - from) as f32);
            let noise = |n: usize| if n.is_multiple_of(2) { NOISE } else { -NOISE };
            let signal = |n: usize| noise(n) + if n < from { 0.0 } else { force(n) };
            core::array::from_fn(|_| (0..N).map(signal).collect())
        };
        Record {
            start_s: 0.0,
            pose: Default::default(),
            path: Default::default(),
            since_s: 0.0,
            rate_hz: RATE_HZ,
            has_doubtful_rate: false,
            force: signal(onset, 1.0),
            acceleration: signal(onset + LATER, TIMES),
            force_noise: [NOISE; 3],
            acceleration_noise: [NOISE; 3],
            force_noise_shape: Default::default(),
            acceleration_noise_shape: Default::default(),
            starts_at_rest: true,
            point: [0.0; 3],
        }
    }

    /// `A = 3 e^(−5s/rate) F` at each bin, however long the rest: the noise of a long rest does not outweigh the cut.
    #[test]
    fn the_rest_before_the_cut_is_left_out() {
        for onset in [100, N / 4, N / 2] {
            let band = 20..200;
            let spectra = ThinnedSpectra::<64>::new(&record(onset), band, &mut [0.0; N]).unwrap();
            let [force, acceleration] = [&spectra.force, &spectra.acceleration];
            for bin in 0..spectra.bins {
                let complex = |re: f32, im: f32| Complex::new(f64::from(re), f64::from(im));
                let [f, a] = [force, acceleration].map(|of| complex(of.re[0][bin], of.im[0][bin]));
                let s = complex(spectra.alpha, spectra.omega[bin]);
                let later = (s * (-(LATER as f64) / RATE_HZ)).exp() * f64::from(TIMES);
                let ratio = a / f;
                let off = (ratio / later - 1.0).norm();
                assert!(off < 0.01, "onset {onset}, bin {bin}: {off}");
            }
        }
    }
}
