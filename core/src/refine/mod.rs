//! Refinement: damped Gauss-Newton (Levenberg-Marquardt) in the logarithms of the parameters, with the exact
//! gradient, every bin weighted by its noise, and the seam of every record projected out.
//!
//! One [`Refinement::step`] tries one step. It ends when the step that is left would lower the sum of squares by
//! less than 1e-4: a hundredth of a standard deviation in all parameters together, but for combinations that the data
//! hardly tell, which the damping holds back.

mod equations;
mod information;
mod knowledge;
pub(crate) mod normal;
pub(crate) mod residuals;
mod rows;
pub(crate) mod seam;
mod statics;
mod summary;
mod whitening;

use fearless_simd::Level;

use crate::calibration::Calibration;
use crate::chain::Chain;
use crate::chain::linearise::LinearChain;
use crate::parameters::{Bounds, Bushings, MAX_PARAMETERS};
use crate::receptance::Terms;
use crate::spectrum::{Accelerometer, Experiment, Measurement};
use crate::statics::StaticTest;
use crate::unknowns::{Coordinates, MAX_UNKNOWNS, Sought};
use crate::verdict::{self, Covariance, Direction, MAX_DIRECTIONS};
use equations::{Assembly, Bins, RecordNormal, Unknowns};
pub use information::Information;
use knowledge::Knowledge;
use normal::{Normal, packed};
pub use residuals::Agreement;
use residuals::Residuals;
use seam::{MAX_SEAM, Seam, unknowns};
use statics::Statics;
use summary::Summary;

/// Predicted gain in the sum of squares (whose expectation is its degrees of freedom) that ends the refinement.
const NEGLIGIBLE: f64 = 1e-4;
/// A step may not change a parameter by more than this factor's logarithm.
const LONGEST_STEP: f64 = 1.0;
/// First damping, relative to the information of each parameter.
const FIRST_DAMPING: f64 = 1e-2;
/// The damping at which nothing moves any more.
const LAST_DAMPING: f64 = 1e8;
/// Steps after which a refinement ends wherever it is.
const MAX_ITERATIONS: u32 = 50;
/// Information per parameter that damping starts from, so that an unobserved one stays put.
const FLOOR: f64 = 1e-6;

/// What a seam's unknowns cost, as a part of what they explain: with many joints some hardly differ in the band,
/// and would grow without bound against each other.
const SMALL_SEAM: f64 = 1e-11;

/// What is held fixed while refining.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a> {
    /// The robot.
    pub chain: &'a Chain,
    /// What was measured.
    pub measurement: &'a Measurement,
    /// Where the parameters may lie.
    pub bounds: &'a Bounds,
    /// What is sought.
    pub sought: &'a Sought,
    /// Static tests that the fit rests on beside the records: [checked](crate::statics::check).
    pub statics: &'a [StaticTest],
    /// Instruction set.
    pub level: Level,
}

impl Problem<'_> {
    /// The chain at a pose, with the masses that it is taken to have.
    fn linearise(
        &self,
        pose: &[f64],
        bushings: &Bushings,
        calibration: &Calibration,
    ) -> LinearChain {
        let gravity = self.measurement.gravity();
        if self.sought.seeks_masses() {
            self.chain.weighing(&calibration.mass).linearise(pose, gravity, bushings)
        } else {
            self.chain.linearise(pose, gravity, bushings)
        }
    }
}

/// How a refinement stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Another step is worth while.
    Improving,
    /// No step would gain anything.
    Converged,
    /// It has had its steps, and is not at a minimum.
    Exhausted,
}

/// How well the parameters explain the records.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Sum of squares of the whitened residuals, of static tests and of priors; what retired records add is left out.
    pub sum_of_squares: f64,
    /// Its expectation if the model is right: real residuals less unknowns that are told.
    pub degrees_of_freedom: f64,
    /// Share of the static tests in the sum of squares.
    pub static_sum_of_squares: f64,
    /// Displacements that the static tests have measured.
    pub static_residuals: usize,
    /// Standard deviation of the logarithm of each parameter; infinite where the data do not tell, zero where it is fixed.
    pub deviations: [f64; MAX_PARAMETERS],
    /// Covariance of the unknowns that are sought.
    pub covariance: Covariance,
    /// Surface similarity parameter per direction and experiment, median and largest.
    pub ssp: [f64; 2],
    /// Ljung and Box's statistic of the whitened residuals, less its expectation and in its standard deviations: about
    /// N(0, 1) if the model and the colour of the noise are right.
    pub whiteness: f64,
    /// By how much the sum of squares is larger than the least that kept and retired records would have each by
    /// themselves: χ² of as many degrees of freedom as unknowns are told, if nothing has changed; 0 without retired ones.
    pub contradiction: f64,
}

