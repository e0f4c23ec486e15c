//! A record in the frequency domain.

use core::f64::consts::TAU;

use heapless::Vec;
use nalgebra::Vector3;

use super::cut_noise::CutNoise;
use super::measurement::Measurement;
use super::signals::{MIN_BINS, Spectrum, SpectrumError};
use super::thinned::ThinnedSpectra;
use super::tone::{MAX_TONES, Tone};
use super::{drift, fft};
use crate::MAX_JOINTS;
use crate::chain::Chain;
use crate::noise::NoiseShape;
use crate::stream::Record;

/// A record is of no use if its force power in the band is at most this many times that of the noise. The fit weighs its estimate
/// of the force as if no noise were left in it.
pub const LEAST_FORCE: f64 = 10.0;

/// Returns whether an axis of the acceleration is not measured: its noise is infinite, and nothing is read.
fn is_absent(signal: &[f32], noise: f32) -> bool {
    noise == f32::INFINITY && signal.iter().all(|value| *value == 0.0)
}

/// Where a force acts: the pose of the robot, and the point of its tool.
#[derive(Clone, Copy, Debug)]
pub struct Site<'a> {
    /// Joint angles, rad (m).
    pub pose: &'a [f64],
    /// Point at which the force acts, from the TCP, TCP axes, m.
    pub point: Vector3<f64>,
}

impl<'a> Site<'a> {
    /// The TCP at a pose, rad (m).
    pub fn tcp(pose: &'a [f64]) -> Self {
        Self { pose, point: Vector3::zeros() }
    }
}

/// A record in the frequency domain, with its pose and its noise.
#[derive(Clone, Debug)]
pub struct Experiment<const B: usize> {
    /// Joint angles, rad (m).
    pub pose: Vec<f64, MAX_JOINTS>,
    /// Point at which the force acts, from the TCP, TCP axes, m.
    pub point: [f64; 3],
    /// Fundamental frequency 2π/T, rad/s: the spacing of the bins.
    pub spacing: f64,
    /// Bin number of the first bin.
    pub first_bin: usize,
    /// DFT of the force times the sample period, along the force sensor's axes, Ns.
    pub force: Spectrum<B>,
    /// DFT of the acceleration times the sample period, along the accelerometer's axes, m/s.
    pub acceleration: Spectrum<B>,
    /// Derivative of [`Experiment::acceleration`] by the growth of its delay (s/s), which is zero at the start of the record, but for a
    /// constant; in the same bins and axes, m/s.
    pub drift: Spectrum<B>,
    /// Mean square of the noise in each bin of the force, per axis, (Ns)².
    pub force_noise: [Vec<f32, B>; 3],
    /// Mean square of the noise in each bin of the acceleration, per axis, (m/s)². It is infinite along an axis that is not measured.
    pub acceleration_noise: [Vec<f32, B>; 3],
    /// Mean square of that noise without its lines, per axis, (m/s)².
    pub broad_noise: [Vec<f32, B>; 3],
    /// Noise of the cut, to which the noise of the acceleration has been raised.
    pub cut_noise: CutNoise,
    /// Tones that have been subtracted from the acceleration.
    pub tones: Vec<Tone, MAX_TONES>,
    /// Spectra that the search fits.
    pub thinned: ThinnedSpectra<B>,
}

