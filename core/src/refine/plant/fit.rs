//! The minimum over unknowns and imperfections.

use super::super::Refinement;
use super::super::fit::{Assembled, Fit};
use super::super::levenberg_marquardt::{LevenbergMarquardt, Outcome, Remaining};
use super::super::model::Model;
use super::super::problem::Problem;
use super::super::proposal::FLOOR;
use super::super::sizes::ParameterNormal;
use super::super::sizes::{ALL, OF_ALL};
use super::super::stagnation::{OF_PLANT, Stagnation};
use super::super::statics::Statics;
use super::super::sum_of_squares::SumOfSquares;
use super::super::thinning::{self, residuals};
use super::Plant;
use super::domain::{PlantDomain, Point};
use super::factors::Restated;
use super::objective::OfPlant;
use super::retired::RetiredOfPlant;
use crate::chain::linearise::LinearisationError;
use crate::imperfection::{self, Correction, Imperfection, MAX_IMPERFECTIONS};
use crate::linear::normal::Normal;
use crate::sought::{Coordinates, MAX_UNKNOWNS};
use crate::spectrum::{Experiment, Site};
use crate::verdict::FOREIGN;

impl Refinement {
    /// Goes to the parameters where this refinement stands, with so many records, and to the imperfections of its model. The robot `feeds` in one of
    /// the records: where it stands in all, retired ones included, the delay of the joint angles has no effect.
    pub(crate) fn restart_plant(&self, plant: &mut Plant, records: usize, feeds: bool) {
        plant.point =
            Point { coordinates: self.coordinates, imperfections: [0.0; MAX_IMPERFECTIONS] };
        let mut all = imperfection::all(&plant.accuracies, &plant.joints, records);
        let retired = plant.retired.as_ref();
        if !feeds && !retired.is_some_and(|own| own.shows(Imperfection::JointDelay)) {
            all.retain(|(own, _)| *own != Imperfection::JointDelay);
        }
        plant.imperfections.all = all;
        plant.go_to(&self.workspace.correction);
        plant.restated = Restated::default();
        plant.stagnation = Stagnation::new(OF_PLANT);
        plant.minimiser.restart();
        plant.end_levels();
        plant.every = 1;
    }

    /// Restarts as [`Refinement::restart_plant`], for a fit to these experiments.
    pub(crate) fn restart_plant_to<const B: usize>(
        &self,
        plant: &mut Plant,
        experiments: &[Experiment<B>],
    ) {
        self.restart_plant(plant, experiments.len(), experiments.iter().any(Experiment::feeds));
    }

    /// Restarts as [`Refinement::restart_plant`], where a minimum may be a wrong one: the fit counts some of the bins at first.
    pub(crate) fn restart_plant_thinned<const B: usize>(
        &self,
        plant: &mut Plant,
        experiments: &[Experiment<B>],
    ) {
        self.restart_plant_to(plant, experiments);
        plant.thin(thinning::distance(experiments));
    }

    /// Restarts as [`Refinement::restart_plant_thinned`], where a descent has ended: the fit also allows for errors of the model at first.
    pub(crate) fn restart_plant_from_descent<const B: usize>(
        &self,
        plant: &mut Plant,
        experiments: &[Experiment<B>],
    ) {
        self.restart_plant_thinned(plant, experiments);
        plant.begin_levels();
    }

    /// The model has the imperfections of a plant.
    pub(crate) fn is_corrected(&self) -> bool {
        !self.workspace.correction.is_none()
    }

    /// The imperfections of the model.
    pub(crate) fn correction(&self) -> &Correction {
        &self.workspace.correction
    }

    /// Gives the model these imperfections from now on. The refinement stays where it is.
    pub(crate) fn set_correction(&mut self, correction: &Correction) {
        self.workspace.correction.clone_from(correction);
        self.minimiser.linearised = false;
        self.is_behind_retired = true;
    }

