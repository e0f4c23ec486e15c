//! The joint angles of a stretch: for how long a reading holds, and what it is worth.
//!
//! Senders repeat angles in a cycle, or send them on change alone. A sender that has repeated an angle will do so again: until it
//! does, the joint may have moved. So will one that has sent the angles of a joint at rest for long. Any other sender would have sent a
//! new angle if the joint had moved: its last angle holds.
//!
//! A reading that leaves the pose is doubted for [`NOTICE_S`]. If a reading is at the pose again meanwhile, it was wrong: no joint moves
//! away and back in that time. If not, the joint has moved.

use heapless::Vec;

use super::clock::SET_BACK_S;
use super::config::AngleSignal;
use crate::MAX_JOINTS;

/// Largest movement of a joint within one pose, rad or m, where its signal has smaller steps. A pose wrong by 1e-3 rad biases
/// stiffnesses by 1 %.
pub const STATIC: f64 = 5e-4;
/// A sender is cyclic if it has repeated the same angle this often in a row. A signal has steps if it has returned from one to the
/// other as often.
const REPEATS: u8 = 3;
/// Longest time from an angle to its repetition, s. A slower cycle would make a record of 4 s wait for long.
const CYCLE_S: f64 = 2.0;
/// Time for which a sender on change may send the angle of a joint that comes to rest, s: a drive settles in less.
const LONG_REST_S: f64 = 2.0;
/// Time after which a sender on change has sent the angle of a joint that moves, s: twice the cycle of a slow fieldbus gateway.
pub(super) const NOTICE_S: f64 = 0.25;
/// Largest step between two readings that is taken for the resolution of a signal, rad or m: 0.1°, the coarsest that displays of robots
/// have, and its rounding.
const COARSEST: f64 = 2e-3;

/// Readings away from the pose, the newest of which agree with each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Doubt {
    /// The first of those that agree, rad (m).
    pub(super) angle: f64,
    /// Its arrival, s.
    pub(super) time_s: f64,
    /// Samples of the stretch when it came.
    pub(super) samples: usize,
    /// Samples of the stretch when the newest reading came.
    pub(super) confirmed: usize,
    /// Number of all these readings.
    pub(super) readings: u32,
    /// Distance of the first of all from the pose, rad (m).
    pub(super) by: f64,
    /// Arrival of the first of all, s.
    since_s: f64,
    /// Samples of the stretch when the first of all came.
    since: usize,
}

/// Joint angles over a stretch.
#[derive(Clone, Debug, Default)]
pub(super) struct Pose {
    angles: [Angle; MAX_JOINTS],
}

#[derive(Clone, Copy, Debug, Default)]
struct Angle {
    sender: Sender,
    first: f64,
    /// Sum of the readings' distances from the first.
    sum: f64,
    readings: u32,
    /// Samples of the stretch when the angle was last read; `None` if it has not come since the last gap.
    confirmed: Option<usize>,
    /// Arrival of the reading since which none came late, s, and the longest time between two of them.
    since_s: f64,
    apart_s: f64,
    doubt: Option<Doubt>,
}

/// What is known of the sender of an angle, whatever the stretch.
#[derive(Clone, Copy, Debug, Default)]
struct Sender {
    /// Newest reading and its arrival, s; `None` if it is forgotten.
    newest: Option<(f64, f64)>,
    /// Number of repetitions of the same angle in a row.
    repeats: u8,
    /// Longest time between these repetitions, s.
    cycle_s: f64,
    steps: Steps,
}

/// The steps of a signal. A joint that rests between two of them reads one or the other.
#[derive(Clone, Copy, Debug, Default)]
struct Steps {
    /// Smallest difference between two readings so far, rad (m).
    smallest: Option<f64>,
    /// The value before the present one, and the time when it changed, s.
    before: Option<(f64, f64)>,
    /// Number of times that the signal returned by the smallest difference to the value that it had just left.
    returns: u8,
}

impl Steps {
    fn note(&mut self, angle: f64, newest: f64, time_s: f64, signal: &AngleSignal) {
        let difference = signal.difference(angle, newest).abs();
        if difference == 0.0 {
            return;
        }
        // Sums and differences of floating point numbers are not exact.
        let rounding = 1e-6 * difference;
        if self.smallest.is_none_or(|smallest| difference < smallest - rounding) {
            (self.smallest, self.returns) = (Some(difference), 0);
        }
        let is_back = self.before.is_some_and(|(before, since_s)| {
            signal.difference(angle, before).abs() <= rounding && time_s - since_s <= NOTICE_S
        });
        if is_back && self.smallest.is_some_and(|smallest| difference <= smallest + rounding) {
            self.returns = self.returns.saturating_add(1);
        }
        self.before = Some((newest, time_s));
    }

