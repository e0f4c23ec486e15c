//! Records in, parameters out.

use std::io;
use std::time::{Duration, Instant};

use fearless_simd::Level;
use flexid_core::chain::Chain;
use flexid_core::identify::{Identifier, Phase};
use flexid_core::spectrum::{Measurement, SpectrumError};
use flexid_core::unknowns::Sought;
use flexid_wire::messages::{self, Progress};
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::confidence::confidence;
use super::report::{self, Basis, report};
use super::retention::{Entry, Room, find_room};
use super::{Counts, Experiment, MAX_EXPERIMENTS, Pose, Record, SAMPLES, unchecked};
use crate::config::Config;
use crate::finding::Finding;
use crate::stop::Stop;
use crate::summary::count;

/// A record that is being worked on may take so long after the end was asked for.
const GRACE: Duration = Duration::from_secs(2);

/// Holds the newest records of each pose, and what they tell of the parameters.
///
/// Each record is worked on until the identifier settles before the next is taken, with a budget of steps and
/// none of time: the same records in the same order give the same parameters on any machine of one SIMD level.
pub struct Solver<'a> {
    config: &'a Config,
    chain: Chain,
    measurement: Measurement,
    sought: Sought,
    identifier: Box<Identifier<Xoshiro256PlusPlus>>,
    experiments: Vec<Experiment>,
    /// Where core works on one signal.
    buffer: Box<[f32; SAMPLES]>,
    /// Taken in, and of these the ones that were when the estimate last settled.
    records: u64,
    settled: u64,
    /// Of the experiments that the estimate rests on.
    poses: Vec<Pose>,
    /// Left in the queue at the end.
    waiting: u64,
    refused: Option<(u64, SpectrumError)>,
    /// Poses that had to make room, and were not folded into what is known.
    dropped_poses: u64,
    /// Records that were too short to take the place of others.
    too_short: u64,
    spent: Duration,
}

impl<'a> Solver<'a> {
    /// A solver that knows what the static tests tell. Needs a thread with a large stack.
    ///
    /// # Errors
    /// None for a checked config.
    pub fn new(config: &'a Config) -> io::Result<Self> {
        let chain = config.model.chain().map_err(unchecked)?;
        let measurement = config.measurement();
        let rng = Xoshiro256PlusPlus::seed_from_u64(config.seed);
        let sought = config.sought.clone();
        let identifier =
            Identifier::new(chain.clone(), config.bounds, measurement, Level::new(), rng)
                .seeking(sought.clone())
                .with_statics(&config.statics)
                .map_err(unchecked)?;
        let mut solver = Self {
            config,
            chain,
            measurement,
            sought,
            identifier: Box::new(identifier),
            experiments: Vec::with_capacity(MAX_EXPERIMENTS),
            buffer: Box::new([0.0; SAMPLES]),
            records: 0,
            settled: 0,
            poses: Vec::new(),
            waiting: 0,
            refused: None,
            dropped_poses: 0,
            too_short: 0,
            spent: Duration::ZERO,
        };
        let identifier = &mut solver.identifier;
        identifier.renew(&solver.experiments);
        while !matches!(identifier.step(&mut solver.experiments), Phase::Settled | Phase::Waiting) {
        }
        Ok(solver)
    }

    /// Takes a record in and works until all is found that it tells; once `stop` asks for the end, for 2 s more
    /// at most. `on_progress` hears of every step.
    pub fn take(&mut self, record: &Record, stop: &Stop, mut on_progress: impl FnMut(&Progress)) {
        let begun = Instant::now();
        match Experiment::new(&self.chain, &self.measurement, record, &mut self.buffer) {
            Ok(experiment) => {
                let news = self.keep(experiment);
                // What was settled before this record is so with it, if it is not kept.
                self.settled += u64::from(!news && self.settled == self.records);
                self.records += 1;
                if !news {
                    return;
                }
            }
            Err(error) => {
                self.refused.get_or_insert((0, error)).0 += 1;
                return;
            }
        }
        self.identifier.renew(&self.experiments);
        let mut deadline = None;
        let in_time = |deadline: &mut Option<Instant>| {
            !stop.requested()
                || Instant::now() < *deadline.get_or_insert_with(|| Instant::now() + GRACE)
        };
        while in_time(&mut deadline) {
            let phase = self.identifier.step(&mut self.experiments);
            on_progress(&self.progress());
            if matches!(phase, Phase::Settled | Phase::Waiting) {
                self.settled = self.records;
                self.poses = self.experiments.iter().map(|each| each.pose.clone()).collect();
                break;
            }
        }
        self.spent += begun.elapsed();
    }

