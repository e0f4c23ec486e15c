//! Properties of the signals that a stream reads, and their ranges.

use core::error::Error;
use core::f64::consts::TAU;
use core::fmt;

use crate::MAX_JOINTS;
use crate::spectrum::fft::MIN_SAMPLES;

/// Properties of the signals that a stream reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreamConfig {
    /// Sampling rate of force and acceleration, Hz.
    pub rate_hz: f64,
    /// Samples of a full record: a power of two up to the stream's capacity.
    pub record_samples: usize,
    /// Number of joint angles that a pose needs.
    pub joints: usize,
    /// Width of the counters, bits (8 to 32).
    pub counter_bits: u32,
    /// Smallest step of the force signal, N.
    pub force_resolution: f32,
    /// Smallest step of the acceleration signal, m/s².
    pub acceleration_resolution: f32,
    /// Properties of the signals of the joints, base first.
    pub angles: [AngleSignal; MAX_JOINTS],
}

/// Properties of the signal of a joint's angle or stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngleSignal {
    /// Smallest step of the signal, rad (m). A joint that rests may read two neighbouring values in turn.
    pub resolution: f64,
    /// True if the joint turns: angles that differ by whole turns are equal.
    pub turns: bool,
}

impl AngleSignal {
    /// The signal of a joint that turns, whose steps are too small to matter.
    pub const FINE: Self = Self { resolution: 0.0, turns: true };

    /// Distance from one position to another, rad (m): the shorter way of a joint that turns.
    pub fn difference(&self, to: f64, from: f64) -> f64 {
        if self.turns { libm::remainder(to - from, TAU) } else { to - from }
    }
}

/// Why a stream refuses its configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StreamError {
    /// `rate_hz` is not positive and finite.
    Rate,
    /// `record_samples` is not a power of two from 256 to the capacity.
    RecordSamples,
    /// `joints` is not 1 to [`MAX_JOINTS`].
    Joints,
    /// `counter_bits` is not 8 to 32.
    CounterBits,
    /// A resolution is not positive and finite.
    Resolution,
    /// The resolution of a joint's angle is negative or not finite.
    AngleResolution,
}

impl StreamConfig {
    pub(super) fn check(&self, capacity: usize) -> Result<(), StreamError> {
        let samples = self.record_samples;
        if !(self.rate_hz.is_finite() && self.rate_hz > 0.0) {
            Err(StreamError::Rate)
        } else if !samples.is_power_of_two() || !(MIN_SAMPLES..=capacity).contains(&samples) {
            Err(StreamError::RecordSamples)
        } else if !(1..=MAX_JOINTS).contains(&self.joints) {
            Err(StreamError::Joints)
        } else if !(8..=32).contains(&self.counter_bits) {
            Err(StreamError::CounterBits)
        } else if ![self.force_resolution, self.acceleration_resolution]
            .iter()
            .all(|step| step.is_finite() && *step > 0.0)
        {
            Err(StreamError::Resolution)
        } else if !self.angles.iter().all(|angle| (0.0..f64::INFINITY).contains(&angle.resolution))
        {
            Err(StreamError::AngleResolution)
        } else {
            Ok(())
        }
    }
}

impl fmt::Display for StreamError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rate => f.write_str("sampling rate: must be positive and finite"),
            Self::RecordSamples => write!(
                f,
                "samples of a record: must be a power of two from {MIN_SAMPLES} to the stream's capacity"
            ),
            Self::Joints => write!(f, "joints: must be 1 to {MAX_JOINTS}"),
            Self::CounterBits => f.write_str("width of the counters: must be 8 to 32 bits"),
            Self::Resolution => f.write_str("resolutions: must be positive and finite"),
            Self::AngleResolution => {
                f.write_str("resolutions of the joints' angles: must not be negative, and finite")
            }
        }
    }
}

impl Error for StreamError {}
