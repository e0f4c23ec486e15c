//! Samples in a row, at one static pose or along a path, from which records are cut.

use heapless::Vec;

use super::StreamConfig;
use super::align::Instant;
use super::noise::{self, BLOCK};
use super::pose::Pose;
use super::sender::NOTICE_S;
use crate::spectrum::fft::MIN_SAMPLES;

/// A block is part of the cut if the variance of its force is more than this many times that of the quietest blocks in a row. Noise
/// of 1500 blocks (49 s at 2 kHz) reaches 1.6 ± 0.1 if it is white, 2.9 ± 0.4 behind a filter of eighth order at a tenth of the
/// rate, and 4.9 at a twentieth (medians of 20 simulations). A cut on white noise counts from 4.2 times its mean variance.
const CUT: f32 = 5.0;
/// Number of blocks in a row whose mean variance gives the quietest. The variance of a single block behind a filter of eighth order
/// is down to 0.4 of the mean.
const IN_A_ROW: usize = 4;
/// While no block has varied by this many times the quietest blocks, six times what noise reaches, the quietest blocks may be part
/// of a cut too. A cut exceeds this if its force has 5.4 times the amplitude of the noise.
const CONTRAST: f32 = 30.0;
/// Without that contrast, a block is part of the cut if it varies by more than this many steps of the sensor on each axis, and
/// repeats itself as milling does. A sensor's noise is a few steps: 16 in the reference scenario (0.16 N of 0.01 N), a quarter of
/// this.
const LOUD_STEPS: f32 = 64.0;
/// The quietest blocks are forgotten after this many blocks at the earliest, and after twice as many at the latest: half a minute
/// at 2 kHz. The start-up of a sensor does not count for longer.
const MEMORY: u32 = 1024;
/// Longest time that is kept from before the cut, s.
const BEFORE_CUT_S: f64 = 1.0;
/// The time before the cut is at most the length of a full record, divided by this.
const BEFORE_CUT_PART: usize = 4;
/// A record is no shorter than a full one divided by this.
const SHORTEST: usize = 8;
/// A full stretch waits for the next joint angle for its length divided by this.
const PATIENCE: usize = 8;

/// A growing stretch. A missing sample is NaN.
#[derive(Clone, Debug)]
pub(super) struct Stretch<const N: usize> {
    pub(super) force: [Vec<f32, N>; 3],
    pub(super) acceleration: [Vec<f32, N>; 3],
    /// Time of the first sample, s.
    pub(super) start_s: f64,
    pub(super) pose: Pose,
    /// Instants that came while the stretch was full, and were discarded.
    beyond: usize,
    /// True if the cut has begun; before it only the newest samples are kept.
    pub(super) cutting: bool,
    /// Samples before the cut.
    pub(super) cut_from: usize,
    /// True if a full record has come out of the stretch.
    pub(super) has_given_full: bool,
    /// True if the robot feeds: it has left its pose before that stood for a record.
    pub(super) feeds: bool,
    /// Time from the start of the first record along the path to the first sample, s.
    pub(super) since_s: f64,
    range: Range,
    /// True if a reading has changed since the sensor started.
    has_started: bool,
}

/// Samples of a block that are not missing.
struct Block {
    force: [Vec<f32, BLOCK>; 3],
}

impl Block {
    /// Variance of the force, sum over the axes, N².
    fn variance(&self) -> f32 {
        self.force.iter().map(|signal| noise::variance(signal)).sum()
    }

    fn is_dead(&self) -> bool {
        noise::is_dead(self.force.each_ref().map(Vec::as_slice))
    }

    fn repeats(&self) -> bool {
        noise::repeats(self.force.each_ref().map(Vec::as_slice))
    }
}

/// Variances of the blocks of all stretches, N².
#[derive(Clone, Debug)]
struct Range {
    /// Smallest mean variance of blocks in a row, and largest variance of a block, among the newest blocks.
    newest: [f32; 2],
    /// Smallest mean and largest variance among the [`MEMORY`] blocks before the newest.
    before: [f32; 2],
    /// Number of the newest blocks.
    blocks: u32,
    /// Variances of the last blocks, oldest first.
    row: Vec<f32, IN_A_ROW>,
}

impl Range {
    const NONE: [f32; 2] = [f32::INFINITY, 0.0];

    fn new() -> Self {
        Self { newest: Self::NONE, before: Self::NONE, blocks: 0, row: Vec::new() }
    }

    fn note(&mut self, variance: f32) {
        if self.blocks == MEMORY {
            (self.newest, self.before, self.blocks) = (Self::NONE, self.newest, 0);
        }
        self.blocks += 1;
        if self.row.is_full() {
            self.row.remove(0);
        }
        let _ = self.row.push(variance);
        let mean = self.row.iter().sum::<f32>() / self.row.len() as f32;
        self.newest = [self.newest[0].min(mean), self.newest[1].max(variance)];
    }

