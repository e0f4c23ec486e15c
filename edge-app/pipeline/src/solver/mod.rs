//! Makes an estimate of the parameters from records.

mod course;
mod epoch;
mod experiment;
mod finding;
mod fitted;
mod kept;
mod refused;
mod repeats;
mod retention;
mod spectra;
mod state;
mod work;

use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use fearless_simd::Level;
use flexid_core::chain::Chain;
use flexid_core::identify::{Identifier, MAX_NOISE_ROUNDS, Phase, PlantEstimate};
use flexid_core::loss::target::Target;
use flexid_core::parameters::Bushings;
use flexid_core::refine::{LeftOver, Plant};
use flexid_core::sought::Sought;
use flexid_core::spectrum::Measurement;
use flexid_wire::messages::{self, Progress};
use flexid_wire::unused::RecordFault;
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use tracing::warn;

use crate::config::{Config, Validity};
use crate::intake::Counts;
use crate::intake::plausibility::{Axes, Scale};
use crate::record::{BINS, Experiment, MAX_EXPERIMENTS, Pose, Record, SAMPLES};
use crate::stop::Stop;
use crate::text::count;
use crate::unchecked;
use course::Course;
pub use course::CoursePoint;
pub(crate) use experiment::{Candidate, experiment};
pub use fitted::{FittedBin, FittedRecord};
use refused::Refused;
pub(crate) use repeats::{Fingerprint, Taken};
use retention::Room;
pub use spectra::{Band, bands};
pub use state::{Format8, State};
use state::{MAX_WAITING, Retired, Settled};
use work::Work;

/// Number of records that may join before an accepted minimum is settled on. Without this limit steady milling would never
/// publish a report.
const MAX_JOINING: usize = 4;

/// Holds the newest records of each pose, and the estimate from them.
///
/// Records are admitted one by one and worked on until the identifier settles. The budget limits steps, not time. While more records
/// are at hand, up to four join before the work begins, or before another start is made: a second record determines more than a
/// second start. Once four records have joined, an accepted minimum is settled on. A recording therefore gives the same parameters
/// on all machines with the same SIMD level.
pub struct Solver {
    config: Arc<Config>,
    chain: Chain,
    measurement: Measurement,
    sought: Sought,
    identifier: Box<Identifier<Xoshiro256PlusPlus>>,
    /// Standard deviation of the displacements that state none, by their residuals, m. `None` if all state theirs, or if the residuals are
    /// too few.
    static_deviation: Option<f64>,
    /// Those of the measured receptances, which stay, and then those of the records.
    experiments: Vec<Experiment>,
    /// Record of which each experiment was made. `None` of a measured receptance.
    sources: Vec<Option<Arc<Record>>>,
    /// Number of each experiment among all receptances and records that came, from 1.
    numbers: Vec<u64>,
    /// Number of receptances and records that came.
    came: u64,
    taken: Taken,
    /// Imperfections that the configuration allows, and the fit to them.
    /// `None` for a perfect plant.
    plant: Option<Box<Plant>>,
    /// True if axes of the signals are wrong. The search then fits no imperfections, since they explain such records in no minimum.
    has_wrong_axes: bool,
    /// Estimate that holds whatever these imperfections are. `None` until it is made of the settled estimate.
    of_plant: Option<Box<PlantEstimate>>,
    /// Places where the residuals of the settled estimate are larger than elsewhere.
    left_over: Vec<LeftOver>,
    /// True if that, and the noise in the residuals of the settled estimate, have been considered.
    is_considered: bool,
    /// Robot at the upper ends of the bounds. A record is refused if this robot has no equilibrium at its pose.
    stiffest: Bushings,
    /// State when the solver last settled.
    state: State,
    /// Records that have become experiments since then.
    unsettled: Vec<Arc<Record>>,
    /// True until the measured receptances have been fitted.
    has_new_receptances: bool,
    /// True if the identifier must be renewed for the newest of these records.
    changed: bool,
    /// Instant at which the work must end. `None` until the end is requested.
    deadline: Option<Instant>,
    /// Buffer in which core works on one signal.
    buffer: Box<[f32; SAMPLES]>,
    /// Number of records taken in.
    records: u64,
    /// Number of records taken in when the estimate last settled.
    settled: u64,
    /// Poses of the experiments that the estimate rests on.
    poses: Vec<Pose>,
    /// Number of records that are left in the queue at the end.
    waiting: u64,
    refused: Refused,
    /// Number of poses that made room without leaving their information.
    dropped_poses: u64,
    /// Number of records that were too short to take the place of others.
    too_short: u64,
    scale: Scale,
    axes: Axes,
    /// Progress of the work on the unsettled records.
    work: Work,
    course: Course,
    spent: Duration,
}

