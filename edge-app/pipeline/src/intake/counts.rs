//! Counts of what has come in.

use flexid_core::MAX_JOINTS;
use flexid_core::stream::StreamHealth;
use flexid_wire::misfits::Misfit;

use super::feeding::Feeding;
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
    /// Number of remote requests and of frames without data of a known identifier.
    pub not_data: u64,
    /// Worst misfit among the frames of a wrong length, those without data and those that were left out.
    pub misfit: Option<Misfit>,
    /// Number of force and acceleration frames with a value at the limit of its signal.
    pub clipped: u64,
    /// Number of values at the limit for each axis: force x, y, z, acceleration x, y, z.
    pub at_limit: [u64; 6],
    /// Number of frames whose counter equals that of the frame before: force, acceleration.
    pub standing_still: [u64; 2],
    /// Number of frames of force and acceleration that were left out, since another frame of their sample is missing.
    pub left_out: u64,
    /// Number of force and acceleration readings that are not finite.
    pub not_finite: u64,
    /// Implausible readings.
    pub implausible: Implausible,
    /// How the angle of each joint came in records along a path, base first.
    pub feeding: [Feeding; MAX_JOINTS],
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
        // A loss may turn out to be none, and is taken back.
        let more = u64::saturating_sub;
        Self {
            misfit,
            wrong_length: more(self.wrong_length, earlier.wrong_length),
            not_data: more(self.not_data, earlier.not_data),
            clipped: more(self.clipped, earlier.clipped),
            standing_still: [
                more(force, earlier.standing_still[0]),
                more(acceleration, earlier.standing_still[1]),
            ],
            left_out: more(self.left_out, earlier.left_out),
            not_finite: more(self.not_finite, earlier.not_finite),
            stream: StreamHealth {
                frames: more(now.frames, before.frames),
                frames_lost: more(now.frames_lost, before.frames_lost),
                restarts: more(now.restarts, before.restarts),
                repeated: more(now.repeated, before.repeated),
                refused: more(now.refused, before.refused),
                records: more(now.records, before.records),
                wrong_rate: more(now.wrong_rate, before.wrong_rate),
                doubtful_rate: more(now.doubtful_rate, before.doubtful_rate),
                ..*now
            },
            ..*self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loss_that_is_taken_back_leaves_none() {
        let lost = |frames_lost| Counts {
            stream: StreamHealth { frames_lost, ..StreamHealth::default() },
            ..Counts::default()
        };
        assert_eq!(lost(4).since(&lost(512), None).stream.frames_lost, 0);
        assert_eq!(lost(520).since(&lost(512), None).stream.frames_lost, 8);
    }
}
