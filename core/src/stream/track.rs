//! Where a joint is over a stretch: straight lines between its readings.

use heapless::Vec;

/// Most readings that are kept. Chosen: half as many again as one in each half of a part of a full record.
const READINGS: usize = 96;

/// Readings of one joint.
#[derive(Clone, Debug, Default)]
pub(super) struct Track {
    /// Number of each sample since the start, and the angle there, rad (m); the newest last.
    readings: Vec<(f64, f64), READINGS>,
    /// Number of the first sample of the stretch since the start.
    first: f64,
}

impl Track {
    /// Takes a reading after so many `samples` of the stretch. The newest takes the place of one that came less than `spacing` samples after the one before it.
    pub(super) fn read(&mut self, samples: usize, angle: f64, spacing: usize) {
        let place = self.first + samples as f64;
        let count = self.readings.len();
        if count > 1 && self.readings[count - 1].0 - self.readings[count - 2].0 < spacing as f64 {
            self.readings.pop();
        }
        if self.readings.is_full() {
            self.readings.remove(0);
        }
        let _ = self.readings.push((place, angle));
    }

    /// The newest reading, rad (m).
    pub(super) fn newest(&self) -> Option<f64> {
        self.readings.last().map(|(_, angle)| *angle)
    }

    /// Returns whether a reading shows where the joint was at a sample of the stretch or before.
    pub(super) fn reaches(&self, sample: f64) -> bool {
        self.readings.first().is_some_and(|(place, _)| *place <= self.first + sample)
    }

    /// Takes note that the oldest `samples` of the stretch are gone.
    pub(super) fn discard(&mut self, samples: usize) {
        self.first += samples as f64;
    }

    /// Begins another stretch at the newest reading.
    pub(super) fn restart(&mut self) {
        let newest = self.newest();
        *self = Self::default();
        if let Some(newest) = newest {
            self.read(0, newest, 1);
        }
    }

    /// Angle at a sample of the stretch, rad (m): that of the nearest reading before the first and after the last. Zero without readings.
    fn at(&self, sample: f64) -> f64 {
        let place = self.first + sample;
        let after = self.readings.partition_point(|(own, _)| *own <= place);
        match (after.checked_sub(1).map(|before| self.readings[before]), self.readings.get(after)) {
            (Some((before, from)), Some((after, to))) => {
                from + (to - from) * (place - before) / (after - before)
            }
            (Some((_, only)), None) | (None, Some(&(_, only))) => only,
            (None, None) => 0.0,
        }
    }

    /// Samples at which the lines between two samples of the stretch begin and end, with the angles there.
    fn corners(&self, from: f64, to: f64) -> impl Iterator<Item = (f64, f64)> {
        let own = self.readings.iter().map(|(place, angle)| (place - self.first, *angle));
        let within = own.filter(move |(sample, _)| (from..to).contains(sample) && *sample > from);
        core::iter::once((from, self.at(from))).chain(within).chain([(to, self.at(to))])
    }

    /// Mean angle between two samples of the stretch, rad (m).
    pub(super) fn mean(&self, [from, to]: [f64; 2]) -> f64 {
        let lines = self.corners(from, to).zip(self.corners(from, to).skip(1));
        let area = lines.map(|((a, start), (b, end))| 0.5 * (b - a) * (start + end)).sum::<f64>();
        area / (to - from)
    }

    /// Largest distance of two neighbouring readings of which the later one comes after a sample of the stretch, rad (m).
    pub(super) fn step_after(&self, sample: usize) -> f64 {
        let place = self.first + sample as f64;
        let pairs = self.readings.windows(2).filter(|pair| pair[1].0 > place);
        pairs.map(|pair| (pair[1].1 - pair[0].1).abs()).fold(0.0, f64::max)
    }

    /// Mean rates over the first and the second half of the time between two samples, rad (m) a sample.
    pub(super) fn rates(&self, [from, to]: [f64; 2]) -> [f64; 2] {
        let middle = 0.5 * (from + to);
        let rate = |from: f64, to: f64| (self.at(to) - self.at(from)) / (to - from);
        [rate(from, middle), rate(middle, to)]
    }

    /// Distance of the farthest two angles between two samples of the stretch, rad (m).
    pub(super) fn extent(&self, [from, to]: [f64; 2]) -> f64 {
        let ends = self
            .corners(from, to)
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (_, angle)| {
                [low.min(angle), high.max(angle)]
            });
        ends[1] - ends[0]
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// A joint that turns evenly is where it is in the middle, however its readings are spaced, and whatever has been discarded.
        #[test]
        fn the_mean_of_an_even_motion_is_its_middle(
            steps in prop::collection::vec(1..200_usize, 5..90),
            gone in 0..50_usize,
            rate in -1e-4..1e-4_f64,
            part in 0.1..0.9_f64,
        ) {
            let mut track = Track::default();
            let mut samples = 0;
            for step in &steps {
                track.read(samples, rate * samples as f64, 1);
                samples += step;
            }
            let last = (samples - steps[steps.len() - 1]) as f64;
            let gone = gone.min(last as usize / 2);
            track.discard(gone);
            let end = last - gone as f64;
            let middle = 0.5 * (part * end + end) + gone as f64;
            prop_assert!((track.mean([part * end, end]) - rate * middle).abs() < 1e-9);
            prop_assert!((track.extent([part * end, end]) - rate.abs() * (1.0 - part) * end).abs() < 1e-9);
        }
    }

    #[test]
    fn dense_readings_leave_room_for_a_whole_record() {
        let mut track = Track::default();
        for sample in 0..8192 {
            track.read(sample, sample as f64, 128);
        }
        assert!((track.mean([0.0, 8191.0]) - 4095.5).abs() < 1e-6);
        assert_eq!(track.newest(), Some(8191.0));
    }

    #[test]
    fn a_turn_is_within_the_extent() {
        let mut track = Track::default();
        for (sample, angle) in [(0, 0.0), (100, 0.3), (200, 0.1)] {
            track.read(sample, angle, 1);
        }
        assert_eq!(track.extent([0.0, 200.0]), 0.3);
        assert!((track.mean([0.0, 200.0]) - 0.175).abs() < 1e-12);
    }
}
