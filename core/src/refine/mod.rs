//! Refinement: damped Gauss-Newton (Levenberg-Marquardt) in the logarithms of the parameters, with the exact
//! gradient, every bin weighted by its noise, and the seam of every record projected out.
//!
//! | file                                                           | what                                                    |
//! | -------------------------------------------------------------- | ------------------------------------------------------- |
//! | `objective`, `levenberg_marquardt`, `damping`, `proposal`      | a minimisation within bounds, independent of the robot  |
//! | `compliance`, `straight`                                       | compliances: steps along them, and what is straight     |
//! | `levels`                                                       | errors of the model that a fit allows for at first      |
//! | `problem`                                                      | the robot, the unknowns and their domain                |
//! | `sum_of_squares`, `corrected`, `others`, `statics`, `retired`  | the objective: records, priors, static tests, retired   |
//! | `record`, `basis`, `model`, `modelled`, `seam`                 | a part of a record, its seam projected out              |
//! | `equations`, `batch`, `rows`, `whitening`, `residuals`         | the rows of its bins                                    |
//! | `responses`                                                    | the same from the responses to unit loads               |
//! | `fit`, `summary`, `structure`, `leverage`, `information`       | the results of a fit                                    |
//! | `left_out`                                                     | each static test as all else predicts it                |
//! | `thinning`, `stagnation`                                       | fits that count some of the bins, or are given up       |
//! | `unexplained`                                                  | what a model leaves of a record, bin by bin             |
//! | `left_over`                                                    | where what is left is larger than elsewhere             |
//! | `plant`                                                        | a fit to a plant that is not perfect                    |
//!
//! One [`Refinement::step`] tries one step. It ends when the step that is left, without damping and within the bounds,
//! would lower the sum of squares by less than 1e-4: a hundredth of a standard deviation in all parameters together.

mod basis;
mod batch;
pub(crate) mod compliance;
mod corrected;
pub(crate) mod damping;
mod equations;
mod fit;
mod information;
mod left_out;
mod left_over;
pub(crate) mod levels;
mod levenberg_marquardt;
mod leverage;
mod model;
mod modelled;
mod objective;
mod others;
mod plant;
mod problem;
pub(crate) mod proposal;
mod record;
pub(crate) mod residuals;
mod responses;
mod retired;
mod rows;
pub(crate) mod seam;
mod seam_noise;
mod sizes;
mod stagnation;
mod statics;
mod straight;
mod structure;
mod sum_of_squares;
mod summary;
pub(crate) mod thinning;
mod unexplained;
mod whitening;

use heapless::Vec;

use crate::chain::linearise::LinearisationError;
use crate::parameters::Bushings;
use crate::sought::{Coordinate, Coordinates, MAX_UNKNOWNS, Sought};
use crate::spectrum::Experiment;
use crate::verdict::{self, Direction, MAX_DIRECTIONS};
use basis::Asked;
pub use basis::Basis;
pub use fit::Fit;
pub(crate) use fit::lies_on_bound;
pub use information::Information;
pub use left_over::{LeftOver, MAX_LEFT_OVER};
pub use levenberg_marquardt::Outcome;
pub(crate) use levenberg_marquardt::Remaining;
use levenberg_marquardt::{LevenbergMarquardt, Limits};
pub use plant::{
    Explanation, MAX_EXPLANATIONS, MAX_RIVALS, Mechanics, Places, Plant, PlantInformation,
    RetiredRecords,
};
pub use problem::Problem;
use record::Workspace;
pub use residuals::Agreement;
pub(crate) use retired::Retired;
use retired::RetiredInformation;
use sizes::PACKED;
pub(crate) use sizes::ParameterNormal;
pub(crate) use stagnation::{OF_BRANCH, Stagnation};
pub use structure::{Local, Structure};
use sum_of_squares::SumOfSquares;
pub use unexplained::BinLeft;
pub(crate) use unexplained::Unexplained;

/// Steps of a start without an equilibrium, each half the way to the stiffest robot. Chosen: after ten, a stiffness that was six decades lower
/// lies 1.3 % below its upper bound.
const MAX_STIFFENINGS: u32 = 10;

