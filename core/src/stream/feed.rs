//! A stretch along a path: whether the robot feeds, how long its records are, and where it is in their parts.

use super::noise::BLOCK;
use super::record::{LEAST_EVEN, MAX_PARTS};
use super::stretch::Stretch;
use super::{Record, StreamConfig};
use crate::spectrum::fft::MIN_SAMPLES;

/// Largest movement of a joint within a part of a record, rad (m). Chosen: a mode changes its frequency by about its own size per rad, so that half of
/// this movement changes it by 0.5 %, half of what a damping of 1 % makes its half-width. Half as much costs information at 50 mm/s.
pub const WITHIN_PART: f64 = 0.01;
/// Least parts of a record along a path. Chosen: with these the noise of a bin is known to a half. The parts of a record of 4.1 s last 0.5 s; the
/// deviations grow by a tenth.
const LEAST_PARTS: usize = 8;
/// A movement farther than this between two readings, or in the shortest part of a record, is no feed, rad (m). Chosen: three times what a part may
/// move; a robot of 1 m reach feeds no faster than 230 mm/s.
pub const LEAP: f64 = 3.0 * WITHIN_PART;
/// Largest movement of a joint within a record, rad (m): the search takes one pose for all of it. Chosen: at 50 mm/s and 1 m reach a record of 4.1 s
/// is whole, and descents find the basin.
const WITHIN_RECORD: f64 = 0.2;

impl<const N: usize> Stretch<N> {
    /// Takes note that a joint has left the pose after so many samples. Returns whether the robot feeds: it has not stood for a record of the
    /// cut, and does not leap.
    pub(super) fn feeds_from(
        &mut self,
        standing: usize,
        joint: usize,
        config: &StreamConfig,
    ) -> bool {
        let is_known = self.pose.unknown(config.joints).is_none() && !self.overflows();
        let has_record = self.cutting && standing >= self.cut_from + Self::least(config);
        let may_feed = self.feeds || is_known && !has_record;
        self.feeds = may_feed && !self.leaps(standing, joint);
        self.feeds
    }

    /// Returns whether a joint has moved faster than a feed since so many samples.
    pub(super) fn leaps(&self, since: usize, joint: usize) -> bool {
        self.pose.leaps(joint, [since, self.came()], MIN_SAMPLES, LEAP)
    }

    /// Returns whether a robot that has fed has stood for a record again.
    pub(super) fn rests_again(&self, config: &StreamConfig) -> bool {
        let since = if self.feeds { self.pose.rests_since(config.joints) } else { None };
        since.is_some_and(|since| since + Self::least(config) <= self.came())
    }

    /// Samples of the record along the path that is complete, if there is one.
    pub(super) fn fed(&self, config: &StreamConfig) -> Option<usize> {
        let known = self.pose.known(config.joints, self.came(), Self::notice(config));
        let known = known.min(self.len());
        // The part after the record is known, too, unless there is no room for it.
        let most = if known < N { known * LEAST_PARTS / (LEAST_PARTS + 1) } else { N };
        if most >= config.record_samples {
            return Some(config.record_samples);
        }
        let is_far = self.len().is_multiple_of(BLOCK)
            && most >= self.shortest(config)
            && self.pose.moves(config.joints, most, 1) > WITHIN_RECORD;
        is_far.then(|| 1 << most.ilog2())
    }

    /// Least samples of the next record.
    pub(super) fn shortest(&self, config: &StreamConfig) -> usize {
        let of_feed = if self.feeds { LEAST_EVEN * MIN_SAMPLES } else { 0 };
        Self::least(config).max(of_feed)
    }

    /// Number of equal parts of the oldest `samples` in each of which no joint moves by more than [`WITHIN_PART`], as far as parts may be short; at
    /// least [`LEAST_PARTS`], if so many may be.
    fn parts(&self, samples: usize, config: &StreamConfig) -> usize {
        let most = (samples / MIN_SAMPLES).min(MAX_PARTS);
        let mut parts = LEAST_PARTS.min(most);
        while 2 * parts <= most && self.pose.moves(config.joints, samples, parts) > WITHIN_PART {
            parts *= 2;
        }
        parts
    }

    /// Writes where the robot was in the oldest `samples` into a record of them. Returns whether that is known: the robot did not leap.
    pub(super) fn write_poses(
        &self,
        samples: usize,
        config: &StreamConfig,
        record: &mut Record<N>,
    ) -> bool {
        let known = self.pose.known(config.joints, self.came(), Self::notice(config));
        let path = |parts| self.pose.path(config, [samples, known], parts);
        record.path.clear();
        record.since_s = 0.0;
        record.pose = match self.feeds {
            false => self.pose.mean(config.joints),
            true => path(1).swap_remove(0).pose,
        };
        if !self.feeds {
            return true;
        }
        let parts = self.parts(samples, config);
        (record.path, record.since_s) = (path(parts), self.since_s);
        self.pose.moves(config.joints, samples, parts) <= LEAP
    }
}
