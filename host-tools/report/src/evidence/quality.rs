//! Counts of what has come in.

use flexid_pipeline::Counts;
use serde::{Deserialize, Serialize};

/// Counts of what has come in. Lists of six are of the force's axes, then of the acceleration's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct DataQuality {
    /// Frames of all kinds.
    pub frames: u64,
    /// Frames of a known identifier with another length than in the DBC file.
    pub wrong_length: u64,
    /// Frames of an identifier that has no signal.
    pub unknown: u64,
    /// Errors that the bus reported.
    pub bus_errors: u64,
    /// Values at the limit of their signal.
    pub at_limit: [u64; 6],
    /// Readings that are not finite.
    pub not_finite: u64,
    /// Force and acceleration readings taken.
    pub readings: u64,
    /// Readings that are missing by their counters.
    pub lost: u64,
    /// Missing samples of records that were bridged.
    pub bridged: u64,
    /// Restarts of the counters.
    pub restarts: u64,
    /// Readings whose counter had come before.
    pub repeated: u64,
    /// Single wrong samples in records.
    pub spikes: [u64; 6],
    /// Samples at the end of a sensor's range in records.
    pub clipped: [u64; 6],
    /// Samples in records that repeat the one before although the axis should have moved.
    pub held: [u64; 6],
    /// Records that were cut.
    pub records: u64,
    /// Number of these refused: spikes, clipped samples, held samples, too fast.
    pub refused: [u64; 4],
    /// Samples that are in no record.
    pub samples_discarded: u64,
    /// Records whose measured rate differs from the configured one.
    pub wrong_rate: u64,
    /// Records whose measured rate contradicts the configured one without being certain.
    pub doubtful_rate: u64,
}

impl From<&Counts> for DataQuality {
    fn from(counts: &Counts) -> Self {
        let stream = &counts.stream;
        Self {
            frames: counts.all,
            wrong_length: counts.wrong_length,
            unknown: counts.unknown,
            bus_errors: counts.bus_errors,
            at_limit: counts.at_limit,
            not_finite: counts.not_finite,
            readings: stream.frames,
            lost: stream.frames_lost,
            bridged: stream.bridged,
            restarts: stream.restarts,
            repeated: stream.repeated,
            spikes: stream.spikes,
            clipped: stream.clipped,
            held: stream.held,
            records: stream.records,
            refused: [stream.spiked, stream.refused_clipped, stream.refused_held, stream.too_fast],
            samples_discarded: stream.samples_discarded,
            wrong_rate: stream.wrong_rate,
            doubtful_rate: stream.doubtful_rate,
        }
    }
}
