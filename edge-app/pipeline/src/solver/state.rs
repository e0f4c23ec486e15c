//! State of a solver, from which another continues after a restart or under another config.

use std::sync::Arc;
use std::time::Duration;

use flexid_core::identify::Standing;
use flexid_core::refine::{Plant, RetiredRecords};
use flexid_core::sought::Sought;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::repeats::Taken;
use crate::config::{Config, Fingerprint, Validity};
use crate::intake::Counts;
use crate::record::{MAX_EXPERIMENTS, Record};

/// Most records that may wait in a state. Each early end adds those of the queue. There is room for eight early ends in a row.
pub(super) const MAX_WAITING: usize = 64;

/// Version of the fit in a state. It changes with every struct in [`Settled`], and with the meaning of a number there. A fit of
/// another version is left out, and the records are fitted anew.
const FIT: u32 = 5;

/// The solver when it last settled, and the records that have come since.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    pub(super) fingerprint: Fingerprint,
    pub(super) earlier: Earlier,
    /// Identifier and counts. `None` while the solver has not settled on any record, or if the fit is of another version or is none.
    #[serde(with = "sealed")]
    pub(super) settled: Option<Box<Settled>>,
    /// The records that the estimate rests on, in the order of the experiments.
    #[serde(with = "with_path")]
    pub(super) kept: Vec<Arc<Record>>,
    /// Records that the estimate does not rest on yet, in the order in which they came.
    #[serde(with = "with_path")]
    pub(super) waiting: Vec<Arc<Record>>,
}

/// A state as flexid wrote it before records had paths.
#[derive(Deserialize)]
pub struct Format8 {
    fingerprint: Fingerprint,
    earlier: Earlier,
    #[serde(deserialize_with = "sealed::deserialize")]
    settled: Option<Box<Settled>>,
    kept: Vec<Arc<Record>>,
    waiting: Vec<Arc<Record>>,
}

impl From<Format8> for State {
    fn from(before: Format8) -> Self {
        let Format8 { fingerprint, earlier, settled, kept, waiting } = before;
        Self { fingerprint, earlier, settled, kept, waiting }
    }
}

/// Records, each with its path.
mod with_path {
    use std::sync::Arc;

    use flexid_core::stream::{MAX_PARTS, Stage};
    use serde::{Deserialize as _, Deserializer, Serializer};

    use crate::record::Record;

    pub(super) fn serialize<S: Serializer>(
        records: &[Arc<Record>],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(records.iter().map(|record| (record, &record.path, record.since_s)))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<Arc<Record>>, D::Error> {
        type Path = heapless::Vec<Stage, MAX_PARTS>;
        let records: Vec<(Box<Record>, Path, f64)> = Vec::deserialize(deserializer)?;
        let with_path = |(mut record, path, since_s): (Box<Record>, Path, f64)| {
            (record.path, record.since_s) = (path, since_s);
            Arc::from(record)
        };
        Ok(records.into_iter().map(with_path).collect())
    }
}

/// A fit as bytes with its version, which a reader of another version can skip.
mod sealed {
    use serde::{Deserialize as _, Deserializer, Serialize as _, Serializer, ser};

    use super::{FIT, Settled};

    type Bytes = Option<(u32, Vec<u8>)>;

    pub(super) fn serialize<S: Serializer>(
        settled: &Option<Box<Settled>>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let bytes = settled.as_deref().map(|fit| postcard::to_extend(fit, Vec::new())).transpose();
        let bytes: Bytes = bytes.map_err(ser::Error::custom)?.map(|bytes| (FIT, bytes));
        bytes.serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<Box<Settled>>, D::Error> {
        let own = Bytes::deserialize(deserializer)?.filter(|(version, _)| *version == FIT);
        Ok(own.and_then(|(_, bytes)| postcard::from_bytes(&bytes).ok()))
    }
}

/// Identifier and counts of the solver when it last settled.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Settled {
    pub(super) standing: Standing,
    /// Retired records with the imperfections of the plant. `None` if there are none, or the plant is perfect.
    pub(super) retired: Option<Retired>,
    pub(super) generator: Xoshiro256PlusPlus,
    pub(super) records: u64,
    /// Number of records that came, including those that were left out.
    pub(super) came: u64,
    /// Number of each experiment among all records that came.
    pub(super) numbers: Vec<u64>,
    pub(super) taken: Taken,
    pub(super) dropped_poses: u64,
    pub(super) too_short: u64,
    pub(super) spent: Duration,
}

/// Retired records of a plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Retired {
    normal: Vec<f64>,
    at: Vec<f64>,
    records: u64,
}

