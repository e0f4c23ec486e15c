//! Log lines about what keeps the daemon from records: each state when it has stood for a while, silence of the bus, and a drought of
//! records.

use std::time::{Duration, Instant};

use flexid_pipeline::Counts;
use flexid_pipeline::text::count;
use flexid_wire::state::State;

use crate::tally::{Line, Tally, kind};

/// Time for which a state must stand before it is logged: signals that start or pause one after the other are no news. Chosen: as
/// long as a sensor's silence.
const STEADY: Duration = Duration::from_secs(2);
/// Time without any frame after which the bus is called silent.
const SILENCE: Duration = Duration::from_secs(10);
/// Time without a record, while frames come, or without a first frame, after which the log says so. Chosen: most work pieces are changed
/// sooner.
const DROUGHT: Duration = Duration::from_secs(600);

/// The states that the log has named.
#[derive(Debug)]
pub(super) struct StateLog {
    /// Kind of the newest of them.
    said: Option<String>,
    tally: Tally<String>,
    /// Kind of the present state, and since when it stands.
    stands: Option<(String, Instant)>,
    /// Number of frames of all kinds, and when it last grew.
    frames: (u64, Instant),
    is_silent: bool,
    /// The wait for a record. `None` while no frames come.
    wait: Option<Wait>,
}

/// The wait for a record, from the one before, or from when frames began to come.
#[derive(Debug)]
struct Wait {
    counts: Counts,
    since: Instant,
    is_said: bool,
}

impl StateLog {
    pub(super) fn new(now: Instant) -> Self {
        Self {
            said: None,
            tally: Tally::default(),
            stands: None,
            frames: (0, now),
            is_silent: false,
            wait: None,
        }
    }

    /// Logs what is new at `now`. `state` is `None` while the bus has a fault, which has a line of its own.
    pub(super) fn log(&mut self, state: Option<&State>, counts: &Counts, now: Instant) {
        self.news(state, counts, now).iter().for_each(Line::log);
    }

    fn news(&mut self, state: Option<&State>, counts: &Counts, now: Instant) -> Vec<Line> {
        let mut lines = self.tally.counts(now);
        if state.is_none() {
            // Silence is that of the fault.
            self.frames.1 = now;
        }
        lines.extend(self.silence(counts, now));
        match state.filter(|_| !self.is_silent) {
            Some(state) => {
                lines.extend(self.state(state, now));
                lines.extend(self.drought(state, counts, now));
            }
            None => (self.stands, self.wait) = (None, None),
        }
        lines
    }

    /// Says when the bus falls silent, and when it is heard again.
    fn silence(&mut self, counts: &Counts, now: Instant) -> Option<Line> {
        let (frames, since) = self.frames;
        if counts.all != frames {
            self.frames = (counts.all, now);
            return std::mem::take(&mut self.is_silent).then(|| Line::Info("frames come".into()));
        }
        let longest = if frames > 0 { SILENCE } else { DROUGHT };
        if self.is_silent || now - since < longest {
            return None;
        }
        self.is_silent = true;
        let minutes = DROUGHT.as_secs() / 60;
        Some(Line::Warning(match frames {
            0 => format!("no frame has come for {minutes} min"),
            _ => "no frame comes any more".into(),
        }))
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
        self.said = Some(kind.clone());
        let line = if state.is_in_order() { Line::Info(text) } else { Line::Warning(text) };
        self.tally.line(kind, line, now)
    }

    /// Says once that no record comes for long while frames do, and why, as far as it is known.
    fn drought(&mut self, state: &State, counts: &Counts, now: Instant) -> Option<Line> {
        // A stream that begins anew counts from 0.
        let goes_on = self.wait.as_ref().is_some_and(|Wait { counts: at, .. }| {
            counts.stream.records == at.stream.records && counts.all >= at.all
        });
        if !goes_on {
            let wait = Wait { counts: *counts, since: now, is_said: false };
            self.wait = Some(wait).filter(|_| counts.all > 0);
        }
        let wait = self.wait.as_mut()?;
        if wait.is_said || now - wait.since < DROUGHT {
            return None;
        }
        wait.is_said = true;
        let minutes = DROUGHT.as_secs() / 60;
        Some(match lost_cuts(counts, &wait.counts) {
            Some(cuts) => Line::Warning(format!("no record for {minutes} min: {cuts}; {state}")),
            None if state.is_in_order() => Line::Info(format!("no cut for {minutes} min")),
            None => Line::Warning(format!("no record for {minutes} min: {state}")),
        })
    }
}

/// Returns the most frequent reason why cuts gave no record since `before`. Returns `None` if there was no cut.
fn lost_cuts(now: &Counts, before: &Counts) -> Option<String> {
    let [moved, moved_before] =
        [now, before].map(|counts| counts.stream.angles.iter().map(|angle| angle.ended).sum());
    let (now, before) = (&now.stream, &before.stream);
    let reasons = [
        (moved, moved_before, "ended early since a joint moved"),
        (now.without_pose, before.without_pose, "without joint angles that confirm the pose"),
        (now.refused_clipped, before.refused_clipped, "with values at the end of a sensor's range"),
        (now.refused_held, before.refused_held, "with values that stand still"),
        (now.spiked, before.spiked, "with spikes"),
        (now.too_fast, before.too_fast, "with samples at another rate"),
    ];
    let grown =
        reasons.map(|(now, before, reason): (u64, _, _)| (now.saturating_sub(before), reason));
    let (cuts, reason) = grown.into_iter().rev().max_by_key(|(cuts, _)| *cuts)?;
    (cuts > 0).then(|| format!("{} {reason}", count(cuts, "cut")))
}

