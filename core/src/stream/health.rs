//! Counts and measurements of a stream.

use super::clock;
use super::invalid::Invalid;
use crate::MAX_JOINTS;

/// Counts of the readings of one joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AngleHealth {
    /// Readings away from the pose for at most 0.25 s or a cycle and a half, which no joint can be: left out.
    pub wrong: u64,
    /// The newest of them, rad (m).
    pub wrong_value: f64,
    /// Step of the signal, rad, if the joint was seen to rest between two steps that are larger than a pose may change; else 0.
    pub step: f64,
    /// Cuts that ended before they gave a full record since the joint moved.
    pub ended: u64,
    /// Smallest of these movements, rad (m).
    pub ended_by: f64,
}

/// Counts and measurements of a stream since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StreamHealth {
    /// Force and acceleration readings taken.
    pub frames: u64,
    /// Force and acceleration readings that are missing by their counters.
    pub frames_lost: u64,
    /// Those of `frames_lost` that fall into a silence of both sensors of more than 0.5 s, over which the counters ran on with the
    /// time: nobody listened.
    pub frames_unheard: u64,
    /// Bridged samples of emitted records; force and acceleration count separately. Only samples that were
    /// lost are among them.
    pub bridged: u64,
    /// Single wrong samples in records: of the force's axes, then of the acceleration's. Those of emitted records were bridged.
    pub spikes: [u64; 6],
    /// Records refused since more than one in two hundred samples of an axis is such a spike.
    pub spiked: u64,
    /// Samples at the end of a sensor's range in records, axes as for `spikes`. Those of emitted records were bridged.
    pub clipped: [u64; 6],
    /// Records refused since too many samples of an axis are clipped, or too many in a row.
    pub refused_clipped: u64,
    /// Samples in records that repeat the one before although the axis should have moved, axes as for `spikes`. Those of emitted records
    /// were bridged.
    pub held: [u64; 6],
    /// Records refused since too many samples of an axis are held, or too many in a row.
    pub refused_held: u64,
    /// Restarts: a counter disagreed with the time that passed, since the sensor started anew or was silent.
    pub restarts: u64,
    /// Restarts after a silence whose counter went on without a gap: the clock was set forward, or the sensor paused.
    pub pauses: u64,
    /// Readings whose counter had come before.
    pub repeated: u64,
    /// Records emitted.
    pub records: u64,
    /// Samples discarded, as when the pose moved, the gap was too long or the stretch too short.
    pub samples_discarded: u64,
    /// Cuts of which an eighth of a record or more was discarded since no joint angle confirmed the pose, nor showed a movement.
    pub without_pose: u64,
    /// Readings refused: a value that is not finite, a joint that the robot does not have, a single counter out of sequence.
    pub refused: u64,
    /// Records whose measured rate differs from the configured one: by more than 200 ppm and three standard deviations where the
    /// sensor kept time, by more than 10 % where its sender was held up. A record whose samples came more than 10 % faster is
    /// refused.
    pub wrong_rate: u64,
    /// Records of `wrong_rate` that were refused.
    pub too_fast: u64,
    /// Records whose measured rate contradicts the configured one, but is too uncertain to replace it. They have the configured
    /// rate.
    pub doubtful_rate: u64,
    /// Measured rate of the newest record that one of these three counts, Hz; 0 before the first.
    pub measured_rate_hz: f32,
    /// Standard deviation of `measured_rate_hz`, Hz.
    pub measured_rate_std_hz: f32,
    /// Readings of the joints, base first.
    pub angles: [AngleHealth; MAX_JOINTS],
}

impl StreamHealth {
    /// Counts the samples of the force and of the acceleration in a record that are no measurement, and the record where they are too many.
    pub fn count_invalid(&mut self, invalid: &[Invalid; 2]) {
        for (sensor, own) in invalid.iter().enumerate() {
            for axis in 0..3 {
                self.clipped[3 * sensor + axis] += own.clipped[axis] as u64;
                self.held[3 * sensor + axis] += own.held[axis] as u64;
                self.spikes[3 * sensor + axis] += own.spikes[axis] as u64;
            }
        }
        let any = |are_many: fn(&Invalid) -> bool| u64::from(invalid.iter().any(are_many));
        self.refused_clipped += any(|own| own.clipped_are_many);
        self.refused_held += any(|own| own.held_are_many);
        self.spiked += any(|own| own.spikes_are_many);
    }

    /// Adds what [`StreamHealth::count_invalid`] has counted elsewhere.
    pub fn add_invalid(&mut self, other: &Self) {
        let pairs = [
            (&mut self.clipped, &other.clipped),
            (&mut self.held, &other.held),
            (&mut self.spikes, &other.spikes),
        ];
        for (own, other) in pairs {
            own.iter_mut().zip(other).for_each(|(own, other)| *own += other);
        }
        self.refused_clipped += other.refused_clipped;
        self.refused_held += other.refused_held;
        self.spiked += other.spiked;
    }

    /// True if `measured_rate_hz` is certain enough to be the rate of the records.
    pub fn measured_rate_is_used(&self) -> bool {
        f64::from(self.measured_rate_std_hz) <= clock::CRYSTAL * f64::from(self.measured_rate_hz)
    }
}
