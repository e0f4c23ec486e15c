//! Spikes: single wrong samples of one axis, as loose contacts and sparks make them.
//!
//! The sixth differences of a signal stop what is slower than a fifth of the rate. A spike of height h shows in seven of them, with the
//! coefficients of the differences:
//!
//! ```text
//! d(n) = x(n−3) − 6 x(n−2) + 15 x(n−1) − 20 x(n) + 15 x(n+1) − 6 x(n+2) + x(n+3)          h (1, −6, 15, −20, 15, −6, 1)
//! ```
//!
//! A sample is a spike if this explains the differences about it: no filter of a sensor, no step and no impact has this shape. An impact
//! also shakes all axes at once. A spike may meet the strike of a tooth, which is much smaller. It counts as a lost sample, and is bridged.

use heapless::Vec;

/// Coefficients of the sixth differences.
const SIXTH: [f32; 7] = [1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0];
/// Samples on each side of the middle of a difference.
const REACH: usize = SIXTH.len() / 2;
/// Sum of the squares of the coefficients, C(12, 6).
const SQUARES: f32 = 924.0;
/// Samples over which the usual size of the differences is read: a twentieth of a second at 2 kHz, several teeth.
const BLOCK: usize = 128;
/// Samples on each side of a part of a signal that tell its spikes as the whole signal does.
pub const SPIKE_CONTEXT: usize = BLOCK + 2 * REACH;
/// Median of the absolute value of normal noise, in its standard deviations.
const MEDIAN: f32 = 0.6745;
/// Least height of a spike, in standard deviations of what the differences say of a single sample. Normal noise exceeds it once in 10²³.
const HIGH: f32 = 10.0;
/// Standard deviations that noise does not exceed in the differences about a spike, nor on the other axes: once in two million.
const NOISE: f32 = 5.0;
/// Part of the height of a spike that a tooth may have at the same instant. Chosen: an impact shakes the other
/// axes by more, and lasts for more than one sample.
const TOOTH: f32 = 0.1;
/// A record with more spikes than one in so many samples is refused. Chosen: of bridged samples there may be one in two hundred
/// ([`super::bridge`]).
const MANY: usize = 200;

/// Makes the spikes of the three axes of a sensor missing (NaN). Returns how many each axis has. `step` is the smallest step of the signals.
pub(super) fn remove(signals: &mut [&mut [f32]; 3], step: f32) -> [usize; 3] {
    let mut counts = [0; 3];
    let samples = signals[0].len();
    for first in (0..samples).step_by(BLOCK) {
        let usual: [f32; 3] = core::array::from_fn(|axis| usual(signals[axis], first).max(step));
        for sample in first..(first + BLOCK).min(samples) {
            let heights: [f32; 3] = core::array::from_fn(|axis| height(signals[axis], sample));
            // What is NaN is missing already.
            let largest =
                heights.iter().fold(0.0, |largest: f32, height| largest.max(height.abs()));
            let is_high =
                |&axis: &usize| heights[axis].abs() > (NOISE * usual[axis]).max(TOOTH * largest);
            let mut high = (0..3).filter(is_high);
            let (Some(axis), None) = (high.next(), high.next()) else { continue };
            let is_spike = heights[axis].abs() > HIGH * usual[axis];
            if is_spike && is_single(signals[axis], sample, usual[axis]) {
                signals[axis][sample] = f32::NAN;
                counts[axis] += 1;
            }
        }
    }
    counts
}

/// True if so many spikes of the axes are too many for a record of so many samples.
pub(super) fn are_many(spikes: &[usize; 3], samples: usize) -> bool {
    spikes.iter().any(|count| count * MANY > samples)
}

/// The sixth difference about a sample; NaN where samples are missing.
fn difference(signal: &[f32], sample: usize) -> f32 {
    let about = sample.checked_sub(REACH).and_then(|first| signal.get(first..=sample + REACH));
    about.map_or(f32::NAN, |about| about.iter().zip(SIXTH).map(|(value, c)| value * c).sum())
}

/// Height of a spike that explains the difference about a sample.
fn height(signal: &[f32], sample: usize) -> f32 {
    difference(signal, sample) / SIXTH[REACH]
}

/// Standard deviation of these heights about a block: the largest of those of three blocks, since a cut may begin in one of them.
fn usual(signal: &[f32], first: usize) -> f32 {
    let of_block = |first: usize| {
        let block = first..(first + BLOCK).min(signal.len());
        let heights = block.map(|sample| height(signal, sample).abs());
        let mut heights: Vec<f32, BLOCK> = heights.filter(|height| !height.is_nan()).collect();
        heights.sort_unstable_by(f32::total_cmp);
        heights.get(heights.len() / 2).copied().unwrap_or(0.0) / MEDIAN
    };
    let before = first.checked_sub(BLOCK).map_or(0.0, of_block);
    before.max(of_block(first)).max(of_block(first + BLOCK))
}

