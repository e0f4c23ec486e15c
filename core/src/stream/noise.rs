//! Noise of the sensors, from the stretches of a record in which nothing is cut.
//!
//! Quiet is judged block by block from the force. The robot may still ring then, so the acceleration's noise is read
//! from its sixth differences, which pass white noise and stop what rings below a fifth of the rate.

/// Samples of a block.
pub(super) const BLOCK: usize = 64;
/// A block is quiet if its force varies by less than this many times the quietest blocks' variance.
const QUIET: f32 = 3.0;
/// The quietest blocks: this part of all.
const QUIETEST: f32 = 0.02;
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
    /// Variance of the force in the quietest blocks, sum over the axes, N².
    pub(super) quietest: f32,
}

/// Estimates the noise of one record without holes. `known` is the quietest variance that earlier records had: a record in
/// which all is louder than that has no quiet stretch, and yields `None`.
pub(super) fn estimate(
    force: [&[f32]; 3],
    acceleration: [&[f32]; 3],
    known: Option<f32>,
) -> Option<Noise> {
    let blocks = force[0].len() / BLOCK;
    let mut variances = heapless::Vec::<f32, MAX_BLOCKS>::new();
    for block in 0..blocks.min(MAX_BLOCKS) {
        let _ = variances.push(force.iter().map(|signal| variance(part(signal, block))).sum());
    }
    let mut sorted = variances.clone();
    sorted.sort_unstable_by(f32::total_cmp);
    let quietest = *sorted.get((sorted.len() as f32 * QUIETEST) as usize)?;
    if known.is_some_and(|known| quietest > 4.0 * QUIET * known) {
        return None;
    }
    let is_quiet = |block: &usize| variances[*block] <= QUIET * quietest;
    let mean_over_quiet = |of: &dyn Fn(usize) -> f32| {
        let (mut sum, mut count) = (0.0, 0);
        for block in (0..variances.len()).filter(is_quiet) {
            sum += of(block);
            count += 1;
        }
        sum / count.max(1) as f32
    };
    let force_variance =
        force.map(|signal| mean_over_quiet(&|block| variance(part(signal, block))));
    let acceleration_variance =
        acceleration.map(|signal| mean_over_quiet(&|block| sixth_difference(part(signal, block))));
    let leading = (0..variances.len().min(REST_BLOCKS)).take_while(is_quiet).count() * BLOCK;
    let starts_at_rest = leading > 0
        && acceleration.iter().zip(acceleration_variance).all(|(signal, noise)| {
            let motion = RESTING * RESTING * variance(signal);
            variance(&signal[..leading]) <= 2.0 * noise + motion
        });
    Some(Noise {
        force: force_variance.map(libm::sqrtf),
        acceleration: acceleration_variance.map(libm::sqrtf),
        starts_at_rest,
        quietest,
    })
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

/// Variance of the white part.
fn sixth_difference(signal: &[f32]) -> f32 {
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

    fn of(record: &([Vec<f32>; 3], [Vec<f32>; 3]), known: Option<f32>) -> Option<Noise> {
        let slices = |signals: &'_ [Vec<f32>; 3]| -> [Vec<f32>; 3] { signals.clone() };
        let (force, acceleration) = (slices(&record.0), slices(&record.1));
        estimate(
            force.each_ref().map(|s| s.as_slice()),
            acceleration.each_ref().map(|s| s.as_slice()),
            known,
        )
    }

    #[test]
    fn finds_the_noise_beside_the_cut_and_under_the_ringing() {
        let noise = of(&record(400, 400..6500), None).expect("a quiet stretch");
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
        let noise = of(&record(400, 400..8192), None).expect("a quiet stretch");
        for axis in 0..3 {
            assert!((noise.force[axis] / 0.16 - 1.0).abs() < 0.12, "{:?}", noise.force);
        }
    }

    #[test]
    fn a_ringing_start_is_no_rest() {
        let noise = of(&record(0, 400..6500), None).expect("a quiet stretch");
        assert!(!noise.starts_at_rest);
        assert!((noise.acceleration[1] / 0.0155 - 1.0).abs() < 0.06);
    }

    #[test]
    fn a_record_cut_out_of_the_milling_has_no_quiet_stretch() {
        assert_eq!(of(&record(0, 0..8192), Some(0.08)), None);
        assert!(
            of(&record(0, 0..8192), None)
                .is_some_and(|noise| !noise.starts_at_rest || noise.quietest > 1.0)
        );
    }
}
