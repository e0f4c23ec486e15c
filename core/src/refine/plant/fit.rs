//! The minimum over unknowns and imperfections.

use super::super::levenberg_marquardt::{Outcome, Remaining};
use super::super::proposal::FLOOR;
use super::super::{Fit, ParameterNormal, Problem, Refinement};
use super::objective::{PlantDomain, PlantSumOfSquares, Point};
use super::restated::Restated;
use super::sizes::ALL;
use super::stagnation::Stagnation;
use super::{Correction, Plant};
use crate::imperfection::{self, MAX_IMPERFECTIONS};
use crate::sought::{Coordinates, MAX_UNKNOWNS};
use crate::spectrum::Experiment;

impl Refinement {
    /// Goes to the parameters where this refinement stands, with so many records, and to the imperfections of its model.
    pub(crate) fn restart_plant(&self, plant: &mut Plant, records: usize) {
        plant.point =
            Point { coordinates: self.coordinates, imperfections: [0.0; MAX_IMPERFECTIONS] };
        plant.imperfections.all = imperfection::all(&plant.accuracies, &plant.joints, records);
        plant.go_to(&self.workspace.correction);
        plant.restated = Restated::default();
        plant.stagnation = Stagnation::NONE;
        plant.minimiser.restart();
        plant.end_levels();
        plant.count_all_bins();
    }

    /// As [`Refinement::restart_plant`], where a minimum may be a wrong one: the fit counts some of the bins at first.
    pub(crate) fn restart_plant_thinned<const B: usize>(
        &self,
        plant: &mut Plant,
        experiments: &[Experiment<B>],
    ) {
        self.restart_plant(plant, experiments.len());
        plant.thin(experiments.iter().map(Experiment::bins).min().unwrap_or(0));
    }

    /// As [`Refinement::restart_plant_thinned`], where a descent has ended: the fit also allows for errors of the model at first.
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

    /// From now on the model has these imperfections. The refinement stays where it is.
    pub(crate) fn set_correction(&mut self, correction: &Correction) {
        self.workspace.correction.clone_from(correction);
        self.minimiser.linearised = false;
    }

    /// Tries one step over unknowns and imperfections, by Levenberg and Marquardt's method. The refinement stays where it is. Where the
    /// fit has ended, it may go on: with all bins, or with accuracies restated that the data contradict.
    pub(crate) fn step_plant<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        plant: &mut Plant,
    ) -> Outcome {
        let Plant {
            imperfections, minimiser, point, record, relative_error, every, summary, ..
        } = plant;
        let domain = PlantDomain::new(problem, &imperfections.all);
        self.minimiser.linearised = false;
        let mut objective = PlantSumOfSquares {
            problem,
            experiments,
            retired: &self.retired,
            workspace: &mut self.workspace,
            imperfections,
            record,
            others: &mut self.minimiser.normal,
            relative_error: *relative_error,
            every: *every,
            summary,
        };
        let standing = minimiser.linearised.then(|| minimiser.normal.sum_of_squares());
        let outcome = minimiser.step(&domain, &mut objective, point).unwrap_or(Outcome::Exhausted);
        if plant.go_on_to_next_level(outcome, standing.unwrap_or(f64::INFINITY)) {
            return Outcome::Improving;
        }
        if outcome != Outcome::Improving && plant.goes_on_after(outcome) {
            return Outcome::Improving;
        }
        outcome
    }

    /// As [`Refinement::step_plant`]. A fit that stagnates is given up, unless the data contradict accuracies.
    pub(crate) fn step_plant_or_give_up<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        plant: &mut Plant,
    ) -> Outcome {
        let outcome = self.step_plant(problem, experiments, plant);
        let bins = |experiment: &Experiment<B>| experiment.bins().div_ceil(plant.every);
        let residuals = experiments.iter().map(|experiment| 6 * bins(experiment)).sum();
        let sum_of_squares = plant.minimiser.normal.sum_of_squares();
        // Where the fit has gone on to another level, or with other accuracies, sums of squares do not compare.
        let compares = plant.minimiser.linearised && plant.is_on_last_level();
        if outcome == Outcome::Improving
            && compares
            && plant.stagnation.ends_fit(sum_of_squares, residuals)
        {
            let goes_on = plant.goes_on_after(Outcome::Exhausted);
            return if goes_on { Outcome::Improving } else { Outcome::Exhausted };
        }
        outcome
    }

    /// Evaluates the fit where the plant stands, and goes there. Fisher information and covariance are those that hold whatever the
    /// imperfections are. Returns also the way that is left to the minimum. Returns `None` where gravity leaves the robot no
    /// equilibrium.
    pub(crate) fn fit_plant<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiments: &[Experiment<B>],
        plant: &mut Plant,
    ) -> Option<(Fit, Remaining)> {
        if !plant.minimiser.linearised {
            return None;
        }
        let count = plant.imperfections.all.len();
        let domain = PlantDomain::new(problem, &plant.imperfections.all);
        let Remaining::<ALL> { step, gain } = plant.minimiser.remaining(&domain, &plant.point);
        let mut of_unknowns = [0.0; MAX_UNKNOWNS];
        of_unknowns.copy_from_slice(&step[count..count + MAX_UNKNOWNS]);
        plant.determine();
        self.coordinates = plant.point.coordinates;
        self.minimiser.normal.reset(problem.sought.unknowns());
        plant.eliminate_from(&mut self.minimiser.normal);
        let fit = self.fit_of(problem, experiments, Ok(plant.summary.clone()));
        Some((fit, Remaining { step: of_unknowns, gain }))
    }
}

impl Plant {
    /// Whether the fit goes on after it has ended with this outcome. From a minimum of some of the bins it goes on with all of them.
    /// Accuracies that the data contradict are restated, once. A fit that has then come to no minimum of some of the bins takes one last
    /// step, with all of them.
    pub(super) fn goes_on_after(&mut self, outcome: Outcome) -> bool {
        self.stagnation = Stagnation::NONE;
        if outcome == Outcome::Converged && self.count_all_bins() || self.restate_accuracies() {
            return true;
        }
        self.stagnation = Stagnation::END;
        self.count_all_bins()
    }

    /// Goes on with a fit that has had its steps, from where it stands.
    pub(crate) fn prolong(&mut self) {
        self.minimiser.restart();
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