    /// The domain of a fit, its sum of squares, its minimisation, and where it stands.
    pub(super) fn minimisation<'a, const B: usize>(
        &'a mut self,
        problem: &'a Problem<'_>,
        experiments: &'a [Experiment<B>],
        plant: &'a mut Plant,
    ) -> (
        PlantDomain<'a>,
        SumOfSquares<'a, OfPlant<'a>, B>,
        &'a mut LevenbergMarquardt<OF_ALL>,
        &'a mut Point,
    ) {
        let Plant { imperfections, minimiser, point, record, summary, retired, .. } = plant;
        self.minimiser.linearised = false;
        let domain = PlantDomain::new(problem, &imperfections.all);
        let (retired, workspace) = (retired.as_ref(), &mut self.workspace);
        let fitted = OfPlant { retired, workspace, imperfections, record, summary };
        let (relative_error, every) = (plant.relative_error, plant.every);
        let objective = SumOfSquares { problem, experiments, fitted, relative_error, every };
        (domain, objective, minimiser, point)
    }

    /// Tries one step over unknowns and imperfections, by Levenberg and Marquardt's method. The refinement stays where it is. Where the
    /// fit has ended, it may go on: with all bins, or with accuracies restated that the data contradict. Where a level ends, the movement in the parts
    /// of divided experiments becomes that of the plant.
    pub(crate) fn step_plant<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &mut [Experiment<B>],
        plant: &mut Plant,
    ) -> Outcome {
        let (domain, mut objective, minimiser, point) =
            self.minimisation(problem, experiments, plant);
        let standing = minimiser.linearised.then(|| minimiser.normal.sum_of_squares());
        let outcome = minimiser.step(&domain, &mut objective, point).unwrap_or(Outcome::Exhausted);
        if plant.go_on_to_next_level(outcome, standing.unwrap_or(f64::INFINITY)) {
            self.follow_movement(problem, Some(plant), experiments);
            return Outcome::Improving;
        }
        if outcome == Outcome::Improving {
            return outcome;
        }
        self.end_or_go_on(problem, experiments, plant, outcome)
    }

    /// Ends a fit or goes on. Where some of the bins count and what it has found may explain the records, it goes on with all of them, and takes
    /// a new damping if it was stuck. Else, once, accuracies are restated that the data contradict, by all bins, and it goes on with as many as
    /// before.
    fn end_or_go_on<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        plant: &mut Plant,
        outcome: Outcome,
    ) -> Outcome {
        plant.stagnation = Stagnation::new(OF_PLANT);
        let every = plant.every;
        let may_explain =
            plant.minimiser.linearised && plant.may_explain(residuals(problem, experiments, every));
        if plant.count_all_bins() {
            if may_explain {
                if outcome == Outcome::Exhausted {
                    plant.minimiser.restart();
                }
                return Outcome::Improving;
            }
            let (_, mut objective, minimiser, point) =
                self.minimisation(problem, experiments, plant);
            // Without derivatives there the fit has none.
            let _ = minimiser.linearise(&mut objective, point);
        }
        if plant.restate_accuracies() {
            plant.every = every;
            return Outcome::Improving;
        }
        outcome
    }

    /// Takes a [`Refinement::step_plant`]. A fit that stagnates is given up, unless it may go on ([`Refinement::end_or_go_on`]).
    pub(crate) fn step_plant_or_give_up<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &mut [Experiment<B>],
        plant: &mut Plant,
    ) -> Outcome {
        let outcome = self.step_plant(problem, experiments, plant);
        let target = FOREIGN * residuals(problem, experiments, plant.every) as f64;
        let least_gain = plant.least_gain();
        let sum_of_squares = plant.minimiser.normal.sum_of_squares();
        // Where the fit has gone on to another level, or with other accuracies, sums of squares do not compare.
        let compares = plant.minimiser.linearised && plant.is_on_last_level();
        if outcome == Outcome::Improving
            && compares
            && plant.stagnation.ends_fit(sum_of_squares, target, least_gain)
        {
            return self.end_or_go_on(problem, experiments, plant, Outcome::Exhausted);
        }
        outcome
    }

    /// Evaluates the fit where the plant stands, and goes there. Fisher information and covariance are those that hold
    /// whatever the imperfections are. Returns also the way that is left to the minimum. Returns `None` where gravity leaves the robot
    /// no equilibrium.
    pub(crate) fn fit_plant<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        plant: &mut Plant,
    ) -> Option<(Fit, Remaining)> {
        let Remaining { step, gain } = plant.remaining(problem)?;
        let count = plant.imperfections.all.len();
        let mut of_unknowns = [0.0; MAX_UNKNOWNS];
        of_unknowns.copy_from_slice(&step[count..count + MAX_UNKNOWNS]);
        self.go_where_plant_stands(problem, plant);
        let assembled = Assembled {
            summary: plant.summary.clone(),
            of_statics: plant.statics(problem).sum_of_squares(),
            of_retired: plant.sum_of_retired(problem),
            // The minimum from which the fit has begun has been compared with them.
            contradiction: 0.0,
        };
        let fit = self.fit_of(problem, experiments, Some(plant), Ok(assembled));
        Some((fit, Remaining { step: of_unknowns, gain }))
    }

    /// Takes the unknowns of a plant, and its equations, the imperfections eliminated.
    pub(super) fn go_where_plant_stands(&mut self, problem: &Problem<'_>, plant: &mut Plant) {
        plant.determine();
        self.coordinates = plant.point.coordinates;
        self.minimiser.normal.reset(problem.sought.unknowns());
        plant.eliminate_from(&mut self.minimiser.normal);
    }
}

