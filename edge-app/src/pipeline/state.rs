//! What a solver keeps to go on after a restart, or under another config.

use std::sync::Arc;
use std::time::Duration;

use flexid_core::identify::Standing;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::repeats::Taken;
use super::{Counts, MAX_EXPERIMENTS, Record};
use crate::config::{Config, Fingerprint, Validity};

/// Most records that may wait in a state. Each early end adds those of the queue: eight such ends in a row.
pub(super) const MAX_WAITING: usize = 64;

/// The solver as it last settled, and the records that have come since.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    pub(super) fingerprint: Fingerprint,
    pub(super) earlier: Earlier,
    /// `None` while it has not settled on any record.
    pub(super) settled: Option<Box<Settled>>,
    /// The records that the estimate rests on, in the order of the experiments.
    pub(super) kept: Vec<Arc<Record>>,
    /// Records that the estimate does not rest on yet, in the order in which they came.
    pub(super) waiting: Vec<Arc<Record>>,
}

/// Where the identifier and the solver's own counts stood.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Settled {
    pub(super) standing: Standing,
    pub(super) generator: Xoshiro256PlusPlus,
    pub(super) records: u64,
    /// Records that came, those that were left out among them, and the number of each experiment among them.
    pub(super) came: u64,
    pub(super) numbers: Vec<u64>,
    pub(super) taken: Taken,
    pub(super) dropped_poses: u64,
    pub(super) too_short: u64,
    pub(super) spent: Duration,
}

/// What came in before this run, as far as reports count it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Earlier {
    frames: u64,
    frames_lost: u64,
    bridged: u64,
}

impl State {
    /// Of a solver that has not taken a record.
    pub(super) fn new(config: &Config) -> Self {
        Self {
            fingerprint: Fingerprint::of(config),
            earlier: Earlier::default(),
            settled: None,
            kept: Vec::new(),
            waiting: Vec::new(),
        }
    }

    /// How much of it holds under `config`.
    pub fn validity(&self, config: &Config) -> Validity {
        self.fingerprint.validity(&Fingerprint::of(config))
    }

    /// Whether there is nothing in it that would be lost.
    pub fn is_empty(&self) -> bool {
        self.kept.is_empty() && self.waiting.is_empty()
    }

    /// How many records are kept in full, and how many wait.
    pub fn records(&self) -> [usize; 2] {
        [self.kept.len(), self.waiting.len()]
    }

    /// How many records were not kept any more when it was left, whose information only a fit like that one can use.
    pub fn retired(&self) -> u64 {
        self.settled.as_ref().map_or(0, |settled| settled.standing.retired())
    }

    /// The records that wait, which are taken out.
    pub fn take_waiting(&mut self) -> Vec<Arc<Record>> {
        std::mem::take(&mut self.waiting)
    }

    /// Whether a solver can have left it so.
    pub(crate) fn is_possible(&self) -> bool {
        self.kept.len() <= MAX_EXPERIMENTS
            && self.waiting.len() <= MAX_WAITING
            && self.settled.as_ref().map_or(0, |settled| settled.numbers.len()) == self.kept.len()
            && self.settled.is_none() == self.kept.is_empty()
    }
}

impl Earlier {
    /// With what has come in since.
    pub(super) fn and(self, counts: &Counts) -> Self {
        let Counts { stream, .. } = counts;
        Self {
            frames: self.frames.saturating_add(stream.frames),
            frames_lost: self.frames_lost.saturating_add(stream.frames_lost),
            bridged: self.bridged.saturating_add(stream.bridged),
        }
    }

    /// `counts` of this run, and what came in before.
    pub(super) fn added_to(self, mut counts: Counts) -> Counts {
        let Self { frames, frames_lost, bridged } = self.and(&counts);
        let stream = &mut counts.stream;
        (stream.frames, stream.frames_lost, stream.bridged) = (frames, frames_lost, bridged);
        counts
    }
}
