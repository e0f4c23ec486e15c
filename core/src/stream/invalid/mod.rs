//! Samples that are no measurement although their frames come: [clipped] and [held] ones, and [spikes].
//!
//! Few of them, in runs of one or two, are bridged like lost samples. A record with more of them is refused.

mod clipped;
mod held;
mod motion;

use super::bridge::MAX_GAP;
use super::spikes;
use motion::{BLOCK, Motion};

/// −ln of the largest probability at which chance explains a count: 1e-7. Of a million records with twelve ends and six axes one or
/// two are taken for wrong.
const CHANCE: f32 = 16.0;
/// A record with more such samples of an axis than one in so many is refused. Chosen: of bridged samples there may be one in two
/// hundred ([`super::bridge`]).
const MANY: usize = 200;

/// Samples of the axes of a sensor that were made missing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Invalid {
    /// Samples of each axis at an end of its range.
    pub clipped: [usize; 3],
    /// Samples of each axis that repeat the one before although it moves.
    pub held: [usize; 3],
    /// Single wrong samples of each axis. They are sought where neither the clipped nor the held ones are too many.
    pub spikes: [usize; 3],
    /// True if there are too many clipped ones to be bridged, or too many in a row.
    pub clipped_are_many: bool,
    /// True if there are too many held ones.
    pub held_are_many: bool,
    /// True if there are too many spikes.
    pub spikes_are_many: bool,
}

impl Invalid {
    /// Returns whether there are too many of any kind to be bridged.
    pub fn are_many(&self) -> bool {
        self.clipped_are_many || self.held_are_many || self.spikes_are_many
    }
}

/// Least and largest value of each axis at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rest([[f32; 2]; 3]);

impl Rest {
    /// Nothing is at rest.
    const NONE: Self = Self([[f32::NAN; 2]; 3]);

    /// The range of the start of a record. `None` where an axis moves clearly, or where too few samples follow each other to tell.
    fn of(signals: &[&mut [f32]; 3], motions: &[Motion; 3]) -> Option<Self> {
        let is_shown = |signal: &&mut [f32]| {
            let pairs = signal.get(..BLOCK).unwrap_or_default().windows(2);
            2 * pairs.filter(|pair| pair.iter().all(|value| value.is_finite())).count() >= BLOCK
        };
        if !signals.iter().all(is_shown) {
            return None;
        }
        let moves =
            |axis: usize| (1..BLOCK).any(|sample| motions[axis].is_clear(signals[axis], sample));
        let range = |axis: usize| {
            let values = || signals[axis][..BLOCK].iter().copied();
            let margin = motions[axis].small();
            [values().fold(f32::NAN, f32::min) - margin, values().fold(f32::NAN, f32::max) + margin]
        };
        (!(0..3).any(moves)).then(|| Self(core::array::from_fn(range)))
    }

    fn is_at(&self, axis: usize, value: f32) -> bool {
        let [least, largest] = self.0[axis];
        (least..=largest).contains(&value)
    }
}

/// Tells samples that are no measurement, by the record and by what earlier ones showed of the sensors.
#[derive(Clone, Debug)]
pub struct Validity {
    /// Smallest step of the signals of force and acceleration.
    steps: [f32; 2],
    /// The force at rest, in the newest record that begins with it.
    rest: Option<Rest>,
    /// Motion of the axes of the acceleration in the newest record in which all of them move.
    motions: [Motion; 3],
}

impl Validity {
    /// Nothing is known yet but the smallest step of the signals of force (N) and acceleration (m/s²).
    pub fn new(steps: [f32; 2]) -> Self {
        Self { steps, rest: None, motions: [Motion::none(steps[1]); 3] }
    }

    /// Makes the clipped, held and spiked samples of the force in a record missing (NaN), N. A force whose rest is not known is judged by its spikes
    /// alone.
    pub fn remove_from_force(&mut self, signals: &mut [&mut [f32]; 3]) -> Invalid {
        let (motions, rest) = self.of_force(signals);
        remove(signals, &motions, rest, self.steps[0])
    }

    /// Makes the clipped, held and spiked samples of the acceleration in a record missing (NaN), m/s². It does not rest in a cut.
    pub fn remove_from_acceleration(&mut self, signals: &mut [&mut [f32]; 3]) -> Invalid {
        let motions = self.of_acceleration(signals);
        remove(signals, &motions, Some(Rest::NONE), self.steps[1])
    }

