//! Samples in a row at one static pose, from which records are cut.

use heapless::Vec;

use super::StreamConfig;
use super::align::Instant;
use super::noise::{self, BLOCK};
use crate::MAX_JOINTS;

/// How far a joint may move before the pose counts as another: rad or m. A pose wrong by 1e-3 rad biases stiffnesses by 1 %.
const STATIC: f64 = 5e-4;
/// A block is part of the cut if its force is not white, and varies by more than this many times the quietest block's
/// variance,
const CUT: f32 = 6.0;
/// or by more than this many of its steps.
const LOUD_STEPS: f32 = 64.0;
/// What is kept from before the cut, s, but at most this part of a record.
const BEFORE_CUT_S: f64 = 1.0;
const BEFORE_CUT_PART: usize = 4;
/// A full stretch waits for the next joint angle for this part of its length.
const PATIENCE: usize = 8;

/// Why a stretch cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Moved;

/// A growing stretch. Missing samples are not a number.
#[derive(Clone, Debug)]
pub(super) struct Stretch<const N: usize> {
    pub(super) force: [Vec<f32, N>; 3],
    pub(super) acceleration: [Vec<f32, N>; 3],
    /// Of the first sample.
    pub(super) start_s: f64,
    pub(super) pose: Pose,
    /// Arrival of the first and the newest instant since it was last cleared, and how many came.
    arrivals: (f64, f64, u64),
    /// Instants that came while it was full, and were let go.
    beyond: usize,
    /// Whether the cut has begun; before it only the newest samples are kept.
    pub(super) cutting: bool,
    /// Smallest variance of a block so far, N²; known from all stretches.
    quietest: f32,
}

/// Joint angles over a stretch.
#[derive(Clone, Debug, Default)]
pub(super) struct Pose {
    angles: [Angle; MAX_JOINTS],
}

#[derive(Clone, Copy, Debug, Default)]
struct Angle {
    first: f64,
    /// Sum of the readings' distances from the first.
    sum: f64,
    readings: u32,
    /// Samples of the stretch when it was last read.
    confirmed: usize,
}

