//! Stamps of a log that are wrong, or no times.
//!
//! Frames stand in a log in the order in which they came, so that their stamps ascend. A stamp is wrong if it is not between the median
//! of those before it and the median of those after it, which stand up to two wrong ones of five. In its place comes the median of all. Where
//! the median after a stamp is less than that before it, the clock was set back, or another recording begins.

use std::collections::VecDeque;

use flexid_wire::trouble::StampFault;

/// Neighbours on each side of a frame among which its stamp is judged.
pub(super) const REACH: usize = 5;
/// Distance from the median from which on a stamp counts as wrong, s. Readers on several processors swap frames of some
/// milliseconds, as in `monotonic`.
const JUMP_S: f64 = 0.01;
/// Fewest frames by which the stamps of a log are judged: those of a tenth of a second of the slowest bus of use (2 sensors at
/// 500 Hz).
const FEWEST: u64 = 100;
/// Stamps are no times if they go back at one in so many frames. Stamps that jump do so rarely, and a log that begins anew does once.
const GO_BACK: u64 = 10;

/// Judges the stamps of one log.
#[derive(Clone, Debug, Default)]
pub(super) struct Stamps {
    frames: u64,
    first_s: f64,
    before_s: f64,
    /// Number of stamps that equal the first.
    equal: u64,
    /// Number of stamps without decimals.
    whole: u64,
    /// Number of stamps before that of the frame before.
    back: u64,
    /// Number of stamps that were wrong by themselves.
    jumps: u64,
}

impl Stamps {
    /// Takes the next stamp, s.
    pub(super) fn note(&mut self, time_s: f64) {
        if self.frames == 0 {
            (self.first_s, self.before_s) = (time_s, time_s);
        }
        self.frames += 1;
        self.equal += u64::from(time_s == self.first_s);
        self.whole += u64::from(time_s.fract() == 0.0);
        self.back += u64::from(time_s < self.before_s);
        self.before_s = time_s;
    }

    /// Returns the time of a frame with the stamp `time_s`, s, from the times before it and the stamps after it.
    pub(super) fn mended(
        &mut self,
        before: &VecDeque<f64>,
        time_s: f64,
        after: impl Iterator<Item = f64>,
    ) -> f64 {
        let mut near: heapless::Vec<f64, { 2 * REACH + 1 }> = heapless::Vec::new();
        near.extend(before.iter().rev().take(REACH).copied());
        let sides = near.len();
        near.extend(after.take(REACH));
        let least_s = median(&mut near[..sides]).unwrap_or(f64::NEG_INFINITY);
        let most_s = median(&mut near[sides..]).unwrap_or(f64::INFINITY);
        if most_s < least_s || (least_s..=most_s).contains(&time_s) {
            return time_s;
        }
        // There is room for one more.
        let _ = near.push(time_s);
        let median_s = median(&mut near).unwrap_or(time_s);
        self.jumps += u64::from((median_s - time_s).abs() > JUMP_S);
        median_s
    }

    /// Returns the fault of the stamps, with the number of the frames concerned.
    pub(super) fn fault(&self) -> Option<(StampFault, u64)> {
        let Self { frames, equal, whole, back, jumps, .. } = *self;
        if frames < FEWEST {
            None
        } else if equal == frames {
            Some((StampFault::Equal, frames))
        } else if whole == frames {
            Some((StampFault::WholeSeconds, frames))
        } else if back * GO_BACK > frames {
            Some((StampFault::GoBack, back))
        } else {
            (jumps > 0).then_some((StampFault::Jump, jumps))
        }
    }
}

fn median(times: &mut [f64]) -> Option<f64> {
    times.sort_unstable_by(f64::total_cmp);
    times.get(times.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The times of a log of these stamps, and the fault of it.
    fn judged(stamps: &[f64]) -> (Vec<f64>, Option<(StampFault, u64)>) {
        let (mut judge, mut before, mut times) = (Stamps::default(), VecDeque::new(), Vec::new());
        for (frame, &stamp_s) in stamps.iter().enumerate() {
            judge.note(stamp_s);
            let time_s = judge.mended(&before, stamp_s, stamps[frame + 1..].iter().copied());
            times.push(time_s);
            before.push_back(time_s);
            if before.len() > REACH {
                before.pop_front();
            }
        }
        (times, judge.fault())
    }

    fn ascending() -> Vec<f64> {
        (0..1000).map(|frame| 1000.0 + 2.5e-4 * f64::from(frame)).collect()
    }

    #[test]
    fn stamps_that_ascend_stay() {
        let mut stamps = ascending();
        assert_eq!(judged(&stamps), (stamps.clone(), None));
        // A pause, and doubled frames.
        stamps[500..].iter_mut().for_each(|stamp| *stamp += 100.0);
        stamps[300] = stamps[299];
        assert_eq!(judged(&stamps), (stamps.clone(), None));
    }

    #[test]
    fn stamps_that_jump_for_a_moment_are_mended() {
        let right = ascending();
        let mut stamps = right.clone();
        for (frame, by) in
            [(200, 0.7), (301, -0.3), (400, 5.0), (401, 5.0), (402, -5.0), (700, 1e9)]
        {
            stamps[frame] += by;
        }
        let (times, fault) = judged(&stamps);
        assert_eq!(fault, Some((StampFault::Jump, 6)));
        for (frame, (time, right)) in times.iter().zip(&right).enumerate() {
            assert!((time - right).abs() < 1e-3, "{frame}: {time}");
        }
        // Another recording, made earlier, begins where it begins.
        stamps = [&right[..], &right[..]].concat();
        assert_eq!(judged(&stamps), (stamps, None));
    }

    #[test]
    fn stamps_that_are_no_times_are_named() {
        for (stamp, fault) in [
            ((|_| 0.0) as fn(u32) -> f64, StampFault::Equal),
            (|frame| f64::from(frame / 400), StampFault::WholeSeconds),
            (|frame| if frame % 2 == 0 { 1.31e-4 } else { 3.69e-4 }, StampFault::GoBack),
        ] {
            let stamps: Vec<_> = (0..1000).map(stamp).collect();
            assert_eq!(judged(&stamps).1.map(|(fault, _)| fault), Some(fault));
            assert_eq!(judged(&stamps[..50]).1, None);
        }
    }
}