    fn of_force(&mut self, signals: &[&mut [f32]; 3]) -> ([Motion; 3], Option<Rest>) {
        let motions = signals.each_ref().map(|signal| Motion::of(signal, self.steps[0]));
        self.rest = Rest::of(signals, &motions).or(self.rest);
        (motions, self.rest)
    }

    /// Returns the motion of the axes. An axis that moves in earlier records, and not in this one, is stuck if the others move as they did: it has its
    /// earlier motion.
    fn of_acceleration(&mut self, signals: &[&mut [f32]; 3]) -> [Motion; 3] {
        let own = signals.each_ref().map(|signal| Motion::of(signal, self.steps[1]));
        if own.iter().all(Motion::moves) {
            self.motions = own;
        }
        core::array::from_fn(|axis| {
            let mut others = (0..3).filter(|&other| other != axis);
            let as_before = others.all(|other| own[other].is_like(&self.motions[other]));
            let has_stopped = self.motions[axis].moves() && !own[axis].moves();
            if as_before && has_stopped { self.motions[axis] } else { own[axis] }
        })
    }
}

/// Makes clipped and held samples missing, and spikes where these are few.
fn remove(
    signals: &mut [&mut [f32]; 3],
    motions: &[Motion; 3],
    rest: Option<Rest>,
    step: f32,
) -> Invalid {
    let mut invalid = remove_clipped_and_held(signals, motions, rest);
    if !invalid.are_many() {
        invalid.spikes = spikes::remove(signals, step);
        invalid.spikes_are_many = spikes::are_many(&invalid.spikes, signals[0].len());
    }
    invalid
}

/// Makes clipped and held samples missing, if it is known where the sensor is at rest.
fn remove_clipped_and_held(
    signals: &mut [&mut [f32]; 3],
    motions: &[Motion; 3],
    rest: Option<Rest>,
) -> Invalid {
    let Some(rest) = &rest else { return Invalid::default() };
    let mut invalid = Invalid::default();
    let before = signals.each_ref().map(|signal| longest_gap(signal));
    invalid.clipped = clipped::remove(signals, motions, rest);
    invalid.clipped_are_many = are_many(signals, &invalid.clipped, &before);
    let before = signals.each_ref().map(|signal| longest_gap(signal));
    invalid.held = held::remove(signals, motions, rest);
    invalid.held_are_many = are_many(signals, &invalid.held, &before);
    invalid
}

/// Returns whether the samples that were made missing are too many to be bridged.
fn are_many(signals: &[&mut [f32]; 3], counts: &[usize; 3], before: &[usize; 3]) -> bool {
    (0..3).any(|axis| {
        let gap = longest_gap(signals[axis]);
        counts[axis] * MANY > signals[axis].len() || (gap > MAX_GAP && gap > before[axis])
    })
}

/// Most samples in a row that are missing.
fn longest_gap(signal: &[f32]) -> usize {
    let (mut longest, mut gap) = (0, 0);
    for value in signal {
        gap = if value.is_nan() { gap + 1 } else { 0 };
        longest = longest.max(gap);
    }
    longest
}

/// Returns whether another axis of the sensor moves clearly from the sample before to this one.
fn other_moves(
    signals: &[&mut [f32]; 3],
    motions: &[Motion; 3],
    axis: usize,
    sample: usize,
) -> bool {
    let mut others = (0..3).filter(|&other| other != axis);
    others.any(|other| motions[other].is_clear(signals[other], sample))
}

/// Returns whether so many hits `of` all cases are more than chance explains that makes a `share` of hits, by Chernoff's bound on the tail of the
/// binomial distribution (Hoeffding, Journal of the American Statistical Association 58, 1963, theorem 1):
///
/// ```text
/// P ≤ exp(−n D)          D = p ln(p / q) + (1 − p) ln((1 − p) / (1 − q))          p hits of n, q expected
/// ```
fn beyond_chance(hits: usize, of: usize, share: f32) -> bool {
    let part = hits as f32 / of.max(1) as f32;
    if part <= share {
        return false;
    }
    let term = |p: f32, q: f32| if p > 0.0 { p * libm::logf(p / q) } else { 0.0 };
    of as f32 * (term(part, share) + term(1.0 - part, 1.0 - share)) > CHANCE
}

#[cfg(test)]
mod tests;
