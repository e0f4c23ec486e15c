//! Force and acceleration, brought together by their counters; the counters are checked against time.
//!
//! Both frames of one instant carry the same counter. Frames may be missing, late or doubled; the sensor may start anew with any
//! counter. The output is a sequence of instants in order, each with those of its frames that arrived.

use super::StreamHealth;
use super::clock::SET_BACK_S;

/// Force or acceleration along three axes.
pub(super) type Value = [f32; 3];

/// One sampling instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Instant {
    pub(super) time_s: f64,
    pub(super) force: Option<Value>,
    pub(super) acceleration: Option<Value>,
}

/// Next element of the sequence of instants, or its interruption.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Aligned {
    /// The next instant.
    Instant(Instant),
    /// More instants are missing than can be bridged, and the sequence goes on. It holds their number, if the time gives it.
    Gap(Option<u64>),
    /// The sensor started anew, or was silent: the number of instants between is not known.
    Restart,
}

/// Kind of a frame; each instant has one of both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Channel {
    Force,
    Acceleration,
}

/// Number of instants that stay open for frames out of order.
const OPEN: usize = 4;
/// Most missing instants in a row that are delivered as instants without frames; more are an [`Aligned::Gap`].
const MAX_MISSING: i64 = 2;
/// A longer silence ends the sequence of instants, s.
pub const SILENCE_S: f64 = 0.5;
/// Most by which a frame may come later than its counter implies, after a gap too long to be bridged, s.
pub const LATE_S: f64 = 0.05;
/// Most sample periods by which a frame may come earlier than its counter implies.
const EARLY_PERIODS: f64 = 3.0;
/// A counter that is less than this many instants back is that of a late or doubled frame, not of a restart.
const RECENT: i64 = 10;
/// Repeated frames in a row after which the sensor counts as started anew, at a counter a little further back.
const MAX_REPEATS: usize = 2 * OPEN;
/// Part by which the sensor's period may differ from the configured one. The delay of a frame is forgotten at this rate.
const DRIFT: f64 = 0.1;

/// Aligns the readings of one sensor.
#[derive(Clone, Debug)]
pub(super) struct Aligner {
    period_s: f64,
    counter_bits: u32,
    /// The newest instant; `None` before the first frame.
    newest: Option<Newest>,
    /// Open instants, from the oldest to the newest.
    open: heapless::Deque<Instant, OPEN>,
    /// A frame whose counter disagrees with the sequence; the next frame shows which of the two is wrong.
    suspect: Option<Frame>,
    /// Repeated frames in a row.
    repeats: usize,
    /// The newest gap of whole turns of the counter, until it is certain that they were lost.
    turns: Option<Turns>,
    /// Counter of the newest frame before a restart, until the next frame comes.
    before: Option<u32>,
}

/// Turns of the counter that were counted as lost, since a frame came late by as much. If the sender was only held up, the frames
/// after it come early.
#[derive(Clone, Copy, Debug)]
struct Turns {
    instants: u64,
    /// Time by which the frames came early so far, s.
    early_s: f64,
    /// End of the time in which they may come early, on the clock of the frames, s.
    until_s: f64,
}

/// One frame of a sensor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) time_s: f64,
    pub(super) counter: u32,
    pub(super) channel: Channel,
    pub(super) value: Value,
}

#[derive(Clone, Copy, Debug)]
struct Newest {
    counter: u32,
    /// Arrival of the first reading of it, s.
    time_s: f64,
    /// Time by which it came later than the earliest frames do, s.
    delay_s: f64,
}

impl Aligner {
    pub(super) fn new(rate_hz: f64, counter_bits: u32) -> Self {
        Self {
            period_s: 1.0 / rate_hz,
            counter_bits,
            newest: None,
            open: heapless::Deque::new(),
            suspect: None,
            repeats: 0,
            turns: None,
            before: None,
        }
    }

    /// Takes one frame; `sink` gets what has become complete.
    pub(super) fn push(
        &mut self,
        frame: Frame,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(Aligned, &mut StreamHealth),
    ) {
        health.frames += 1;
        let Some(newest) = self.newest else { return self.begin(frame, health) };
        let step = self.step(newest.counter, frame.counter);
        let since_s = frame.time_s - newest.time_s;
        // The clock went back by more than a late frame lies behind the newest.
        let set_back = since_s < step.min(0) as f64 * self.period_s - SET_BACK_S;
        let passed_s = if set_back { step.max(0) as f64 * self.period_s } else { since_s };
        let silent = !set_back && since_s > SILENCE_S;
        let tells_time = !silent && !set_back;
        let turned = tells_time && self.may_have_turned(step, passed_s, newest.delay_s);
        if turned {
            self.settle(health);
            self.turn(step, passed_s, &frame, health, sink);
        } else if step <= 0 && self.enter(step, &frame) {
            self.settle(health);
        } else if step <= 0 && step > -RECENT && tells_time && self.repeats < MAX_REPEATS {
            self.repeats += 1;
            health.repeated += 1;
        } else if step > 0 && self.agrees(step, passed_s, set_back) {
            self.settle(health);
            self.advance(step, passed_s, &frame, health, sink);
        } else {
            self.disagree(frame, silent, health, sink);
        }
    }

