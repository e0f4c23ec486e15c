//! The state machine from records to an estimate: search, refine, judge, and search again while the residuals say
//! that the basin is wrong.
//!
//! A minimum is accepted if noise alone explains the size and the structure of its residuals, the records stand clear of the noise,
//! and no better minimum has been found on its branches (`branch`). Where it leaves a stiffness undetermined, so that a wrong minimum
//! may be nearly as good, noise must explain size and structure together. If not, the basin is wrong, or the model is, or the noise
//! hides which, and another search begins. The best minimum is accepted as well once several searches have reached it, compared by
//! coordinates and not by χ² alone; if noise does not explain it, the model is suspect. Structure alone, up to a limit, is no
//! reason for that (`decision`). A bare threshold on χ² would search for ever on real data. Two equally good minima in different places leave the estimate unsettled: the data do not say which is right.
//!
//! On a plant that is not perfect, a minimum that noise does not explain is judged by the residuals that are left once the
//! [imperfections](crate::imperfection) of the plant are fitted with the parameters, from the end of the descent that has led to it, and else
//! from the minimum. If they explain the records, or most of what noise does not, the model has these imperfections from then on: branches
//! and rivals of the minimum are those of that model, and so are later searches, until a fit to the plant from another minimum finds better
//! ones. A fit that needs an error far beyond its accuracy is believed last (`deferred`).
//!
//! A search is a few descents from low to high frequencies (`descent`) or, one in four, the paper's random search
//! ([`crate::search`]).
//!
//! Work is budgeted per change of the records, not by the clock, so that the same records give the same estimate
//! on any machine.

mod branch;
mod corrected;
mod cut_noise;
mod decision;
mod deferred;
mod descent;
mod distortion;
mod effort;
mod estimate;
mod judge;
mod judged;
mod left_over;
mod lines;
mod local_response;
mod minimum;
mod noise;
mod on_plant;
mod phase;
mod plant;
mod progress;
mod retire;
mod searching;
mod settle;
mod shown;
mod standing;
mod start;
mod static_noise;
mod tones;

use core::mem;

use fearless_simd::Level;
use heapless::Vec;
use rand_core::Rng;

use crate::DOF;
use crate::chain::Chain;
use crate::imperfection::Correction;
use crate::loss::target::Target;
use crate::parameters::Bounds;
use crate::refine::{Outcome, Plant, Problem, Refinement};
use crate::search::{MAX_EXPERIMENTS, Search, Strategy};
use crate::sought::{Coordinates, Sought, SoughtError};
use crate::spectrum::{Experiment, Measurement};
use crate::statics::{self, MAX_STATIC_TESTS, StaticTest, StaticTestError};
use branch::{Branch, Tried};
use corrected::{Corrected, Deferred};
use descent::Descent;
pub use effort::{Effort, FoundBy};
pub use estimate::{Acceptance, Estimate};
use minimum::Minimum;
pub use noise::MAX_NOISE_ROUNDS;
pub use phase::Phase;
pub use plant::PlantEstimate;
pub use progress::Progress;
pub use standing::{Standing, StandingError};
use start::Method;

/// Purpose of the present refinement.
#[derive(Clone, Debug, Default)]
enum Purpose {
    /// The minimum of a start.
    #[default]
    Start,
    /// A branch of the best minimum.
    Branch(Branch),
    /// The kept records without the retired ones; the minimum is that of both.
    Alone(Minimum),
    /// A fit to the plant, after which a minimum is judged.
    Plant {
        /// The minimum.
        found: Minimum,
        /// Start of the fit.
        from: FitStart,
    },
}

