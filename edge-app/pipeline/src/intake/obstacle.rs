//! Obstacles that keep frames from becoming records, in words with the correction.

use flexid_core::stream::{Reading, StreamHealth};

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
            Reading::Joint { .. } => return,
        };
        self.standing_still[sensor] += u64::from(self.last[sensor] == Some(counter));
        self.last[sensor] = Some(counter);
        self.not_finite += u64::from(!value.iter().all(|value| value.is_finite()));
    }
}

/// Returns in words why the frames give no record. An identifier without any readable frame and a wrong rate come first, then
/// the largest obstacle, if it is large enough to be reported.
pub(super) fn obstacle(counts: &Counts, config: &Config) -> Option<String> {
    let Counts { stream, misfit, .. } = counts;
    if let Some(misfit) = misfit.filter(|misfit| !misfit.others_fit) {
        return Some(misfit.to_string());
    }
    if let Some(wrong_rate) = wrong_rate(counts, config) {
        return Some(wrong_rate);
    }
    let [force, acceleration] = counts.standing_still;
    let not_finite = counts.not_finite;
    // Core counts standing counters and readings that are not finite among these.
    let jumps = stream.restarts + stream.repeated + stream.refused;
    let apart = jumps.saturating_sub(force + acceleration + not_finite);
    let still = |sensor: &str, frames: u64| {
        format!(
            "[signals] {sensor}_counter stands still ({frames} frames): it must count the instants"
        )
    };
    let obstacles = [
        (force, still("force", force)),
        (acceleration, still("acceleration", acceleration)),
        (
            apart,
            format!(
                "the counters of force and acceleration do not go together ({apart} jumps): both must be \
                 equal at the same instant"
            ),
        ),
        (
            not_finite,
            format!("{not_finite} readings are no finite numbers: check the factors in [bus] dbc"),
        ),
        (
            misfit.map_or(0, |misfit| misfit.frames),
            misfit.map_or_else(String::new, |misfit| misfit.to_string()),
        ),
    ];
    let of = stream.frames + not_finite + counts.wrong_length + counts.not_data;
    let (frames, text) = obstacles.into_iter().max_by_key(|(frames, _)| *frames)?;
    (frames > 0 && frames >= of / SHARE).then_some(text)
}

/// Returns a line about the wrong rate, if at least one record came at another rate than that of the config.
pub(crate) fn wrong_rate(counts: &Counts, config: &Config) -> Option<String> {
    let stream = &counts.stream;
    let measured_hz = f64::from(stream.measured_rate_hz);
    // There are as many decimals as the difference needs.
    let places = if (measured_hz / config.rate_hz - 1.0).abs() > 0.01 { 0 } else { 2 };
    (stream.wrong_rate > 0 || stream.doubtful_rate > 0).then(|| {
        format!(
            "{}: [measurement] rate_hz is {}, but frames come at {measured_hz:.places$}/s",
            config.file_name(),
            config.rate_hz,
        )
    })
}

/// Returns in words which rate is used.
pub(crate) fn rate_used(stream: &StreamHealth) -> String {
    if stream.doubtful_rate > 0 {
        let deviation = stream.measured_rate_std_hz;
        format!("± {deviation:.2}: too uncertain to be used, so nothing is identified")
    } else if stream.too_fast > 0 {
        "too fast to be used".into()
    } else if stream.measured_rate_is_used() {
        "that is used".into()
    } else {
        "held up, so rate_hz is used".into()
    }
}