impl Solver {
    /// Makes a solver and fits the static tests. The calling thread needs a large stack.
    ///
    /// # Errors
    /// A checked config gives no error.
    pub fn new(config: &Config) -> io::Result<Self> {
        let rng = Xoshiro256PlusPlus::seed_from_u64(config.seed);
        let mut solver = Self::begin(config, config.sought.clone(), rng)?;
        if !solver.has_new_receptances {
            solver.fit_statics();
        }
        Ok(solver)
    }

    /// [`Solver::new`] for static tests alone: a parameter that they do not determine is taken as typical.
    ///
    /// # Errors
    /// A checked config gives no error.
    pub fn of_statics(config: &Config) -> io::Result<Self> {
        let mut sought = config.sought.clone();
        sought.expect_stiffnesses();
        let mut solver =
            Self::begin(config, sought, Xoshiro256PlusPlus::seed_from_u64(config.seed))?;
        solver.fit_statics();
        Ok(solver)
    }

    fn fit_statics(&mut self) {
        let Self { identifier, experiments, work, .. } = self;
        identifier.renew(experiments);
        while !matches!(identifier.step(experiments), Phase::Settled | Phase::Waiting) {}
        work.advance(&identifier.progress());
    }

    /// Makes a solver that continues from the `state` of another one, as far as it [holds](State::validity) under `config`. If
    /// all of it holds, the solver takes over the fit. If the records hold, it fits the kept records anew. The caller must
    /// admit the records that wait in `state`.
    ///
    /// # Errors
    /// A checked config gives no error.
    pub fn resume(
        config: &Config,
        state: State,
        stop: &Stop,
        on_progress: impl FnMut(&Progress),
    ) -> io::Result<Self> {
        match (state.validity(config), &state.settled) {
            (Validity::Whole, Some(settled)) => {
                let mut solver =
                    Self::begin(config, config.sought.clone(), settled.generator.clone())?;
                solver.take_over(&state.kept);
                let Solver { identifier, experiments, plant, sought, .. } = &mut solver;
                let all = experiments.len() == config.receptances.len() + state.kept.len();
                let has_retired = match (plant, &settled.retired) {
                    (Some(plant), Some(retired)) => retired.resume(plant, sought).is_some(),
                    (_, retired) => retired.is_none(),
                };
                let resumes = all && has_retired;
                if !resumes || identifier.resume(&settled.standing, experiments).is_err() {
                    return Self::refit(config, state, stop, on_progress);
                }
                solver.dropped_poses = settled.dropped_poses;
                solver.too_short = settled.too_short;
                solver.spent = settled.spent;
                (solver.records, solver.settled) = (settled.records, settled.records);
                solver.came = settled.came;
                solver.numbers.truncate(config.receptances.len());
                solver.numbers.extend(&settled.numbers);
                solver.has_new_receptances = false;
                solver.taken = settled.taken.clone();
                solver.poses = solver.poses_of_experiments();
                solver.consider_plant(stop);
                solver.state = State { waiting: Vec::new(), ..state };
                Ok(solver)
            }
            (Validity::Whole, None) | (Validity::Records(_), _) => {
                Self::refit(config, state, stop, on_progress)
            }
            (Validity::Nothing(_), _) => Self::new(config),
        }
    }

    /// Makes a solver that has fitted the records kept in `state`.
    fn refit(
        config: &Config,
        state: State,
        stop: &Stop,
        on_progress: impl FnMut(&Progress),
    ) -> io::Result<Self> {
        let mut solver = Self::new(config)?;
        solver.state.earlier = state.earlier;
        solver.take_over(&state.kept);
        solver.unsettled = solver.sources.iter().flatten().cloned().collect();
        solver.changed = true;
        solver.work(stop, || false, on_progress);
        Ok(solver)
    }

