//! The state machine from records to an estimate: search, refine, judge, and search again while the residuals say
//! that the basin is wrong.
//!
//! A refinement that converges is accepted if noise alone explains its residuals, and the records stand clear of
//! the noise. If not, either the basin is wrong, or the model is, or the noise hides which; another search tells: the
//! best minimum reached again and again is accepted as well, with the remark that the model is suspect if the noise does not
//! explain it. A bare threshold would restart for ever on real data.
//!
//! Work is budgeted per change of the records, not by the clock, so that the same records give the same estimate
//! on any machine.

use fearless_simd::Level;
use heapless::Vec;
use rand_core::Rng;

use crate::DOF;
use crate::calibration::Nuisances;
use crate::chain::Chain;
use crate::loss::spectral;
use crate::parameters::{Bounds, Bushings, End};
use crate::refine::{Agreement, Fit, Outcome, Problem, Refinement};
use crate::search::{MAX_EXPERIMENTS, Search, Sensitivities, Strategy, Weighing};
use crate::spectrum::{Experiment, Measurement};
use crate::statics::{self, MAX_STATIC_TESTS, StaticTest, StaticTestError};
use crate::unknowns::{Coordinates, MAX_NUISANCES, Nuisance, Sought};
use crate::verdict::{Covariance, Direction, MAX_DIRECTIONS, Trust};

/// χ² per degree of freedom up to which noise explains the residuals, if they are many. The noise itself is known from a
/// few hundred quiet samples to 7 % of its power; the nearest wrong basin of the reference scenario lies at 2.
const CONSISTENT: f64 = 1.3;
/// Whiteness up to which noise explains the residuals' structure.
const STRUCTURED: f64 = 4.0;
/// Median SSP up to which the records stand clear of the noise: with ten times the noise of the reference scenario (0.14)
/// one wrong basin in twenty has residuals that noise explains.
const CLEAR: f64 = 0.05;
/// Two minima are the same if their sums of squares differ by less than 1, and this part of them.
const SAME_MINIMUM: f64 = 1e-4;
/// How often the best minimum must have been reached to be accepted where the noise could hide a wrong basin,
const TIMES_CONSISTENT: u32 = 2;
/// and where its residuals are larger than the noise explains: two robots of 1200 reach a wrong basin twice in a row.
const TIMES_SUSPECT: u32 = 4;
/// Searches that one change of the records may cost.
const MAX_STARTS: u32 = 8;

/// What an [`Identifier`] is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Needs a record.
    Waiting,
    /// Random search for the basin.
    Searching,
    /// Gauss-Newton refinement.
    Refining,
    /// Nothing to do until the next record.
    Settled,
}

/// How far a settled estimate can be believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Acceptance {
    /// The residuals are as large as the noise explains.
    Consistent,
    /// The same minimum was reached from several searches, and its residuals are larger than the noise
    /// explains: the model is wrong.
    ModelSuspect,
    /// The budget of starts ran out before either.
    Unsettled,
}

/// The parameters as they stand.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Stiffness and damping of every joint.
    pub bushings: Bushings,
    /// Standard deviation of each, same units; infinite where the data do not tell.
    pub standard_deviations: Bushings,
    /// Surface similarity parameter per direction and experiment: the median of them.
    pub ssp_median: f64,
    /// The largest of them.
    pub ssp_max: f64,
    /// χ² per degree of freedom; 1 when noise alone explains the residuals.
    pub consistency: f64,
    /// Sum of squares of the static tests' residuals per displacement measured, about 1 or less when their noise alone
    /// explains them; none without static tests.
    pub static_consistency: Option<f64>,
    /// How far to believe it.
    pub acceptance: Acceptance,
    /// Residuals' whiteness, about N(0, 1); far above, the model or the colour of the noise is wrong.
    pub whiteness: f64,
    /// Whether the residuals are larger than noise explains.
    pub size_objects: bool,
    /// Whether they have more structure along the band than noise explains.
    pub whiteness_objects: bool,
    /// Whether the residuals of the static tests by themselves are larger than their noise explains.
    pub statics_object: bool,
    /// Whether the records stand clear of the noise, so that it cannot hide a wrong minimum.
    pub stands_clear: bool,
    /// Covariance of the unknowns; [`Identifier::sought`] says which they are.
    pub covariance: Covariance,
    /// Combinations of unknowns that the data tell badly, the worst first.
    pub weak_directions: Vec<Direction, MAX_DIRECTIONS>,
    /// How well a fit to the others predicts each experiment, in their order; empty if there are no others.
    pub held_out: Vec<Agreement, MAX_EXPERIMENTS>,
    /// What was sought beside the parameters.
    pub nuisances: Vec<Nuisance, MAX_NUISANCES>,
    /// Records that are not kept any more, whose information is in the numbers.
    pub retired: u64,
    /// Retired records that had to be forgotten, since the newer ones contradict them: the robot has changed.
    pub forgotten: u64,
    coordinates: Coordinates,
}

