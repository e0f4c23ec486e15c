//! Log lines about what keeps the daemon from records: each state once, when it has stood for a while, and a drought of records.

use std::time::{Duration, Instant};

use flexid_pipeline::Counts;
use flexid_wire::state::State;
use tracing::{info, warn};

/// Time for which a state must stand before it is logged: signals that start or pause one after the other are no news. Chosen: as
/// long as a sensor's silence.
const STEADY: Duration = Duration::from_secs(2);
/// Time without any frame after which the bus is called silent.
const SILENCE: Duration = Duration::from_secs(10);
/// Time without a record, while frames come, after which the log says so. Chosen: most work pieces are changed sooner.
const DROUGHT: Duration = Duration::from_secs(600);

/// A line for the log. A warning is of what needs somebody to act.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Line {
    Info(String),
    Warning(String),
}

/// What the log has said of the state.
#[derive(Debug)]
pub(super) struct StateLog {
    /// Kind of the state that was logged last.
    said: Option<String>,
    /// Kind of the present state, and since when it stands.
    stands: Option<(String, Instant)>,
    /// Number of frames of all kinds, and when it last grew.
    frames: (u64, Instant),
    is_silent: bool,
    /// Counts at the newest record, or when frames came again, and when that was.
    record: (Counts, Instant),
    is_dry: bool,
}

impl StateLog {
    pub(super) fn new(now: Instant) -> Self {
        Self {
            said: None,
            stands: None,
            frames: (0, now),
            is_silent: false,
            record: (Counts::default(), now),
            is_dry: false,
        }
    }

    /// Logs what is new at `now`. `state` is `None` while the bus has a fault, which has a line of its own.
    pub(super) fn log(&mut self, state: Option<&State>, counts: &Counts, now: Instant) {
        for line in self.news(state, counts, now) {
            match line {
                Line::Info(text) => info!("{text}"),
                Line::Warning(text) => warn!("{text}"),
            }
        }
    }

    fn news(&mut self, state: Option<&State>, counts: &Counts, now: Instant) -> Vec<Line> {
        let silence = self.silence(counts, now);
        let state = state.filter(|_| !self.is_silent);
        silence
            .into_iter()
            .chain(state.and_then(|state| self.state(state, now)))
            .chain(state.and_then(|state| self.drought(state, counts, now)))
            .collect()
    }

    /// Says when the bus falls silent, and when it is heard again.
    fn silence(&mut self, counts: &Counts, now: Instant) -> Option<Line> {
        let (frames, since) = self.frames;
        if counts.all != frames {
            self.frames = (counts.all, now);
            if std::mem::take(&mut self.is_silent) {
                self.record = (*counts, now);
                return Some(Line::Info("frames come again".into()));
            }
        } else if frames > 0 && !self.is_silent && now - since >= SILENCE {
            self.is_silent = true;
            return Some(Line::Info("no frame comes any more".into()));
        }
        None
    }

    /// Says the state, if it is of another kind than the one that was said last and has stood for a while.
    fn state(&mut self, state: &State, now: Instant) -> Option<Line> {
        let text = state.to_string();
        let kind = kind(&text);
        let since = match &self.stands {
            Some((standing, since)) if *standing == kind => *since,
            _ => self.stands.insert((kind.clone(), now)).1,
        };
        if now - since < STEADY || self.said.as_ref() == Some(&kind) {
            return None;
        }
        self.said = Some(kind);
        Some(if is_in_order(state) { Line::Info(text) } else { Line::Warning(text) })
    }

    /// Says once that no record comes for long while frames do.
    fn drought(&mut self, state: &State, counts: &Counts, now: Instant) -> Option<Line> {
        let (at, since) = &self.record;
        // A stream that begins anew counts from 0.
        if counts.stream.records != at.stream.records || counts.all < at.all {
            self.record = (*counts, now);
            self.is_dry = false;
            return None;
        }
        if self.is_dry || now - *since < DROUGHT || counts.all == at.all {
            return None;
        }
        self.is_dry = true;
        let discarded = counts.stream.samples_discarded.saturating_sub(at.stream.samples_discarded);
        let minutes = DROUGHT.as_secs() / 60;
        Some(Line::Warning(format!(
            "no record for {minutes} min while frames come ({discarded} samples discarded since: \
             the pose moved, or the stretch was too short): {state}"
        )))
    }
}