    /// The step that the signal has shown, rad (m); 0 without any.
    fn step(&self) -> f64 {
        let smallest = self.smallest.filter(|smallest| *smallest <= COARSEST);
        smallest.filter(|_| self.returns >= REPEATS).unwrap_or(0.0)
    }
}

impl Sender {
    fn is_cyclic(&self) -> bool {
        self.repeats >= REPEATS
    }

    fn note(&mut self, angle: f64, time_s: f64, signal: &AngleSignal) {
        if let Some((before, before_s)) = self.newest {
            self.steps.note(angle, before, time_s, signal);
            if !self.is_cyclic() {
                let passed_s = time_s - before_s;
                let again = angle == before && (0.0..=CYCLE_S).contains(&passed_s);
                self.repeats = if again { self.repeats + 1 } else { 0 };
                self.cycle_s = if again { self.cycle_s.max(passed_s) } else { 0.0 };
            }
        }
        self.newest = Some((angle, time_s));
    }
}

impl Angle {
    /// Takes the first reading of a stretch.
    fn begin(&mut self, angle: f64, time_s: f64, samples: usize) {
        (self.first, self.sum, self.readings, self.confirmed) = (angle, 0.0, 1, Some(samples));
        (self.since_s, self.apart_s) = (time_s, 0.0);
    }

    /// Takes note that the joint held its position from one reading to the next. A sender that sends the angle of a joint at rest for long
    /// does so in a cycle, although the last digit differs.
    fn note_rest(&mut self, before_s: f64, time_s: f64) {
        let apart_s = time_s - before_s;
        if !(0.0..=CYCLE_S).contains(&apart_s) {
            (self.since_s, self.apart_s) = (time_s, 0.0);
            return;
        }
        self.apart_s = self.apart_s.max(apart_s);
        if !self.sender.is_cyclic() && time_s - self.since_s > LONG_REST_S {
            (self.sender.repeats, self.sender.cycle_s) = (REPEATS, self.apart_s);
        }
    }

    /// Samples, of so many, during which the joint is known to have stood still; `notice` is [`NOTICE_S`] in samples.
    fn standing(&self, samples: usize, notice: usize) -> usize {
        let samples = self.doubt.map_or(samples, |doubt| doubt.since.min(samples));
        let confirmed = self.confirmed.unwrap_or(0);
        match self.sender.is_cyclic() || self.readings == 0 {
            true => confirmed,
            false => confirmed.max(samples.saturating_sub(notice)),
        }
    }
}

impl Pose {
    /// Takes a joint's angle, read at `time_s` when the stretch has `samples`. Returns the doubt that it shows to be wrong.
    pub(super) fn read(
        &mut self,
        joint: usize,
        angle: f64,
        time_s: f64,
        samples: usize,
        signal: &AngleSignal,
    ) -> Option<Doubt> {
        let known = &mut self.angles[joint];
        let before_s = known.sender.newest.map_or(time_s, |(_, before_s)| before_s);
        known.sender.note(angle, time_s, signal);
        if known.readings == 0 {
            known.begin(angle, time_s, samples);
            return None;
        }
        let step = signal.resolution.max(known.sender.steps.step());
        let is_at =
            |place: f64| signal.difference(angle, place).abs() <= STATIC.max(step * (1.0 + 1e-6));
        if is_at(known.first) {
            known.sum += signal.difference(angle, known.first);
            known.readings += 1;
            known.confirmed = Some(samples);
            known.note_rest(before_s, time_s);
            return known.doubt.take();
        }
        let new = Doubt {
            angle,
            time_s,
            samples,
            confirmed: samples,
            readings: 1,
            by: signal.difference(angle, known.first).abs(),
            since_s: time_s,
            since: samples,
        };
        known.doubt = Some(known.doubt.map_or(new, |doubt| {
            let readings = doubt.readings.saturating_add(1);
            let (angle, time_s, samples) = match is_at(doubt.angle) {
                true => (doubt.angle, doubt.time_s, doubt.samples),
                false => (angle, time_s, samples),
            };
            Doubt { angle, time_s, samples, confirmed: new.samples, readings, ..doubt }
        }));
        None
    }

    /// The first joint that has been away from the pose for so long at `now_s` that it has moved.
    pub(super) fn moved(&self, now_s: f64) -> Option<usize> {
        let recent = -SET_BACK_S..=NOTICE_S;
        let has_moved = |doubt: Doubt| !recent.contains(&(now_s - doubt.since_s));
        self.angles.iter().position(|angle| angle.doubt.is_some_and(has_moved))
    }

    /// The readings of a joint away from the pose.
    pub(super) fn doubt(&self, joint: usize) -> Option<Doubt> {
        self.angles[joint].doubt
    }

    /// Begins a stretch of so many samples where a joint has gone, since it was first read there.
    pub(super) fn settle(&mut self, joint: usize, doubt: &Doubt, samples: usize) {
        let angle = &mut self.angles[joint];
        *angle = Angle { sender: angle.sender, ..Angle::default() };
        angle.begin(doubt.angle, doubt.time_s, samples.min(doubt.confirmed - doubt.samples));
    }