impl Estimate {
    /// How far its parameters can be trusted: none is identified in a fit that did not settle, or that static tests contradict.
    pub fn trust(&self) -> Trust {
        let sound = self.acceptance != Acceptance::Unsettled && !self.statics_object;
        Trust::new(self.consistency, sound)
    }
}

/// How the work stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// What is going on.
    pub phase: Phase,
    /// Of the present search or refinement, 0 to 1.
    pub fraction: f32,
    /// Searches begun.
    pub starts: u32,
    /// Samples that the searches have cost.
    pub search_evaluations: u64,
    /// Refinement iterations done.
    pub refine_iterations: u64,
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
    search: Search,
    refinement: Refinement,
    /// Searches since the records last changed.
    starts: u32,
    total_starts: u32,
    search_evaluations: u64,
    refine_iterations: u64,
    /// The best minimum since the records last changed.
    best: Option<Minimum>,
    /// The minimum with the retired records, while those that are kept are tried alone.
    together: Option<Minimum>,
    estimate: Option<Estimate>,
    /// Retired records that had to be forgotten.
    forgotten: u64,
}

#[derive(Clone, Debug)]
struct Minimum {
    coordinates: Coordinates,
    fit: Fit,
    converged: bool,
    /// How often it has been reached.
    times: u32,
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
        let sought = Sought::new(chain.joints().len(), &Nuisances::default());
        let refinement = Refinement::new(&sought, &bounds.bushings(search.centre()));
        Self {
            chain,
            bounds,
            measurement,
            level,
            generator,
            phase: Phase::Waiting,
            sought,
            statics: Vec::new(),
            search,
            refinement,
            starts: 0,
            total_starts: 0,
            search_evaluations: 0,
            refine_iterations: 0,
            best: None,
            together: None,
            estimate: None,
            forgotten: 0,
        }
    }

    /// Seeks something else than every parameter for itself: before the first record.
    pub fn seeking(mut self, sought: Sought) -> Self {
        self.refinement = Refinement::new(&sought, &self.bounds.bushings(self.search.centre()));
        self.sought = sought;
        self
    }

    /// Rests the fit on static tests as well: before the first record. They need none: [`Identifier::renew`] with no
    /// experiments has their estimate worked out, in which the dampings are not told.
    ///
    /// # Errors
    /// The first test that no fit can take.
    pub fn with_statics(mut self, tests: &[StaticTest]) -> Result<Self, StaticTestError> {
        statics::check(tests, self.chain.joints().len())?;
        self.statics = tests.iter().cloned().collect();
        Ok(self)
    }

    /// What is sought.
    pub fn sought(&self) -> &Sought {
        &self.sought
    }

    /// Takes notice of a changed set of experiments: goes on from where it stands, with a new budget.
    pub fn renew<const B: usize>(&mut self, experiments: &[Experiment<B>]) {
        self.best = None;
        self.starts = 0;
        if self.together.take().is_some() {
            self.refinement.unshelve(true);
        }
        if experiments.is_empty() {
            self.phase = Phase::Waiting;
            if !self.statics.is_empty() {
                let middle = self.bounds.middle(self.chain.joints().len());
                self.refinement.restart(&self.sought, &middle);
                self.phase = Phase::Refining;
            }
            return;
        }
        match (self.phase, &self.estimate) {
            // What static tests tell alone is no basin of the records.
            _ if self.total_starts == 0 => self.start_search(experiments),
            (Phase::Waiting, _) | (Phase::Settled, None) => self.start_search(experiments),
            (Phase::Searching, _) => self.search.renew(self.weighing(experiments)),
            (Phase::Refining, _) => {
                let standing = *self.refinement.coordinates();
                self.refinement.restart_at(&standing);
            }
            (Phase::Settled, Some(estimate)) => {
                self.refinement.restart_at(&estimate.coordinates);
                self.phase = Phase::Refining;
            }
        }
    }

    /// Folds an experiment that will not be kept into what is known, if the estimate that rests on it can be believed; whether
    /// it has. Before the [`Identifier::renew`] that tells of its going.
    pub fn retire<const B: usize>(&mut self, experiment: &mut Experiment<B>) -> bool {
        let believed = |estimate: &&Estimate| estimate.acceptance == Acceptance::Consistent;
        let settled = self.phase == Phase::Settled;
        let Self { chain, measurement, bounds, sought, statics, refinement, estimate, .. } = self;
        let Some(estimate) = estimate.as_ref().filter(believed).filter(|_| settled) else {
            return false;
        };
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        refinement.restart_at(&estimate.coordinates);
        refinement.retire(&problem, experiment);
        true
    }

    /// One sample of the search, or one step of the refinement. Call with the experiments that [`Identifier::renew`]
    /// last saw; only what is fitted beside the parameters changes in them.
    pub fn step<const B: usize>(&mut self, experiments: &mut [Experiment<B>]) -> Phase {
        match self.phase {
            Phase::Waiting | Phase::Settled => {}
            Phase::Searching => {
                let mut guess = self.bounds.bushings(self.search.ask(&mut self.generator));
                self.sought.impose(&mut guess);
                self.search.tell(&spectral::losses(experiments, &guess, self.level));
                self.search_evaluations += 1;
                if self.search.finished() {
                    let found = self.bounds.bushings(self.search.centre());
                    self.refinement.restart(&self.sought, &found);
                    self.phase = Phase::Refining;
                }
            }
            Phase::Refining => {
                self.refine_iterations += 1;
                let Self { chain, measurement, bounds, sought, statics, refinement, .. } = self;
                let problem =
                    Problem { chain, measurement, bounds, sought, statics, level: self.level };
                let outcome = refinement.step(&problem, experiments);
                if outcome != Outcome::Improving {
                    let fit = refinement.fit(&problem, experiments);
                    self.judge(fit, outcome == Outcome::Converged, experiments);
                }
            }
        }
        self.phase
    }

    /// The estimate of the records as they last stood; none before the first has settled.
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
                Phase::Searching => done as f32 / of as f32,
                Phase::Refining => self.refinement.iterations() as f32 / TYPICAL_ITERATIONS,
                Phase::Settled => 1.0,
            }
            .min(1.0),
            starts: self.total_starts,
            search_evaluations: self.search_evaluations,
            refine_iterations: self.refine_iterations,
            search_loss: self.search.loss(),
        }
    }

    fn start_search<const B: usize>(&mut self, experiments: &[Experiment<B>]) {
        self.starts += 1;
        self.total_starts += 1;
        self.search = Search::new(Strategy::default(), 2 * DOF * self.chain.joints().len());
        self.search.renew(self.weighing(experiments));
        self.phase = Phase::Searching;
    }

    fn weighing<const B: usize>(&self, experiments: &[Experiment<B>]) -> Weighing {
        let jacobians = experiments.iter().map(|experiment| &experiment.search.jacobian);
        Weighing::Sensitivities(Sensitivities::jacobian(jacobians, self.chain.joints().len()))
    }

    /// Accepts what a refinement has come to, or searches again.
    fn judge<const B: usize>(
        &mut self,
        fit: Fit,
        converged: bool,
        experiments: &mut [Experiment<B>],
    ) {
        let found =
            Minimum { coordinates: *self.refinement.coordinates(), fit, converged, times: 1 };
        let Some(mut found) = self.reconsidered(found) else { return };
        if found.converged && !found.is_tested() {
            return self.settle(&found, Acceptance::Unsettled, experiments);
        }
        if found.is_beyond_doubt() {
            return self.settle(&found, Acceptance::Consistent, experiments);
        }
        if experiments.is_empty() {
            // In the compliances static tests are linear, but for gravity: another start would end here, too.
            let acceptance =
                if found.converged { Acceptance::ModelSuspect } else { Acceptance::Unsettled };
            return self.settle(&found, acceptance, experiments);
        }
        let best = match self.best.take() {
            Some(mut best) => {
                if found.converged && found.is_as_good_as(&best) {
                    let times = best.times + found.times;
                    (best.times, found.times) = (times, times);
                }
                if best.fit.sum_of_squares < found.fit.sum_of_squares { best } else { found }
            }
            None => found,
        };
        if best.times >= TIMES_CONSISTENT && best.is_consistent() {
            self.settle(&best, Acceptance::Consistent, experiments);
        } else if best.times >= TIMES_SUSPECT {
            self.settle(&best, Acceptance::ModelSuspect, experiments);
        } else if self.starts >= MAX_STARTS {
            self.settle(&best, Acceptance::Unsettled, experiments);
        } else {
            self.best = Some(best);
            self.start_search(experiments);
        }
    }

    /// Where retired records and those that are kept cannot both be right, those that are kept are tried alone first, and
    /// there is no minimum yet. What is retired is forgotten only if they are consistent without.
    fn reconsidered(&mut self, found: Minimum) -> Option<Minimum> {
        let refinement = &mut self.refinement;
        if let Some(together) = self.together.take() {
            let forget = found.converged && found.is_consistent();
            self.forgotten += refinement.unshelve(!forget);
            return Some(if forget { found } else { together });
        }
        if found.converged && found.is_contradicted() {
            refinement.shelve(&self.sought);
            refinement.restart_at(&found.coordinates);
            self.together = Some(found);
            return None;
        }
        Some(found)
    }

    fn settle<const B: usize>(
        &mut self,
        minimum: &Minimum,
        acceptance: Acceptance,
        experiments: &mut [Experiment<B>],
    ) {
        let Self { chain, measurement, bounds, sought, statics, refinement, .. } = self;
        let problem = Problem { chain, measurement, bounds, sought, statics, level: self.level };
        refinement.restart_at(&minimum.coordinates);
        let fit = refinement.fit(&problem, experiments);
        let weak_directions = refinement.weak_directions();
        let mut held_out = Vec::new();
        if experiments.len() > 1 {
            for experiment in experiments.iter_mut().take(MAX_EXPERIMENTS) {
                let _ = held_out.push(refinement.hold_out(&problem, experiment));
            }
        }
        let bushings = refinement.bushings(sought);
        self.estimate = Some(Estimate {
            standard_deviations: within(bounds, &bushings, &fit),
            bushings,
            ssp_median: fit.ssp[0],
            ssp_max: fit.ssp[1],
            consistency: fit.sum_of_squares / fit.degrees_of_freedom.max(1.0),
            static_consistency: (fit.static_residuals > 0)
                .then(|| fit.static_sum_of_squares / fit.static_residuals as f64),
            acceptance,
            whiteness: fit.whiteness,
            size_objects: !noise_explains(fit.sum_of_squares, fit.degrees_of_freedom),
            // What is no number does.
            whiteness_objects: fit.whiteness.is_nan() || fit.whiteness > STRUCTURED,
            statics_object: statics_object(&fit),
            stands_clear: fit.ssp[0] <= CLEAR,
            weak_directions,
            held_out,
            nuisances: sought.found(&minimum.coordinates, &fit.covariance),
            covariance: fit.covariance,
            retired: refinement.retired(),
            forgotten: self.forgotten,
            coordinates: minimum.coordinates,
        });
        self.best = None;
        self.phase = Phase::Settled;
    }
}

