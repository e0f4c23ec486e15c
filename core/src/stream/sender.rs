//! The sender of a joint's angle: its cycle, if it has one, and the steps of its signal.
//!
//! Senders repeat angles in a cycle, or send them on change alone. A sender that has repeated an angle will do so again: until it
//! does, the joint may have moved. So will one that has sent the angles of a joint at rest in regular intervals. Any other sender would
//! have sent a new angle if the joint had moved: its last angle holds.

use super::config::AngleSignal;

/// A sender is cyclic if it has repeated the same angle this often in a row. A signal has steps if it has returned from one to the
/// other as often.
const REPEATS: u8 = 3;
/// Longest time from an angle to its repetition, s. A slower cycle would make a record of 4 s wait for long.
pub const CYCLE_S: f64 = 2.0;
/// Least time after which a sender on change has sent the angle of a joint that moves, s: twice the cycle of a slow fieldbus gateway.
pub(super) const NOTICE_S: f64 = 0.25;
/// Cycles until a reading has come again, if the arrivals differ by half a cycle.
const NOTICE_CYCLES: f64 = 1.5;
/// Time for which a sender on change may send the angle of a joint that comes to rest, s. A drive with a velocity gain of 5 1/s, a slow
/// one, comes from [`STATIC`](super::pose::STATIC) to the microradian of a signal's last digit in 1.3 s.
const LONG_REST_S: f64 = 2.0;
/// Number of intervals that show whether they are regular, and largest variance of regular ones over their squared mean. The latter is
/// that of a cycle of which one reading in ten is lost, or whose arrivals differ by half of it. A sender on change whose joint rests
/// between two values passes for regular in less than one of 1000 rests of 20 s (simulated, changes looked for every 10 to 250 ms).
const INTERVALS: u32 = 20;
const REGULAR: f64 = 0.1;
/// Largest step between two readings that is taken for the resolution of a joint that turns, rad: 0.1°, the coarsest that displays of
/// robots have, and its rounding. Displays of axes that slide show 0.1 mm, which a pose allows for in any case.
const COARSEST: f64 = 2e-3;

/// A sender of an angle, whatever the stretch.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sender {
    /// Newest reading and its arrival, s; `None` if it is forgotten.
    pub(super) newest: Option<(f64, f64)>,
    /// Number of repetitions of the same angle in a row, up to [`REPEATS`]: then the sender is cyclic.
    repeats: u8,
    /// Mean time of the last repetitions, s; 0 before the first. A sender on change has none, however rarely it sends.
    pub(super) cycle_s: f64,
    steps: Steps,
}

impl Sender {
    pub(super) fn is_cyclic(&self) -> bool {
        self.repeats >= REPEATS
    }

    /// Time within which a reading comes that proves the one before it wrong, s.
    pub(super) fn notice_s(&self) -> f64 {
        NOTICE_S.max(NOTICE_CYCLES * self.cycle_s)
    }

    /// The step that the signal has shown, rad; 0 without any.
    pub(super) fn step(&self) -> f64 {
        self.steps.step()
    }

    pub(super) fn note(&mut self, angle: f64, time_s: f64, signal: &AngleSignal) {
        if let Some((before, before_s)) = self.newest {
            let passed_s = time_s - before_s;
            let is_again = angle == before && (0.0..=CYCLE_S).contains(&passed_s);
            if is_again {
                let weight = if self.cycle_s == 0.0 { 1.0 } else { 1.0 / f64::from(REPEATS) };
                self.cycle_s += weight * (passed_s - self.cycle_s);
            }
            self.steps.note(angle, before, time_s, self.notice_s(), signal);
            // It sent nothing until the angle changed.
            let is_on_change = angle != before && passed_s > CYCLE_S;
            self.repeats = match self.repeats {
                _ if is_on_change => 0,
                REPEATS => REPEATS,
                repeats if is_again => repeats + 1,
                _ => 0,
            };
        }
        self.newest = Some((angle, time_s));
    }

    /// Takes note that the angles of a joint at rest come in a cycle, although the last digit differs.
    pub(super) fn note_rest(&mut self, rest: &Rest) {
        if rest.is_regular() {
            self.repeats = REPEATS;
            self.cycle_s = rest.sum_s / f64::from(rest.intervals);
        }
    }

    /// Forgets the newest reading. A cycle that is not certain is forgotten with it.
    pub(super) fn forget(&mut self) {
        *self = match self.is_cyclic() {
            true => Self { newest: None, ..*self },
            false => Self { steps: self.steps, ..Self::default() },
        };
    }
}

/// The intervals between the readings of a joint at rest.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Rest {
    intervals: u32,
    /// Sum, s, and sum of squares, s².
    sum_s: f64,
    squares: f64,
}

impl Rest {
    pub(super) fn note(&mut self, interval_s: f64) {
        if !(0.0..=CYCLE_S).contains(&interval_s) {
            return *self = Self::default();
        }
        self.intervals = self.intervals.saturating_add(1);
        self.sum_s += interval_s;
        self.squares += interval_s * interval_s;
    }

    fn is_regular(&self) -> bool {
        let variance = f64::from(self.intervals) * self.squares / (self.sum_s * self.sum_s) - 1.0;
        self.intervals >= INTERVALS && self.sum_s > LONG_REST_S && variance <= REGULAR
    }
}

/// The steps of a signal. A joint that rests between two of them reads one or the other.
#[derive(Clone, Copy, Debug, Default)]
struct Steps {
    /// Smallest difference between two readings so far, rad.
    smallest: Option<f64>,
    /// The value before the present one, and the time when it changed, s.
    before: Option<(f64, f64)>,
    /// Number of times that the signal returned to the value that it had just left.
    returns: u8,
    /// Largest difference from which it returned, rad.
    largest: f64,
}

impl Steps {
    /// Takes a reading after the `newest`. A joint that moves away for `notice_s` does not rest.
    fn note(&mut self, angle: f64, newest: f64, time_s: f64, notice_s: f64, signal: &AngleSignal) {
        let apart = |other: f64| signal.difference(angle, other).abs();
        // Numbers of 32 bits differ by their rounding at the half turn.
        let is_at = |other: f64| apart(other) <= f64::from(f32::EPSILON) * angle.abs();
        if !signal.turns || is_at(newest) {
            return;
        }
        let difference = apart(newest);
        let smallest = self.smallest.map_or(difference, |smallest| smallest.min(difference));
        self.smallest = Some(smallest);
        // Values that are rounded to decimals differ by a step or by a little more or less.
        let is_step = |difference: f64| difference <= COARSEST && difference <= 2.0 * smallest;
        if !is_step(self.largest) {
            (self.returns, self.largest) = (0, 0.0);
        }
        let is_back = self
            .before
            .is_some_and(|(before, since_s)| is_at(before) && time_s - since_s <= notice_s);
        if is_back && is_step(difference) {
            self.returns = self.returns.saturating_add(1);
            self.largest = self.largest.max(difference);
        }
        self.before = Some((newest, time_s));
    }

    fn step(&self) -> f64 {
        if self.returns >= REPEATS { self.largest } else { 0.0 }
    }
}
