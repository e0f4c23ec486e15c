//! The state machine from records to an estimate: search, refine, judge, and search again while the residuals say
//! that the basin is wrong.
//!
//! A minimum is accepted if noise alone explains the size and the structure of its residuals, the records stand clear of the noise,
//! and no better minimum has been found on its branches (`branch`). Where it leaves a stiffness undetermined, so that a wrong minimum
//! may be nearly as good, noise must explain size and structure together. If not, the basin is wrong, or the model is, or the noise
//! hides which, and another search begins. The best minimum is accepted as well once several searches have reached it, compared by
//! coordinates and not by χ² alone; if noise does not explain it, the model is suspect. A bare threshold on χ² would search for
//! ever on real data. Two equally good minima in different places leave the estimate unsettled: the data do not say which is right.
//!
//! A search is a few descents from low to high frequencies (`descent`) or, one in four, the paper's random search
//! ([`crate::search`]).
//!
//! Work is budgeted per change of the records, not by the clock, so that the same records give the same estimate
//! on any machine.

mod branch;
mod decision;
mod descent;
mod effort;
mod estimate;
mod minimum;
mod settle;
mod standing;
mod start;

use core::mem;

use fearless_simd::Level;
use heapless::Vec;
use rand_core::Rng;

use crate::DOF;
use crate::chain::Chain;
use crate::loss::spectral;
use crate::loss::target::Target;
use crate::parameters::Bounds;
use crate::refine::{Outcome, Problem, Refinement};
use crate::search::{MAX_EXPERIMENTS, Search, Sensitivities, Strategy, Weighing};
use crate::sought::{Sought, SoughtError};
use crate::spectrum::{Experiment, Measurement};
use crate::statics::{self, MAX_STATIC_TESTS, StaticTest, StaticTestError};
use branch::{Branch, Tried};
use decision::{Circumstances, OfBest, OfFound, TIMES_CONSISTENT};
use descent::Descent;
pub use effort::{Effort, FoundBy};
pub use estimate::{Acceptance, Estimate};
use minimum::Minimum;
pub use standing::{Standing, StandingError};
use start::Method;

/// Typical number of steps of a refinement that starts in the right basin.
const TYPICAL_ITERATIONS: f32 = 12.0;
/// What an [`Identifier`] is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Needs a record.
    Waiting,
    /// A descent into the basin, or a random search for it.
    Searching,
    /// Gauss-Newton refinement.
    Refining,
    /// Nothing to do until the next record.
    Settled,
}

/// What the present refinement is for.
#[derive(Clone, Debug, Default)]
#[expect(clippy::large_enum_variant, reason = "there is no allocator to box a minimum with")]
enum Purpose {
    /// The minimum of a start.
    #[default]
    Start,
    /// A branch of the best minimum.
    Branch(Branch),
    /// The kept records without the retired ones; the minimum is that of both.
    Alone(Minimum),
}

/// How the work stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// What is going on.
    pub phase: Phase,
    /// Of the present search or refinement, 0 to 1.
    pub fraction: f32,
    /// Total cost so far.
    pub effort: Effort,
    /// Smallest loss of the present search (SSP).
    pub search_loss: f32,
}

/// Identifies the bushings of one robot from its experiments, which the caller keeps.
#[derive(Clone, Debug)]
pub struct Identifier<R> {
    chain: Chain,
    bounds: Bounds,
    measurement: Measurement,
    level: Level,
    generator: R,
    phase: Phase,
    sought: Sought,
    statics: Vec<StaticTest, MAX_STATIC_TESTS>,
    /// How the present start searches.
    method: Method,
    descent: Descent,
    search: Search,
    /// Targets of the present random search, in the order of the experiments.
    targets: Vec<Target, MAX_EXPERIMENTS>,
    refinement: Refinement,
    /// How often the present refinement has been continued.
    prolongations: u32,
    /// Searches since the records last changed.
    starts: u32,
    effort: Effort,
    /// The method that found the start of the present refinement.
    found_by: FoundBy,
    /// The best minimum since the records last changed.
    best: Option<Minimum>,
    purpose: Purpose,
    tried: Tried,
    /// How often in a row branches have been clearly worse since the last search.
    exclusions: u32,
    estimate: Option<Estimate>,
    /// Number of retired records that were dropped because newer ones contradict them.
    forgotten: u64,
}