    /// Makes experiments of the records that were kept.
    fn take_over(&mut self, kept: &[Arc<Record>]) {
        for record in kept {
            self.came += 1;
            match self.experiment(record) {
                Ok(experiment) => {
                    self.note_agreement(&experiment, self.ratio(&experiment));
                    self.experiments.push(experiment);
                    self.sources.push(Some(Arc::clone(record)));
                    self.numbers.push(self.came);
                    self.taken.add(self.came, Fingerprint::of(record));
                    self.records += 1;
                }
                Err(fault) => self.refused.note(fault),
            }
        }
    }

    /// Makes a solver that has not yet fitted the static tests.
    fn begin(config: &Config, sought: Sought, rng: Xoshiro256PlusPlus) -> io::Result<Self> {
        let chain = config.model.chain().map_err(unchecked)?;
        let measurement = config.measurement();
        let level = Level::new();
        let scale = Scale::new(&config.bounds, config.model.joints.len(), level);
        let identifier = Identifier::new(chain.clone(), config.bounds, measurement, level, rng);
        let mut identifier = Box::new(identifier);
        identifier.add_statics(&config.statics.tests).map_err(unchecked)?;
        identifier.seek(sought.clone()).map_err(unchecked)?;
        let static_deviation = identifier.estimate_static_deviation::<BINS>();
        let stiffest = config.bounds.stiffest(sought.joints());
        let mut plant = Box::new(Plant::new(&config.accuracies, &chain));
        plant.adopt(config.adopts_explanations);
        let mut solver = Self {
            config: Arc::new(config.clone()),
            chain,
            measurement,
            sought,
            identifier,
            static_deviation,
            experiments: Vec::with_capacity(MAX_EXPERIMENTS),
            sources: Vec::with_capacity(MAX_EXPERIMENTS),
            numbers: Vec::with_capacity(MAX_EXPERIMENTS),
            came: 0,
            taken: Taken::default(),
            plant: Some(plant).filter(|plant| !plant.is_perfect()),
            has_wrong_axes: false,
            of_plant: None,
            left_over: Vec::new(),
            is_considered: false,
            stiffest,
            state: State::new(config),
            unsettled: Vec::new(),
            has_new_receptances: false,
            changed: false,
            deadline: None,
            buffer: Box::new([0.0; SAMPLES]),
            records: 0,
            settled: 0,
            poses: Vec::new(),
            waiting: 0,
            refused: Refused::default(),
            dropped_poses: 0,
            too_short: 0,
            scale,
            axes: Axes::new(&config.mounting),
            work: Work::default(),
            course: Course::new(),
            spent: Duration::ZERO,
        };
        solver.take_receptances();
        Ok(solver)
    }

    /// Returns whether experiments have not been fitted yet.
    fn is_unsettled(&self) -> bool {
        self.has_new_receptances || !self.unsettled.is_empty()
    }

    /// Takes in a record. If another record must make room for it, works first until the earlier records are settled, as
    /// [`Solver::work`] does.
    pub fn admit(&mut self, record: &Record, stop: &Stop, on_progress: impl FnMut(&Progress)) {
        let made = |solver: &mut Self| {
            let experiment = solver.experiment(record)?;
            let ratio = solver.ratio(&experiment);
            Ok((experiment, ratio))
        };
        self.admit_made(record, Fingerprint::of(record), made, stop, on_progress);
    }

    /// Takes in a record that has been examined, like [`Solver::admit`].
    pub(crate) fn admit_examined(
        &mut self,
        candidate: Candidate<'_>,
        stop: &Stop,
        on_progress: impl FnMut(&Progress),
    ) {
        let Candidate { record, fingerprint, experiment, ratio } = candidate;
        let made = |solver: &mut Self| {
            let experiment = experiment?;
            let ratio = ratio.or_else(|| solver.ratio(&experiment));
            Ok((experiment, ratio))
        };
        self.admit_made(record, fingerprint, made, stop, on_progress);
    }