/// Start of a fit to the plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FitStart {
    /// The minimum.
    Minimum,
    /// The end of a branch whose minimum has already been accepted, with this acceptance.
    BranchOf(Acceptance),
    /// The end of the descent that has led to the minimum. A descent allows for relative errors of the model, so that imperfections draw its
    /// end away less than the minimum of the perfect model. If the fit explains too little, another one begins at the minimum.
    Descent,
    /// The best minimum, once the budget of searches is spent: the fit is not given up, and if it explains too little the identifier settles.
    Best,
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
    /// Search method of the present start.
    method: Method,
    descent: Descent,
    search: Search,
    /// Targets of the present random search, in the order of the experiments.
    targets: Vec<Target, MAX_EXPERIMENTS>,
    refinement: Refinement,
    /// Number of continuations of the present refinement.
    prolongations: u32,
    /// How often the present refinement, or the present fit to the plant, has gone on since the movement of the model had changed.
    movements: u32,
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
    /// How often a minimum counts as reached when the work comes to it: once, or as often as its acceptance took if the noise was read again.
    times: u32,
    /// Visits of the minimum that was settled on.
    settled_times: u32,
    /// Visits of a settled minimum that was consistent, while new records are fitted from there.
    confirmations: u32,
    estimate: Option<Estimate>,
    /// The fit to the plant whose imperfections the model has; `None` if it has none, or was resumed.
    corrected: Option<Corrected>,
    /// The best fit to the plant that is not believed yet.
    deferred: Option<Deferred>,
    /// Number of retired records that were dropped because newer ones contradict them.
    forgotten: u64,
    /// End of the descent of the present start, as long as the plant has not been fitted from there.
    descent_end: Option<Coordinates>,
    /// In the present model, noise has explained what implausible imperfections leave: they may stand for a few wrong bushings.
    is_explained_implausibly: bool,
    /// The plant stands where its fit from the settled estimate has ended.
    is_fitted_to_plant: bool,
}

