//! A measured receptance in the frequency domain: frequency responses of a modal test, with a variance for each bin.
//!
//! The response A to a unit force is an experiment whose force has the spectrum 1 Ns along one direction, and no noise:
//!
//! ```text
//! A(s) = s² H(s) e          s = σ + iω          E |ΔA|² = the variance of the bin
//! ```
//!
//! Frequency responses have no end, and so no seam. An exponential window `e^(−σt)` on force and response of a test moves its bins to
//! `s = σ + iω`, where the same holds. Each direction of the force at one pose is an experiment.

use core::array::from_fn;

use heapless::Vec;

use super::cut_noise::CutNoise;
use super::experiment::{Experiment, Kind};
use super::measurement::Measurement;
use super::movement::Movement;
use super::part::Pose;
use super::signals::{MIN_BINS, Spectrum, SpectrumError};
use super::thinned::ThinnedSpectra;
use crate::chain::Chain;
use crate::stream::Stage;

/// Mean square of the noise of a bin that was not measured, over that of its response. Chosen: beside the noise of any other bin its weight is nothing, and it
/// is finite in single precision.
const UNMEASURED: f64 = 1e12;

/// Part of the spacing by which rounding moves a frequency.
const ROUNDING: f64 = 1e-3;

/// Accelerations of a robot at rest per force along one direction, at evenly spaced frequencies.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredReceptance<'a> {
    /// Joint angles, rad (m).
    pub pose: &'a [f64],
    /// Point at which the force acts, from the TCP, TCP axes, m.
    pub point: [f64; 3],
    /// Unit vector of the force, TCP axes.
    pub direction: [f64; 3],
    /// Distance of the frequencies, Hz.
    pub spacing_hz: f64,
    /// The first frequency, Hz.
    pub first_hz: f64,
    /// Decay of the exponential window, 1/s; 0 without one.
    pub decay: f64,
    /// Bins along each axis of the accelerometer. Empty along an axis that is not measured.
    pub axes: [&'a [MeasuredBin]; 3],
}

/// A frequency response in one bin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredBin {
    /// Real and imaginary part of the acceleration per force, 1/kg.
    pub accelerance: [f64; 2],
    /// Mean square of its complex error, 1/kg². Infinite where nothing is known.
    pub variance: f64,
}

impl<const B: usize> Experiment<B> {
    /// Spectra of a measured receptance of `chain` in the measured band.
    ///
    /// # Errors
    ///
    /// Returns an error if the pose or a value is invalid, if the axes have unlike numbers of bins, if the band holds too few or too many bins, or if
    /// no axis is measured.
    pub fn of_receptance(
        chain: &Chain,
        measurement: &Measurement,
        measured: &MeasuredReceptance<'_>,
    ) -> Result<Self, SpectrumError> {
        let MeasuredReceptance { pose, point, direction, spacing_hz, first_hz, decay, axes } =
            *measured;
        if pose.len() != chain.driven() {
            return Err(SpectrumError::Pose(pose.len()));
        }
        let length = axes.iter().map(|axis| axis.len()).max().unwrap_or(0);
        if let Some(other) = axes.iter().find(|axis| !axis.is_empty() && axis.len() != length) {
            return Err(SpectrumError::Bins(other.len()));
        }
        let numbers =
            pose.iter().chain(&point).chain(&direction).chain([&spacing_hz, &first_hz, &decay]);
        let parts = axes.iter().copied().flatten();
        let is_sound = |bin: &MeasuredBin| {
            bin.accelerance.iter().all(|part| part.is_finite()) && bin.variance > 0.0
        };
        if !numbers.copied().all(f64::is_finite)
            || spacing_hz <= 0.0
            || first_hz < 0.0
            || decay < 0.0
            || !parts.clone().all(is_sound)
        {
            return Err(SpectrumError::NotFinite);
        }
        // An edge that a frequency misses by rounding has it.
        let place = |edge: f64| (edge - first_hz) / spacing_hz;
        let [lower, upper] = measurement.band_hz.map(place);
        let first = libm::ceil(lower - ROUNDING).max(0.0) as usize;
        // Frequency 0 has no acceleration.
        let first = if first_hz == 0.0 { first.max(1) } else { first };
        let end = (libm::floor(upper + ROUNDING) + 1.0).max(0.0) as usize;
        let bins = end.min(length).saturating_sub(first);
        if !(MIN_BINS..=B).contains(&bins) {
            return Err(SpectrumError::Bins(bins));
        }
        let band = first..first + bins;
        let filled = |value: f64| -> Vec<f32, B> { (0..bins).map(|_| value as f32).collect() };
        let along = |axis: usize, own: &dyn Fn(&MeasuredBin) -> f64, absent: f64| -> Vec<f32, B> {
            match axes[axis] {
                [] => filled(absent),
                axis => axis[band.clone()].iter().map(|bin| own(bin) as f32).collect(),
            }
        };
        let part = |part: usize| from_fn(|axis| along(axis, &|bin| bin.accelerance[part], 0.0));
        let acceleration = Spectrum { re: part(0), im: part(1) };
        // The largest response of the axis stands for that of a bin that was not measured.
        let largest = axes.map(|axis| {
            let squares =
                axis.iter().map(|bin| bin.accelerance.iter().map(|part| part * part).sum());
            squares.fold(f64::MIN_POSITIVE, f64::max)
        });
        let variance = |axis: usize| {
            let most = UNMEASURED * largest[axis];
            along(axis, &|bin: &MeasuredBin| bin.variance.min(most), f64::INFINITY)
        };
        let acceleration_noise: [Vec<f32, B>; 3] = from_fn(variance);
        let is_weighed = |noise: &f32| noise.is_finite() && *noise > 0.0;
        if !acceleration_noise
            .iter()
            .zip(axes)
            .all(|(noise, axis)| axis.is_empty() || noise.iter().all(is_weighed))
        {
            return Err(SpectrumError::NotFinite);
        }
        let force = Spectrum { re: direction.map(filled), im: from_fn(|_| filled(0.0)) };
        let omega = |bin: usize| core::f64::consts::TAU * (first_hz + bin as f64 * spacing_hz);
        let thinned =
            ThinnedSpectra::of_receptance(pose, first, omega, decay, &force, &acceleration)?;
        let pose: Pose = pose.iter().copied().collect();
        let stage = Stage { pose: pose.clone(), moves: 0.0, is_even: true };
        Ok(Self {
            kind: Kind::Receptance { decay, first: core::f64::consts::TAU * first_hz },
            pose,
            path: core::iter::once(stage).collect(),
            rates: core::iter::once(Pose::new()).collect(),
            divided: 1,
            point,
            spacing: core::f64::consts::TAU * spacing_hz,
            first_bin: first,
            force,
            acceleration,
            drift: Spectrum { re: from_fn(|_| filled(0.0)), im: from_fn(|_| filled(0.0)) },
            force_noise: from_fn(|_| filled(0.0)),
            broad_noise: acceleration_noise.clone(),
            acceleration_noise,
            movement: Movement::NONE,
            cut_noise: CutNoise::default(),
            tones: Vec::new(),
            thinned,
        })
    }
}