impl<const B: usize> Experiment<B> {
    /// Spectra of a `record` of `chain` in the measured band. `buffer` holds one signal at a time and is overwritten.
    ///
    /// # Errors
    ///
    /// Returns an error if the length, the pose or a value of the record is invalid, if the band holds too few or too many bins,
    /// or if the force in the band is hardly above its noise.
    pub fn new<const N: usize>(
        chain: &Chain,
        measurement: &Measurement,
        record: &Record<N>,
        buffer: &mut [f32; N],
    ) -> Result<Self, SpectrumError> {
        let samples = record.force[0].len();
        if !(fft::MIN_SAMPLES..=fft::MAX_SAMPLES).contains(&samples) || !samples.is_power_of_two() {
            return Err(SpectrumError::Length(samples));
        }
        if record.pose.len() != chain.driven() {
            return Err(SpectrumError::Pose(record.pose.len()));
        }
        let signals = || record.force.iter().chain(&record.acceleration);
        if let Some(other) = signals().find(|signal| signal.len() != samples) {
            return Err(SpectrumError::Length(other.len()));
        }
        let axes = record.acceleration.iter().zip(&record.acceleration_noise);
        let measured = axes.filter(|(signal, noise)| !is_absent(signal, **noise));
        let noise = record.force_noise.iter().chain(measured.map(|(_, noise)| noise));
        if signals().flatten().chain(noise).any(|value| !value.is_finite())
            || record.pose.iter().chain(&record.point).any(|value| !value.is_finite())
        {
            return Err(SpectrumError::NotFinite);
        }
        let period = 1.0 / record.rate_hz;
        let spacing = TAU * record.rate_hz / samples as f64;
        let hz_per_bin = record.rate_hz / samples as f64;
        let first_bin = libm::ceil(measurement.band_hz[0] / hz_per_bin).max(1.0) as usize;
        let last_bin =
            (libm::floor(measurement.band_hz[1] / hz_per_bin) as usize).min(samples / 2 - 1);
        let bins = (last_bin + 1).saturating_sub(first_bin);
        if !(MIN_BINS..=B).contains(&bins) {
            return Err(SpectrumError::Bins(bins));
        }
        let band = first_bin..last_bin + 1;
        let mut plain = |signals: &[Vec<f32, N>; 3], weight: fn(f32) -> f32| {
            let mut spectrum = Spectrum::EMPTY;
            for (axis, signal) in signals.iter().enumerate() {
                for (n, (weighted, value)) in buffer.iter_mut().zip(signal).enumerate() {
                    *weighted = value * weight(n as f32 / samples as f32);
                }
                let transformed = fft::real_transform(&mut buffer[..samples])
                    .ok_or(SpectrumError::Length(samples))?;
                for bin in &transformed[band.clone()] {
                    let _ = spectrum.re[axis].push(bin.re * period as f32);
                    let _ = spectrum.im[axis].push(bin.im * period as f32);
                }
            }
            Ok(spectrum)
        };
        let force = plain(&record.force, |_| 1.0)?;
        let acceleration = plain(&record.acceleration, |_| 1.0)?;
        let by_time = plain(&record.acceleration, |part| part)?;
        if !force.power().is_finite() || !acceleration.power().is_finite() {
            return Err(SpectrumError::NotFinite);
        }
        type Density = fn(&NoiseShape, f32, usize) -> f32;
        let mean_square = |deviation: [f32; 3], shapes: &[NoiseShape; 3], density: Density| {
            core::array::from_fn(|axis| {
                let white = f64::from(deviation[axis]) * f64::from(deviation[axis]);
                let white = (white * samples as f64 * period * period) as f32;
                let frequency = |bin: usize| bin as f32 / samples as f32;
                let density = |bin| density(&shapes[axis], frequency(bin), samples);
                let mean_square =
                    |bin| if white.is_finite() { white * density(bin) } else { white };
                band.clone().map(mean_square).collect::<Vec<f32, B>>()
            })
        };
        let force_noise: [Vec<f32, B>; 3] =
            mean_square(record.force_noise, &record.force_noise_shape, NoiseShape::density);
        let of_acceleration = |density: Density| {
            mean_square(record.acceleration_noise, &record.acceleration_noise_shape, density)
        };
        let acceleration_noise: [Vec<f32, B>; 3] = of_acceleration(NoiseShape::density);
        let broad_noise = of_acceleration(|shape, frequency, _| shape.broad_density(frequency));
        let measured = acceleration_noise.iter().zip(&record.acceleration_noise);
        let measured = measured.filter(|(_, noise)| noise.is_finite()).map(|(axis, _)| axis);
        let mut noises = force_noise.iter().chain(measured).flatten();
        if noises.any(|value| !value.is_finite()) {
            return Err(SpectrumError::NotFinite);
        }
        // No force at all is too little, even where its noise is given as zero.
        let noise: f64 = force_noise.iter().flatten().map(|value| f64::from(*value)).sum();
        if force.power() <= LEAST_FORCE * noise {
            return Err(SpectrumError::NoForce);
        }
        let drift = drift::of(&acceleration, &by_time, first_bin);
        let thinned = ThinnedSpectra::new(record, band, buffer)?;
        Ok(Self {
            pose: record.pose.clone(),
            point: record.point,
            spacing,
            first_bin,
            force,
            acceleration,
            drift,
            force_noise,
            acceleration_noise,
            broad_noise,
            cut_noise: CutNoise::default(),
            tones: Vec::new(),
            thinned,
        })
    }

    /// Number of bins.
    pub fn bins(&self) -> usize {
        self.force.re[0].len()
    }

    /// Where the force acts.
    pub fn site(&self) -> Site<'_> {
        Site { pose: &self.pose, point: self.point.into() }
    }

    /// Returns whether the acceleration along an axis is measured.
    pub fn measures(&self, axis: usize) -> bool {
        self.acceleration_noise[axis].iter().all(|noise| noise.is_finite())
    }

    /// Number of axes along which the acceleration is measured.
    pub(crate) fn measured_axes(&self) -> usize {
        (0..3).filter(|axis| self.measures(*axis)).count()
    }

    /// Number of real residuals of one out of `every` bin.
    pub fn residuals(&self, every: usize) -> usize {
        2 * self.measured_axes() * self.bins().div_ceil(every)
    }

    /// Root mean square of the force over the record in the band, all axes together, N.
    pub fn rms_force(&self) -> f64 {
        libm::sqrt(2.0 * self.force.power()) / self.length()
    }

    /// Length of the record, s.
    pub(crate) fn length(&self) -> f64 {
        TAU / self.spacing
    }

    /// Angular frequency of a bin, rad/s.
    pub fn omega(&self, bin: usize) -> f64 {
        (self.first_bin + bin) as f64 * self.spacing
    }
}
