//! Records in, parameters out.

use std::time::{Duration, Instant};

use fearless_simd::Level;
use flexid_core::chain::Chain;
use flexid_core::identify::{Identifier, Phase};
use flexid_core::spectrum::{Measurement, SpectrumError};
use flexid_wire::messages::{self, Progress};
use flexid_wire::report::Report;
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::report::{self, Basis};
use super::{Counts, Experiment, MAX_EXPERIMENTS, Record, SAMPLES};
use crate::config::Config;
use crate::model::ModelError;
use crate::stop::Stop;

/// Poses whose angles differ by no more are the same pose, rad (m).
const SAME_POSE: f64 = 1e-3;

/// Holds the newest record of each pose, and what they tell of the parameters.
///
/// Each record is worked on until the identifier settles before the next is taken, with a budget of steps and
/// none of time: the same records in the same order give the same parameters on any machine of one SIMD level.
pub struct Solver<'a> {
    config: &'a Config,
    chain: Chain,
    measurement: Measurement,
    identifier: Box<Identifier<Xoshiro256PlusPlus>>,
    experiments: Vec<Experiment>,
    /// Where core works on one signal.
    buffer: Box<[f32; SAMPLES]>,
    records: u64,
    refused: Option<(u64, SpectrumError)>,
    forgotten: u64,
    spent: Duration,
}

impl<'a> Solver<'a> {
    /// A solver that knows nothing. Needs a thread with a large stack.
    ///
    /// # Errors
    /// None for a checked config.
    pub fn new(config: &'a Config) -> Result<Self, ModelError> {
        let chain = config.model.chain()?;
        let measurement = config.measurement();
        let rng = Xoshiro256PlusPlus::seed_from_u64(config.seed);
        let identifier =
            Identifier::new(chain.clone(), config.bounds, measurement, Level::new(), rng);
        Ok(Self {
            config,
            chain,
            measurement,
            identifier: Box::new(identifier),
            experiments: Vec::with_capacity(MAX_EXPERIMENTS),
            buffer: Box::new([0.0; SAMPLES]),
            records: 0,
            refused: None,
            forgotten: 0,
            spent: Duration::ZERO,
        })
    }

    /// Takes a record in and works until all is found that it tells, or until `stop`. `on_progress` hears of
    /// every step.
    pub fn take(&mut self, record: &Record, stop: &Stop, mut on_progress: impl FnMut(&Progress)) {
        let begun = Instant::now();
        match Experiment::new(&self.chain, &self.measurement, record, &mut self.buffer) {
            Ok(experiment) => {
                self.records += 1;
                if !self.keep(experiment) {
                    return;
                }
            }
            Err(error) => {
                self.refused.get_or_insert((0, error)).0 += 1;
                return;
            }
        }
        self.identifier.renew(&self.experiments);
        while !stop.requested() {
            let phase = self.identifier.step(&mut self.experiments);
            on_progress(&self.progress());
            if matches!(phase, Phase::Settled | Phase::Waiting) {
                break;
            }
        }
        self.spent += begun.elapsed();
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
    pub fn report(&self, counts: &Counts, trouble: &str) -> Option<Report> {
        let estimate = self.identifier.estimate()?;
        Some(report::report(
            &self.config.model,
            estimate,
            &Basis {
                progress: self.progress(),
                counts: *counts,
                seconds: self.spent.as_secs_f64(),
                refusal: self.refusal(),
                forgotten: self.forgotten,
                trouble,
            },
        ))
    }

    /// Why the records so far tell nothing, in words; `None` when there were none.
    pub fn refusal(&self) -> Option<String> {
        let (count, error) = self.refused?;
        Some(format!("{count} records refused, the first because {}", report::reason(error)))
    }

    /// The newest record of a pose takes the place of the one before, unless it is shorter: what is left of a
    /// stretch when the robot moves on. Whether there is something new.
    fn keep(&mut self, experiment: Experiment) -> bool {
        let same = |other: &Experiment| {
            other.pose.iter().zip(&experiment.pose).all(|(a, b)| (a - b).abs() <= SAME_POSE)
        };
        if let Some(index) = self.experiments.iter().position(same) {
            // The bins of a shorter record are wider apart.
            if experiment.spacing > self.experiments[index].spacing {
                return false;
            }
            self.experiments.remove(index);
        } else if self.experiments.len() == MAX_EXPERIMENTS {
            self.experiments.remove(0);
            self.forgotten += 1;
        }
        self.experiments.push(experiment);
        true
    }
}