    /// There are so many more records that will not be taken: the end has come.
    pub fn leave(&mut self, records: u64) {
        self.waiting += records;
    }

    /// How the work stands.
    pub fn progress(&self) -> Progress {
        let progress = self.identifier.progress();
        Progress {
            phase: match progress.phase {
                Phase::Waiting => messages::Phase::Waiting,
                Phase::Searching => messages::Phase::Searching,
                Phase::Refining => messages::Phase::Refining,
                Phase::Settled => messages::Phase::Settled,
            },
            fraction: progress.fraction,
            starts: progress.starts,
            search_evaluations: progress.search_evaluations,
            refine_iterations: progress.refine_iterations,
            search_loss: progress.search_loss,
            records: self.records,
        }
    }

    /// The parameters as they stand, once there are any; `counts` says what they rest on, `trouble` what went
    /// wrong at the source.
    pub fn finding(&self, counts: &Counts, trouble: &str) -> Option<Finding> {
        let Self { config, sought, .. } = self;
        let estimate = self.identifier.estimate()?;
        let records = self.poses.len() as u64 + estimate.retired;
        let left_out = self.settled.saturating_sub(records);
        let basis = Basis {
            progress: self.progress(),
            records,
            counts: *counts,
            seconds: self.spent.as_secs_f64(),
            refusal: self.refused(),
            left_out: self.left_out(),
            dropped: left_out.saturating_sub(self.too_short + estimate.forgotten),
            dropped_poses: self.dropped_poses,
            too_short: self.too_short,
            trouble,
        };
        let report = report(config, sought, estimate, &basis);
        let confidence = confidence(config, sought, estimate, &report, &self.poses, left_out);
        Some(Finding { report, confidence })
    }

    /// Why the records so far tell nothing, in words; `None` when there were none.
    pub fn refusal(&self) -> Option<String> {
        self.refused().or_else(|| self.left_out())
    }

    fn refused(&self) -> Option<String> {
        let (records, error) = self.refused?;
        let records = count(records, "record");
        Some(format!("{records} refused, the first because {}", report::reason(error)))
    }

    fn left_out(&self) -> Option<String> {
        let records = self.records - self.settled + self.waiting;
        match records {
            0 => None,
            1 => Some(
                "ended before the newest record was worked through: it is not in the numbers"
                    .into(),
            ),
            _ => Some(format!(
                "ended before the newest {records} records were worked through: they are not in the numbers"
            )),
        }
    }

    /// Keeps an experiment if there is room for it; whether it is kept.
    fn keep(&mut self, experiment: Experiment) -> bool {
        fn entry(experiment: &Experiment) -> Entry<'_> {
            Entry { pose: &experiment.pose, spacing: experiment.spacing }
        }
        let kept: Vec<Entry> = self.experiments.iter().map(entry).collect();
        match find_room(&kept, &entry(&experiment)) {
            Room::Free => {}
            Room::Instead(index) => {
                let last = kept.iter().filter(|other| other.shares_pose(&kept[index])).count() == 1;
                // What it tells stays, if it is known what that is.
                let mut retiring = self.experiments.remove(index);
                let retired = self.identifier.retire(&mut retiring);
                self.dropped_poses += u64::from(last && !retired);
            }
            Room::Nowhere => {
                self.too_short += 1;
                return false;
            }
        }
        self.experiments.push(experiment);
        true
    }
}
