//! How far an axis moves from one sample to the next.

use heapless::Vec;

/// Samples over which the usual difference is read: a twentieth of a second at 2 kHz, several teeth.
pub(super) const BLOCK: usize = 128;
/// An axis moves if its usual difference is at least so many steps. Normal differences are then zero once in seventeen samples.
const MOVES: f32 = 8.0;
/// A difference of up to so many steps is small.
const SMALL: f32 = 4.5;
/// Part of its usual difference by which an axis moves clearly. Chosen: of normal differences three in four are larger.
const CLEARLY: f32 = 0.25;
/// Differences before and after some samples that show whether an axis moves there.
const BESIDE: usize = 3;

/// Motion of one axis in a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motion {
    /// Step of the axis: its smallest difference, which may be a multiple of the configured one.
    pub(super) step: f32,
    /// Upper quartile of the differences of two samples in a row, in the block where that is largest: between teeth there are none.
    usual: f32,
}

impl Motion {
    /// An axis that is not known to move.
    pub(super) fn none(step: f32) -> Self {
        Self { step, usual: 0.0 }
    }

    /// `step` is the smallest step that the configuration knows.
    pub(super) fn of(signal: &[f32], step: f32) -> Self {
        let differences = |part: &[f32]| -> Vec<f32, BLOCK> {
            let all = part.windows(2).map(|pair| (pair[1] - pair[0]).abs());
            all.filter(|difference| !difference.is_nan()).collect()
        };
        let (mut least, mut usual) = (f32::INFINITY, 0.0_f32);
        for first in (0..signal.len()).step_by(BLOCK) {
            let mut block = differences(&signal[first..(first + BLOCK + 1).min(signal.len())]);
            least = block.iter().copied().filter(|own| *own > 0.0).fold(least, f32::min);
            block.sort_unstable_by(f32::total_cmp);
            usual = usual.max(block.get(block.len() * 3 / 4).copied().unwrap_or(0.0));
        }
        Self { step: if least.is_finite() { least.max(step) } else { step }, usual }
    }

    /// Returns whether the axis moves by so much that two samples in a row are rarely equal.
    pub(super) fn moves(&self) -> bool {
        self.usual >= MOVES * self.step
    }

    /// Returns whether the axis moves at least half as far as another one does.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        2.0 * self.usual >= other.usual
    }

    /// Largest small difference.
    pub(super) fn small(&self) -> f32 {
        SMALL * self.step
    }

    /// Returns whether a difference is small; one to a missing sample is not.
    pub(super) fn is_small(&self, difference: f32) -> bool {
        difference.abs() <= self.small()
    }

    /// Returns whether the axis moves clearly from the sample before to this one.
    pub(super) fn is_clear(&self, signal: &[f32], sample: usize) -> bool {
        let difference = (signal[sample] - signal[sample - 1]).abs();
        difference > (CLEARLY * self.usual).max(self.small())
    }

    /// Returns whether the axis moves by more than small differences just before the samples from `first` on, and just after those before `end`,
    /// among those that are not missing: of held samples that were removed the first one is left. Where there is no other one, it counts as motion.
    pub(super) fn moves_beside(&self, signal: &[f32], first: usize, end: usize) -> bool {
        self.moves_along(signal[..=first].iter().rev())
            && self.moves_along(signal[end - 1..].iter())
    }

    fn moves_along<'a>(&self, samples: impl Iterator<Item = &'a f32>) -> bool {
        let known = samples.filter(|value| !value.is_nan()).take(1 + BESIDE);
        let known: Vec<f32, { 1 + BESIDE }> = known.copied().collect();
        known.len() < 2 || known.windows(2).any(|pair| !self.is_small(pair[1] - pair[0]))
    }
}