/// True if one wrong sample explains the differences about it.
fn is_single(signal: &[f32], sample: usize, usual: f32) -> bool {
    let about = |offset: usize| difference(signal, sample + offset - REACH);
    let known = (0..SIXTH.len()).filter(|&offset| !about(offset).is_nan());
    let (mut right, mut squares) = (0.0, 0.0);
    for offset in known.clone() {
        right += SIXTH[offset] * about(offset);
        squares += SIXTH[offset] * SIXTH[offset];
    }
    let height = right / squares;
    let limit = (NOISE * usual).max(TOOTH * height.abs()) * SIXTH[REACH].abs();
    2.0 * squares > SQUARES
        && known.clone().all(|offset| (about(offset) - SIXTH[offset] * height).abs() <= limit)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLES: usize = 4096;

    fn remove_from(signals: &mut [Vec<f32, SAMPLES>; 3], step: f32) -> [usize; 3] {
        remove(&mut signals.each_mut().map(|signal| signal.as_mut_slice()), step)
    }

    struct Noises(u32);

    impl Noises {
        /// Noise of unit variance.
        fn next(&mut self) -> f32 {
            let mut sum = 0.0;
            for _ in 0..12 {
                self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                sum += (self.0 >> 8) as f32 / (1 << 24) as f32;
            }
            sum - 6.0
        }
    }

    /// A cut that begins at a quarter of the record, on three axes.
    fn cut(seed: u32) -> [Vec<f32, SAMPLES>; 3] {
        let mut noise = Noises(seed);
        core::array::from_fn(|axis| {
            (0..SAMPLES)
                .map(|n| {
                    let size = if n > SAMPLES / 4 { 3.0 } else { 0.0 };
                    let swing = libm::sinf(0.2 * n as f32 + axis as f32);
                    let tooth = libm::sinf(0.031 * n as f32).max(0.0);
                    size * (swing + tooth) + 0.0155 * noise.next()
                })
                .collect()
        })
    }

    #[test]
    fn a_spike_is_made_missing_and_nothing_else() {
        for seed in 1..20 {
            let mut signals = cut(seed);
            assert_eq!(remove_from(&mut signals, 1e-3), [0; 3], "{seed}");
            signals[0][700] += 0.5;
            signals[0][3000] -= 20.0;
            signals[2][3100] += 2.0;
            assert_eq!(remove_from(&mut signals, 1e-3), [2, 0, 1], "{seed}");
            for (axis, sample) in [(0, 700), (0, 3000), (2, 3100)] {
                assert!(signals[axis][sample].is_nan(), "{seed}: {axis} {sample}");
            }
        }
    }

    #[test]
    fn steps_impacts_and_rings_are_no_spikes() {
        let changes: [fn(usize) -> f32; 4] = [
            |n| if n >= 2000 { 5.0 } else { 0.0 },
            |n| if n == 2000 || n == 2001 { 5.0 } else { 0.0 },
            |n| if n >= 2000 { 5.0 * libm::expf(-0.5 * (n - 2000) as f32) } else { 0.0 },
            |n| {
                let after = n as f32 - 2000.0;
                let decay = if after < 0.0 { 0.0 } else { libm::expf(-0.1 * after) };
                8.0 * decay * libm::cosf(1.5 * after)
            },
        ];
        for (number, change) in changes.into_iter().enumerate() {
            let mut signals = cut(3);
            signals[1].iter_mut().enumerate().for_each(|(n, value)| *value += change(n));
            assert_eq!(remove_from(&mut signals, 1e-3), [0; 3], "change {number}");
        }
        // The same sample of all axes.
        let mut signals = cut(4);
        signals.iter_mut().for_each(|signal| signal[2000] += 5.0);
        assert_eq!(remove_from(&mut signals, 1e-3), [0; 3]);
    }

    /// Each tooth strikes all axes, harder than is usual between the strikes.
    #[test]
    fn a_spike_may_meet_a_tooth() {
        for seed in 1..20 {
            let mut signals = cut(seed);
            let apart = 20 + 5 * seed as usize;
            for strike in (2000..SAMPLES).step_by(apart) {
                signals.iter_mut().for_each(|signal| signal[strike] += 0.4);
            }
            assert_eq!(remove_from(&mut signals, 1e-3), [0; 3], "{seed}");
            signals[1][2000 + 10 * apart] += 20.0;
            signals[1][2000 + 11 * apart] -= 20.0;
            assert_eq!(remove_from(&mut signals, 1e-3), [0, 2, 0], "{seed}");
        }
    }

    #[test]
    fn many_spikes_are_refused() {
        for (every, many) in [(300, false), (150, true), (50, true), (30, true)] {
            let mut signals = cut(5);
            (10..SAMPLES - 10).step_by(every).for_each(|sample| signals[1][sample] += 9.0);
            let spikes = remove_from(&mut signals, 1e-3);
            assert_eq!(are_many(&spikes, SAMPLES), many, "one in {every}");
        }
    }

    /// Missing samples are no spikes, and hide none that is not beside them.
    #[test]
    fn missing_samples_stay_missing() {
        let mut signals = cut(6);
        signals.iter_mut().for_each(|signal| signal[1000..1002].fill(f32::NAN));
        signals[1][1010] += 9.0;
        assert_eq!(remove_from(&mut signals, 1e-3), [0, 1, 0]);
    }
}
