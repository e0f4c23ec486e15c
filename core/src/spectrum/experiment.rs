//! A record in the frequency domain.

use core::f64::consts::TAU;

use heapless::Vec;

use super::cut_noise::CutNoise;
use super::measurement::Measurement;
use super::movement::Movement;
use super::part::{self, Part, Pose};
use super::signals::{MIN_BINS, Spectrum, SpectrumError};
use super::site::Site;
use super::thinned::ThinnedSpectra;
use super::tone::{MAX_TONES, Tone};
use super::{drift, fft};
use crate::chain::Chain;
use crate::noise::NoiseShape;
use crate::stream::{LEAST_EVEN, MAX_PARTS, Record, Stage};

/// A record is of no use if its force power in the band is at most this many times that of the noise. The fit weighs its estimate
/// of the force as if no noise were left in it.
pub const LEAST_FORCE: f64 = 10.0;

/// Returns whether an axis of the acceleration is not measured: its noise is infinite, and nothing is read.
fn is_absent(signal: &[f32], noise: f32) -> bool {
    noise == f32::INFINITY && signal.iter().all(|value| *value == 0.0)
}

/// What the spectra of an experiment are of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A record at `s = iω`: its end has a seam.
    Record,
    /// A measured receptance at `s = decay + iω`: it has no end, and so no seam.
    Receptance {
        /// Decay of the exponential window, 1/s; 0 without one.
        decay: f64,
        /// Angular frequency of bin 0, rad/s: the bins need not be multiples of their spacing.
        first: f64,
    },
}

impl Kind {
    /// Angular frequency of bin 0, rad/s.
    pub(crate) fn first(self) -> f64 {
        match self {
            Self::Record => 0.0,
            Self::Receptance { first, .. } => first,
        }
    }
}

/// A record or a measured receptance in the frequency domain, with its pose and its noise.
#[derive(Clone, Debug)]
pub struct Experiment<const B: usize> {
    /// What the spectra are of.
    pub kind: Kind,
    /// Mean joint angles, rad (m).
    pub pose: Pose,
    /// Stage of each [part](Experiment::parts). There is at least one.
    pub path: Vec<Stage, MAX_PARTS>,
    /// Rates of the joints in each part, rad/s (m/s); empty where the robot stands.
    pub rates: Vec<Pose, MAX_PARTS>,
    /// Number of parts into which the record was divided, with those that are left out.
    pub divided: usize,
    /// Point at which the force acts, from the TCP, TCP axes, m.
    pub point: [f64; 3],
    /// Fundamental frequency 2π/T of a part of length T, rad/s: the spacing of its bins.
    pub spacing: f64,
    /// Bin number of the first bin of each part. The spectra have all bins of a part, and then those of the next.
    pub first_bin: usize,
    /// DFT of the force times the sample period, along the force sensor's axes, Ns.
    pub force: Spectrum<B>,
    /// DFT of the acceleration times the sample period, along the accelerometer's axes, m/s.
    pub acceleration: Spectrum<B>,
    /// Derivative of [`Experiment::acceleration`] by the growth of its delay (s/s), which is zero at the start of the record, but for a
    /// constant in each part; in the same bins and axes, m/s.
    pub drift: Spectrum<B>,
    /// Mean square of the noise in each bin of the force, per axis, (Ns)².
    pub force_noise: [Vec<f32, B>; 3],
    /// Mean square of the noise in each bin of the acceleration, per axis, (m/s)². It is infinite along an axis that is not measured.
    pub acceleration_noise: [Vec<f32, B>; 3],
    /// Mean square of that noise without its lines, per axis, (m/s)².
    pub broad_noise: [Vec<f32, B>; 3],
    /// Reading of its parts beyond that at their mean poses.
    pub(crate) movement: Movement<B>,
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
        let path = record.path.iter().map(|stage| &stage.pose);
        let poses = core::iter::once(&record.pose).chain(path);
        if let Some(other) = poses.clone().find(|pose| pose.len() != chain.driven()) {
            return Err(SpectrumError::Pose(other.len()));
        }
        if !record.path.is_empty() && !record.path.len().is_power_of_two() {
            return Err(SpectrumError::Length(samples / record.path.len()));
        }
        let signals = || record.force.iter().chain(&record.acceleration);
        if let Some(other) = signals().find(|signal| signal.len() != samples) {
            return Err(SpectrumError::Length(other.len()));
        }
        let axes = record.acceleration.iter().zip(&record.acceleration_noise);
        let measured = axes.filter(|(signal, noise)| !is_absent(signal, **noise));
        let noise = record.force_noise.iter().chain(measured.map(|(_, noise)| noise));
        if signals().flatten().chain(noise).any(|value| !value.is_finite())
            || poses.flatten().chain(&record.point).any(|value| !value.is_finite())
        {
            return Err(SpectrumError::NotFinite);
        }
        let period = 1.0 / record.rate_hz;
        let whole = measurement.bins(record.rate_hz, samples);
        if !(MIN_BINS..=B).contains(&whole.len()) {
            return Err(SpectrumError::Bins(whole.len()));
        }
        let stages = part::stages(record, whole.len());
        let divided = stages.len();
        let even = || stages.iter().filter(|stage| stage.is_even);
        let path: Vec<Stage, MAX_PARTS> = even().cloned().collect();
        // One part alone does not tell how fast the robot moves.
        if divided == 1 && !record.path.is_empty() {
            return Err(SpectrumError::Bins(whole.len()));
        }
        if path.len() < LEAST_EVEN.min(divided) {
            return Err(SpectrumError::Uneven);
        }
        let length = samples / divided;
        let rates = part::rates(&stages, length as f64 * period);
        let rates = rates.zip(&stages).filter(|(_, stage)| stage.is_even);
        let rates: Vec<Pose, MAX_PARTS> = rates.map(|(rates, _)| rates).collect();
        let spacing = TAU * record.rate_hz / length as f64;
        let band = measurement.bins(record.rate_hz, length);
        let bins = path.len() * band.len();
        if bins > B {
            return Err(SpectrumError::Bins(bins));
        }
        let mut plain = |signals: &[Vec<f32, N>; 3], weight: fn(f32) -> f32| {
            let mut spectrum = Spectrum::EMPTY;
            for (axis, signal) in signals.iter().enumerate() {
                for (n, (weighted, value)) in buffer.iter_mut().zip(signal).enumerate() {
                    *weighted = value * weight(n as f32 / samples as f32);
                }
                let parts = buffer[..samples].chunks_exact_mut(length).zip(&stages);
                for (part, _) in parts.filter(|(_, stage)| stage.is_even) {
                    let transformed =
                        fft::real_transform(part).ok_or(SpectrumError::Length(samples))?;
                    for bin in &transformed[band.clone()] {
                        let _ = spectrum.re[axis].push(bin.re * period as f32);
                        let _ = spectrum.im[axis].push(bin.im * period as f32);
                    }
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
                let white = (white * length as f64 * period * period) as f32;
                let frequency = |bin: usize| bin as f32 / length as f32;
                let density = |bin| density(&shapes[axis], frequency(bin), length);
                let mean_square =
                    |bin| if white.is_finite() { white * density(bin) } else { white };
                let of_part: Vec<f32, B> = band.clone().map(mean_square).collect();
                of_part.iter().cycle().take(bins).copied().collect::<Vec<f32, B>>()
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
        let movement = match divided {
            1 => Movement::NONE,
            _ => Movement::without_a_model(&acceleration, &path),
        };
        let drift =
            drift::of(&acceleration, &by_time, &band, divided, record.since_s * spacing / TAU);
        let thinned = ThinnedSpectra::new(record, whole, buffer)?;
        Ok(Self {
            kind: Kind::Record,
            pose: record.pose.clone(),
            path,
            rates,
            divided,
            point: record.point,
            spacing,
            first_bin: band.start,
            force,
            acceleration,
            drift,
            force_noise,
            acceleration_noise,
            broad_noise,
            movement,
            cut_noise: CutNoise::default(),
            tones: Vec::new(),
            thinned,
        })
    }

    /// The parts of the record, as they follow each other: one where the robot stands.
    pub fn parts<'a>(&'a self) -> impl Iterator<Item = Part<'a>> {
        let (bins, site) = (self.bins_of_part(), self.site());
        let part = move |(part, stage): (usize, &'a Stage)| Part {
            site: Site { pose: &stage.pose, rates: &self.rates[part], ..site },
            bins: part * bins..(part + 1) * bins,
        };
        self.path.iter().enumerate().map(part)
    }

