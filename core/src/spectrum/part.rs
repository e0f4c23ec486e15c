//! Parts of a record of a robot that feeds: each has spectra of its own, at the mean pose of its time.
//!
//! A part is a record by itself, with a seam of its own. The parts of a record share what is off in that record, and its noise. A part is so
//! short that its pose hardly changes; the stream says how many parts a record needs ([`Record::path`](crate::stream::Record::path)). Parts in
//! which the robot does not move evenly are left out, and a record that has too few others.

use core::ops::Range;

use heapless::Vec;

use super::fft::MIN_SAMPLES;
use super::site::Site;
use crate::MAX_JOINTS;
use crate::stream::{MAX_PARTS, Record, Stage};

/// Fewest bins of a part; a narrower band has fewer parts. Chosen: their 96 real residuals are as many as a seam of seven joints has unknowns.
const LEAST_BINS: usize = 16;

/// Joint angles, rad (m).
pub(super) type Pose = Vec<f64, MAX_JOINTS>;

/// A part of a record.
#[derive(Clone, Debug)]
pub struct Part<'a> {
    /// Where the force acts.
    pub site: Site<'a>,
    /// Its bins among those of the record, in ascending order of their frequencies.
    pub bins: Range<usize>,
}

/// The parts into which a record is divided whose band holds so many bins.
pub(super) fn stages<const N: usize>(record: &Record<N>, bins: usize) -> Vec<Stage, MAX_PARTS> {
    let mut stages = record.path.clone();
    if stages.is_empty() {
        let _ = stages.push(Stage { pose: record.pose.clone(), moves: 0.0, is_even: true });
    }
    let samples = record.force[0].len();
    while stages.len() > 1
        && (bins / stages.len() < LEAST_BINS || samples / stages.len() < MIN_SAMPLES)
    {
        let both = |pair: &[Stage]| Stage {
            pose: mean(pair),
            moves: pair.iter().map(|stage| stage.moves).sum(),
            is_even: pair.iter().all(|stage| stage.is_even),
        };
        stages = stages.chunks(2).map(both).collect();
    }
    stages
}

/// Mean rates of the joints in each of these stages, of which each lasts so many seconds, rad/s (m/s): the difference of the poses beside it. An even
/// stage has neighbours of the same rates.
pub(super) fn rates(stages: &[Stage], seconds: f64) -> impl Iterator<Item = Pose> {
    let last = stages.len() - 1;
    (0..=last).map(move |stage| {
        let [before, after] = [stage.saturating_sub(1), (stage + 1).min(last)];
        let time = (after - before) as f64 * seconds;
        let both = stages[before].pose.iter().zip(&stages[after].pose);
        both.filter(|_| time > 0.0).map(|(from, to)| (to - from) / time).collect()
    })
}

/// Mean pose of some stages.
pub(super) fn mean(stages: &[Stage]) -> Pose {
    let joints = stages.first().map_or(0, |stage| stage.pose.len());
    let sum = |joint: usize| stages.iter().map(|stage| stage.pose[joint]).sum::<f64>();
    (0..joints).map(|joint| sum(joint) / stages.len() as f64).collect()
}

#[cfg(test)]
mod tests;
