//! Force and acceleration brought together by their counters, and the counters checked against time.
//!
//! Both frames of one instant carry the same counter. Frames may be missing, late or doubled; the sensor may start
//! anew with any counter. What leaves here is a sequence of instants in order, each with what arrived of it.

use super::StreamHealth;

/// Force or acceleration along three axes.
pub(super) type Value = [f32; 3];

/// One sampling instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Instant {
    pub(super) time_s: f64,
    pub(super) force: Option<Value>,
    pub(super) acceleration: Option<Value>,
}

/// What the sequence of instants is interrupted or continued by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Aligned {
    /// The next instant.
    Instant(Instant),
    /// More instants are missing than can be bridged; the robot has gone on.
    Gap,
    /// The sensor started anew, or was silent: nothing is known of what lies between.
    Restart,
}

/// Which of an instant's two frames a reading is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Channel {
    Force,
    Acceleration,
}

/// Instants that stay open for frames out of order.
const OPEN: usize = 4;
/// Missing instants in a row that are handed on as such; more are a [`Aligned::Gap`].
const MAX_MISSING: i64 = 2;
/// A silence that ends the sequence, s.
const SILENCE_S: f64 = 0.5;
/// How much later than its counter says a frame may come after a gap too long to be bridged, s.
const LATE_S: f64 = 0.05;
/// How many sample periods before its time.
const EARLY_PERIODS: f64 = 3.0;
/// How far back a counter counts as a late or doubled frame, not as a restart, instants.
const RECENT: i64 = 10;
/// Repeated frames in a row after which the sensor counts as started anew a little further back.
const MAX_REPEATS: usize = 2 * OPEN;
/// How fast the earliest arrival is forgotten, so that it follows the sensor's clock: 1000 ppm.
const DRIFT: f64 = 1e-3;

/// Aligns the readings of one sensor.
#[derive(Clone, Debug)]
pub(super) struct Aligner {
    period_s: f64,
    counter_bits: u32,
    /// Of the newest instant.
    newest: Option<Newest>,
    /// The newest instants, oldest first; the last is the newest.
    open: heapless::Deque<Instant, OPEN>,
    /// A frame whose counter disagrees with the sequence: the next one tells which of the two is wrong.
    odd: Option<Frame>,
    /// Frames in a row that had already been seen.
    repeats: usize,
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
    /// Arrival of the latest reading of it.
    time_s: f64,
    /// How much later it came than the earliest frames do, s.
    delay_s: f64,
}

impl Aligner {
    pub(super) fn new(rate_hz: f64, counter_bits: u32) -> Self {
        Self {
            period_s: 1.0 / rate_hz,
            counter_bits,
            newest: None,
            open: heapless::Deque::new(),
            odd: None,
            repeats: 0,
        }
    }

    /// Takes one frame; hands on what has become complete.
    pub(super) fn push(
        &mut self,
        frame: Frame,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(Aligned, &mut StreamHealth),
    ) {
        health.frames += 1;
        let Some(newest) = self.newest else { return self.begin(frame) };
        let step = self.step(newest.counter, frame.counter);
        let silent = frame.time_s - newest.time_s > SILENCE_S;
        if step <= 0 && self.enter(step, &frame) {
            self.settle(health);
        } else if step <= 0 && step > -RECENT && !silent && self.repeats < MAX_REPEATS {
            self.repeats += 1;
            health.repeated += 1;
        } else if step > 0 && self.agrees(step, frame.time_s) {
            self.settle(health);
            self.advance(step, &frame, health, sink);
        } else {
            self.disagree(frame, silent, health, sink);
        }
    }

    /// A first frame.
    fn begin(&mut self, frame: Frame) {
        let Frame { time_s, counter, .. } = frame;
        self.newest = Some(Newest { counter, time_s, delay_s: 0.0 });
        let _ = self.open.push_back(Instant { time_s, ..Instant::default() });
        self.enter(0, &frame);
    }

    /// The sequence goes on: a frame that disagreed with it was wrong.
    fn settle(&mut self, health: &mut StreamHealth) {
        self.repeats = 0;
        health.refused += u64::from(self.odd.take().is_some());
    }

    /// One odd counter is set aside; two that follow each other, or any after a silence, are a restart.
    fn disagree(
        &mut self,
        frame: Frame,
        silent: bool,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(Aligned, &mut StreamHealth),
    ) {
        let follows =
            |odd: &Frame| (0..=OPEN as i64).contains(&self.step(odd.counter, frame.counter));
        let first = self.odd.filter(follows);
        if first.is_none() && !silent && self.repeats < MAX_REPEATS {
            self.settle(health);
            self.odd = Some(frame);
            return;
        }
        health.restarts += 1;
        self.flush(health, sink);
        sink(Aligned::Restart, health);
        self.begin(first.unwrap_or(frame));
        if first.is_some() {
            // Counted already; the new sequence takes it as its second.
            health.frames -= 1;
            self.push(frame, health, sink);
        }
    }