    /// The step of a joint's signal, as its readings show it, rad (m); 0 if they do not.
    pub(super) fn step(&self, joint: usize) -> f64 {
        self.angles[joint].sender.steps.step()
    }

    /// The first of `joints` whose angle is not known.
    pub(super) fn unknown(&self, joints: usize) -> Option<usize> {
        self.angles[..joints].iter().position(|angle| angle.readings == 0)
    }

    /// Those of `joints` whose angle has never come or is forgotten, or used to come in a cycle and no longer does at `now_s`.
    pub(super) fn awaited(&self, joints: usize, now_s: f64) -> impl Iterator<Item = usize> {
        let is_awaited = move |angle: &Angle| match angle.sender.newest {
            None => true,
            Some((_, newest_s)) => angle.sender.is_cyclic() && now_s - newest_s > CYCLE_S,
        };
        let all = self.angles[..joints].iter().enumerate();
        all.filter(move |(_, angle)| is_awaited(angle)).map(|(joint, _)| joint)
    }

    /// Number of the oldest `samples` during which every joint is known to have stood still; `notice` is [`NOTICE_S`] in samples.
    pub(super) fn standing(&self, joints: usize, samples: usize, notice: usize) -> usize {
        let standing = |angle: &Angle| angle.standing(samples, notice);
        self.angles[..joints].iter().map(standing).min().unwrap_or(0)
    }

    /// The same where the stretch ends: the next angle of a cyclic sender was not due yet, or one was lost.
    pub(super) fn standing_at_end(
        &self,
        joints: usize,
        samples: usize,
        notice: usize,
        rate_hz: f64,
    ) -> usize {
        let standing = |angle: &Angle| {
            let cycles = (2.0 * angle.sender.cycle_s * rate_hz) as usize;
            match (angle.doubt, angle.sender.is_cyclic()) {
                (Some(_), _) => angle.standing(samples, notice),
                (None, true) => angle
                    .confirmed
                    .map_or(0, |confirmed| samples.min(confirmed + cycles.max(notice))),
                (None, false) => samples,
            }
        };
        self.angles[..joints].iter().map(standing).min().unwrap_or(0)
    }

    /// Mean angles.
    pub(super) fn mean(&self, joints: usize) -> Vec<f64, MAX_JOINTS> {
        let mean = |angle: &Angle| angle.first + angle.sum / f64::from(angle.readings.max(1));
        self.angles[..joints].iter().map(mean).collect()
    }

    /// Takes note that the oldest `samples` of the stretch are gone.
    pub(super) fn discard(&mut self, samples: usize) {
        for angle in &mut self.angles {
            angle.confirmed = angle.confirmed.map(|confirmed| confirmed.saturating_sub(samples));
            if let Some(doubt) = &mut angle.doubt {
                doubt.samples = doubt.samples.saturating_sub(samples);
                doubt.confirmed = doubt.confirmed.saturating_sub(samples);
                doubt.since = doubt.since.saturating_sub(samples);
            }
        }
    }

    /// Takes note of a gap in the stretch: all its samples are gone, and the angle of a cyclic sender must come again.
    pub(super) fn interrupt(&mut self) {
        self.discard(usize::MAX);
        self.angles.iter_mut().for_each(|angle| angle.confirmed = None);
    }

    /// Begins another stretch. The angle of a cyclic sender must come again, that of any other sender holds. A forgotten angle
    /// stays forgotten.
    pub(super) fn renew(&mut self) {
        self.renew_since(f64::INFINITY);
    }

    /// Begins another stretch, with the samples that came after `time_s`, s: the angles that came after it hold, too.
    pub(super) fn renew_since(&mut self, since_s: f64) {
        for angle in &mut self.angles {
            let sender = angle.sender;
            *angle = Angle { sender, ..Angle::default() };
            let holds = |(_, time_s): &(f64, f64)| !sender.is_cyclic() || *time_s >= since_s;
            if let Some((newest, time_s)) = sender.newest.filter(holds) {
                angle.begin(newest, time_s, 0);
            }
        }
    }

    /// Forgets the angle of a joint that may have moved, until it comes again.
    fn forget(&mut self, joint: usize) {
        let angle = &mut self.angles[joint];
        let sender = Sender { newest: None, ..angle.sender };
        let sender = if sender.is_cyclic() {
            sender
        } else {
            Sender { steps: sender.steps, ..Sender::default() }
        };
        *angle = Angle { sender, ..Angle::default() };
    }

    /// Forgets all angles, after a silence in which every joint may have moved.
    pub(super) fn forget_all(&mut self) {
        (0..MAX_JOINTS).for_each(|joint| self.forget(joint));
    }
}