impl<R: Rng> Identifier<R> {
    /// For one robot. `level` is the instruction set to use; `generator` drives the search.
    pub fn new(
        chain: Chain,
        bounds: Bounds,
        measurement: Measurement,
        level: Level,
        generator: R,
    ) -> Self {
        let search = Search::new(Strategy::default(), 2 * DOF * chain.joints().len());
        let sought = Sought::parameters_of(&chain);
        let refinement = Refinement::new(&sought, &bounds.within(search.centre()));
        let descent = Descent::first(start::middle(&bounds, &sought));
        Self {
            method: Method::Descent,
            descent,
            chain,
            bounds,
            measurement,
            level,
            generator,
            phase: Phase::Waiting,
            sought,
            statics: Vec::new(),
            search,
            targets: Vec::new(),
            refinement,
            prolongations: 0,
            starts: 0,
            effort: Effort::default(),
            found_by: FoundBy::Refinement,
            best: None,
            purpose: Purpose::Start,
            tried: Tried::default(),
            exclusions: 0,
            estimate: None,
            forgotten: 0,
        }
    }

    /// Replaces the unknowns, which by default are all parameters. Call it before the first record.
    ///
    /// # Errors
    /// The unknowns are of a chain with another number of joints.
    pub fn seek(&mut self, sought: Sought) -> Result<(), SoughtError> {
        if sought.joints() != self.chain.joints().len() {
            return Err(SoughtError::JointCount(sought.joints()));
        }
        self.refinement = Refinement::new(&sought, &self.bounds.within(self.search.centre()));
        self.sought = sought;
        Ok(())
    }

    /// Adds static tests to the fit. Call it before the first record. They need no records: [`Identifier::renew`] without
    /// experiments fits them alone, and leaves the dampings undetermined.
    ///
    /// # Errors
    /// The first test that no fit can take.
    pub fn add_statics(&mut self, tests: &[StaticTest]) -> Result<(), StaticTestError> {
        statics::check(tests, self.chain.joints().len())?;
        self.statics = tests.iter().cloned().collect();
        Ok(())
    }

    /// The unknowns.
    pub fn sought(&self) -> &Sought {
        &self.sought
    }

    /// Continues with a changed set of experiments from where it stands, with a new budget of searches.
    pub fn renew<const B: usize>(&mut self, experiments: &[Experiment<B>]) {
        let branched = match mem::take(&mut self.purpose) {
            Purpose::Start => None,
            Purpose::Branch(_) => self.best.take(),
            Purpose::Alone(_) => {
                self.refinement.unshelve(true);
                None
            }
        };
        self.best = None;
        self.tried = Tried::default();
        self.starts = 0;
        self.prolongations = 0;
        if experiments.is_empty() {
            self.phase = Phase::Waiting;
            if !self.statics.is_empty() {
                let middle = self.bounds.middle(self.sought.joints());
                self.refinement.restart(&self.sought, &middle);
                self.phase = Phase::Refining;
            }
            return;
        }
        match (self.phase, &self.estimate) {
            // What static tests tell alone is no basin of the records.
            _ if self.effort.starts == 0 => self.start_search(experiments),
            (Phase::Waiting, _) | (Phase::Settled, None) => self.start_search(experiments),
            (Phase::Searching, _) if branched.is_none() => match self.method {
                Method::Descent => self.descent.renew(),
                Method::RandomSearch => self.aim(experiments),
            },
            (Phase::Refining | Phase::Searching, _) => {
                let mut standing = *self.refinement.coordinates();
                if let Some(minimum) = branched {
                    (standing, self.found_by) = (minimum.coordinates, minimum.found_by);
                }
                self.refinement.restart_at(&standing);
                self.phase = Phase::Refining;
            }
            (Phase::Settled, Some(estimate)) => {
                self.refinement.restart_at(&estimate.coordinates);
                self.found_by = estimate.found_by;
                self.phase = Phase::Refining;
            }
        }
    }

