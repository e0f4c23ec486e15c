//! The readings of a recording, until its end.

use flexid_core::stream::{Reading, SET_BACK_S};
use nalgebra::Rotation3;

use super::number::Sample;

/// What is known of the recording beforehand.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Expected {
    /// Width of the counter of the force and of the acceleration, bits. `None`: without.
    pub(crate) counter_bits: [Option<u32>; 2],
    /// Configured rate, Hz.
    pub(crate) rate_hz: f64,
    /// Upper edge of the band that is fitted, Hz.
    pub(crate) highest_hz: f64,
    /// Samples of a record.
    pub(crate) record_samples: usize,
    /// Smallest steps of the force, N, and of the acceleration, m/s².
    pub(crate) steps: [f32; 2],
    /// From the axes of the force sensor and of the accelerometer to those of the TCP.
    pub(crate) axes: [Rotation3<f64>; 2],
    /// True if a fit seeks the delay anyway, with a prior that the configuration states.
    pub(crate) seeks_delay: bool,
}

/// The readings of a recording, until its end.
pub(super) struct Kept {
    pub(super) expected: Expected,
    pub(super) sensors: [Vec<Sample>; 2],
    /// All other readings, with their times, s.
    pub(super) others: Vec<(f64, Reading)>,
    /// Where the clock of the recording was set back: the first readings behind.
    pub(super) parts: Vec<Part>,
    /// Time of the first reading, and of the newest, s. Smaller numbers have finer steps.
    pub(super) times_s: Option<(f64, f64)>,
}

/// The first force, acceleration and other reading of a part of the recording.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Part {
    pub(super) sensors: [usize; 2],
    pub(super) others: usize,
}

impl Kept {
    pub(super) fn new(expected: Expected) -> Self {
        Self {
            expected,
            sensors: Default::default(),
            others: Vec::new(),
            parts: vec![Part::default()],
            times_s: None,
        }
    }

    /// Takes a reading that arrived at a time, s.
    pub(super) fn push(&mut self, time_s: f64, reading: Reading) {
        if !time_s.is_finite() {
            return;
        }
        let (first_s, newest_s) = self.times_s.unwrap_or((time_s, time_s));
        self.times_s = Some((first_s, time_s));
        if time_s < newest_s - SET_BACK_S {
            let sensors = self.sensors.each_ref().map(Vec::len);
            self.parts.push(Part { sensors, others: self.others.len() });
        }
        let time_s = time_s - first_s;
        match reading {
            Reading::Force { counter, value } => {
                self.sensors[0].push(Sample { time_s, counter, value })
            }
            Reading::Acceleration { counter, value } => {
                self.sensors[1].push(Sample { time_s, counter, value })
            }
            other => self.others.push((time_s, other)),
        }
    }
}