    /// Returns whether the spectra are those of a record.
    pub fn is_record(&self) -> bool {
        self.kind == Kind::Record
    }

    /// Returns whether the robot feeds.
    pub(crate) fn feeds(&self) -> bool {
        self.rates.iter().flatten().any(|rate| *rate != 0.0)
    }

    /// Returns whether the record has one part, with all of its samples.
    pub(crate) fn is_whole(&self) -> bool {
        self.divided == 1
    }

    /// Number of bins of each part.
    pub(crate) fn bins_of_part(&self) -> usize {
        self.bins() / self.path.len()
    }

    /// Number of bins of all parts.
    pub fn bins(&self) -> usize {
        self.force.re[0].len()
    }

    /// Where the force acts in the mean pose.
    pub fn site(&self) -> Site<'_> {
        let (pose, point) = (&self.pose, self.point.into());
        Site { pose, rates: &[], point, is_of_test: !self.is_record() }
    }

    /// Returns whether the acceleration along an axis is measured.
    pub fn measures(&self, axis: usize) -> bool {
        self.acceleration_noise[axis].iter().all(|noise| noise.is_finite())
    }

    /// Number of axes along which the acceleration is measured.
    pub(crate) fn measured_axes(&self) -> usize {
        (0..3).filter(|axis| self.measures(*axis)).count()
    }

    /// Number of real residuals of one out of `every` bin of each part.
    pub fn residuals(&self, every: usize) -> usize {
        2 * self.measured_axes() * self.path.len() * self.bins_of_part().div_ceil(every)
    }

    /// Root mean square of the force over the record in the band, all axes together, N.
    pub fn rms_force(&self) -> f64 {
        libm::sqrt(2.0 * self.force.power() / self.path.len() as f64) / self.length()
    }

    /// Length of a part, s.
    pub(crate) fn length(&self) -> f64 {
        TAU / self.spacing
    }

    /// Length of the record, with parts that are left out, s.
    pub fn duration(&self) -> f64 {
        self.divided as f64 * self.length()
    }

    /// Angular frequency of a bin, rad/s.
    pub fn omega(&self, bin: usize) -> f64 {
        self.kind.first() + (self.first_bin + bin % self.bins_of_part()) as f64 * self.spacing
    }
}