pub(crate) type ParameterNormal = Normal<{ packed(MAX_UNKNOWNS + 1) }>;

/// State of a refinement, in double precision.
#[derive(Clone, Debug)]
pub struct Refinement {
    coordinates: Coordinates,
    /// Normal equations at `coordinates`, the seams projected out.
    normal: ParameterNormal,
    record: RecordNormal,
    /// What retired records tell.
    knowledge: Knowledge,
    /// Put aside, to see whether the records that are kept do better without.
    shelf: Option<Knowledge>,
    assembled: bool,
    damping: f64,
    iterations: u32,
}

impl Refinement {
    /// From a first guess, one bushing per joint.
    pub fn new(sought: &Sought, guess: &Bushings) -> Self {
        Self {
            coordinates: sought.coordinates(guess),
            normal: Normal::new(),
            record: Normal::new(),
            knowledge: Knowledge::none(sought.unknowns()),
            shelf: None,
            assembled: false,
            damping: FIRST_DAMPING,
            iterations: 0,
        }
    }

    /// Starts anew from `guess`.
    pub fn restart(&mut self, sought: &Sought, guess: &Bushings) {
        self.restart_at(&sought.coordinates(guess));
    }

    /// Starts anew from some coordinates.
    pub(crate) fn restart_at(&mut self, coordinates: &Coordinates) {
        self.coordinates = *coordinates;
        self.assembled = false;
        self.damping = FIRST_DAMPING;
        self.iterations = 0;
    }

    /// Steps tried since the start.
    pub fn iterations(&self) -> u32 {
        self.iterations
    }

    /// The parameters as they stand.
    pub fn bushings(&self, sought: &Sought) -> Bushings {
        sought.bushings(&self.coordinates)
    }

    /// The nuisances as they stand.
    pub fn calibration(&self, sought: &Sought) -> Calibration {
        sought.calibration(&self.coordinates)
    }

    pub(crate) fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    /// Combinations of the unknowns that the data tell badly, where the last [`Refinement::fit`] was.
    pub fn weak_directions(&self) -> heapless::Vec<Direction, MAX_DIRECTIONS> {
        verdict::weak_directions(&self.normal)
    }