impl<R: Rng> Identifier<R> {
    /// Identifier of one robot. `level` is the instruction set to use; `generator` drives the search.
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
            movements: 0,
            starts: 0,
            effort: Effort::default(),
            found_by: FoundBy::Refinement,
            best: None,
            purpose: Purpose::Start,
            tried: Tried::default(),
            exclusions: 0,
            times: 1,
            settled_times: 0,
            confirmations: 0,
            estimate: None,
            corrected: None,
            deferred: None,
            forgotten: 0,
            descent_end: None,
            is_explained_implausibly: false,
            is_fitted_to_plant: false,
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
        statics::check(tests, self.chain.driven())?;
        self.statics = tests.iter().cloned().collect();
        Ok(())
    }

    /// The unknowns.
    pub fn sought(&self) -> &Sought {
        &self.sought
    }

    /// Continues with a changed set of experiments from where it stands, with a new budget of searches. A consistent minimum that explains the new
    /// records, too, is not searched for again: they are a test that a wrong one is unlikely to pass.
    pub fn renew<const B: usize>(&mut self, experiments: &[Experiment<B>]) {
        self.starts = 0;
        let was = self.estimate.as_ref().filter(|_| self.phase == Phase::Settled);
        let was_consistent = was.is_some_and(|own| own.acceptance == Acceptance::Consistent);
        self.confirmations = if was_consistent { self.settled_times } else { 0 };
        self.renew_noise(experiments);
        self.times = 1;
    }

    /// Continues with the same experiments, whose noise has been [read again](Identifier::read_noise_again), from where it stands. The searches are
    /// those of the records: what is spent stays spent, and a minimum that was accepted has been reached often enough.
    pub fn renew_noise<const B: usize>(&mut self, experiments: &[Experiment<B>]) {
        let branched = match mem::take(&mut self.purpose) {
            Purpose::Branch(_) | Purpose::Plant { from: FitStart::BranchOf(_), .. } => {
                self.best.take()
            }
            Purpose::Start | Purpose::Plant { .. } => None,
            Purpose::Alone(_) => {
                self.refinement.end_setting_aside(true);
                None
            }
        };
        self.best = None;
        let estimate = self.estimate.as_ref().filter(|_| self.phase == Phase::Settled);
        self.times = match estimate.map(|own| own.acceptance) {
            Some(Acceptance::Consistent) => self.settled_times.max(decision::TIMES_CONSISTENT),
            Some(Acceptance::ModelSuspect) => decision::TIMES_SUSPECT,
            Some(Acceptance::Unsettled) | None => 1,
        };
        let was_corrected = self.refinement.is_corrected();
        self.refinement.set_correction(&Correction::NONE);
        self.corrected = None;
        self.deferred = None;
        self.descent_end = None;
        self.is_explained_implausibly = false;
        self.is_fitted_to_plant = false;
        self.tried = Tried::default();
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
            // What static tests alone determine is no basin of the records.
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
                // The minimum of the perfect model may lie elsewhere.
                self.descent_end = was_corrected.then_some(standing);
                self.phase = Phase::Refining;
            }
            (Phase::Settled, Some(estimate)) => {
                self.refinement.restart_at(&estimate.coordinates);
                // As above.
                self.descent_end = was_corrected.then_some(estimate.coordinates);
                self.found_by = estimate.found_by;
                self.phase = Phase::Refining;
            }
        }
    }

    /// Does one sample of the search or one step of the refinement, with the experiments of the last [`Identifier::renew`].
    ///
    /// Where a refinement has ended, the movement in the parts of divided experiments becomes that of the model.
    pub fn step<const B: usize>(&mut self, experiments: &mut [Experiment<B>]) -> Phase {
        self.advance(experiments, None)
    }

    /// Takes a step as [`Identifier::step`], of a plant that is not perfect: a minimum that noise does not explain is judged by the residuals
    /// that its imperfections leave. The estimate takes the imperfections as perfectly known; see [`Identifier::estimate_of_plant`].
    ///
    /// # Panics
    /// If `plant` is of other joints.
    pub fn step_on_plant<const B: usize>(
        &mut self,
        experiments: &mut [Experiment<B>],
        plant: &mut Plant,
    ) -> Phase {
        assert!(plant.is_of(&self.chain), "a plant of another robot");
        let plant = Some(plant).filter(|plant| !plant.is_perfect());
        self.advance(experiments, plant)
    }

    fn advance<const B: usize>(
        &mut self,
        experiments: &mut [Experiment<B>],
        mut plant: Option<&mut Plant>,
    ) -> Phase {
        if let Some(plant) = plant.as_deref_mut() {
            self.refinement.follow_retired(plant);
        }
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
                if let Purpose::Plant { from, .. } = self.purpose {
                    let is_over = plant.as_deref_mut().is_none_or(|plant| {
                        let outcome = if from == FitStart::Best {
                            refinement.step_plant(&problem, experiments, plant)
                        } else {
                            refinement.step_plant_or_give_up(&problem, experiments, plant)
                        };
                        outcome != Outcome::Improving
                    });
                    if is_over && !self.goes_on_moving(experiments, plant.as_deref_mut()) {
                        self.judge_on_plant(experiments, plant);
                    }
                    return self.phase;
                }
                let outcome = match &self.purpose {
                    Purpose::Branch(branch) => {
                        refinement.step_below(branch.most_at_first(), &problem, experiments)
                    }
                    _ => refinement.step(&problem, experiments),
                };
                let objective = refinement.objective();
                // As all bins would show it.
                let remaining = || refinement.every() as f64 * refinement.remaining(&problem).gain;
                let is_over = match &mut self.purpose {
                    Purpose::Branch(branch) => {
                        branch.is_to_be_given_up(objective)
                            || branch.is_near_its_end(objective, remaining)
                    }
                    _ => false,
                };
                let is_over = outcome != Outcome::Improving || is_over || self.is_back();
                if is_over
                    && !self.goes_on_with_all_bins()
                    && !self.goes_on_moving(experiments, None)
                {
                    self.judge(experiments, plant);
                }
            }
        }
        self.phase
    }

    /// Goes on with all bins where some of them have not rejected a branch. Returns whether it does.
    fn goes_on_with_all_bins(&mut self) -> bool {
        let goes_on = self.refinement.every() > 1 && self.passes_screen();
        if goes_on {
            let standing = *self.refinement.coordinates();
            self.refinement.restart_at(&standing);
        }
        goes_on
    }

    /// Returns whether a minimum has been accepted, and only its branches and rivals are searched before it is settled on.
    pub fn has_accepted(&self) -> bool {
        match &self.purpose {
            Purpose::Branch(branch) => branch.is_of_accepted(),
            Purpose::Plant { from, .. } => matches!(from, FitStart::BranchOf(_)),
            _ => false,
        }
    }

    /// The random generator of the searches, in its present state.
    pub fn generator(&self) -> &R {
        &self.generator
    }

    /// The last settled estimate; none before the first.
    pub fn estimate(&self) -> Option<&Estimate> {
        self.estimate.as_ref()
    }
}
