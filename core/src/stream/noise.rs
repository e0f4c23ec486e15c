//! Noise of the sensors, from the stretches of a record in which nothing is cut.
//!
//! Quiet is judged block by block from the force: it is quiet if it is white, that is if its variance is hardly more than
//! its sixth differences tell; or, for a sensor whose noise is not white, if it is far quieter than the loudest
//! block and about as quiet as the quietest. The robot may still ring then, so the acceleration's noise is read
//! from its sixth differences, which pass white noise and stop what rings below a fifth of the rate.

/// Samples of a block.
pub(super) const BLOCK: usize = 64;
/// A block is white if its variance is less than this many times that of its white part.
pub(super) const WHITE: f32 = 3.0;
/// A block is as quiet as the quietest if it varies by less than this many times their variance,
const QUIET: f32 = 3.0;
/// who are this part of all,
const QUIETEST: f32 = 0.02;
/// and vary by less than this part of the loudest's variance.
const CONTRAST: f32 = 1e-3;
/// Sum of the squares of the sixth differences' coefficients, C(12, 6).
const SIXTH: f32 = 924.0;
/// A robot rests if it moves by less than this part of its motion in the record.
const RESTING: f32 = 0.02;
/// Longest stretch from the start that is asked whether the robot rests, blocks: 0.5 s at 2 kHz.
const REST_BLOCKS: usize = 16;
/// Most blocks of a record.
const MAX_BLOCKS: usize = 32_768 / BLOCK;

/// Standard deviations of the noise of one sample, per axis, and how the record starts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Noise {
    /// N.
    pub(super) force: [f32; 3],
    /// m/s².
    pub(super) acceleration: [f32; 3],
    /// Whether nothing moves when the record starts.
    pub(super) starts_at_rest: bool,
    /// Whether the record has a quiet stretch; else the noise is the white part of its quietest block.
    pub(super) quiet: bool,
}

/// Estimates the noise of one record without holes.
pub(super) fn estimate(force: [&[f32]; 3], acceleration: [&[f32]; 3]) -> Noise {
    let blocks = (force[0].len() / BLOCK).min(MAX_BLOCKS);
    // Of the force, sum over the axes: variance and its white part.
    let mut variances = heapless::Vec::<[f32; 2], MAX_BLOCKS>::new();
    for block in 0..blocks {
        let sum = |of: fn(&[f32]) -> f32| force.iter().map(|signal| of(part(signal, block))).sum();
        let _ = variances.push([sum(variance), sum(sixth_difference)]);
    }
    let mut sorted: heapless::Vec<f32, MAX_BLOCKS> = variances.iter().map(|v| v[0]).collect();
    sorted.sort_unstable_by(f32::total_cmp);
    let quietest = sorted.get((sorted.len() as f32 * QUIETEST) as usize).copied().unwrap_or(0.0);
    let loudest = sorted.last().copied().unwrap_or(0.0);
    let contrasts = quietest <= CONTRAST * loudest;
    let is_quiet = |block: &usize| {
        let [all, white] = variances[*block];
        all <= WHITE * white || (contrasts && all <= QUIET * quietest)
    };
    let quiet = (0..blocks).any(|block| is_quiet(&block));
    // Without a quiet block, the one with the smallest white part.
    let whitest = (0..blocks).min_by(|a, b| variances[*a][1].total_cmp(&variances[*b][1]));
    let mean = |signal: &[f32], of: fn(&[f32]) -> f32| {
        let (mut sum, mut count) = (0.0, 0);
        for block in (0..blocks)
            .filter(|block| if quiet { is_quiet(block) } else { Some(*block) == whitest })
        {
            sum += of(part(signal, block));
            count += 1;
        }
        sum / count.max(1) as f32
    };
    let force_variance =
        force.map(|signal| mean(signal, if quiet { variance } else { sixth_difference }));
    let acceleration_variance = acceleration.map(|signal| mean(signal, sixth_difference));
    let leading = (0..blocks.min(REST_BLOCKS)).take_while(is_quiet).count() * BLOCK;
    let starts_at_rest = leading > 0
        && acceleration.iter().zip(acceleration_variance).all(|(signal, noise)| {
            let motion = RESTING * RESTING * variance(signal);
            variance(&signal[..leading]) <= 2.0 * noise + motion
        });
    Noise {
        force: force_variance.map(libm::sqrtf),
        acceleration: acceleration_variance.map(libm::sqrtf),
        starts_at_rest,
        quiet,
    }
}

fn part(signal: &[f32], block: usize) -> &[f32] {
    &signal[block * BLOCK..][..BLOCK]
}