    /// Adds the information of an experiment that will not be kept to that of the retired ones, if the present estimate is
    /// consistent; returns whether it has. Call it before the [`Identifier::renew`] without that experiment.
    pub fn retire<const B: usize>(&mut self, experiment: &Experiment<B>) -> bool {
        let believed = |estimate: &&Estimate| estimate.acceptance == Acceptance::Consistent;
        let settled = self.phase == Phase::Settled;
        let Self { chain, measurement, bounds, sought, statics, refinement, estimate, .. } = self;
        let Some(estimate) = estimate.as_ref().filter(believed).filter(|_| settled) else {
            return false;
        };
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        refinement.restart_at(&estimate.coordinates);
        refinement.retire(&problem, experiment).is_ok()
    }

    /// Does one sample of the search or one step of the refinement, with the experiments of the last [`Identifier::renew`].
    pub fn step<const B: usize>(&mut self, experiments: &[Experiment<B>]) -> Phase {
        match self.phase {
            Phase::Waiting | Phase::Settled => {}
            Phase::Searching => {
                self.effort.search_evaluations += 1;
                match self.method {
                    Method::Descent => self.descend(experiments),
                    Method::RandomSearch => self.sample(experiments),
                }
            }
            Phase::Refining => {
                self.effort.refine_iterations += 1;
                let Self { chain, measurement, bounds, sought, statics, refinement, .. } = self;
                let problem =
                    Problem { chain, measurement, bounds, sought, statics, level: self.level };
                let outcome = refinement.step(&problem, experiments);
                let objective = refinement.objective();
                let remaining = || refinement.remaining(&problem).gain;
                let is_over = match &mut self.purpose {
                    Purpose::Branch(branch) => {
                        branch.is_hopeless(objective)
                            || branch.is_near_its_end(objective, remaining)
                    }
                    _ => false,
                };
                if outcome != Outcome::Improving || is_over || self.is_back() {
                    self.judge(experiments);
                }
            }
        }
        self.phase
    }

    /// Where it stands; `None` unless it has settled on an estimate of records.
    pub fn standing(&self) -> Option<Standing> {
        let estimate = self.estimate.as_ref().filter(|_| self.phase == Phase::Settled)?;
        Some(Standing {
            coordinates: estimate.coordinates.iter().copied().collect(),
            apart: estimate.apart.clone(),
            deviations_elsewhere: estimate.deviations_elsewhere.clone(),
            exclusions: self.exclusions,
            acceptance: estimate.acceptance,
            retired: self.refinement.retired_records(),
            forgotten: self.forgotten,
            effort: self.effort,
            found_by: estimate.found_by,
        })
    }

    /// Whether a minimum has been accepted, and only its branches and rivals are searched before it is settled on.
    pub fn has_accepted(&self) -> bool {
        matches!(&self.purpose, Purpose::Branch(branch) if branch.is_of_accepted())
    }

    /// The random generator of the searches, in its present state.
    pub fn generator(&self) -> &R {
        &self.generator
    }