impl Retired {
    /// Returns those of a plant. `None` if there are none.
    pub(super) fn of(plant: &Plant) -> Option<Self> {
        let RetiredRecords { normal, at, records } = plant.retired_records()?;
        Some(Self { normal: normal.to_vec(), at: at.to_vec(), records })
    }

    /// Gives them to a plant whose fit seeks `sought`. `None` if they are of another plant.
    pub(super) fn resume(&self, plant: &mut Plant, sought: &Sought) -> Option<()> {
        let Self { normal, at, records } = self;
        plant.resume_retired(&RetiredRecords { normal, at, records: *records }, sought)
    }
}

/// Counts of what came in before this run, as far as reports contain them. An epoch that begins in the midst of a run has less than none
/// before it: the numbers wrap, and are right again when the counts of the run are added.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Earlier {
    frames: u64,
    frames_lost: u64,
    bridged: u64,
}

impl State {
    /// Makes the state of a solver that has not taken a record.
    pub(super) fn new(config: &Config) -> Self {
        Self {
            fingerprint: Fingerprint::of(config),
            earlier: Earlier::default(),
            settled: None,
            kept: Vec::new(),
            waiting: Vec::new(),
        }
    }

    /// Returns how much of the state holds under `config`.
    pub fn validity(&self, config: &Config) -> Validity {
        self.fingerprint.validity(&Fingerprint::of(config))
    }

    /// Returns the checksums of the config under which the state was found.
    pub fn fingerprint(&self) -> Fingerprint {
        self.fingerprint
    }

    /// Returns whether records are kept without the fit to them: another version of flexid has made it, or it cannot be read.
    pub fn lacks_fit(&self) -> bool {
        self.settled.is_none() && !self.kept.is_empty()
    }

    /// Returns whether the state holds no record.
    pub fn is_empty(&self) -> bool {
        self.kept.is_empty() && self.waiting.is_empty()
    }

    /// Returns the number of records that are kept in full, and the number of records that wait.
    pub fn records(&self) -> [usize; 2] {
        [self.kept.len(), self.waiting.len()]
    }

    /// Returns the number of retired records. Only a fit under the same config can use their information.
    pub fn retired(&self) -> u64 {
        self.settled.as_ref().map_or(0, |settled| settled.standing.retired())
    }

    /// Takes out the records that wait.
    pub fn take_waiting(&mut self) -> Vec<Arc<Record>> {
        std::mem::take(&mut self.waiting)
    }

    /// Returns the state without a fit that is not to its records. Returns `None` if no solver can have left so many records.
    pub fn checked(mut self) -> Option<Self> {
        let kept = self.kept.len();
        self.settled = self.settled.filter(|fit| kept > 0 && fit.numbers.len() == kept);
        (kept <= MAX_EXPERIMENTS && self.waiting.len() <= MAX_WAITING).then_some(self)
    }
}

impl Earlier {
    /// Returns the sum of these counts and `counts`, which have come in since.
    pub(super) fn and(self, counts: &Counts) -> Self {
        let Counts { stream, .. } = counts;
        Self {
            frames: self.frames.wrapping_add(stream.frames),
            frames_lost: self.frames_lost.wrapping_add(stream.frames_lost),
            bridged: self.bridged.wrapping_add(stream.bridged),
        }
    }

    /// Returns these counts less `counts`, which have come in before the epoch.
    pub(super) fn without(self, counts: &Counts) -> Self {
        let Counts { stream, .. } = counts;
        Self {
            frames: self.frames.wrapping_sub(stream.frames),
            frames_lost: self.frames_lost.wrapping_sub(stream.frames_lost),
            bridged: self.bridged.wrapping_sub(stream.bridged),
        }
    }

    /// Returns `counts` of this run, increased by what came in before.
    pub(super) fn added_to(self, mut counts: Counts) -> Counts {
        let Self { frames, frames_lost, bridged } = self.and(&counts);
        let stream = &mut counts.stream;
        (stream.frames, stream.frames_lost, stream.bridged) = (frames, frames_lost, bridged);
        counts
    }
}
