//! Quiet blocks of a record: judged from the force, against the loudest and the quietest block, and free of shocks in the acceleration.

use core::ops::Range;

use heapless::Vec;

/// Samples of a block.
pub(in crate::stream) const BLOCK: usize = 64;
/// A block is quiet if the variance of its force is at most this many times that of the quietest block. Behind a filter at a tenth
/// of the rate, a block has 38 degrees of freedom on three axes, and the quietest block of a record that is quiet for a fifth has
/// 0.7 of the mean variance. χ² of 38 degrees of freedom exceeds 2.1 times its mean once in ten thousand blocks, and that of white
/// noise (189) never does.
const QUIET: f32 = 3.0;
/// The quietest block has the variance that this part of all blocks does not exceed. Two of the 128 blocks of a record of
/// 8192 samples may be quieter than the noise, as in half of a start-up or with a stuck sensor.
const QUIETEST: f32 = 0.02;
/// The quietest block is no part of the cut if its variance is at most this part of the loudest block's, a tenth of its amplitude.
const CONTRAST: f32 = 0.01;
/// The quietest block is no part of the cut either if its variance is at most this part of the loudest block's, and nothing in it
/// repeats itself.
const CONTRAST_OF_NOISE: f32 = 1.0 / 6.0;
/// Lags at which a block is compared with itself: beyond the memory of an anti-aliasing filter, and within that of a tooth
/// passing.
const LAGS: core::ops::RangeInclusive<usize> = 8..=24;
/// Statistic of the three axes above which a block repeats itself. White noise has 38 ± 8, noise behind a filter at a fifth of the
/// rate 95 ± 30, a sine on one axis some 300.
const REPEATS: f32 = 250.0;
/// Most blocks of a record.
const MAX_BLOCKS: usize = 32_768 / BLOCK;

/// The blocks of a record.
pub(super) struct Blocks {
    /// True if a block is quiet.
    quiet: Vec<bool, MAX_BLOCKS>,
    /// The block whose force has the smallest white part.
    whitest: usize,
}

/// Quiet samples in a row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct QuietRun {
    pub(super) samples: Range<usize>,
    /// True if something is cut after it.
    pub(super) precedes_cut: bool,
}

impl Blocks {
    /// Judges the blocks of a record. `force_step` is the smallest step of the force signal, N.
    pub(super) fn judge(force: [&[f32]; 3], acceleration: [&[f32]; 3], force_step: f32) -> Self {
        let blocks = (force[0].len() / BLOCK).min(MAX_BLOCKS);
        let dies = |signals: [&[f32]; 3], block| is_dead(signals.map(|signal| part(signal, block)));
        let dead: Vec<bool, MAX_BLOCKS> =
            (0..blocks).map(|block| dies(force, block) || dies(acceleration, block)).collect();
        let sum = |block: usize, of: fn(&[f32]) -> f32| -> f32 {
            force.iter().map(|signal| of(part(signal, block))).sum()
        };
        let variances: Vec<f32, MAX_BLOCKS> =
            (0..blocks).map(|block| sum(block, variance)).collect();
        let alive = variances.iter().zip(&dead).filter(|(_, dead)| !**dead);
        let mut sorted: Vec<f32, MAX_BLOCKS> = alive.map(|(variance, _)| *variance).collect();
        sorted.sort_unstable_by(f32::total_cmp);
        let loudest = sorted.last().copied().unwrap_or(0.0);
        let quietest = sorted.get((sorted.len() as f32 * QUIETEST) as usize).copied();
        let stands_out = quietest.is_some_and(|quietest| quietest <= CONTRAST_OF_NOISE * loudest);
        // A sensor varies by no less than the rounding of its three axes. Where no other block is quiet, the noise is less than a
        // step, and dead blocks are quiet.
        let rounding = 0.25 * force_step * force_step;
        let quietest = quietest.filter(|_| stands_out || !dead.contains(&true));
        let quietest = quietest.unwrap_or(0.0).max(rounding);
        let is_quiet = |block: usize| {
            let repeats = || repeats(force.map(|signal| part(signal, block)));
            variances[block] <= QUIET * quietest
                && (!dead[block] || quietest == rounding)
                && (quietest <= CONTRAST * loudest
                    || quietest <= CONTRAST_OF_NOISE * loudest && !repeats())
        };
        let mut quiet: Vec<bool, MAX_BLOCKS> = (0..blocks).map(is_quiet).collect();
        for signal in acceleration {
            leave_out_shocks(signal, &mut quiet);
        }
        let white = |block: &usize| sum(*block, super::sixth_difference);
        let whitest = (0..blocks).min_by(|a, b| white(a).total_cmp(&white(b))).unwrap_or_default();
        Self { quiet, whitest }
    }