    /// Hands on all that is open: nothing more will come.
    pub(super) fn flush(
        &mut self,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(Aligned, &mut StreamHealth),
    ) {
        while let Some(instant) = self.open.pop_front() {
            hand_on(instant, health, sink);
        }
        health.refused += u64::from(self.odd.take().is_some());
        self.newest = None;
        self.repeats = 0;
    }

    /// Signed difference of two counters that wrap.
    fn step(&self, from: u32, to: u32) -> i64 {
        let span = 1_i64 << self.counter_bits;
        let difference = (i64::from(to) - i64::from(from)).rem_euclid(span);
        if difference > span / 2 { difference - span } else { difference }
    }

    /// Puts a value into an open instant, `step` (≤ 0) from the newest; false if there is none or it is taken.
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

    /// Whether a counter that has advanced by `step` agrees with the time that has passed.
    fn agrees(&self, step: i64, time_s: f64) -> bool {
        let Some(newest) = self.newest else { return false };
        let passed = time_s - newest.time_s;
        if step == 1 {
            // A sender that was held up catches up in a burst.
            return passed <= SILENCE_S;
        }
        let late = passed - step as f64 * self.period_s;
        let latest = if step <= 1 + MAX_MISSING { SILENCE_S } else { LATE_S };
        late <= latest && newest.delay_s + late >= -EARLY_PERIODS * self.period_s
    }

    fn advance(
        &mut self,
        step: i64,
        frame: &Frame,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(Aligned, &mut StreamHealth),
    ) {
        let Frame { time_s, counter, .. } = *frame;
        let expected_s = step as f64 * self.period_s;
        let delay_s = self.newest.map_or(0.0, |newest| {
            let late = time_s - newest.time_s - expected_s;
            (newest.delay_s + late - DRIFT * expected_s).max(0.0)
        });
        if step - 1 > MAX_MISSING {
            while let Some(instant) = self.open.pop_front() {
                hand_on(instant, health, sink);
            }
            health.frames_lost += 2 * (step as u64 - 1);
            sink(Aligned::Gap, health);
            let _ = self.open.push_back(Instant { time_s, ..Instant::default() });
        } else {
            for missing in (0..step).rev() {
                if self.open.is_full()
                    && let Some(instant) = self.open.pop_front()
                {
                    hand_on(instant, health, sink);
                }
                let time_s = time_s - missing as f64 * self.period_s;
                let _ = self.open.push_back(Instant { time_s, ..Instant::default() });
            }
        }
        self.newest = Some(Newest { counter, time_s, delay_s });
        self.enter(0, frame);
    }
}

