//! Refinement: damped Gauss-Newton (Levenberg-Marquardt) in the logarithms of the parameters, with the exact
//! gradient, every bin weighted by its noise, and the seam of every record projected out.
//!
//! One [`Refinement::step`] tries one step. It ends when the step that is left, without damping and within the bounds,
//! would lower the sum of squares by less than 1e-4: a hundredth of a standard deviation in all parameters together.

mod assembly;
mod batch;
pub(crate) mod compliance;
mod equations;
mod fit;
mod information;
pub(crate) mod proposal;
pub(crate) mod residuals;
mod retired;
mod rows;
pub(crate) mod seam;
mod statics;
mod summary;
mod whitening;

use fearless_simd::Level;
use heapless::Vec;

use crate::calibration::Calibration;
use crate::chain::Chain;
use crate::chain::linearise::{LinearChain, LinearisationError};
use crate::linear::normal::Normal;
use crate::linear::packed::packed;
use crate::parameters::{Bounds, Bushings};
use crate::search::MAX_EXPERIMENTS;
use crate::sought::{Coordinate, Coordinates, MAX_UNKNOWNS, Sought};
use crate::spectrum::{Experiment, Measurement};
use crate::statics::StaticTest;
use crate::verdict::{self, Direction, MAX_DIRECTIONS};
use equations::{RecordNormal, Unknowns};
pub use fit::Fit;
pub(crate) use fit::lies_on_bound;
pub use information::Information;
pub use residuals::Agreement;
pub(crate) use retired::Retired;
use retired::RetiredInformation;
use seam::Seam;

/// Predicted gain in the sum of squares (whose expectation is its degrees of freedom) that ends the refinement.
const NEGLIGIBLE: f64 = 1e-4;
/// First damping, relative to the information of each parameter.
const FIRST_DAMPING: f64 = 1e-2;
/// The damping at which nothing moves any more.
const LAST_DAMPING: f64 = 1e8;
/// How often a start without an equilibrium goes half the way to the stiffest robot: ten times leave a hundredth of six decades.
const MAX_STIFFENINGS: u32 = 10;
/// Steps after which a refinement ends wherever it is.
const MAX_ITERATIONS: u32 = 100;

/// The inputs of a refinement.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a> {
    /// The robot.
    pub chain: &'a Chain,
    /// What was measured.
    pub measurement: &'a Measurement,
    /// Where the parameters may lie.
    pub bounds: &'a Bounds,
    /// The unknowns.
    pub sought: &'a Sought,
    /// Static tests, [checked](crate::statics::check), which are fitted with the records.
    pub statics: &'a [StaticTest],
    /// Instruction set.
    pub level: Level,
}

impl Problem<'_> {
    /// Real unknowns of the seam of each record.
    pub(crate) fn seam_unknowns(&self) -> usize {
        seam::unknowns(self.chain.joints().len(), self.measurement.feels_gravity())
    }

    /// The chain at a pose, with the masses that it is taken to have.
    pub(crate) fn linearise(
        &self,
        pose: &[f64],
        bushings: &Bushings,
        calibration: &Calibration,
    ) -> Result<LinearChain, LinearisationError> {
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
    /// No step would gain anything, however little it is damped.
    Converged,
    /// It has had its steps, or those that promise a gain are no good: it may not be at a minimum.
    Exhausted,
}

/// The way to the minimum of the quadratic that the normal equations describe.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Remaining {
    /// Of the unknowns.
    pub(crate) step: [f64; MAX_UNKNOWNS],
    /// By how much it would lower the sum of squares.
    pub(crate) gain: f64,
}

pub(crate) type ParameterNormal = Normal<{ packed(MAX_UNKNOWNS + 1) }>;

/// State of a refinement, in double precision.
#[derive(Clone, Debug)]
pub struct Refinement {
    coordinates: Coordinates,
    /// Normal equations at `coordinates`, the seams projected out.
    normal: ParameterNormal,
    record: RecordNormal,
    /// Seams of the records at the parameters that were tried last; of the first records, as many as there is room for.
    seams: Vec<Seam, MAX_EXPERIMENTS>,
    /// Information of the retired records.
    retired: RetiredInformation,
    /// Information of retired records, put aside while the kept records are fitted without it.
    shelf: Option<RetiredInformation>,
    assembled: bool,
    damping: f64,
    /// The last trial step was rejected; a less damped one goes further, and would be as well.
    refused: bool,
    iterations: u32,
}