/// Returns the kind of a line: its words without the numbers. Lines of one kind differ in their counts only.
pub(super) fn kind(line: &str) -> String {
    let is_number = |word: &&str| {
        word.contains(|c: char| c.is_ascii_digit())
            && !word.contains(|c: char| c.is_alphabetic() || c == '_')
    };
    line.split_whitespace().filter(|word| !is_number(word)).collect::<Vec<_>>().join(" ")
}

/// Returns whether a state needs nobody to act.
fn is_in_order(state: &State) -> bool {
    match state {
        State::NoFrames => true,
        State::AwaitingRecord { implausible, faint_force_n, .. } => {
            implausible.is_none() && faint_force_n.is_none()
        }
        State::Measuring { implausible } => implausible.is_none(),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use flexid_wire::state::{Obstacle, Sensor};

    use super::*;

    fn clipped(frames: u64) -> State {
        State::Obstacle(Obstacle::Clipped { frames })
    }

    /// Counts of so many frames, and one record.
    fn frames(all: u64) -> Counts {
        let mut counts = Counts { all, ..Counts::default() };
        counts.stream.records = 1;
        counts
    }

    #[test]
    fn a_state_is_said_once_when_it_stands() {
        let begun = Instant::now();
        let mut log = StateLog::new(begun);
        let measuring = State::Measuring { implausible: None };
        let force = State::SensorSilent(Sensor::Force);
        let steps = [
            (&State::NoFrames, ""),
            (&State::NoForce, ""),
            (&measuring, ""),
            (&measuring, ""),
            (&measuring, "measuring"),
            (&clipped(100), ""),
            (&measuring, ""),
            (&force, ""),
            (&force, ""),
            (&force, "waiting for force frames: they do not come any more"),
            (&force, ""),
            (&clipped(1), ""),
            (&clipped(20), ""),
            (&clipped(300), "300 frames of force and acceleration are at the limit"),
            (&clipped(4000), ""),
            (&measuring, ""),
            (&measuring, ""),
            (&measuring, "measuring"),
        ];
        for (second, (state, said)) in (0..).zip(steps) {
            let now = begun + Duration::from_secs(second);
            let lines = log.news(Some(state), &frames(1 + second), now);
            assert_eq!(lines.is_empty(), said.is_empty(), "{second} s: {lines:?}");
            for line in lines {
                let (text, in_order) = match &line {
                    Line::Info(text) => (text, true),
                    Line::Warning(text) => (text, false),
                };
                assert!(text.starts_with(said), "{second} s: {line:?}");
                assert_eq!(in_order, said == "measuring", "{second} s: {line:?}");
            }
        }
    }

    #[test]
    fn silence_and_drought_are_said_once_each() {
        let begun = Instant::now();
        let mut log = StateLog::new(begun);
        let state = State::Measuring { implausible: None };
        let mut said = Vec::new();
        // Frames come until minute 1, from minute 20 to 45, and with a record in the last minutes.
        for minute in 0..60 {
            let mut counts = frames(if (1..20).contains(&minute) { 1 } else { 1 + minute });
            counts.stream.records += u64::from(minute > 45);
            counts.stream.samples_discarded = 100 * minute;
            let now = begun + Duration::from_secs(60 * minute);
            for line in log.news(Some(&state), &counts, now) {
                let (Line::Info(text) | Line::Warning(text)) = line;
                said.push((minute, text));
            }
        }
        let expected = [
            (1, "no frame comes any more"),
            (20, "frames come again"),
            (20, "measuring"),
            (30, "no record for 10 min while frames come (1000 samples discarded since: "),
            (56, "no record for 10 min while frames come (1000 samples discarded since: "),
        ];
        assert_eq!(said.len(), expected.len(), "{said:?}");
        for ((minute, text), (expected_at, beginning)) in said.iter().zip(expected) {
            assert!(*minute == expected_at && text.starts_with(beginning), "{said:?}");
        }
    }
}
