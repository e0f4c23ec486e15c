//! Recognition of records that have been taken before. A log that is given twice counts once.
//!
//! Two passes over a log may cut it at different samples. The comparison therefore does not depend on where a record begins: of
//! the hashes of all short windows of a record the smallest are kept (Broder, "On the resemblance and containment of
//! documents", 1997). The more samples two records have in common, the more of these hashes they have in common.

use std::collections::VecDeque;
use std::hash::Hasher;

use flexid_wire::warning::Warning;
use fnv::FnvHasher;
use serde::{Deserialize, Serialize};

use crate::record::Record;

/// Samples of a window. The noise of the sensors makes any two windows of so many readings of six signals different.
const WINDOW: usize = 8;
/// Number of hashes that are kept of a record.
const KEPT: usize = 32;
/// Number of common hashes from which on two records are the same: they share more than half of their samples. If a quarter of
/// the samples is alike, five hashes are common on average. A rest before the cut may be alike where the steps of the signals
/// hide the noise.
const IN_COMMON: usize = 12;
/// Number of the newest records that are remembered: four hours of cuts of four seconds, in one megabyte.
const REMEMBERED: usize = 4096;

/// Fingerprint of a record, which does not depend on the sample where the record begins: the smallest FNV-1a hashes of its
/// windows, in ascending order. Files contain them, so that the hash function must not change.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Fingerprint([u64; KEPT]);

impl Fingerprint {
    pub(crate) fn of(record: &Record) -> Self {
        let signals = record.force.iter().chain(&record.acceleration);
        Self::of_signals(&signals.map(|signal| &signal[..]).collect::<Vec<_>>())
    }

    /// Computes the fingerprint of signals of equal length.
    fn of_signals(signals: &[&[f32]]) -> Self {
        let samples = signals.first().map_or(0, |signal| signal.len());
        let windows = (0..=samples.saturating_sub(WINDOW)).map(|first| {
            let mut hasher = FnvHasher::default();
            for value in signals.iter().flat_map(|signal| signal.iter().skip(first).take(WINDOW)) {
                hasher.write(&value.to_le_bytes());
            }
            hasher.finish()
        });
        let mut hashes: Vec<u64> = windows.collect();
        hashes.sort_unstable();
        hashes.dedup();
        hashes.resize(KEPT.max(hashes.len()), u64::MAX);
        Self(std::array::from_fn(|place| hashes[place]))
    }

    fn is_of_same(&self, other: &Self) -> bool {
        self.0.iter().filter(|hash| other.0.binary_search(hash).is_ok()).count() >= IN_COMMON
    }
}

/// Fingerprints of the records that a fit rests on, kept or retired, with their numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Taken {
    records: VecDeque<(u64, Fingerprint)>,
    /// Number of records that came again.
    repeats: u64,
    /// Number of the first record that came again, and number of the record that it repeats.
    first: Option<(u64, u64)>,
}

impl Taken {
    /// Returns whether record `number` has been taken before. If so, counts it.
    pub(crate) fn has(&mut self, number: u64, fingerprint: &Fingerprint) -> bool {
        let Some(original) = self.original(fingerprint) else { return false };
        self.repeats += 1;
        self.first.get_or_insert((number, original));
        true
    }

    /// Returns the number of the record that a record of this fingerprint repeats.
    pub(crate) fn original(&self, fingerprint: &Fingerprint) -> Option<u64> {
        let same = self.records.iter().find(|(_, taken)| taken.is_of_same(fingerprint));
        same.map(|(original, _)| *original)
    }

    /// Adds a record.
    pub(crate) fn add(&mut self, number: u64, fingerprint: Fingerprint) {
        if self.records.len() == REMEMBERED {
            self.records.pop_front();
        }
        self.records.push_back((number, fingerprint));
    }

    /// Removes a record of which nothing is left in the fit, so that it may come again.
    pub(crate) fn forget(&mut self, number: u64) {
        self.records.retain(|(own, _)| *own != number);
    }

    /// Returns the warning about records that came again.
    pub(crate) fn repeated(&self) -> Option<Warning> {
        let (again, original) = self.first?;
        Some(Warning::Repeated { records: self.repeats, again, original })
    }
}

#[cfg(test)]
mod tests {
    use rand_core::{Rng as _, SeedableRng as _};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    const LENGTH: usize = 4096;

    /// Returns the fingerprint of the samples `from..from + LENGTH` of a recording. Three of its signals do not move by a step
    /// in its first thousand samples.
    fn fingerprint(recording: u64, from: usize) -> Fingerprint {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(recording);
        let mut signal = |rest: usize| -> Vec<f32> {
            let mut step = || 0.25 * ((random.next_u32() >> 20) as f32 - 2048.0);
            (0..2 * LENGTH).map(|n| if n < rest { 0.0 } else { step() }).collect()
        };
        let signals = [1000, 1000, 1000, 0, 0, 0].map(&mut signal);
        Fingerprint::of_signals(&signals.each_ref().map(|signal| &signal[from..from + LENGTH]))
    }

    #[test]
    fn a_copy_is_recognised_wherever_it_begins() {
        let mut taken = Taken::default();
        for number in 1..=20 {
            let fingerprint = fingerprint(number, 0);
            assert!(!taken.has(number, &fingerprint), "record {number} is none of the others");
            taken.add(number, fingerprint);
        }
        assert_eq!(taken.repeated(), None);
        for (again, from) in [(4, 0), (5, 1), (6, 64), (7, 700)] {
            assert!(taken.has(20 + again, &fingerprint(again, from)), "from {from}");
        }
        // The stretch that follows is no copy.
        assert!(!taken.has(30, &fingerprint(8, LENGTH)));
        let repeated = Warning::Repeated { records: 4, again: 24, original: 4 };
        assert_eq!(taken.repeated(), Some(repeated));
    }

    #[test]
    fn what_is_lost_may_come_again() {
        let mut taken = Taken::default();
        let fingerprint = fingerprint(1, 0);
        taken.add(1, fingerprint.clone());
        taken.forget(1);
        assert!(!taken.has(2, &fingerprint));
        taken.add(2, fingerprint.clone());
        assert!(taken.has(4, &fingerprint));
        let repeated = Warning::Repeated { records: 1, again: 4, original: 2 };
        assert_eq!(taken.repeated(), Some(repeated));
    }

    #[test]
    fn memory_is_bounded() {
        let mut taken = Taken::default();
        for number in 0..=REMEMBERED as u64 {
            taken.add(number, Fingerprint([number; KEPT]));
        }
        assert_eq!(taken.records.len(), REMEMBERED);
        assert!(!taken.has(0, &Fingerprint([0; KEPT])));
    }
}