impl Refinement {
    /// From a first guess, one bushing per joint.
    pub fn new(sought: &Sought, guess: &Bushings) -> Self {
        Self {
            coordinates: sought.coordinates(guess),
            normal: Normal::new(),
            record: Normal::new(),
            seams: Vec::new(),
            retired: RetiredInformation::none(sought.unknowns()),
            shelf: None,
            assembled: false,
            damping: FIRST_DAMPING,
            refused: false,
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
        self.refused = false;
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

    /// The objective after the last step: sum of squares of residuals and priors. NaN before the first.
    pub(crate) fn objective(&self) -> f64 {
        if self.assembled { self.normal.sum_of_squares() } else { f64::NAN }
    }

    pub(crate) fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    /// Lends the memory of the normal equations. The next step assembles its own anew.
    pub(crate) fn room(&mut self) -> &mut ParameterNormal {
        self.assembled = false;
        &mut self.normal
    }

    /// Combinations of the unknowns that the data determine badly, at the last [`Refinement::fit`]. A single undetermined unknown
    /// is one of them only if `asked`.
    pub(crate) fn weak_directions(
        &self,
        asked: impl Fn(usize) -> bool,
    ) -> Vec<Direction, MAX_DIRECTIONS> {
        verdict::weak_directions(&self.normal, asked)
    }

    /// Tries one step, and keeps it if the sum of squares falls. A start that is too soft for gravity is made stiffer.
    pub fn step<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
    ) -> Outcome {
        if !self.assembled {
            self.fit_seams(problem, experiments);
            match self.assemble(problem, experiments) {
                Ok(_) => {}
                Err(LinearisationError::NoEquilibrium(_) | LinearisationError::QuarterTurn(_)) => {
                    return self.stiffen(problem);
                }
                Err(_) => return Outcome::Exhausted,
            }
        }
        self.iterations += 1;
        let before = self.coordinates;
        let standing = self.normal.sum_of_squares();
        let (step, predicted) = self.propose(problem, &self.normal, self.damping);
        if predicted < NEGLIGIBLE {
            // A damped step that gains nothing says little: what counts is the step without damping.
            if self.remaining(problem).gain < NEGLIGIBLE {
                return Outcome::Converged;
            }
            if self.refused {
                return Outcome::Exhausted;
            }
            self.damping *= 0.1;
            return self.unless_exhausted();
        }
        self.advance(problem, &step);
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
            self.refused = false;
            if self.assemble(problem, experiments).is_err() {
                return Outcome::Exhausted;
            }
        } else {
            self.coordinates = before;
            self.refused = true;
            self.damping *= 10.0;
        }
        self.unless_exhausted()
    }

    /// Takes a step of the linearised problem.
    fn advance(&mut self, problem: &Problem<'_>, step: &[f64; MAX_UNKNOWNS]) {
        let ranges = problem.sought.ranges(&self.coordinates, problem.bounds);
        let moved = compliance::logarithms(problem.sought, &ranges, step);
        problem.sought.advance(&mut self.coordinates, &moved);
    }

    /// Moves half the way to the stiffest robot, by the logarithms: the step where gravity leaves no equilibrium.
    fn stiffen(&mut self, problem: &Problem<'_>) -> Outcome {
        if self.iterations >= MAX_STIFFENINGS {
            return Outcome::Exhausted;
        }
        self.iterations += 1;
        let sought = problem.sought;
        let ranges = sought.ranges(&self.coordinates, problem.bounds);
        let mut step = [0.0; MAX_UNKNOWNS];
        for (unknown, [value, _, upper]) in ranges.into_iter().take(sought.unknowns()).enumerate() {
            if let Some(Coordinate::Stiffness { .. }) = sought.coordinate(unknown) {
                step[unknown] = 0.5 * (upper - value);
            }
        }
        sought.advance(&mut self.coordinates, &step);
        Outcome::Improving
    }

