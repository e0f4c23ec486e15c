//! What keeps frames from becoming records, told so that people can mend it.

use std::collections::HashSet;
use std::fmt;

use embedded_can::Id;
use flexid_core::stream::{Reading, StreamHealth};

use super::Counts;
use crate::config::Config;
use crate::source::Frame;

/// An obstacle is worth naming from this part of the frames on.
const SHARE: u64 = 10;

/// Frames of a known identifier that are not as the DBC file says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Misfit {
    /// Their identifier.
    pub id: Id,
    /// What they are instead.
    pub kind: MisfitKind,
    /// How many came.
    pub frames: u64,
    /// Whether other frames of this identifier could be read.
    pub others_fit: bool,
}

/// What is wrong with a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MisfitKind {
    /// Bytes of the payload, and bytes by the DBC file.
    Length {
        /// On the bus.
        got: u8,
        /// In the DBC file.
        expected: u8,
    },
    /// A remote request.
    Remote,
    /// A CAN FD frame.
    Fd,
}

impl fmt::Display for Misfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.id {
            Id::Standard(id) => write!(f, "frames 0x{:03X}", id.as_raw())?,
            Id::Extended(id) => write!(f, "frames 0x{:08X}", id.as_raw())?,
        }
        match self.kind {
            MisfitKind::Length { got, expected } => {
                write!(
                    f,
                    " have {got} bytes, by [bus] dbc {expected}: mend the DBC file or the sender"
                )?;
            }
            MisfitKind::Remote => write!(f, " are remote requests: does the sensor answer?")?,
            MisfitKind::Fd => write!(f, " are CAN FD: set the sender to classical CAN")?,
        }
        write!(f, " ({} so far)", self.frames)
    }
}

/// The misfits of all identifiers.
#[derive(Clone, Debug, Default)]
pub(super) struct Misfits {
    seen: Vec<Misfit>,
    fitting: HashSet<Id>,
}

impl Misfits {
    pub(super) fn fits(&mut self, frame: &Frame) {
        self.fitting.insert(frame.id);
    }

    pub(super) fn add(&mut self, frame: &Frame, kind: MisfitKind) {
        match self.seen.iter_mut().find(|misfit| (misfit.id, misfit.kind) == (frame.id, kind)) {
            Some(misfit) => misfit.frames += 1,
            None => {
                self.seen.push(Misfit { id: frame.id, kind, frames: 1, others_fit: false });
            }
        }
    }

    /// The most frequent; before all others one of an identifier of which nothing could be read.
    pub(super) fn worst(&self) -> Option<Misfit> {
        let all = self
            .seen
            .iter()
            .map(|misfit| Misfit { others_fit: self.fitting.contains(&misfit.id), ..*misfit });
        all.max_by_key(|misfit| (!misfit.others_fit, misfit.frames))
    }
}

/// What is odd about readings, sensor by sensor: force, acceleration.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Oddities {
    last: [Option<u32>; 2],
    /// Readings whose counter is the one of the reading before.
    pub(super) standing_still: [u64; 2],
    /// Readings that are no finite numbers.
    pub(super) not_finite: u64,
}

impl Oddities {
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

/// Why frames that come give no record, in words: the largest obstacle, if one is worth naming.
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
    // Core cannot tell one from the other.
    let odd = stream.restarts + stream.repeated + stream.refused;
    let apart = odd.saturating_sub(force + acceleration + not_finite);
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

/// That frames come at another rate than the config says, in words, once a record did.
pub(super) fn wrong_rate(counts: &Counts, config: &Config) -> Option<String> {
    let stream = &counts.stream;
    let measured_hz = f64::from(stream.measured_rate_hz);
    // To what can be seen of the difference.
    let places = if (measured_hz / config.rate_hz - 1.0).abs() > 0.01 { 0 } else { 2 };
    (stream.wrong_rate > 0 || stream.doubtful_rate > 0).then(|| {
        format!(
            "{}: [measurement] rate_hz is {}, but frames come at {measured_hz:.places$}/s",
            config.file_name(),
            config.rate_hz,
        )
    })
}

/// What is done about it.
pub(super) fn rate_used(stream: &StreamHealth) -> String {
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