    fn admit_made(
        &mut self,
        record: &Record,
        fingerprint: Fingerprint,
        made: impl FnOnce(&mut Self) -> Result<(Experiment, Option<f64>), RecordFault>,
        stop: &Stop,
        on_progress: impl FnMut(&Progress),
    ) {
        self.came += 1;
        if self.taken.has(self.came, &fingerprint) {
            return;
        }
        match made(self) {
            Ok((experiment, ratio)) => {
                self.note_agreement(&experiment, ratio);
                if matches!(self.room(&experiment), Room::Instead(_)) {
                    self.work(stop, || false, on_progress);
                }
                let news = self.keep(experiment, record);
                // A record that is left out leaves a settled estimate settled.
                self.settled += u64::from(!news && self.settled == self.records);
                self.records += 1;
                if news {
                    self.taken.add(self.came, fingerprint);
                } else {
                    self.note_settled();
                }
            }
            Err(fault) => self.refused.note(fault),
        }
    }

    /// Works until the estimate is settled. It does not begin while few records have joined and `more` are at hand, and stops if
    /// the first start has failed and `more` are at hand. It does not stop then if several records have led to an accepted minimum, which
    /// is settled on before more records join.
    /// Once `stop` requests the end, it works for the grace of `stop` at most. It calls `on_progress` after every step. Returns whether
    /// nothing is left to do.
    pub fn work(
        &mut self,
        stop: &Stop,
        more: impl Fn() -> bool,
        mut on_progress: impl FnMut(&Progress),
    ) -> bool {
        if !self.is_unsettled() {
            self.consider_plant(stop);
            return true;
        }
        if self.unsettled.len() < MAX_JOINING && more() {
            return false;
        }
        let begun = Instant::now();
        if std::mem::take(&mut self.changed) {
            self.renew();
            self.work = Work::default();
        }
        let residuals = self.experiments.iter().map(|experiment| experiment.residuals(1)).sum();
        while is_in_time(stop, &mut self.deadline) {
            let phase = self.step();
            let progress = self.identifier.progress();
            self.work.advance(&progress);
            self.course.note(&progress, self.experiments.len() as u64, residuals);
            on_progress(&self.progress());
            if matches!(phase, Phase::Settled | Phase::Waiting) {
                self.settled = self.records;
                self.poses = self.poses_of_experiments();
                self.unsettled.clear();
                self.has_new_receptances = false;
                self.of_plant = None;
                self.left_over.clear();
                self.is_considered = false;
                break;
            }
            let is_nearly_settled =
                self.unsettled.len() >= MAX_JOINING && self.identifier.has_accepted();
            if self.work.rounds() > 0 && !is_nearly_settled && more() {
                break;
            }
        }
        self.note_settled();
        if !self.is_unsettled() && !more() {
            self.consider_plant(stop);
        }
        self.spent += begun.elapsed();
        !self.is_unsettled()
    }

    /// Renews the identifier, since the experiments have changed.
    fn renew(&mut self) {
        self.identifier.renew(&self.experiments);
        self.has_wrong_axes = self.axes.are_wrong();
    }

    /// Does one step of the identifier.
    fn step(&mut self) -> Phase {
        let Self { identifier, experiments, plant, has_wrong_axes, .. } = self;
        match plant {
            Some(plant) if !*has_wrong_axes => identifier.step_on_plant(experiments, plant),
            _ => identifier.step(experiments),
        }
    }

    /// Refines the settled estimate together with the imperfections of the plant, if that has not been done. Reads the noise again from its
    /// residuals, and fits again. Looks where the residuals of the last fit are larger than elsewhere.
    fn consider_plant(&mut self, stop: &Stop) {
        let mut rounds = 0;
        while !self.is_considered && is_in_time(stop, &mut self.deadline) {
            let Self { identifier, experiments, plant, of_plant, left_over, deadline, .. } = self;
            let mut go_on = || is_in_time(stop, deadline);
            if let Some(plant) = plant {
                let found = identifier.estimate_of_plant(experiments, plant, &mut go_on);
                *of_plant = found.map(Box::new);
            }
            let perfect = || identifier.estimate().filter(|_| plant.is_none());
            let estimate = of_plant.as_ref().map(|of_plant| &of_plant.estimate).or_else(perfect);
            let Some(estimate) = estimate.cloned() else { return };
            self.is_considered = rounds == MAX_NOISE_ROUNDS
                || !identifier.read_noise_again(experiments, plant.as_deref(), &estimate);
            if self.is_considered {
                let found = identifier.left_over(experiments, plant.as_deref(), &estimate);
                left_over.extend(found);
                return;
            }
            rounds += 1;
            self.identifier.renew_noise(&self.experiments);
            while is_in_time(stop, &mut self.deadline) {
                if matches!(self.step(), Phase::Settled | Phase::Waiting) {
                    break;
                }
            }
        }
    }