    /// Continues from the state of another identifier of the same problem, which had settled on these `experiments`. Give a new
    /// identifier the other's generator, too. It costs one fit and no search.
    ///
    /// # Errors
    /// The state is that of another problem. Then nothing has changed.
    pub fn resume<const B: usize>(
        &mut self,
        standing: &Standing,
        experiments: &[Experiment<B>],
    ) -> Result<(), StandingError> {
        let coordinates = standing.coordinates(&self.sought, &self.bounds)?;
        self.refinement
            .resume(&self.sought, &coordinates, &standing.retired)
            .ok_or(StandingError::Retired)?;
        self.forgotten = standing.forgotten;
        self.exclusions = standing.exclusions;
        self.effort = standing.effort;
        self.found_by = standing.found_by;
        let mut minimum = self.minimum_here(experiments);
        minimum.apart = standing.apart.clone();
        minimum.deviations_elsewhere = standing.deviations_elsewhere.clone();
        self.settle(&mut minimum, standing.acceptance, experiments);
        Ok(())
    }

    /// The last settled estimate; none before the first.
    pub fn estimate(&self) -> Option<&Estimate> {
        self.estimate.as_ref()
    }

    /// How the work stands.
    pub fn progress(&self) -> Progress {
        let (done, of) = self.search.iterations();
        Progress {
            phase: self.phase,
            fraction: match self.phase {
                Phase::Waiting => 0.0,
                Phase::Searching => match self.method {
                    Method::Descent => self.descent.fraction(),
                    Method::RandomSearch => done as f32 / of as f32,
                },
                Phase::Refining => self.refinement.iterations() as f32 / TYPICAL_ITERATIONS,
                Phase::Settled => 1.0,
            }
            .min(1.0),
            effort: self.effort,
            search_loss: self.search.loss(),
        }
    }

    fn start_search<const B: usize>(&mut self, experiments: &[Experiment<B>]) {
        self.phase = Phase::Searching;
        self.prolongations = 0;
        self.tried = Tried::default();
        self.exclusions = 0;
        self.method = Method::after(self.starts);
        match self.method {
            Method::Descent if self.starts == 0 => {
                self.descent = Descent::first(start::middle(&self.bounds, &self.sought));
            }
            Method::Descent => {
                let from = start::elsewhere(&self.bounds, &self.sought, &mut self.generator);
                self.descent = Descent::elsewhere(from);
            }
            Method::RandomSearch => {
                self.search = Search::new(Strategy::default(), 2 * DOF * self.chain.joints().len());
                self.aim(experiments);
            }
        }
        self.starts += 1;
        self.effort.starts += 1;
        self.effort.random_searches += u32::from(self.method == Method::RandomSearch);
    }

    /// One step of a descent; its end is where the refinement begins.
    fn descend<const B: usize>(&mut self, experiments: &[Experiment<B>]) {
        let Self { chain, measurement, bounds, sought, statics, descent, generator, .. } = self;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        let next = || start::elsewhere(bounds, sought, generator);
        if let Some(found) = descent.step(&problem, experiments, self.refinement.memory(), next) {
            self.refinement.restart_at(&found);
            self.found_by = FoundBy::Descent;
            self.phase = Phase::Refining;
        }
    }

    /// One sample of a random search; its end is where the refinement begins.
    fn sample<const B: usize>(&mut self, experiments: &[Experiment<B>]) {
        let mut guess = self.bounds.within(self.search.ask(&mut self.generator));
        self.sought.impose(&mut guess);
        self.search.tell(&spectral::losses(&self.targets, experiments, &guess, self.level));
        if self.search.finished() {
            let found = self.bounds.within(self.search.centre());
            self.refinement.restart(&self.sought, &found);
            self.found_by = FoundBy::RandomSearch;
            self.phase = Phase::Refining;
        }
    }

    /// Continues the random search with these experiments.
    fn aim<const B: usize>(&mut self, experiments: &[Experiment<B>]) {
        let Self { chain, measurement, targets, search, .. } = self;
        let target =
            |experiment: &Experiment<B>| Target::new(chain, measurement, &experiment.pose).ok();
        targets.clear();
        targets.extend(experiments.iter().map_while(target).take(MAX_EXPERIMENTS));
        debug_assert_eq!(targets.len(), experiments.len().min(MAX_EXPERIMENTS), "of another chain");
        let jacobians = targets.iter().map(|target| &target.jacobian);
        let sensitivities = Sensitivities::jacobian(jacobians, chain.joints().len());
        search.renew(Weighing::Sensitivities(sensitivities));
    }