#[cfg(test)]
mod tests {
    use flexid_wire::state::{Obstacle, Sensor};

    use super::*;

    const MEASURING: State = State::Measuring { implausible: None };

    fn clipped(frames: u64) -> State {
        State::Obstacle(Obstacle::Clipped { frames })
    }

    /// Counts of so many frames, and one record.
    fn frames(all: u64) -> Counts {
        let mut counts = Counts { all, ..Counts::default() };
        counts.stream.records = 1;
        counts
    }

    fn seconds(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    /// Lines of a run in steps of a second, each with its second. `at` gives the state and the counts.
    fn run(lasts: u64, at: impl Fn(u64) -> (Option<State>, Counts)) -> Vec<(u64, Line)> {
        let begun = Instant::now();
        let mut log = StateLog::new(begun);
        let steps = (0..lasts).flat_map(|second| {
            let (state, counts) = at(second);
            let lines = log.news(state.as_ref(), &counts, begun + seconds(second));
            lines.into_iter().map(move |line| (second, line)).collect::<Vec<_>>()
        });
        steps.collect()
    }

    fn assert_said(lines: &[(u64, Line)], expected: &[(u64, bool, &str)]) {
        assert_eq!(lines.len(), expected.len(), "{lines:?}");
        for ((second, line), (at, is_warning, text)) in lines.iter().zip(expected) {
            let is_right = second == at && line.text().starts_with(text);
            assert!(is_right, "{at} s: {text:?}: {lines:?}");
            assert_eq!(matches!(line, Line::Warning(_)), *is_warning, "{lines:?}");
        }
    }

    #[test]
    fn a_state_is_said_once_when_it_stands() {
        let lines = run(60, |second| {
            let state = match second {
                0 => State::NoFrames,
                1 => State::NoForce,
                5 => clipped(100),
                7..=9 => State::SensorSilent(Sensor::Force),
                11..=29 => clipped(1 + second),
                _ => MEASURING,
            };
            (Some(state), frames(1 + second))
        });
        let expected = [
            (4, false, "measuring"),
            (9, true, "waiting for force frames: they do not come any more"),
            (13, true, "14 frames of force and acceleration are at the limit"),
        ];
        assert_said(&lines, &expected);
    }

    /// Two states alternate for an hour.
    #[test]
    fn states_that_alternate_are_counted() {
        let lines = run(3600, |second| {
            let state = if second % 10 < 5 { MEASURING } else { clipped(second) };
            (Some(state), frames(1 + second))
        });
        assert!((110..=2 * 60 + 2).contains(&lines.len()), "{}", lines.len());
        let (_, last) = lines.last().unwrap();
        assert!(last.text().ends_with(" (6 times more since the last such line)"), "{last:?}");
    }

    #[test]
    fn silence_and_drought_are_said_once_each() {
        // Frames come until minute 1, and from minute 20 on, with a record in minute 45.
        let lines = run(3600, |second| {
            let minute = second / 60;
            let mut counts = frames(if (1..20).contains(&minute) { 60 } else { 1 + second });
            counts.stream.records += u64::from(minute >= 45);
            // Samples are let go while nothing is cut, too.
            counts.stream.samples_discarded = 100 * minute;
            counts.stream.angles[1].ended = u64::from(minute >= 50);
            counts.stream.spiked = u64::from(minute >= 55);
            (Some(MEASURING), counts)
        });
        let expected = [
            (2, false, "measuring"),
            (69, true, "no frame comes any more"),
            (1200, false, "frames come"),
            (1800, false, "no cut for 10 min"),
            (3300, true, "no record for 10 min: 1 cut ended early since a joint moved; measuring"),
        ];
        assert_said(&lines, &expected);
    }

    /// The daemon begins hours before the robot.
    #[test]
    fn a_wait_for_the_first_frame_is_no_drought_of_records() {
        let lines = run(3000, |second| match second {
            0..2000 => (Some(State::NoFrames), Counts::default()),
            _ => (Some(clipped(second)), Counts { all: second, ..Counts::default() }),
        });
        let expected = [
            (2, false, "waiting for frames"),
            (600, true, "no frame has come for 10 min"),
            (2000, false, "frames come"),
            (2002, true, "2002 frames of force"),
            (2600, true, "no record for 10 min: 2600 frames of force"),
        ];
        assert_said(&lines, &expected);
    }

    /// The bus is down for half an hour; then frames come again, and no record.
    #[test]
    fn a_fault_of_the_bus_is_no_drought() {
        let lines = run(3000, |second| match second {
            0..300 => (Some(MEASURING), frames(1 + second)),
            300..2100 => (None, frames(300)),
            _ => (Some(MEASURING), frames(second)),
        });
        assert_said(&lines, &[(2, false, "measuring"), (2700, false, "no cut for 10 min")]);
    }
}