/// State of a refinement, in double precision.
#[derive(Clone, Debug)]
pub struct Refinement {
    coordinates: Coordinates,
    minimiser: LevenbergMarquardt<PACKED>,
    /// Distance of the bins that count.
    every: usize,
    workspace: Workspace,
    /// Information of the retired records.
    retired: RetiredInformation<PACKED>,
    /// Information of retired records, put aside while the kept records are fitted without it.
    aside: Option<RetiredInformation<PACKED>>,
    /// The information of the retired records is not that of a robot with the imperfections of the model.
    is_behind_retired: bool,
    /// Retired records have been dropped, which a plant still has.
    has_forgotten: bool,
}

impl Refinement {
    /// Refinement from a first guess, one bushing per joint.
    pub fn new(sought: &Sought, guess: &Bushings) -> Self {
        Self {
            coordinates: sought.coordinates(guess),
            minimiser: LevenbergMarquardt::new(Limits::OF_REFINEMENT),
            every: 1,
            workspace: Workspace::new(),
            retired: RetiredInformation::none(sought.unknowns()),
            aside: None,
            is_behind_retired: false,
            has_forgotten: false,
        }
    }

    /// Starts anew from `guess`.
    pub fn restart(&mut self, sought: &Sought, guess: &Bushings) {
        self.restart_at(&sought.coordinates(guess));
    }

    /// Starts anew from some coordinates.
    pub(crate) fn restart_at(&mut self, coordinates: &Coordinates) {
        self.restart_thinned(coordinates, 1);
    }

    /// Restarts as [`Refinement::restart_at`], with one bin out of `every`.
    pub(crate) fn restart_thinned(&mut self, coordinates: &Coordinates, every: usize) {
        self.coordinates = *coordinates;
        self.every = every;
        self.minimiser.restart();
    }

    /// Distance of the bins that count.
    pub(crate) fn every(&self) -> usize {
        self.every
    }

    /// Steps tried since the start.
    pub fn iterations(&self) -> u32 {
        self.minimiser.iterations
    }

    /// The parameters as they stand.
    pub fn bushings(&self, sought: &Sought) -> Bushings {
        sought.bushings(&self.coordinates)
    }

    /// The objective after the last step: sum of squares of residuals and priors. NaN before the first.
    pub(crate) fn objective(&self) -> f64 {
        if self.minimiser.linearised { self.minimiser.normal.sum_of_squares() } else { f64::NAN }
    }

    pub(crate) fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    /// Lends the memory of the normal equations. The next step assembles its own anew.
    pub(crate) fn memory(&mut self) -> &mut ParameterNormal {
        self.minimiser.linearised = false;
        &mut self.minimiser.normal
    }

    /// Combinations of the unknowns that the data determine badly, at the last [`Refinement::fit`]. A single undetermined unknown
    /// is one of them only if `asked`.
    pub(crate) fn weak_directions(
        &self,
        asked: impl Fn(usize) -> bool,
    ) -> Vec<Direction, MAX_DIRECTIONS> {
        verdict::weak_directions(&self.minimiser.normal, asked)
    }

