//! One stretch of force and acceleration.

use heapless::Vec;

use super::noise;
use crate::MAX_JOINTS;
use crate::noise::NoiseShape;

/// Most parts of a record. Chosen: of 4.1 s each lasts 0.13 s.
pub const MAX_PARTS: usize = 32;

/// Fewest even parts of a divided record. Chosen: with more than the three responses of a bin to the force they show what is noise there, as lines of
/// the spindle.
pub(crate) const LEAST_EVEN: usize = 4;

/// A part of a record along a path.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Stage {
    /// Mean joint angles, rad (m).
    pub pose: Vec<f64, MAX_JOINTS>,
    /// Largest movement of a joint, rad (m).
    pub moves: f64,
    /// True if the robot moves evenly. If it does not, its drives shake it, which no sensor of force sees.
    pub is_even: bool,
}

/// One stretch of force and acceleration, without holes.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Record<const N: usize> {
    /// Time of the first sample, on the clock of the readings, s.
    pub start_s: f64,
    /// Mean joint angles, rad (m).
    pub pose: Vec<f64, MAX_JOINTS>,
    /// Where the robot is in each of as many equal parts of the record, a power of two; empty where it stands. A state keeps it beside the record.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub path: Vec<Stage, MAX_PARTS>,
    /// Time from the start of the first of the records along a path that follow each other without a gap to the start of this one, s. A state keeps it
    /// beside the record.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub since_s: f64,
    /// Sampling rate, Hz. It is the mean of the measured and the configured rate, weighted by their variances, where the two agree.
    /// Where they do not, it is the measured rate if that is known to 50 ppm, else the configured rate.
    pub rate_hz: f64,
    /// True if the measured rate contradicts the configured one, but is too uncertain to replace it. A fit to the record is then
    /// wrong by an unknown factor.
    pub has_doubtful_rate: bool,
    /// Force that the tool exerts on the robot, N, along each of the force sensor's axes. It is 0 along an axis that is not measured.
    pub force: [Vec<f32, N>; 3],
    /// Acceleration, m/s², along each of the accelerometer's axes. It is 0 along an axis that is not measured.
    pub acceleration: [Vec<f32, N>; 3],
    /// Standard deviation of the noise of one force sample, per axis, bridging errors included, N. It is 0 along an axis that is not measured.
    pub force_noise: [f32; 3],
    /// Standard deviation of the noise of one acceleration sample, per axis, bridging errors included, m/s². It is infinite along an axis that is
    /// not measured.
    pub acceleration_noise: [f32; 3],
    /// Spectrum of the force's noise, per axis.
    pub force_noise_shape: [NoiseShape; 3],
    /// Spectrum of the acceleration's noise, per axis.
    pub acceleration_noise_shape: [NoiseShape; 3],
    /// True if the robot rests when the record starts.
    pub starts_at_rest: bool,
    /// Point of the tool at which the force acts, from the TCP, TCP axes, m. Only tables state one, and no state that is kept has records
    /// of these.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub point: [f64; 3],
}

impl<const N: usize> Record<N> {
    /// Number of samples at the start of the record in which nothing is cut: whole blocks of 64, 0 without any. The robot may ring
    /// in them. `force_step` is the smallest step of the force signal, N.
    pub fn quiet_samples(&self, force_step: f32) -> usize {
        let signals = || self.force.iter().chain(&self.acceleration);
        let samples = signals().map(|signal| signal.len()).min().unwrap_or_default();
        let [force, acceleration] = [&self.force, &self.acceleration]
            .map(|sensor| sensor.each_ref().map(|signal| &signal[..samples]));
        noise::leading_quiet(force, acceleration, force_step)
    }
}