    /// Begins a sequence with its first frame.
    fn begin(&mut self, frame: Frame, health: &mut StreamHealth) {
        let Frame { time_s, counter, .. } = frame;
        let step = self.before.take().map(|before| self.step(before, counter));
        health.pauses += u64::from(step.is_some_and(|step| (1..=1 + MAX_MISSING).contains(&step)));
        self.newest = Some(Newest { counter, time_s, delay_s: 0.0 });
        let _ = self.open.push_back(Instant { time_s, ..Instant::default() });
        self.enter(0, &frame);
    }

    /// Refuses a frame that disagreed with the sequence, since the sequence goes on.
    fn settle(&mut self, health: &mut StreamHealth) {
        self.repeats = 0;
        health.refused += u64::from(self.suspect.take().is_some());
    }

    /// Sets aside one frame whose counter is out of sequence. Two that follow each other are a restart, and so is one after a silence or
    /// after [`MAX_REPEATS`] repeated frames.
    fn disagree(
        &mut self,
        frame: Frame,
        silent: bool,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(Aligned, &mut StreamHealth),
    ) {
        let follows = |suspect: &Frame| {
            (0..=OPEN as i64).contains(&self.step(suspect.counter, frame.counter))
        };
        let first = self.suspect.filter(follows);
        if first.is_none() && !silent && self.repeats < MAX_REPEATS {
            self.settle(health);
            self.suspect = Some(frame);
            return;
        }
        if first.is_some() {
            // The first frame was right: the new sequence begins with it.
            self.suspect = None;
        }
        self.restart(health, sink);
        self.begin(first.unwrap_or(frame), health);
        if first.is_some() {
            // The frame is counted already; it is the second of the new sequence.
            health.frames -= 1;
            self.push(frame, health, sink);
        }
    }

    /// Ends the sequence, if one has begun. The next frame begins another, or shows that it was a pause.
    pub(super) fn restart(
        &mut self,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(Aligned, &mut StreamHealth),
    ) {
        let Some(newest) = self.newest else { return };
        health.restarts += 1;
        self.flush(health, sink);
        sink(Aligned::Restart, health);
        self.before = Some(newest.counter);
    }

    /// True if the newest frame disagreed with the sequence, so that the next frame shows which of the two is wrong.
    pub(super) fn is_in_doubt(&self) -> bool {
        self.suspect.is_some()
    }

    /// True if a sequence has begun.
    pub(super) fn has_begun(&self) -> bool {
        self.newest.is_some()
    }

    /// Number of instants that wait for their frames.
    pub(super) fn waiting(&self) -> usize {
        self.open.len()
    }

    /// Delivers all open instants and ends the sequence.
    pub(super) fn flush(
        &mut self,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(Aligned, &mut StreamHealth),
    ) {
        while let Some(instant) = self.open.pop_front() {
            deliver(instant, health, sink);
        }
        health.refused += u64::from(self.suspect.take().is_some());
        (self.newest, self.before, self.turns) = (None, None, None);
        self.repeats = 0;
    }

    /// Signed difference of two counters that wrap.
    fn step(&self, from: u32, to: u32) -> i64 {
        let span = 1_i64 << self.counter_bits;
        let difference = (i64::from(to) - i64::from(from)).rem_euclid(span);
        if difference > span / 2 { difference - span } else { difference }
    }

    /// Puts a value into the open instant that is `step` (≤ 0) from the newest; false if there is none or its place is taken.
    fn enter(&mut self, step: i64, frame: &Frame) -> bool {
        let place = self.open.len() as i64 - 1 + step;
        let Some(instant) =
            usize::try_from(place).ok().and_then(|place| self.open.iter_mut().nth(place))
        else {
            return false;
        };
        let slot = match frame.channel {
            Channel::Force => &mut instant.force,
            Channel::Acceleration => &mut instant.acceleration,
        };
        if slot.is_some() {
            return false;
        }
        *slot = Some(frame.value);
        true
    }

    /// True if the counter may have turned once more than `step` implies: the time allows for it, together with the delay of the
    /// newest instant.
    fn may_have_turned(&self, step: i64, passed_s: f64, delay_s: f64) -> bool {
        let further = (step + (1_i64 << self.counter_bits)) as f64;
        // The second frame of an instant and a late frame come after the frames that were held up with them.
        let early_s = if step > 0 { delay_s } else { 0.0 };
        (1.0 - DRIFT) * further * self.period_s
            <= passed_s + early_s + EARLY_PERIODS * self.period_s
    }