    fn poses_of_experiments(&self) -> Vec<Pose> {
        self.experiments.iter().map(|each| each.pose.clone()).collect()
    }

    /// Stores the state, if the estimate is settled and rests on records.
    fn note_settled(&mut self) {
        if self.is_unsettled() || self.experiments.is_empty() {
            return;
        }
        if let Some(standing) = self.identifier.standing() {
            self.state.kept = self.sources.iter().flatten().cloned().collect();
            self.state.settled = Some(Box::new(Settled {
                standing,
                retired: self.plant.as_deref().and_then(Retired::of),
                generator: self.identifier.generator().clone(),
                records: self.records,
                came: self.came,
                numbers: self.numbers_of_records().collect(),
                taken: self.taken.clone(),
                dropped_poses: self.dropped_poses,
                too_short: self.too_short,
                spent: self.spent,
            }));
        }
    }

    /// Returns the numbers of the records that are kept.
    fn numbers_of_records(&self) -> impl Iterator<Item = u64> {
        let all = self.numbers.iter().zip(&self.sources);
        all.filter(|(_, source)| source.is_some()).map(|(number, _)| *number)
    }

    /// Returns the state from which another solver can continue: this solver when it last settled, and the newest of the
    /// records since then. These include `waiting`, the records that this solver was not given. `counts` is what has come in.
    pub fn state(&self, counts: &Counts, waiting: &[Arc<Record>]) -> State {
        let mut state = self.state.clone();
        state.earlier = state.earlier.and(counts);
        let came = self.unsettled.iter().chain(waiting);
        let excess = came.clone().count().saturating_sub(MAX_WAITING);
        if excess > 0 {
            warn!("{} that no daemon had time for: given up", count(excess as u64, "old record"));
        }
        state.waiting = came.skip(excess).map(Arc::clone).collect();
        state
    }

    /// Counts `records` that will not be taken, since the end has come.
    pub fn leave(&mut self, records: u64) {
        self.waiting += records;
    }

    /// Returns the progress of the work.
    pub fn progress(&self) -> Progress {
        let progress = self.identifier.progress();
        Progress {
            phase: match progress.phase {
                Phase::Waiting => messages::Phase::Waiting,
                Phase::Searching => messages::Phase::Searching,
                Phase::Refining => messages::Phase::Refining,
                Phase::Settled => messages::Phase::Settled,
            },
            fraction: self.work.fraction(),
            starts: progress.effort.starts,
            search_evaluations: progress.effort.search_evaluations,
            refine_iterations: progress.effort.refine_iterations,
            search_loss: progress.search_loss,
            records: self.records,
        }
    }

    /// Makes the experiment of a record.
    fn experiment(&mut self, record: &Record) -> Result<Experiment, RecordFault> {
        experiment(&self.config, &self.chain, &self.stiffest, record, &mut self.buffer)
    }

    /// Returns the ratio of the acceleration of a record to that of the model's masses.
    fn ratio(&self, experiment: &Experiment) -> Option<f64> {
        // An experiment of this chain has a target.
        let target = Target::new(&self.chain, &self.measurement, experiment.site()).ok()?;
        Some(self.scale.ratio(&target, experiment))
    }

    /// Notes this ratio, and which axes of a record may be wrong.
    fn note_agreement(&mut self, experiment: &Experiment, ratio: Option<f64>) {
        if let Some(ratio) = ratio {
            self.scale.note(ratio);
            self.axes.note(experiment);
        }
    }
}

/// Returns whether the work may go on. Once `stop` requests the end, it may for the grace of `stop`.
fn is_in_time(stop: &Stop, deadline: &mut Option<Instant>) -> bool {
    let now = Instant::now();
    !stop.requested() || now < *deadline.get_or_insert(now + stop.grace())
}