    /// Tries one step; keeps it if the residuals shrink.
    pub fn step<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &mut [Experiment<B>],
    ) -> Outcome {
        if !self.assembled {
            self.fit_seams(problem, experiments);
            self.assemble(problem, experiments);
        }
        self.iterations += 1;
        let before = self.coordinates;
        let standing = self.normal.sum_of_squares();
        let (step, predicted) = self.propose(problem, &self.normal, self.damping);
        if predicted < NEGLIGIBLE {
            if predicted >= 0.0 && self.damping <= FIRST_DAMPING {
                return Outcome::Converged;
            }
            // A damped step that gains nothing says little; nor does one that the bounds turned uphill.
            self.damping *= if predicted < 0.0 { 10.0 } else { 0.1 };
            return self.unless_exhausted();
        }
        problem.sought.advance(&mut self.coordinates, &step);
        let reached = self.fit_seams(problem, experiments) + self.beside(problem);
        if reached < standing {
            let agreement = (standing - reached) / predicted;
            self.damping *= if agreement > 0.75 {
                0.1
            } else if agreement > 0.25 {
                1.0
            } else {
                4.0
            };
            self.damping = self.damping.max(1e-9);
            self.assemble(problem, experiments);
        } else {
            self.coordinates = before;
            self.damping *= 10.0;
        }
        self.unless_exhausted()
    }

    fn unless_exhausted(&self) -> Outcome {
        if self.damping > LAST_DAMPING {
            Outcome::Converged
        } else if self.iterations >= MAX_ITERATIONS {
            Outcome::Exhausted
        } else {
            Outcome::Improving
        }
    }

    /// Evaluates the fit at the parameters as they stand.
    pub fn fit<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &mut [Experiment<B>],
    ) -> Fit {
        let static_sum_of_squares = self.statics(problem).sum_of_squares();
        let priors = problem.sought.priors(&self.coordinates);
        let (priors, off) =
            priors.fold((0, 0.0), |(n, sum), (_, value)| (n + 1, sum + value * value));
        let sum_of_squares = self.fit_seams(problem, experiments) + static_sum_of_squares + off;
        let summary = self.assemble(problem, experiments);
        let joints = problem.chain.joints().len();
        let covariance = Covariance::of(&self.normal);
        let static_residuals = problem.statics.iter().map(|test| test.readings().count()).sum();
        let residuals = experiments.iter().map(|e| 6 * e.bins()).sum::<usize>();
        let residuals = residuals + static_residuals + priors;
        // Retired records have told the unknowns before.
        let told = if self.knowledge.records() > 0 { 0 } else { covariance.rank() };
        let sought = told + experiments.len() * seam::unknowns(joints);
        let values = problem.sought.values(&self.coordinates);
        Fit {
            sum_of_squares,
            static_sum_of_squares,
            static_residuals,
            degrees_of_freedom: residuals.saturating_sub(sought) as f64,
            deviations: deviations(problem.sought, &covariance),
            covariance,
            whiteness: summary.whiteness(),
            ssp: summary.similarities.median_and_largest(),
            contradiction: self.knowledge.contradiction(&self.normal, &values),
        }
    }

    /// Folds a record that will not be kept into what is known, at the parameters as they stand.
    pub fn retire<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &mut Experiment<B>,
    ) {
        self.fit_seam(problem, experiment);
        self.assemble_record(problem, experiment, Unknowns::All);
        let values = problem.sought.values(&self.coordinates);
        let seam = unknowns(problem.chain.joints().len());
        self.knowledge.take(&self.record, seam, &values);
        self.assembled = false;
    }

    /// Puts all retired records aside.
    pub(crate) fn shelve(&mut self, sought: &Sought) {
        let none = Knowledge::none(sought.unknowns());
        self.shelf = Some(core::mem::replace(&mut self.knowledge, none));
        self.assembled = false;
    }

    /// Takes back what was put aside, or forgets it; returns how many records are forgotten.
    pub(crate) fn unshelve(&mut self, take_back: bool) -> u64 {
        match self.shelf.take() {
            Some(shelved) if take_back => {
                self.knowledge = shelved;
                self.assembled = false;
                0
            }
            shelved => shelved.map_or(0, |shelved| shelved.records()),
        }
    }

    /// Retired records that the fit rests on beside those that are kept.
    pub fn retired(&self) -> u64 {
        self.knowledge.records()
    }

    /// How well all other records, and what is known, foretell this one, after [`Refinement::fit`]: one step of
    /// Gauss and Newton takes its share out of the estimate.
    pub fn hold_out<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &mut Experiment<B>,
    ) -> Agreement {
        let standing = self.coordinates;
        self.assemble_record(problem, experiment, Unknowns::All);
        let mut others = self.normal.clone();
        others.subtract_complement(&self.record, unknowns(problem.chain.joints().len()));
        let (step, _) = self.propose(problem, &others, 0.0);
        problem.sought.advance(&mut self.coordinates, &step);
        self.fit_seam(problem, experiment);
        let agreement = self.assemble_record(problem, experiment, Unknowns::All).agreement();
        self.coordinates = standing;
        self.fit_seam(problem, experiment);
        agreement
    }

    /// What one experiment tells of the unknowns at the parameters as they stand, its seam projected out.
    ///
    /// The measured acceleration has no part in it, so that an experiment may be asked that has not been done: a
    /// record of the force alone, its acceleration zero.
    pub fn information<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &mut Experiment<B>,
    ) -> Information {
        self.assemble_record(problem, experiment, Unknowns::Foretold);
        let seam = unknowns(problem.chain.joints().len());
        Information::of_complement(&self.record, seam, problem.sought)
    }

    /// The seams that fit best at the parameters; returns the sum of squares that remains.
    fn fit_seams<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &mut [Experiment<B>],
    ) -> f64 {
        experiments.iter_mut().map(|experiment| self.fit_seam(problem, experiment)).sum()
    }

    fn fit_seam<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &mut Experiment<B>,
    ) -> f64 {
        let joints = problem.chain.joints().len();
        self.run(problem, experiment, Unknowns::Seam);
        let normal = &mut self.record;
        normal.prefer_small(&[0.0; MAX_SEAM][..unknowns(joints)], SMALL_SEAM);
        normal.eliminate(unknowns(joints));
        let mut solution = [0.0; MAX_SEAM];
        normal.substitute(unknowns(joints), &mut solution);
        experiment.seam = Seam::from_solution(&solution[..unknowns(joints)], joints);
        normal.sum_of_squares()
    }

    /// Sum of squares of what is known beside the records that are kept: priors, static tests and retired records.
    fn beside(&self, problem: &Problem<'_>) -> f64 {
        let priors = problem.sought.priors(&self.coordinates).map(|(_, value)| value * value);
        priors.sum::<f64>()
            + self.statics(problem).sum_of_squares()
            + self.knowledge.sum_of_squares(&problem.sought.values(&self.coordinates))
    }

    fn statics<'a>(&self, problem: &'a Problem<'a>) -> Statics<'a> {
        let sought = problem.sought;
        Statics { problem, bushings: self.bushings(sought), calibration: self.calibration(sought) }
    }

    /// The normal equations of all unknowns.
    fn assemble<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &mut [Experiment<B>],
    ) -> Summary {
        let mut total = self.normal.clone();
        total.reset(problem.sought.unknowns());
        let mut summary = Summary::default();
        for experiment in experiments {
            summary.push(&self.assemble_record(problem, experiment, Unknowns::All));
            total.add_complement(&self.record, unknowns(problem.chain.joints().len()));
        }
        for (unknown, value) in problem.sought.priors(&self.coordinates) {
            total.add_prior(unknown, value);
        }
        self.statics(problem).add_to(&mut total);
        self.knowledge.add_to(&mut total, &problem.sought.values(&self.coordinates));
        self.normal = total;
        self.assembled = true;
        summary
    }

    /// The normal equations of one record, the seam eliminated.
    fn assemble_record<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &mut Experiment<B>,
        wanted: Unknowns,
    ) -> Residuals {
        let joints = problem.chain.joints().len();
        let standing = experiment.seam;
        let residuals = self.run(problem, experiment, wanted);
        let seam = unknowns(joints);
        self.record.prefer_small(&standing.to_solution(joints)[..seam], SMALL_SEAM);
        self.record.eliminate(seam);
        residuals
    }

    /// Fills the record's normal equations.
    fn run<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &mut Experiment<B>,
        unknowns: Unknowns,
    ) -> Residuals {
        let Problem { measurement, sought, .. } = *problem;
        let bushings = self.bushings(sought);
        let calibration = self.calibration(sought);
        let linear = problem.linearise(&experiment.pose, &bushings, &calibration);
        let strapdown = measurement.accelerometer == Accelerometer::Strapdown;
        let mounting = &measurement.mounting;
        let mut terms = Terms::mounted(&linear, &bushings, strapdown, mounting, &calibration);
        if sought.seeks_masses() {
            terms = terms.with_masses();
        }
        Assembly {
            terms: &terms,
            record: Bins::of(experiment),
            sought,
            calibration: &calibration,
            unknowns,
            normal: &mut self.record,
        }
        .run(problem.level)
    }

    /// The damped step within the bounds, and the gain it promises.
    fn propose(
        &self,
        problem: &Problem<'_>,
        normal: &ParameterNormal,
        damping: f64,
    ) -> ([f64; MAX_UNKNOWNS], f64) {
        let unknowns = normal.unknowns();
        let ranges = problem.sought.ranges(&self.coordinates, problem.bounds);
        // An unknown that would pass its bound, or go too far, is put there, and the others are solved for again.
        let mut put = [None; MAX_UNKNOWNS];
        let mut step = [0.0; MAX_UNKNOWNS];
        loop {
            let mut damped = normal.clone();
            for i in 0..unknowns {
                let diagonal = damped.entry(i, i);
                *diagonal += damping * (*diagonal + FLOOR) + FLOOR;
            }
            damped.fix(&put[..unknowns]);
            damped.eliminate(unknowns);
            damped.substitute(unknowns, &mut step);
            let mut beyond = false;
            for i in 0..unknowns {
                let [value, lower, upper] = ranges[i];
                let (least, most) = (lower - value, upper - value);
                let inside =
                    step[i].max(least.clamp(-LONGEST_STEP, 0.0)).min(most.clamp(0.0, LONGEST_STEP));
                if let Some(value) = put[i] {
                    step[i] = value;
                } else if inside != step[i] {
                    put[i] = Some(inside);
                    beyond = true;
                }
            }
            if !beyond {
                break;
            }
        }
        (step, normal.gain(&step))
    }
}

/// Standard deviation of each parameter's logarithm.
fn deviations(sought: &Sought, covariance: &Covariance) -> [f64; MAX_PARAMETERS] {
    let mut deviations = [0.0; MAX_PARAMETERS];
    for (index, unknown) in sought.sought() {
        if let Some(deviation) = deviations.get_mut(index) {
            *deviation = covariance.deviation(unknown);
        }
    }
    deviations
}