impl Plant {
    /// The model where the fit stands, in a record of this number at a site.
    pub(in super::super) fn model(
        &self,
        problem: &Problem<'_>,
        site: Site<'_>,
        record: usize,
    ) -> Result<Model, LinearisationError> {
        self.imperfections.model(problem, &self.point, site, record)
    }

    /// The static tests of a problem where the plant stands, which also seek its imperfections.
    pub(in crate::refine) fn statics<'a>(&'a self, problem: &'a Problem<'_>) -> Statics<'a> {
        self.imperfections.statics(problem, &self.point)
    }

    /// The static tests of a problem where the plant stands, and the normal equations of its last fit, to be changed.
    pub(in crate::refine) fn statics_and_factor<'a>(
        &'a mut self,
        problem: &'a Problem<'_>,
    ) -> (Statics<'a>, &'a mut Normal<OF_ALL>) {
        let Self { imperfections, point, minimiser, factor, .. } = self;
        factor.clone_from(&minimiser.normal);
        (imperfections.statics(problem, point), factor)
    }

    /// Sum of squares of the retired records where the plant stands.
    fn sum_of_retired(&self, problem: &Problem<'_>) -> f64 {
        let Self { imperfections, point, retired, .. } = self;
        let of = |retired: &RetiredOfPlant| {
            retired.sum_of_squares(problem.sought, point, &imperfections.all)
        };
        retired.as_ref().map_or(0.0, of)
    }

    /// The way that is left to the minimum. `None` where the fit has no derivatives.
    fn remaining(&self, problem: &Problem<'_>) -> Option<Remaining<ALL>> {
        let Self { imperfections, minimiser, point, .. } = self;
        let domain = PlantDomain::new(problem, &imperfections.all);
        minimiser.linearised.then(|| minimiser.remaining(&domain, point))
    }

    /// Goes on from where it stands with a fit that has had its steps. Returns whether it has.
    pub(crate) fn prolong(&mut self) -> bool {
        let has_run_out = self.minimiser.has_run_out();
        if has_run_out {
            self.minimiser.restart();
        }
        has_run_out
    }

    /// The parameters where the last fit has ended.
    pub(crate) fn coordinates(&self) -> Coordinates {
        self.point.coordinates
    }

    /// Adds the normal equations of the unknowns, the imperfections eliminated.
    fn eliminate_from(&mut self, unknowns: &mut ParameterNormal) {
        let Self { imperfections, minimiser, factor, .. } = self;
        let count = imperfections.all.len();
        factor.clone_from(&minimiser.normal);
        factor.eliminate(count);
        unknowns.add_complement(factor, count);
    }

    /// Computes the standard deviation of each imperfection, in that of its prior: `|u|` with `L u = e`, and the factor L of the
    /// information of imperfections and unknowns, to which an undetermined unknown adds a floor.
    pub(super) fn determine(&mut self) {
        let Self { imperfections, minimiser, factor, .. } = self;
        let (count, total) = (imperfections.all.len(), minimiser.normal.unknowns());
        factor.clone_from(&minimiser.normal);
        for i in count..total {
            *factor.entry(i, i) += FLOOR;
        }
        factor.eliminate(total);
        for index in 0..count {
            self.deviations[index] = libm::sqrt(self.forward(index).iter().map(|u| u * u).sum());
        }
    }

    /// u of `L u = e`, where e is 1 for an imperfection alone, after [`Plant::determine`].
    pub(super) fn forward(&self, index: usize) -> [f64; ALL] {
        let mut u = [0.0; ALL];
        for i in index..self.factor.unknowns() {
            let row = self.factor.row(i);
            let known: f64 = row[index..i].iter().zip(&u[index..i]).map(|(l, u)| l * u).sum();
            let own = if i == index { 1.0 } else { 0.0 };
            u[i] = if row[i] > 0.0 { (own - known) / row[i] } else { 0.0 };
        }
        u
    }
}

#[cfg(test)]
mod tests;