    fn quietest(&self) -> f32 {
        self.newest[0].min(self.before[0])
    }

    fn loudest(&self) -> f32 {
        self.newest[1].max(self.before[1])
    }
}

impl<const N: usize> Stretch<N> {
    pub(super) fn new() -> Self {
        Self {
            force: [const { Vec::new() }; 3],
            acceleration: [const { Vec::new() }; 3],
            start_s: 0.0,
            pose: Pose::default(),
            beyond: 0,
            cutting: false,
            cut_from: 0,
            has_given_full: false,
            feeds: false,
            since_s: 0.0,
            range: Range::new(),
            has_started: false,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.force[0].len()
    }

    /// True if instants came for which the stretch had no room.
    pub(super) fn overflows(&self) -> bool {
        self.beyond > 0
    }

    /// True if a full stretch has waited so long for a joint angle that none will come to show where it ends.
    pub(super) fn is_overdue(&self) -> bool {
        self.beyond >= N / PATIENCE
    }

    /// Appends an instant. Returns how many samples were discarded: the oldest while nothing is cut, or this one if the stretch is
    /// full.
    pub(super) fn push(&mut self, instant: &Instant, config: &StreamConfig) -> usize {
        if self.len() == 0 {
            self.start_s = instant.time_s;
            self.cutting = false;
        }
        if self.len() == N {
            self.beyond += 1;
            return 1;
        }
        let missing = [f32::NAN; 3];
        let force = instant.force.unwrap_or(missing);
        let acceleration = instant.acceleration.unwrap_or(missing);
        for axis in 0..3 {
            let _ = self.force[axis].push(force[axis]);
            let _ = self.acceleration[axis].push(acceleration[axis]);
        }
        if !self.len().is_multiple_of(BLOCK) {
            return 0;
        }
        let newest = self.len() - BLOCK;
        self.note(newest);
        if !self.cutting && self.is_cut(newest, config) {
            (self.cutting, self.cut_from) = (true, newest);
        }
        if self.cutting {
            return 0;
        }
        let before_cut = ((BEFORE_CUT_S * config.rate_hz) as usize)
            .min(config.record_samples / BEFORE_CUT_PART)
            .max(BLOCK);
        if self.len() < before_cut + BLOCK {
            return 0;
        }
        self.discard(BLOCK, config.rate_hz);
        self.since_s = 0.0;
        BLOCK
    }

    /// Decides anew whether something is cut in the samples that are left, after the oldest have gone.
    pub(super) fn look_for_cut(&mut self, config: &StreamConfig) {
        let blocks = self.len() / BLOCK;
        let first = (0..blocks).find(|block| self.is_cut(block * BLOCK, config));
        self.cutting = first.is_some();
        self.cut_from = first.unwrap_or(0) * BLOCK;
    }

    /// Takes note of the variance of the block from `first` on. A sensor that gives the same reading throughout has noise of less
    /// than a step, unless it has not started yet.
    fn note(&mut self, first: usize) {
        match self.block(first) {
            Some(block) if !block.is_dead() => {
                self.has_started = true;
                self.range.note(block.variance());
            }
            Some(_) if self.has_started => self.range.note(0.0),
            _ => {}
        }
    }

    /// True if something is cut in the block from `first` on.
    fn is_cut(&self, first: usize, config: &StreamConfig) -> bool {
        let Some(block) = self.block(first) else { return false };
        let variance = block.variance();
        let step = config.force_resolution * config.force_resolution;
        let quietest = self.range.quietest().max(step);
        let contrasts = self.range.loudest() > CONTRAST * quietest;
        let is_loud = variance > 3.0 * LOUD_STEPS * LOUD_STEPS * step;
        variance > CUT * quietest || (!contrasts && is_loud && block.repeats())
    }

    /// The force of the block from `first` on; `None` where more than half of the samples are missing.
    fn block(&self, first: usize) -> Option<Block> {
        let known = |signal: &Vec<f32, N>| {
            let block = signal[first..first + BLOCK].iter().copied();
            block.filter(|value| !value.is_nan()).collect()
        };
        let force: [Vec<f32, BLOCK>; 3] = self.force.each_ref().map(known);
        force.iter().all(|signal| signal.len() >= BLOCK / 2).then_some(Block { force })
    }

    /// Number of instants of the stretch, with those for which it had no room.
    pub(super) fn came(&self) -> usize {
        self.len() + self.beyond
    }

    /// Number of the oldest samples during which every joint is known to have stood still.
    pub(super) fn standing(&self, config: &StreamConfig) -> usize {
        self.pose.standing(config.joints, self.came(), Self::notice(config)).min(self.len())
    }

    /// Number of the oldest samples at known poses where the stretch ends.
    pub(super) fn usable_at_end(&self, config: &StreamConfig) -> usize {
        let (came, notice) = (self.came(), Self::notice(config));
        if self.feeds {
            return self.pose.known(config.joints, came, notice).min(self.len());
        }
        let standing = self.pose.standing_at_end(config.joints, came, notice, config.rate_hz);
        standing.min(self.len())
    }

    /// Least samples of a record.
    pub(super) fn least(config: &StreamConfig) -> usize {
        (config.record_samples / SHORTEST).max(MIN_SAMPLES)
    }

    /// Samples until an angle that is sent on change would have come. They end before a full stretch is overdue.
    pub(super) fn notice(config: &StreamConfig) -> usize {
        ((NOTICE_S * config.rate_hz) as usize).min(N / PATIENCE / 2)
    }

    /// Number of the newest samples in a row that lack force, or lack acceleration.
    pub(super) fn newest_missing(&self) -> usize {
        let missing =
            |signal: &[f32]| signal.iter().rev().take_while(|value| value.is_nan()).count();
        missing(&self.force[0]).max(missing(&self.acceleration[0]))
    }

    /// Discards the oldest `count` samples.
    pub(super) fn discard(&mut self, count: usize, rate_hz: f64) {
        for signal in self.force.iter_mut().chain(&mut self.acceleration) {
            let left = signal.len() - count;
            signal.copy_within(count.., 0);
            signal.truncate(left);
        }
        self.start_s += count as f64 / rate_hz;
        self.since_s += count as f64 / rate_hz;
        self.beyond = 0;
        self.pose.discard(count);
    }

    /// Discards all but the newest `kept` samples.
    pub(super) fn keep(&mut self, kept: usize, config: &StreamConfig) {
        self.discard(self.len() - kept, config.rate_hz);
        if kept == 0 {
            self.pose.interrupt();
        }
        (self.has_given_full, self.feeds, self.has_started) = (false, false, false);
        self.since_s = 0.0;
        self.look_for_cut(config);
    }

    /// Empties the stretch. Joint angles that hold without another reading stay known.
    pub(super) fn clear(&mut self) {
        self.clear_samples();
        self.pose.renew();
        self.has_started = false;
    }

    /// Empties the stretch. The pose stays known.
    pub(super) fn clear_samples(&mut self) {
        for signal in self.force.iter_mut().chain(&mut self.acceleration) {
            signal.clear();
        }
        self.pose.interrupt();
        self.beyond = 0;
        (self.has_given_full, self.feeds, self.cutting) = (false, false, false);
        self.since_s = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Variances of blocks of noise of unit power on three axes, behind Butterworth's filter of eighth order at a tenth of the
    /// rate, in 49 s at 2 kHz.
    fn blocks(seed: u32) -> [f32; 1531] {
        let mut state = seed;
        let mut uniform = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let mut variances = [0.0; 1531];
        for _ in 0..3 {
            let mut filters = [0.5098, 0.6013, 0.9000, 2.5629].map(|quality| (quality, [0.0; 4]));
            let k = libm::tanf(core::f32::consts::PI * 0.1);
            let mut next = || {
                let noise = (0..12).map(|_| uniform()).sum::<f32>() - 6.0;
                filters.iter_mut().fold(noise, |value, (quality, [x1, x2, y1, y2])| {
                    let a0 = 1.0 + k / *quality + k * k;
                    let own = k * k * (value + 2.0 * *x1 + *x2)
                        - 2.0 * (k * k - 1.0) * *y1
                        - (1.0 - k / *quality + k * k) * *y2;
                    (*x2, *x1, *y2, *y1) = (*x1, value, *y1, own / a0);
                    own / a0
                })
            };
            (0..500).for_each(|_| _ = next());
            for variance in &mut variances {
                let block: [f32; BLOCK] = core::array::from_fn(|_| next());
                *variance += noise::variance(&block);
            }
        }
        variances
    }

    #[test]
    fn filtered_noise_is_no_cut() {
        let mut widest = 0.0_f32;
        for seed in 0..20 {
            let mut range = Range::new();
            let variances = blocks(seed);
            for variance in variances {
                range.note(variance);
                assert!(variance < CUT * range.quietest(), "{seed}");
            }
            let single = variances.iter().copied().fold(f32::INFINITY, f32::min);
            widest = widest.max(range.loudest() / single);
            assert!(range.loudest() < 0.8 * CUT * range.quietest(), "{seed}");
        }
        // A single block does not show what is quiet.
        assert!(widest > CUT, "{widest}");
    }

    /// Blocks of noise are followed by blocks of a cut that adds four times the power of the noise.
    #[test]
    fn a_small_cut_is_a_cut() {
        for seed in 0..20 {
            let mut range = Range::new();
            let variances = blocks(seed);
            let mean = variances.iter().sum::<f32>() / variances.len() as f32;
            variances.iter().for_each(|variance| range.note(*variance));
            assert!(5.0 * mean > CUT * range.quietest(), "{seed}");
        }
    }
}
