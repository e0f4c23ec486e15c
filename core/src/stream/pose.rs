//! The joint angles of a stretch, and for how long a reading holds.
//!
//! Senders repeat angles in a cycle, or send them on change alone. A sender that has repeated an angle will do so again: until it
//! does, the joint may have moved. A sender that has never repeated an angle would have sent a new one if the joint had moved: its
//! last angle holds.

use heapless::Vec;

use crate::MAX_JOINTS;

/// Largest movement of a joint within one pose, rad or m. A pose wrong by 1e-3 rad biases stiffnesses by 1 %.
const STATIC: f64 = 5e-4;
/// A sender is cyclic if it has repeated the same angle this often in a row.
const REPEATS: u8 = 3;
/// Longest time from an angle to its repetition, s. A slower cycle would make a record of 4 s wait for long.
const CYCLE_S: f64 = 2.0;
/// Time after which a sender on change has sent the angle of a joint that moves, s: twice the cycle of a slow fieldbus gateway.
pub(super) const NOTICE_S: f64 = 0.25;

/// A joint has moved, so that the stretch cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Moved;

/// Joint angles over a stretch.
#[derive(Clone, Debug, Default)]
pub(super) struct Pose {
    angles: [Angle; MAX_JOINTS],
}

#[derive(Clone, Copy, Debug, Default)]
struct Angle {
    first: f64,
    /// Sum of the readings' distances from the first.
    sum: f64,
    readings: u32,
    /// Samples of the stretch when the angle was last read.
    confirmed: usize,
    /// Newest reading and its arrival, s; `None` if it is forgotten.
    newest: Option<(f64, f64)>,
    /// Number of repetitions of the same angle in a row.
    repeats: u8,
}

impl Angle {
    fn is_cyclic(&self) -> bool {
        self.repeats >= REPEATS
    }

    fn note(&mut self, angle: f64, time_s: f64) {
        if let Some((before, before_s)) = self.newest
            && !self.is_cyclic()
        {
            let again = angle == before && (0.0..=CYCLE_S).contains(&(time_s - before_s));
            self.repeats = if again { self.repeats + 1 } else { 0 };
        }
        self.newest = Some((angle, time_s));
    }
}

impl Pose {
    /// Takes a joint's angle, read at `time_s` when the stretch has `samples`; refuses it if the joint has moved.
    pub(super) fn read(
        &mut self,
        joint: usize,
        angle: f64,
        time_s: f64,
        samples: usize,
    ) -> Result<(), Moved> {
        let known = &mut self.angles[joint];
        if known.readings > 0 && (angle - known.first).abs() > STATIC {
            return Err(Moved);
        }
        known.note(angle, time_s);
        if known.readings == 0 {
            known.first = angle;
        }
        known.sum += angle - known.first;
        known.readings += 1;
        known.confirmed = samples;
        Ok(())
    }

    /// The first of `joints` whose angle is not known.
    pub(super) fn unknown(&self, joints: usize) -> Option<usize> {
        self.angles[..joints].iter().position(|angle| angle.readings == 0)
    }

    /// The first of `joints` whose angle has never come or is forgotten, or used to come in a cycle and no longer does at `now_s`.
    pub(super) fn awaited(&self, joints: usize, now_s: f64) -> Option<usize> {
        self.angles[..joints].iter().position(|angle| match angle.newest {
            None => true,
            Some((_, newest_s)) => angle.is_cyclic() && now_s - newest_s > CYCLE_S,
        })
    }

    /// Number of the oldest `samples` during which every joint is known to have stood still; `notice` is [`NOTICE_S`] in samples.
    pub(super) fn standing(&self, joints: usize, samples: usize, notice: usize) -> usize {
        let noticed = samples.saturating_sub(notice);
        let standing = |angle: &Angle| match angle.is_cyclic() || angle.readings == 0 {
            true => angle.confirmed,
            false => angle.confirmed.max(noticed),
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
            angle.confirmed = angle.confirmed.saturating_sub(samples);
        }
    }

    /// Begins another stretch. The angle of a cyclic sender must come again, that of any other sender holds. A forgotten angle
    /// stays forgotten.
    pub(super) fn renew(&mut self) {
        for angle in &mut self.angles {
            let Angle { newest, repeats, .. } = *angle;
            *angle = Angle { newest, repeats, ..Angle::default() };
            if let Some((newest, _)) = newest.filter(|_| !angle.is_cyclic()) {
                (angle.first, angle.readings) = (newest, 1);
            }
        }
    }

    /// Forgets the angle of a joint that moves or may have moved, until it comes again.
    pub(super) fn forget(&mut self, joint: usize) {
        let angle = &mut self.angles[joint];
        let repeats = if angle.is_cyclic() { angle.repeats } else { 0 };
        *angle = Angle { repeats, ..Angle::default() };
    }

    /// Forgets all angles, after a silence in which every joint may have moved.
    pub(super) fn forget_all(&mut self) {
        (0..MAX_JOINTS).for_each(|joint| self.forget(joint));
    }
}