/// About the mean.
pub(super) fn variance(signal: &[f32]) -> f32 {
    let count = signal.len() as f32;
    let mean = signal.iter().sum::<f32>() / count;
    signal.iter().map(|value| (value - mean) * (value - mean)).sum::<f32>() / (count - 1.0)
}

/// Variance of the white part: of what the neighbours do not tell.
pub(super) fn sixth_difference(signal: &[f32]) -> f32 {
    let differences = signal
        .windows(7)
        .map(|w| w[0] + w[6] - 6.0 * (w[1] + w[5]) + 15.0 * (w[2] + w[4]) - 20.0 * w[3]);
    let (mut sum, mut count) = (0.0, 0);
    for difference in differences {
        sum += difference * difference;
        count += 1;
    }
    sum / (SIXTH * count.max(1) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    struct Noises(u32);

    impl Noises {
        /// Unit variance.
        fn next(&mut self) -> f32 {
            let mut sum = 0.0;
            for _ in 0..12 {
                self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                sum += (self.0 >> 8) as f32 / (1 << 24) as f32;
            }
            sum - 6.0
        }
    }

    /// 8192 samples: quiet, from 400 to 6500 a cut, then quiet; the robot rings at 4 and 30 Hz from `from` on.
    fn record(ringing_from: usize, cut: core::ops::Range<usize>) -> ([Vec<f32>; 3], [Vec<f32>; 3]) {
        let mut noise = Noises(5);
        let force = core::array::from_fn(|_| {
            (0..8192)
                .map(|n| {
                    let cutting =
                        if cut.contains(&n) { 200.0 * libm::sinf(0.3 * n as f32) } else { 0.0 };
                    cutting + 0.16 * noise.next()
                })
                .collect()
        });
        let acceleration = core::array::from_fn(|_| {
            (0..8192)
                .map(|n| {
                    let t = n as f32 / 2000.0;
                    let ring = libm::sinf(25.0 * t) + 0.5 * libm::sinf(190.0 * t);
                    (if n >= ringing_from { ring } else { 0.0 }) + 0.0155 * noise.next()
                })
                .collect()
        });
        (force, acceleration)
    }

    fn of((force, acceleration): &([Vec<f32>; 3], [Vec<f32>; 3])) -> Noise {
        estimate(
            force.each_ref().map(|signal| signal.as_slice()),
            acceleration.each_ref().map(|signal| signal.as_slice()),
        )
    }

    #[test]
    fn finds_the_noise_beside_the_cut_and_under_the_ringing() {
        let noise = of(&record(400, 400..6500));
        for axis in 0..3 {
            assert!((noise.force[axis] / 0.16 - 1.0).abs() < 0.06, "{:?}", noise.force);
            assert!(
                (noise.acceleration[axis] / 0.0155 - 1.0).abs() < 0.06,
                "{:?}",
                noise.acceleration
            );
        }
        assert!(noise.starts_at_rest);
    }

    #[test]
    fn a_twentieth_of_quiet_is_enough() {
        let noise = of(&record(400, 400..8192));
        for axis in 0..3 {
            assert!((noise.force[axis] / 0.16 - 1.0).abs() < 0.12, "{:?}", noise.force);
        }
    }

    #[test]
    fn a_ringing_start_is_no_rest() {
        let noise = of(&record(0, 400..6500));
        assert!(!noise.starts_at_rest);
        assert!((noise.acceleration[1] / 0.0155 - 1.0).abs() < 0.06);
    }

    #[test]
    fn a_record_cut_out_of_the_milling_has_no_quiet_stretch() {
        let noise = of(&record(0, 0..8192));
        assert!(!noise.quiet && !noise.starts_at_rest);
        assert!(noise.force.iter().all(|force| *force < 1.0), "{:?}", noise.force);
    }

    /// A sensor with a filter of its own: neighbours tell of each other.
    #[test]
    fn coloured_noise_is_found_by_contrast() {
        let (mut force, acceleration) = record(400, 400..6500);
        for signal in &mut force {
            let mut state = 0.0;
            for value in signal {
                state += 0.2 * (*value - state);
                *value = state;
            }
        }
        let noise = of(&(force, acceleration));
        // 0.16 N through a first-order filter: sqrt(0.2 / 1.8).
        assert!(noise.quiet);
        assert!(noise.force.iter().all(|f| (f / 0.0533 - 1.0).abs() < 0.15), "{:?}", noise.force);
    }

    #[test]
    fn a_stuck_block_does_not_hide_the_noise() {
        let (mut force, acceleration) = record(400, 400..6500);
        for signal in &mut force {
            signal[..192].fill(0.0);
        }
        let noise = of(&(force, acceleration));
        assert!(noise.force.iter().all(|f| (f / 0.16 - 1.0).abs() < 0.1), "{:?}", noise.force);
    }
}