/// Steps of a refinement that starts in the right basin, about.
const TYPICAL_ITERATIONS: f32 = 12.0;

impl Minimum {
    /// Noise explains the residuals, and by themselves those of the static tests, which the many of the records would
    /// outvote.
    fn is_consistent(&self) -> bool {
        let Fit { sum_of_squares, degrees_of_freedom, .. } = self.fit;
        noise_explains(sum_of_squares, degrees_of_freedom) && !statics_object(&self.fit)
    }

    /// Noise explains the residuals, and is too small to hide a wrong basin.
    fn is_beyond_doubt(&self) -> bool {
        self.converged && self.is_consistent() && self.fit.ssp[0] <= CLEAR
    }

    fn is_as_good_as(&self, best: &Self) -> bool {
        let (found, best) = (self.fit.sum_of_squares, best.fit.sum_of_squares);
        (found - best).abs() <= 1.0 + SAME_MINIMUM * best
    }

    /// There are more residuals than unknowns, so that a wrong model would show.
    fn is_tested(&self) -> bool {
        self.fit.degrees_of_freedom >= 1.0
    }

    /// Retired records and those that are kept are not of the same robot.
    fn is_contradicted(&self) -> bool {
        self.fit.contradiction > rarely_exceeded(self.fit.covariance.rank() as f64)
    }
}

