//! Obstacles that keep frames from becoming records.

use flexid_core::stream::{Reading, StreamHealth};
use flexid_wire::misfits::MisfitKind;
use flexid_wire::rate::{RateUsed, WrongRate};
use flexid_wire::state::{Obstacle, Sensor};

use super::counts::Counts;
use crate::config::Config;

/// An obstacle is reported if it affects at least one in so many frames.
const SHARE: u64 = 10;

/// Faults of the readings of each sensor: force, acceleration.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ReadingFaults {
    last: [Option<u32>; 2],
    /// Number of readings whose counter equals that of the reading before.
    pub(super) standing_still: [u64; 2],
    /// Number of readings that are not finite.
    pub(super) not_finite: u64,
}

impl ReadingFaults {
    pub(super) fn note(&mut self, reading: &Reading) {
        let (sensor, counter, value) = match reading {
            Reading::Force { counter, value } => (0, *counter, value),
            Reading::Acceleration { counter, value } => (1, *counter, value),
            Reading::Joint { .. } | Reading::Setup(_) => return,
        };
        self.standing_still[sensor] += u64::from(self.last[sensor] == Some(counter));
        self.last[sensor] = Some(counter);
        self.not_finite += u64::from(!value.iter().all(|value| value.is_finite()));
    }
}

/// Returns why the frames give no record. An identifier without any readable frame and a wrong rate come first, then
/// the largest obstacle, if it is large enough to be reported.
pub(crate) fn obstacle(counts: &Counts, config: &Config) -> Option<Obstacle> {
    let &Counts { ref stream, misfit, .. } = counts;
    if let Some(misfit) = misfit.filter(|misfit| !misfit.others_fit) {
        return Some(Obstacle::Misfit(misfit));
    }
    if let Some(rate) = wrong_rate(counts, config) {
        return Some(Obstacle::WrongRate(rate));
    }
    let [force, acceleration] = counts.standing_still;
    let not_finite = counts.not_finite;
    // Core counts standing counters and readings that are not finite among these.
    let jumps = stream.restarts + stream.repeated + stream.refused;
    let apart = jumps.saturating_sub(force + acceleration + not_finite);
    let still = |sensor, frames| (frames, Obstacle::CounterStandsStill { sensor, frames });
    let obstacles = [
        Some(still(Sensor::Force, force)),
        Some(still(Sensor::Acceleration, acceleration)),
        Some((apart, Obstacle::CountersApart { jumps: apart })),
        Some((not_finite, Obstacle::NotFinite { readings: not_finite })),
        Some((counts.clipped, Obstacle::Clipped { frames: counts.clipped })),
        // A sensor that is asked for each sample answers.
        misfit
            .filter(|misfit| misfit.kind != MisfitKind::Remote)
            .map(|misfit| (misfit.frames, Obstacle::Misfit(misfit))),
    ];
    let (frames, obstacle) = obstacles.into_iter().flatten().max_by_key(|(frames, _)| *frames)?;
    (frames > 0 && frames >= frames_of_sensors(counts) / SHARE).then_some(obstacle)
}

/// Returns the jumps of the counters, if the time for two records gave none, and less than a record lies between two restarts, or
/// frames are missing in number. Both sensors must be heard.
pub(super) fn counters_jump(stream: &StreamHealth, config: &Config) -> Option<Obstacle> {
    let (jumps, lost) = (stream.restarts, stream.frames_lost);
    let record = frames_of_record(config);
    let is_long = stream.records == 0 && stream.frames + lost >= 2 * record;
    let jump = (jumps + 1) * record > stream.frames || lost >= stream.frames / SHARE;
    (is_long && jumps + lost > 0 && jump).then_some(Obstacle::CountersJump { jumps, lost })
}

/// Returns the number of frames of force and acceleration that came, readable or not.
pub(super) fn frames_of_sensors(counts: &Counts) -> u64 {
    let Counts { stream, not_finite, wrong_length, not_data, left_out, .. } = counts;
    stream.frames + not_finite + wrong_length + not_data + left_out
}

/// Returns the number of frames of force and acceleration in a record.
pub(super) fn frames_of_record(config: &Config) -> u64 {
    2 * config.record_samples as u64
}

/// Returns the wrong rate, if at least one record came at another rate than that of the config.
pub(crate) fn wrong_rate(counts: &Counts, config: &Config) -> Option<WrongRate> {
    let stream = &counts.stream;
    (stream.wrong_rate > 0 || stream.doubtful_rate > 0).then(|| WrongRate {
        file: config.file_name(),
        rate_hz: config.rate_hz,
        measured_hz: stream.measured_rate_hz,
    })
}

/// Returns the rate that is used.
pub(crate) fn rate_used(stream: &StreamHealth) -> RateUsed {
    if stream.doubtful_rate > 0 {
        RateUsed::Uncertain { std_hz: stream.measured_rate_std_hz }
    } else if stream.too_fast > 0 {
        RateUsed::TooFast
    } else if stream.measured_rate_is_used() {
        RateUsed::Measured
    } else {
        RateUsed::Configured
    }
}
