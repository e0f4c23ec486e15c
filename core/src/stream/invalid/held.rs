//! Held samples: an axis, or a whole sensor, repeats its last value although it should have moved.
//!
//! A stuck axis, a loose cable and a sensor that is slower than the bus do so. Where the signal moves by many steps, its small
//! differences are as often one step up, or one down, two up, two down and so on, as none: of the differences of up to four steps a
//! ninth are zero. An axis holds if more than a third of them are beyond chance, and a whole sensor if the same holds for all its axes
//! at once. A silent signal does not count: an axis moves just before and just after it holds, and another one moves meanwhile, and
//! nothing counts that is the force at rest, between two teeth say.

use core::ops::Range;

use super::motion::Motion;
use super::{Rest, beyond_chance, other_moves};

/// Share of zeros among the small differences of an axis that chance does not exceed: three times that of even ones.
const ZEROS: f32 = 1.0 / 3.0;

/// Makes the held samples of the axes missing (NaN). Returns how many each axis has.
pub(super) fn remove(
    signals: &mut [&mut [f32]; 3],
    motions: &[Motion; 3],
    rest: &Rest,
) -> [usize; 3] {
    let of_all = remove_of_all(signals, motions, rest);
    core::array::from_fn(|axis| of_all + remove_of_one(signals, motions, rest, axis))
}

/// Makes the samples missing where only one axis holds.
fn remove_of_one(
    signals: &mut [&mut [f32]; 3],
    motions: &[Motion; 3],
    rest: &Rest,
    axis: usize,
) -> usize {
    let motion = &motions[axis];
    if !motion.moves() {
        return 0;
    }
    let holds = |signals: &[&mut [f32]; 3], run: &Range<usize>| {
        let while_others_move = run
            .clone()
            .skip(1)
            .filter(|&sample| other_moves(signals, motions, axis, sample))
            .count();
        let moves = !rest.is_at(axis, signals[axis][run.start])
            && motion.moves_beside(signals[axis], run.start, run.end);
        if moves { while_others_move } else { 0 }
    };
    let equal = |signals: &[&mut [f32]; 3], sample: usize| {
        signals[axis][sample] == signals[axis][sample - 1]
    };
    let (mut zeros, mut small) = (0, 0);
    for run in Runs::new(|sample| equal(signals, sample), signals[axis].len()) {
        zeros += holds(signals, &run);
    }
    for sample in 1..signals[axis].len() {
        let difference = signals[axis][sample] - signals[axis][sample - 1];
        if difference != 0.0 && motion.is_small(difference) {
            small += usize::from(holds(signals, &(sample - 1..sample + 1)) > 0);
        }
    }
    if !beyond_chance(zeros, zeros + small, ZEROS) {
        return 0;
    }
    let (mut held, mut next) = (0, 0);
    let samples = signals[axis].len();
    loop {
        let run = Runs::from(next, |sample| equal(signals, sample), samples).next();
        let Some(run) = run else { return held };
        if holds(signals, &run) > 0 {
            signals[axis][run.start + 1..run.end].fill(f32::NAN);
            held += run.len() - 1;
        }
        next = run.end;
    }
}

/// Makes the samples missing where all axes hold at once.
fn remove_of_all(signals: &mut [&mut [f32]; 3], motions: &[Motion; 3], rest: &Rest) -> usize {
    let moving = motions.iter().filter(|motion| motion.moves()).count();
    if moving == 0 {
        return 0;
    }
    let samples = signals[0].len();
    let equal = |signals: &[&mut [f32]; 3], sample: usize| {
        signals.iter().all(|signal| signal[sample] == signal[sample - 1])
    };
    let moves_beside = |signals: &[&mut [f32]; 3], run: &Range<usize>| {
        let mut axes = signals.iter().zip(motions).filter(|(_, motion)| motion.moves());
        axes.any(|(signal, motion)| motion.moves_beside(signal, run.start, run.end))
    };
    let holds = |signals: &[&mut [f32]; 3], run: &Range<usize>| {
        let rests = (0..3).all(|axis| rest.is_at(axis, signals[axis][run.start]));
        !rests && moves_beside(signals, run)
    };
    let zeros = Runs::new(|sample| equal(signals, sample), samples)
        .filter(|run| holds(signals, run))
        .count();
    let small = (1..samples)
        .filter(|&sample| {
            let is_small = (0..3).all(|axis| {
                motions[axis].is_small(signals[axis][sample] - signals[axis][sample - 1])
            });
            is_small && !equal(signals, sample) && holds(signals, &(sample - 1..sample + 1))
        })
        .count();
    if !beyond_chance(zeros, zeros + small, libm::powf(ZEROS, moving as f32)) {
        return 0;
    }
    let (mut held, mut next) = (0, 0);
    loop {
        let run = Runs::from(next, |sample| equal(signals, sample), samples).next();
        let Some(run) = run else { return held };
        if holds(signals, &run) {
            for signal in signals.iter_mut() {
                signal[run.start + 1..run.end].fill(f32::NAN);
            }
            held += run.len() - 1;
        }
        next = run.end;
    }
}

/// Runs of two samples and more that are equal.
struct Runs<E> {
    next: usize,
    equal: E,
    samples: usize,
}

impl<E: Fn(usize) -> bool> Runs<E> {
    /// `equal` says whether a sample equals the one before.
    fn new(equal: E, samples: usize) -> Self {
        Self::from(0, equal, samples)
    }

    /// Runs from the sample `next` on.
    fn from(next: usize, equal: E, samples: usize) -> Self {
        Self { next, equal, samples }
    }
}

impl<E: Fn(usize) -> bool> Iterator for Runs<E> {
    type Item = Range<usize>;

    fn next(&mut self) -> Option<Range<usize>> {
        let second = (self.next + 1..self.samples).find(|&sample| (self.equal)(sample))?;
        let beyond = (second..self.samples).find(|&sample| !(self.equal)(sample));
        self.next = beyond.unwrap_or(self.samples);
        Some(second - 1..self.next)
    }
}