/// Whether noise leaves a sum of squares of this size; none that is no number.
fn noise_explains(sum_of_squares: f64, degrees_of_freedom: f64) -> bool {
    let most = (CONSISTENT * degrees_of_freedom).max(rarely_exceeded(degrees_of_freedom));
    (0.0..=most).contains(&sum_of_squares)
}

/// Whether the static tests' residuals are larger than their noise leaves them; what is no number is.
fn statics_object(fit: &Fit) -> bool {
    let most = rarely_exceeded(fit.static_residuals as f64);
    !(0.0..=most).contains(&fit.static_sum_of_squares)
}

/// What χ² of so many degrees of freedom exceeds with a chance below e⁻¹⁰ (Laurent and Massart, 2000, lemma 1).
fn rarely_exceeded(degrees_of_freedom: f64) -> f64 {
    degrees_of_freedom + 2.0 * libm::sqrt(10.0 * degrees_of_freedom) + 2.0 * 10.0
}

/// Standard deviations in the parameters' units. One that lies on a bound has none: the data push it further than it may.
fn within(bounds: &Bounds, bushings: &Bushings, fit: &Fit) -> Bushings {
    let mut deviations = bushings.clone();
    for (joint, bushing) in deviations.iter_mut().enumerate() {
        let ranges = bounds.stiffness.iter().chain(&bounds.damping);
        let values = bushing.stiffness.iter_mut().chain(&mut bushing.damping);
        for (index, (value, &range)) in values.zip(ranges).enumerate() {
            let inside = End::reached(range, *value).is_none();
            let relative = fit.deviations[2 * DOF * joint + index];
            // A parameter that is fixed may lie anywhere.
            *value = if inside || relative == 0.0 { *value * relative } else { f64::INFINITY };
        }
    }
    deviations
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_residuals_may_be_larger_than_many() {
        for (sum_of_squares, degrees_of_freedom, explained) in [
            (12_900.0, 10_000.0, true),
            (13_100.0, 10_000.0, false),
            (30.0, 10.0, true),
            (60.0, 10.0, false),
            (f64::NAN, 10.0, false),
            (f64::INFINITY, 10.0, false),
            (-1.0, 10.0, false),
        ] {
            let told = noise_explains(sum_of_squares, degrees_of_freedom);
            assert_eq!(told, explained, "{sum_of_squares} of {degrees_of_freedom}");
        }
    }
}
