//! How the angle of a joint comes while the robot feeds: how far the joint moves from one angle to the next.
//!
//! A path is known at the instants of the angles alone, with straight lines between them. All means are weighted by the movement, so that the last digit
//! of a joint that hardly moves does not count.

use std::collections::VecDeque;

use flexid_core::MAX_JOINTS;
use flexid_core::stream::{LEAP, Reading};

use crate::record::Record;

/// Time for which angles are kept, in lengths of a full record: a record comes out up to a stretch after its first sample.
const KEPT_RECORDS: f64 = 3.0;

/// How the angle of a joint came in records along a path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Feeding {
    /// Sum of all changes of the angle, rad (m).
    moved: f64,
    /// Sum of their squares, (rad)² (m²).
    squares: f64,
    /// Sums of these, weighted by the change: time from the change before, s; difference from that change, rad (m); equal angles between the two.
    weighted: [f64; 3],
}

impl Feeding {
    /// Mean movement from one angle to the next other one, rad (m). `None` if the joint did not move.
    pub fn step(&self) -> Option<f64> {
        (self.moved > 0.0).then(|| self.squares / self.moved)
    }

    /// Mean time between two different angles, s.
    pub fn every_s(&self) -> f64 {
        self.mean(0)
    }

    /// Mean difference of two steps in a row, rad (m): 0 of a joint that moves evenly, eight times what a straight line is off in the middle.
    pub fn bend(&self) -> f64 {
        self.mean(1)
    }

    /// Mean number of equal angles between two different ones: angles that are held, or whose signal has coarse steps.
    pub fn repeats(&self) -> f64 {
        self.mean(2)
    }

    fn mean(&self, which: usize) -> f64 {
        if self.moved > 0.0 { self.weighted[which] / self.moved } else { 0.0 }
    }

    fn note(&mut self, step: f64, [every_s, bend, repeats]: [f64; 3]) {
        let size = step.abs();
        self.moved += size;
        self.squares += size * size;
        for (sum, own) in self.weighted.iter_mut().zip([every_s, bend.abs(), repeats]) {
            *sum += size * own;
        }
    }
}

/// The newest angles of each joint, and how they came in records along a path.
#[derive(Clone, Debug)]
pub(super) struct Angles {
    kept_s: f64,
    /// Times, s, and angles, rad (m), the newest last.
    newest: [VecDeque<(f64, f64)>; MAX_JOINTS],
    pub(super) feeding: [Feeding; MAX_JOINTS],
}

impl Angles {
    /// `record_s` is the length of a full record, s.
    pub(super) fn new(record_s: f64) -> Self {
        Self {
            kept_s: KEPT_RECORDS * record_s,
            newest: std::array::from_fn(|_| VecDeque::new()),
            feeding: Default::default(),
        }
    }

    pub(super) fn note(&mut self, time_s: f64, reading: &Reading) {
        let Reading::Joint { index, value } = reading else { return };
        let Some(newest) = self.newest.get_mut(usize::from(*index)) else { return };
        while newest.front().is_some_and(|(first_s, _)| time_s - first_s > self.kept_s) {
            newest.pop_front();
        }
        newest.push_back((time_s, *value));
    }

    /// Takes the angles of a record, if that is along a path.
    pub(super) fn note_record(&mut self, record: &Record) {
        if !record.path.is_empty() {
            let seconds = record.force[0].len() as f64 / record.rate_hz;
            self.note_path([record.start_s, record.start_s + seconds]);
        }
    }

    /// Takes the angles between two times, s.
    fn note_path(&mut self, [from_s, to_s]: [f64; 2]) {
        let Self { newest, feeding, .. } = self;
        for (newest, feeding) in newest.iter().zip(feeding) {
            let (mut last, mut repeats) = (None::<(f64, f64, Option<f64>)>, 0.0);
            let within = |(time_s, _): &&(f64, f64)| (from_s..to_s).contains(time_s);
            for &(time_s, angle) in newest.iter().filter(within) {
                match last {
                    None => last = Some((time_s, angle, None)),
                    Some((_, before, _)) if before == angle => repeats += 1.0,
                    Some((before_s, before, step)) => {
                        let new = angle - before;
                        // A farther one is a whole turn.
                        if let Some(step) = step.filter(|_| new.abs() <= LEAP) {
                            feeding.note(new, [time_s - before_s, new - step, repeats]);
                        }
                        (last, repeats) = (Some((time_s, angle, Some(new))), 0.0);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How the angles come over 3 s.
    fn feeding(angles: impl Iterator<Item = (f64, f64)>) -> Feeding {
        let mut own = Angles::new(4.0);
        angles.for_each(|(time_s, value)| own.note(time_s, &Reading::Joint { index: 1, value }));
        own.note_path([11.0, 14.0]);
        own.feeding[1]
    }

    #[test]
    fn steps_times_bends_and_repeats_are_those_of_the_record() {
        // Ten a second; before the record the joint leaps.
        let even = |n: u32| (9.0 + 0.1 * f64::from(n), 0.02 * f64::from(n.max(15)));
        let even = feeding((0..60).map(even));
        assert!((even.step().unwrap() - 0.02).abs() < 1e-9, "{even:?}");
        assert!((even.every_s() - 0.1).abs() < 1e-9 && even.bend() < 1e-9, "{even:?}");
        // A hundred a second, each held for ten.
        let held = feeding((0..600).map(|n| (9.0 + 0.01 * f64::from(n), 0.02 * f64::from(n / 10))));
        assert!((held.step().unwrap() - 0.02).abs() < 1e-9 && held.repeats() > 8.9, "{held:?}");
        // A joint that turns ever faster: the second difference is that of a parabola.
        let bent = feeding((0..60).map(|n| (9.0 + 0.1 * f64::from(n), 1e-4 * f64::from(n * n))));
        assert!((bent.bend() - 2e-4).abs() < 1e-9, "{bent:?}");
        assert_eq!(feeding((0..60).map(|n| (9.0 + 0.1 * f64::from(n), 0.3))).step(), None);
    }
}