    pub(super) fn any_quiet(&self) -> bool {
        self.quiet.contains(&true)
    }

    /// Mean over the quiet blocks; if there are none, the value of the block with the smallest white part.
    pub(super) fn mean(&self, signal: &[f32], of: fn(&[f32]) -> f32) -> f32 {
        let any = self.any_quiet();
        let counts = |block: &usize| if any { self.quiet[*block] } else { *block == self.whitest };
        let (mut sum, mut count) = (0.0, 0);
        for block in (0..self.quiet.len()).filter(counts) {
            sum += of(part(signal, block));
            count += 1;
        }
        sum / count.max(1) as f32
    }

    /// Quiet samples at the start of the record.
    pub(super) fn leading(&self) -> Range<usize> {
        0..BLOCK * self.quiet.iter().take_while(|quiet| **quiet).count()
    }

    /// The first quiet run of at least `samples`, else the longest; `None` if no block is quiet.
    pub(super) fn run(&self, samples: usize) -> Option<QuietRun> {
        let first = self.runs().find(|run| run.samples.len() >= samples);
        first.or_else(|| self.longest())
    }

    /// The longest quiet run.
    pub(super) fn longest(&self) -> Option<QuietRun> {
        self.runs().max_by_key(|run| run.samples.len())
    }

    fn runs(&self) -> impl Iterator<Item = QuietRun> {
        let quiet_at = |block: usize| self.quiet.get(block).is_some_and(|quiet| *quiet);
        let starts = move |block: &usize| quiet_at(*block) && (*block == 0 || !quiet_at(block - 1));
        (0..self.quiet.len()).filter(starts).map(move |start| {
            let end = (start..).find(|block| !quiet_at(*block)).unwrap_or(start);
            let samples = start * BLOCK..end * BLOCK;
            QuietRun { samples, precedes_cut: end < self.quiet.len() }
        })
    }
}

/// Leaves out the quiet blocks in which this axis of the acceleration has more white noise than in the others: a drive starts or stops there.
fn leave_out_shocks(signal: &[f32], quiet: &mut [bool]) {
    let white = |block| super::sixth_difference(part(signal, block));
    let own = quiet.iter().enumerate().filter(|(_, quiet)| **quiet).map(|(block, _)| white(block));
    let mut sorted: Vec<f32, MAX_BLOCKS> = own.collect();
    sorted.sort_unstable_by(f32::total_cmp);
    let Some(median) = sorted.get(sorted.len() / 2).filter(|median| **median > 0.0) else { return };
    for (block, quiet) in quiet.iter_mut().enumerate() {
        *quiet &= white(block) <= QUIET * median;
    }
}

fn part(signal: &[f32], block: usize) -> &[f32] {
    &signal[block * BLOCK..][..BLOCK]
}

/// Variance about the mean.
pub(in crate::stream) fn variance(signal: &[f32]) -> f32 {
    let count = signal.len() as f32;
    let mean = signal.iter().sum::<f32>() / count;
    signal.iter().map(|value| (value - mean) * (value - mean)).sum::<f32>() / (count - 1.0)
}

/// Returns whether a sensor gives the same reading throughout half of a block, as it does before it has started.
pub(in crate::stream) fn is_dead(signals: [&[f32]; 3]) -> bool {
    let constant = |part: &[f32]| part.iter().all(|value| *value == part[0]);
    signals.iter().all(|signal| constant(&signal[..signal.len() / 2]))
        || signals.iter().all(|signal| constant(&signal[signal.len() / 2..]))
}

/// Returns whether a block repeats itself at longer lags, as milling does and noise does not: Box and Pierce's statistic (1970).
pub(in crate::stream) fn repeats(signals: [&[f32]; 3]) -> bool {
    let statistic = |signal: &[f32]| -> f32 {
        let count = signal.len() as f32;
        let mean = signal.iter().sum::<f32>() / count;
        let power: f32 = signal.iter().map(|value| (value - mean) * (value - mean)).sum();
        let correlation = |lag: usize| -> f32 {
            let pairs = signal.iter().zip(signal.iter().skip(lag));
            pairs.map(|(a, b)| (a - mean) * (b - mean)).sum::<f32>() / power.max(f32::MIN_POSITIVE)
        };
        count * LAGS.map(|lag| correlation(lag) * correlation(lag)).sum::<f32>()
    };
    signals.map(statistic).iter().sum::<f32>() > REPEATS
}