fn hand_on(
    instant: Instant,
    health: &mut StreamHealth,
    sink: &mut impl FnMut(Aligned, &mut StreamHealth),
) {
    health.frames_lost +=
        u64::from(instant.force.is_none()) + u64::from(instant.acceleration.is_none());
    sink(Aligned::Instant(instant), health);
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Bench {
        aligner: Aligner,
        health: StreamHealth,
        instants: std::vec::Vec<Instant>,
        breaks: std::vec::Vec<Aligned>,
    }

    impl Bench {
        fn new() -> Self {
            Self {
                aligner: Aligner::new(2000.0, 16),
                health: StreamHealth::default(),
                instants: std::vec::Vec::new(),
                breaks: std::vec::Vec::new(),
            }
        }

        fn push(&mut self, time_s: f64, counter: u32, channel: Channel) {
            let value = [counter as f32; 3];
            let (instants, breaks) = (&mut self.instants, &mut self.breaks);
            let frame = Frame { time_s, counter: counter & 0xffff, channel, value };
            self.aligner.push(frame, &mut self.health, &mut |event, _: &mut StreamHealth| {
                match event {
                    Aligned::Instant(instant) => instants.push(instant),
                    other => breaks.push(other),
                }
            });
        }

        /// Both frames of the instants `counters`, the first at `start_s`.
        fn run(&mut self, start_s: f64, counters: core::ops::Range<u32>) {
            for (n, counter) in counters.enumerate() {
                let time_s = start_s + n as f64 * 5e-4;
                self.push(time_s, counter, Channel::Force);
                self.push(time_s + 1.3e-4, counter, Channel::Acceleration);
            }
        }

        fn end(&mut self) {
            let (instants, breaks) = (&mut self.instants, &mut self.breaks);
            self.aligner.flush(&mut self.health, &mut |event, _: &mut StreamHealth| match event {
                Aligned::Instant(instant) => instants.push(instant),
                other => breaks.push(other),
            });
        }
    }

    #[test]
    fn pairs_by_counter_across_the_wrap() {
        let mut bench = Bench::new();
        bench.run(10.0, 65_000..66_000);
        bench.end();
        assert_eq!(bench.instants.len(), 1000);
        assert!(bench.instants.iter().all(|i| i.force.is_some() && i.force == i.acceleration));
        assert_eq!((bench.health.frames, bench.health.frames_lost), (2000, 0));
    }

    #[test]
    fn counts_single_and_missing_frames_at_edges_too() {
        let mut bench = Bench::new();
        bench.push(0.0, 7, Channel::Acceleration);
        bench.push(5e-4, 8, Channel::Force);
        bench.push(2e-3, 11, Channel::Force);
        bench.push(2.1e-3, 11, Channel::Acceleration);
        bench.end();
        // Force 7, acceleration 8, both of 9 and 10.
        assert_eq!(bench.health.frames_lost, 6);
        assert_eq!(bench.instants.len(), 5);
        assert!(bench.breaks.is_empty());
    }

    #[test]
    fn a_long_gap_is_lost_and_breaks() {
        let mut bench = Bench::new();
        bench.run(0.0, 0..100);
        bench.run(0.065, 130..200);
        bench.end();
        assert_eq!(bench.health.frames_lost, 60);
        assert_eq!(bench.breaks, [Aligned::Gap]);
        assert_eq!(bench.health.restarts, 0);
    }

    #[test]
    fn a_step_that_disagrees_with_time_is_a_restart() {
        // Ahead of time, behind time, back, and a silence with the counter going on.
        for (start_s, counter) in
            [(0.05, 600), (0.05, 20_000), (0.05, 40_000), (1.05, 100), (1.05, 300)]
        {
            let mut bench = Bench::new();
            bench.run(0.0, 0..100);
            bench.run(start_s, counter..counter + 50);
            bench.end();
            assert_eq!(bench.health.frames_lost, 0, "{start_s} {counter}");
            assert_eq!(bench.breaks, [Aligned::Restart], "{start_s} {counter}");
            assert_eq!(bench.instants.len(), 150);
        }
    }

    #[test]
    fn a_burst_after_a_hold_up_is_no_restart() {
        let mut bench = Bench::new();
        bench.run(0.0, 0..100);
        for counter in 100..250 {
            bench.push(0.125, counter, Channel::Force);
            bench.push(0.125, counter, Channel::Acceleration);
        }
        bench.run(0.125, 250..300);
        bench.end();
        assert_eq!((bench.health.frames_lost, bench.health.restarts), (0, 0));
        assert_eq!(bench.instants.len(), 300);
    }

    #[test]
    fn one_odd_counter_is_refused() {
        let mut bench = Bench::new();
        bench.run(0.0, 0..100);
        bench.push(0.05, 30_000, Channel::Force);
        bench.push(0.05013, 100, Channel::Acceleration);
        bench.run(0.0505, 101..200);
        bench.end();
        assert_eq!((bench.health.refused, bench.health.restarts), (1, 0));
        assert_eq!(bench.health.frames_lost, 1, "the force that came with the odd counter");
        assert_eq!(bench.instants.len(), 200);
    }

    #[test]
    fn a_counter_that_falls_back_a_little_is_a_restart() {
        let mut bench = Bench::new();
        bench.run(0.0, 0..100);
        bench.run(0.05, 94..200);
        bench.end();
        assert_eq!((bench.health.restarts, bench.health.frames_lost), (1, 0));
        assert_eq!(bench.breaks, [Aligned::Restart]);
        assert!(bench.instants.len() >= 100 + 106 - 5);
    }

    #[test]
    fn frames_out_of_order_and_doubled() {
        let mut bench = Bench::new();
        bench.run(0.0, 0..10);
        bench.push(5e-3, 10, Channel::Force);
        bench.push(5.5e-3, 11, Channel::Force);
        bench.push(5.6e-3, 10, Channel::Acceleration);
        bench.push(5.7e-3, 11, Channel::Acceleration);
        bench.push(5.8e-3, 11, Channel::Acceleration);
        bench.push(5.9e-3, 3, Channel::Force);
        bench.end();
        assert_eq!(bench.health.frames_lost, 0);
        assert_eq!(bench.health.repeated, 2);
        assert_eq!(bench.instants.len(), 12);
    }
}