    /// True if a counter that has advanced by `step` agrees with the time that has passed. Where the clock was set back, the time
    /// proves nothing, and only a counter that goes on without a gap agrees.
    fn agrees(&self, step: i64, passed_s: f64, set_back: bool) -> bool {
        let Some(newest) = self.newest else { return false };
        if set_back {
            return step <= 1 + MAX_MISSING;
        }
        if step == 1 {
            // A sender that was held up catches up in a burst.
            return passed_s <= SILENCE_S;
        }
        let late = passed_s - step as f64 * self.period_s;
        let latest = if step <= 1 + MAX_MISSING { SILENCE_S } else { LATE_S };
        late <= latest && newest.delay_s + late >= -EARLY_PERIODS * self.period_s
    }

    /// Opens the next instant, after those that are missing.
    fn advance(
        &mut self,
        step: i64,
        passed_s: f64,
        frame: &Frame,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(Aligned, &mut StreamHealth),
    ) {
        self.delay(step, passed_s, frame, health);
        if step - 1 > MAX_MISSING {
            let missing = step as u64 - 1;
            health.frames_lost += 2 * missing;
            health.frames_unheard += if passed_s > SILENCE_S { 2 * missing } else { 0 };
            return self.interrupt(Some(missing), frame, health, sink);
        }
        for missing in (0..step).rev() {
            if self.open.is_full()
                && let Some(instant) = self.open.pop_front()
            {
                deliver(instant, health, sink);
            }
            let time_s = frame.time_s - missing as f64 * self.period_s;
            let _ = self.open.push_back(Instant { time_s, ..Instant::default() });
        }
        self.enter(0, frame);
    }

    /// Opens the next instant of a counter that may have turned once or more. The time gives the number of lost turns. The sequence
    /// is interrupted in any case: the sender may have been held up instead.
    fn turn(
        &mut self,
        step: i64,
        passed_s: f64,
        frame: &Frame,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(Aligned, &mut StreamHealth),
    ) {
        let turn = 1_i64 << self.counter_bits;
        let fewest = i64::from(step <= 0);
        let turns = libm::round((passed_s / self.period_s - step as f64) / turn as f64);
        let step = step + turn * (turns as i64).max(fewest);
        self.delay(step, passed_s, frame, health);
        health.frames_lost += 2 * (step as u64 - 1);
        // Where the counter did not advance, all lost instants were counted because of the turns.
        let instants = if fewest == 0 { turns as u64 * turn as u64 } else { step as u64 - 1 };
        if instants > 0 {
            let until_s = frame.time_s + SILENCE_S;
            self.turns = Some(Turns { instants, early_s: 0.0, until_s });
        }
        self.interrupt(None, frame, health, sink);
    }

    /// Delivers all open instants and a gap; the sequence goes on with this frame.
    fn interrupt(
        &mut self,
        missing: Option<u64>,
        frame: &Frame,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(Aligned, &mut StreamHealth),
    ) {
        while let Some(instant) = self.open.pop_front() {
            deliver(instant, health, sink);
        }
        sink(Aligned::Gap(missing), health);
        let _ = self.open.push_back(Instant { time_s: frame.time_s, ..Instant::default() });
        self.enter(0, frame);
    }

    /// Takes note of when the newest instant came. If the frames come early by more than half of the turns that were counted as
    /// lost, no turn was lost.
    fn delay(&mut self, step: i64, passed_s: f64, frame: &Frame, health: &mut StreamHealth) {
        let expected_s = step as f64 * self.period_s;
        let late_s = passed_s - expected_s;
        let before_s = self.newest.map_or(0.0, |newest| newest.delay_s);
        let mut delay_s = (before_s + late_s - DRIFT * expected_s).max(0.0);
        if let Some(mut turns) = self.turns.take()
            && frame.time_s <= turns.until_s
        {
            turns.early_s -= late_s;
            let held_up_s = turns.instants as f64 * self.period_s;
            if turns.early_s > held_up_s / 2.0 {
                health.frames_lost -= 2 * turns.instants;
                delay_s = held_up_s - turns.early_s;
            } else {
                self.turns = Some(turns);
            }
        }
        self.newest = Some(Newest { counter: frame.counter, time_s: frame.time_s, delay_s });
    }
}

fn deliver(
    instant: Instant,
    health: &mut StreamHealth,
    sink: &mut impl FnMut(Aligned, &mut StreamHealth),
) {
    health.frames_lost +=
        u64::from(instant.force.is_none()) + u64::from(instant.acceleration.is_none());
    sink(Aligned::Instant(instant), health);
}

#[cfg(test)]
mod tests;