    /// What a step without damping, within the bounds, would gain from where the last assembly was.
    pub(crate) fn remaining(&self, problem: &Problem<'_>) -> Remaining {
        let (step, gain) = self.propose(problem, &self.normal, 0.0);
        Remaining { step, gain }
    }

    /// How far other coordinates lie from these: `Δθᵀ N Δθ`, the information N that of the last assembly. The square of a
    /// distance in standard deviations; undetermined directions add nothing.
    pub(crate) fn distance(&self, sought: &Sought, other: &Coordinates) -> f64 {
        let (own, other) = (sought.values(&self.coordinates), sought.values(other));
        let apart: [f64; MAX_UNKNOWNS] = core::array::from_fn(|i| own[i] - other[i]);
        self.normal.quadratic(&apart)
    }

    fn unless_exhausted(&self) -> Outcome {
        if self.damping > LAST_DAMPING || self.iterations >= MAX_ITERATIONS {
            Outcome::Exhausted
        } else {
            Outcome::Improving
        }
    }

    /// Adds the information of a record that will not be kept to that of the retired ones, linearised at the present parameters.
    ///
    /// # Errors
    ///
    /// If the robot has no equilibrium there; then nothing is added.
    pub fn retire<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &Experiment<B>,
    ) -> Result<(), LinearisationError> {
        self.assemble_fitted(problem, experiment)?;
        let values = problem.sought.values(&self.coordinates);
        let seam = problem.seam_unknowns();
        self.retired.take(&self.record, seam, &values);
        self.assembled = false;
        Ok(())
    }

    /// The information of the retired records, to be stored.
    pub(crate) fn retired_records(&self) -> Retired {
        self.retired.retired()
    }

    /// Goes to some coordinates, with these retired records. `None` if they are of other unknowns; then nothing has changed.
    pub(crate) fn resume(
        &mut self,
        sought: &Sought,
        coordinates: &Coordinates,
        retired: &Retired,
    ) -> Option<()> {
        self.retired = RetiredInformation::of(retired, sought.unknowns())?;
        self.shelf = None;
        self.restart_at(coordinates);
        Some(())
    }

    /// Puts all retired records aside.
    pub(crate) fn shelve(&mut self, sought: &Sought) {
        let none = RetiredInformation::none(sought.unknowns());
        self.shelf = Some(core::mem::replace(&mut self.retired, none));
        self.assembled = false;
    }

    /// Takes back the retired records that were put aside, or drops them; returns how many were dropped.
    pub(crate) fn unshelve(&mut self, take_back: bool) -> u64 {
        match self.shelf.take() {
            Some(shelved) if take_back => {
                self.retired = shelved;
                self.assembled = false;
                0
            }
            shelved => shelved.map_or(0, |shelved| shelved.records()),
        }
    }

    /// Number of retired records whose information the fit includes.
    pub fn retired(&self) -> u64 {
        self.retired.records()
    }

    /// Fisher information of a measured experiment at the present parameters, its seam projected out. The measured acceleration
    /// enters by the seam alone.
    ///
    /// # Errors
    ///
    /// If the robot has no equilibrium there.
    pub fn information<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &Experiment<B>,
    ) -> Result<Information, LinearisationError> {
        let (seam, _) = self.fit_seam(problem, experiment)?;
        self.information_at(problem, experiment, &seam)
    }

    /// Fisher information of a planned experiment at the present parameters, its seam projected out: of a record of the force
    /// alone, with zero acceleration. The motion is taken to be periodic, without a seam.
    ///
    /// # Errors
    ///
    /// If the robot has no equilibrium there.
    pub fn information_planned<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &Experiment<B>,
    ) -> Result<Information, LinearisationError> {
        self.information_at(problem, experiment, &Seam::default())
    }

    fn information_at<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &Experiment<B>,
        seam: &Seam,
    ) -> Result<Information, LinearisationError> {
        self.assemble_record(problem, experiment, seam, Unknowns::Foretold)?;
        let seam = problem.seam_unknowns();
        Ok(Information::of_complement(&self.record, seam, problem.sought))
    }
}

#[cfg(test)]
pub(crate) mod tests;
