//! Counts of what has come in.

use flexid_core::stream::StreamHealth;
use flexid_wire::misfits::Misfit;

use super::plausibility::Implausible;

/// Counts of what has come in so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Number of frames of all kinds.
    pub all: u64,
    /// Number of frames of a known identifier, but of another length than in the DBC file.
    pub wrong_length: u64,
    /// Number of frames of an identifier that has no signal.
    pub unknown: u64,
    /// Number of remote requests and CAN FD frames of a known identifier.
    pub not_data: u64,
    /// Worst misfit among the frames of a wrong length and those without data.
    pub misfit: Option<Misfit>,
    /// Number of force and acceleration frames with a value at the limit of its signal.
    pub clipped: u64,
    /// Number of values at the limit for each axis: force x, y, z, acceleration x, y, z.
    pub at_limit: [u64; 6],
    /// Number of frames whose counter equals that of the frame before: force, acceleration.
    pub standing_still: [u64; 2],
    /// Number of force and acceleration readings that are not finite.
    pub not_finite: u64,
    /// Implausible readings.
    pub implausible: Implausible,
    /// Number of errors that the bus reported.
    pub bus_errors: u64,
    /// Counts of the stream.
    pub stream: StreamHealth,
}

impl Counts {
    /// Returns what has come in since `earlier`, as far as obstacles are judged by it: `misfit` is the worst since then.
    pub(super) fn since(&self, earlier: &Self, misfit: Option<Misfit>) -> Self {
        let (now, before) = (&self.stream, &earlier.stream);
        let [force, acceleration] = self.standing_still;
        Self {
            misfit,
            wrong_length: self.wrong_length - earlier.wrong_length,
            not_data: self.not_data - earlier.not_data,
            clipped: self.clipped - earlier.clipped,
            standing_still: [
                force - earlier.standing_still[0],
                acceleration - earlier.standing_still[1],
            ],
            not_finite: self.not_finite - earlier.not_finite,
            stream: StreamHealth {
                frames: now.frames - before.frames,
                frames_lost: now.frames_lost - before.frames_lost,
                restarts: now.restarts - before.restarts,
                repeated: now.repeated - before.repeated,
                refused: now.refused - before.refused,
                records: now.records - before.records,
                wrong_rate: now.wrong_rate - before.wrong_rate,
                doubtful_rate: now.doubtful_rate - before.doubtful_rate,
                ..*now
            },
            ..*self
        }
    }
}