impl<const N: usize> Stretch<N> {
    pub(super) fn new() -> Self {
        Self {
            force: [const { Vec::new() }; 3],
            acceleration: [const { Vec::new() }; 3],
            start_s: 0.0,
            pose: Pose::default(),
            arrivals: (0.0, 0.0, 0),
            beyond: 0,
            cutting: false,
            quietest: f32::INFINITY,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.force[0].len()
    }

    /// Whether instants came that it had no room for.
    pub(super) fn overflows(&self) -> bool {
        self.beyond > 0
    }

    /// Whether no joint angle has come for so long that none will tell of the end of what is full.
    pub(super) fn is_overdue(&self) -> bool {
        self.beyond >= N / PATIENCE
    }

    /// Appends an instant. Returns how many samples were let go: the oldest while nothing is cut, or this one if it is full.
    pub(super) fn push(&mut self, instant: &Instant, config: &StreamConfig) -> usize {
        if self.len() == 0 {
            self.start_s = instant.time_s;
            self.cutting = false;
        }
        if self.arrivals.2 == 0 {
            self.arrivals.0 = instant.time_s;
        }
        self.arrivals = (self.arrivals.0, instant.time_s, self.arrivals.2 + 1);
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
        if self.cutting || !self.len().is_multiple_of(BLOCK) {
            return 0;
        }
        self.cutting = self.is_cut(self.len() - BLOCK, config);
        let before_cut = ((BEFORE_CUT_S * config.rate_hz) as usize)
            .min(config.record_samples / BEFORE_CUT_PART)
            .max(BLOCK);
        if self.cutting || self.len() < before_cut + BLOCK {
            return 0;
        }
        self.discard(BLOCK, config.rate_hz);
        BLOCK
    }

    /// Whether something is cut in what is left, after its oldest samples have gone.
    pub(super) fn look_for_cut(&mut self, config: &StreamConfig) {
        let blocks = self.len() / BLOCK;
        self.cutting = (0..blocks).any(|block| self.is_cut(block * BLOCK, config));
    }

    /// Whether something is cut in the block from `first` on.
    fn is_cut(&mut self, first: usize, config: &StreamConfig) -> bool {
        let (mut varies, mut white) = (0.0, 0.0);
        for signal in &self.force {
            let block = &signal[first..first + BLOCK];
            let known: Vec<f32, BLOCK> = block.iter().copied().filter(|v| !v.is_nan()).collect();
            if known.len() < BLOCK / 2 {
                return false;
            }
            varies += noise::variance(&known);
            white += noise::sixth_difference(&known);
        }
        self.quietest = self.quietest.min(varies);
        let step = config.force_resolution * config.force_resolution;
        varies > noise::WHITE * white + step
            && (varies > CUT * self.quietest.max(step)
                || varies > 3.0 * LOUD_STEPS * LOUD_STEPS * step)
    }

    /// Instants per second, as they arrived; none while there are too few to tell.
    pub(super) fn measured_rate_hz(&self) -> Option<f64> {
        let (first_s, newest_s, count) = self.arrivals;
        (count > 1 && newest_s > first_s).then(|| (count - 1) as f64 / (newest_s - first_s))
    }

    /// When the next instant is due, s.
    pub(super) fn next_s(&self) -> f64 {
        let (first_s, newest_s, count) = self.arrivals;
        newest_s + if count > 1 { (newest_s - first_s) / (count - 1) as f64 } else { 0.0 }
    }

    /// How many of the newest samples in a row lack force, or lack acceleration.
    pub(super) fn newest_missing(&self) -> usize {
        let missing =
            |signal: &[f32]| signal.iter().rev().take_while(|value| value.is_nan()).count();
        missing(&self.force[0]).max(missing(&self.acceleration[0]))
    }

    /// Lets go of the oldest `count` samples.
    pub(super) fn discard(&mut self, count: usize, rate_hz: f64) {
        for signal in self.force.iter_mut().chain(&mut self.acceleration) {
            let left = signal.len() - count;
            signal.copy_within(count.., 0);
            signal.truncate(left);
        }
        self.start_s += count as f64 / rate_hz;
        self.beyond = 0;
        for angle in &mut self.pose.angles {
            angle.confirmed = angle.confirmed.saturating_sub(count);
        }
    }

    /// Empties it, pose included.
    pub(super) fn clear(&mut self) {
        self.clear_samples();
        self.pose = Pose::default();
    }

    /// Empties it; the pose is still known.
    pub(super) fn clear_samples(&mut self) {
        for signal in self.force.iter_mut().chain(&mut self.acceleration) {
            signal.clear();
        }
        for angle in &mut self.pose.angles {
            angle.confirmed = 0;
        }
        self.arrivals.2 = 0;
        self.beyond = 0;
        self.cutting = false;
    }
}

impl Pose {
    /// Takes a joint's angle, read when the stretch has `samples`.
    pub(super) fn read(&mut self, joint: usize, angle: f64, samples: usize) -> Result<(), Moved> {
        let known = &mut self.angles[joint];
        if known.readings > 0 && (angle - known.first).abs() > STATIC {
            return Err(Moved);
        }
        if known.readings == 0 {
            known.first = angle;
        }
        known.sum += angle - known.first;
        known.readings += 1;
        known.confirmed = samples;
        Ok(())
    }

    /// Whether every one of `joints` has been read.
    pub(super) fn is_known(&self, joints: usize) -> bool {
        self.angles[..joints].iter().all(|angle| angle.readings > 0)
    }

    /// Samples up to which every joint is known to have stood still.
    pub(super) fn confirmed(&self, joints: usize) -> usize {
        self.angles[..joints].iter().map(|angle| angle.confirmed).min().unwrap_or(0)
    }

    /// Mean angles.
    pub(super) fn mean(&self, joints: usize) -> Vec<f64, MAX_JOINTS> {
        let mean = |angle: &Angle| angle.first + angle.sum / f64::from(angle.readings.max(1));
        self.angles[..joints].iter().map(mean).collect()
    }
}