    /// Accepts the minimum where a refinement has ended, or goes on.
    fn judge<const B: usize>(&mut self, experiments: &[Experiment<B>]) {
        let Some(mut found) = self.come_to(experiments) else { return };
        let tried_alone = matches!(self.purpose, Purpose::Alone(_));
        if tried_alone {
            self.reconcile(&mut found);
            self.stand_at(&found, experiments);
        }
        let best = self.best.as_ref();
        let circumstances = Circumstances {
            has_records: !experiments.is_empty(),
            tried_alone,
            best_agrees: best.is_some_and(Minimum::agrees),
            has_best: best.is_some(),
            is_outdone: best.is_some_and(|best| best.is_clearly_better_than(&found)),
            leaves_stiffness_undetermined: self.leaves_stiffness_undetermined(&found),
            prolongations: self.prolongations,
        };
        match decision::of_found(&found, &circumstances) {
            OfFound::Settle(acceptance) => self.settle(&mut found, acceptance, experiments),
            OfFound::Conclude(acceptance) => self.conclude(&mut found, acceptance, experiments),
            OfFound::TryAlone => self.try_alone(found),
            OfFound::Prolong => {
                self.prolongations += 1;
                self.refinement.restart_at(&found.coordinates);
            }
            OfFound::Compare { branch } => {
                if !(branch && self.branch_off(&found, None, experiments)) {
                    self.compare(found, experiments);
                }
            }
        }
    }

    /// Accepts the better of `found` and the best minimum so far, or searches again.
    // A minimum is large: inlined, those here would take room on the stack of the caller.
    #[inline(never)]
    fn compare<const B: usize>(&mut self, found: Minimum, experiments: &[Experiment<B>]) {
        let mut best = match self.best.take() {
            Some(mut best) => {
                let distance = self.refinement.distance(&self.sought, &best.coordinates);
                best.compete(found, distance);
                best
            }
            None => found,
        };
        match decision::of_best(&best, self.starts) {
            OfBest::Conclude(acceptance) => self.conclude(&mut best, acceptance, experiments),
            OfBest::TryAlone => self.try_alone(best),
            OfBest::GoOn { branch, search } => {
                if branch && self.branch_off(&best, None, experiments) {
                    return;
                }
                if !search {
                    return self.settle(&mut best, Acceptance::Unsettled, experiments);
                }
                best.is_branched |= branch && !self.excludes_branches();
                self.best = Some(best);
                self.start_search(experiments);
            }
        }
    }

    /// Refines the kept records alone, where they contradict the retired ones.
    #[inline(never)]
    fn try_alone(&mut self, together: Minimum) {
        self.refinement.shelve(&self.sought);
        self.refinement.restart_at(&together.coordinates);
        self.purpose = Purpose::Alone(together);
        self.phase = Phase::Refining;
    }

    /// Drops the retired records if the kept ones are consistent alone, in `found`, and their noise cannot hide a wrong minimum; else
    /// returns to the minimum of both.
    #[inline(never)]
    fn reconcile(&mut self, found: &mut Minimum) {
        let Purpose::Alone(mut together) = mem::take(&mut self.purpose) else { return };
        if found.is_reached() {
            together.contradicted = together.is_contradicted_beyond(found);
        }
        let sure = found.stands_clear() || together.times >= TIMES_CONSISTENT;
        let forget = together.contradicted && found.is_reached() && found.is_consistent() && sure;
        self.forgotten += self.refinement.unshelve(!forget);
        if forget {
            // It was found with the records that are forgotten.
            self.best = None;
        } else {
            *found = together;
        }
    }
}