    /// Tries one step, and keeps it if the sum of squares falls. A start that is too soft for gravity is made stiffer.
    pub fn step<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
    ) -> Outcome {
        let Self { coordinates, minimiser, workspace, retired, every, .. } = self;
        let mut objective = SumOfSquares::new(problem, experiments, retired, workspace, *every);
        match minimiser.step(problem, &mut objective, coordinates) {
            Ok(outcome) => outcome,
            Err(LinearisationError::NoEquilibrium(_) | LinearisationError::QuarterTurn(_)) => {
                self.stiffen(problem)
            }
            Err(_) => Outcome::Exhausted,
        }
    }

    /// Takes a [`Refinement::step`], unless the sum of squares at the start is larger than `most`: then it ends there, and has no normal
    /// equations.
    pub(crate) fn step_below<const B: usize>(
        &mut self,
        most: f64,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
    ) -> Outcome {
        let Self { coordinates, minimiser, workspace, retired, every, .. } = self;
        let mut objective = SumOfSquares::new(problem, experiments, retired, workspace, *every);
        let evaluated = minimiser.linearise_below(most, &mut objective, coordinates);
        if evaluated.is_ok() && !minimiser.linearised {
            return Outcome::Exhausted;
        }
        self.step(problem, experiments)
    }

    /// Moves half the way to the stiffest robot, by the logarithms: the step where gravity leaves no equilibrium.
    fn stiffen(&mut self, problem: &Problem<'_>) -> Outcome {
        if self.minimiser.iterations >= MAX_STIFFENINGS {
            return Outcome::Exhausted;
        }
        self.minimiser.iterations += 1;
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

    /// Returns the step without damping, within the bounds, from the last assembly, and its gain.
    pub(crate) fn remaining(&self, problem: &Problem<'_>) -> Remaining {
        self.minimiser.remaining(problem, &self.coordinates)
    }

    /// Squared distance to other coordinates in standard deviations: `Δθᵀ N Δθ`, the information N that of the last assembly. Undetermined
    /// directions add nothing.
    pub(crate) fn distance(&self, sought: &Sought, other: &Coordinates) -> f64 {
        self.minimiser.normal.quadratic(&self.apart(sought, other))
    }

    /// The least such distance for any values of the unknowns that are free.
    pub(crate) fn least_distance(
        &self,
        sought: &Sought,
        other: &Coordinates,
        is_free: impl Fn(usize) -> bool,
    ) -> f64 {
        self.minimiser.normal.least_quadratic(&self.apart(sought, other), is_free)
    }

    /// Δθ: the unknowns here less those at other coordinates.
    fn apart(&self, sought: &Sought, other: &Coordinates) -> [f64; MAX_UNKNOWNS] {
        let (own, other) = (sought.values(&self.coordinates), sought.values(other));
        core::array::from_fn(|i| own[i] - other[i])
    }

    /// Adds the information of a record that will not be kept to that of the retired ones, expanded where the first of them
    /// has retired.
    ///
    /// # Errors
    ///
    /// If the robot has no equilibrium there; then nothing is added.
    // Inlined, its normal equations would take room on the stack of the caller.
    #[inline(never)]
    pub fn retire<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &Experiment<B>,
    ) -> Result<(), LinearisationError> {
        let Self { workspace, retired, coordinates, .. } = self;
        let expanded = retired.expanded_at(problem.sought, coordinates);
        let mut own = ParameterNormal::new();
        own.reset(problem.sought.unknowns());
        let mut objective = SumOfSquares::new(problem, &[], retired, workspace, 1);
        objective.add_record(&expanded, (0, experiment), Asked::Fit, &mut own)?;
        retired.take_record(&own, problem.sought, &expanded);
        self.minimiser.linearised = false;
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
        self.retired = retired.information(sought.unknowns())?;
        self.aside = None;
        self.restart_at(coordinates);
        Some(())
    }

    /// Puts all retired records aside.
    pub(crate) fn set_retired_aside(&mut self, sought: &Sought) {
        let none = RetiredInformation::none(sought.unknowns());
        self.aside = Some(core::mem::replace(&mut self.retired, none));
        self.minimiser.linearised = false;
    }

    /// Takes back the retired records that were put aside, or drops them; returns how many were dropped.
    pub(crate) fn end_setting_aside(&mut self, take_back: bool) -> u64 {
        match self.aside.take() {
            Some(aside) if take_back => {
                self.retired = aside;
                self.minimiser.linearised = false;
                0
            }
            aside => {
                self.has_forgotten = true;
                aside.map_or(0, |aside| aside.records())
            }
        }
    }

    /// Number of retired records whose information the fit includes.
    pub fn retired(&self) -> u64 {
        self.retired.records()
    }

    /// Fisher information of an experiment at the present parameters, its seam projected out, of a robot with the imperfections of the model. A
    /// measured acceleration has an effect only through the fitted seam; of a planned experiment only the force is used.
    ///
    /// # Errors
    ///
    /// Returns an error if the pose is that of another chain, or if the robot has no equilibrium there.
    pub fn information<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &Experiment<B>,
        basis: Basis,
    ) -> Result<Information, LinearisationError> {
        let Self { coordinates, workspace, retired, .. } = self;
        let mut information = Information::none(problem.sought.unknowns());
        let mut objective = SumOfSquares::new(problem, &[], retired, workspace, 1);
        let asked = Asked::Information(basis);
        objective.add_record(coordinates, (0, experiment), asked, &mut information.normal)?;
        Ok(information)
    }
}

#[cfg(test)]
pub(crate) mod tests;
