//! The objective of a refinement: the sum of squares of records, static tests, priors, and what is retired.

use super::batch::Bins;
use super::equations::Equations;
use super::modelled::Place;
use super::objective::Objective;
use super::others::Others;
use super::problem::Problem;
use super::record::Workspace;
use super::residuals::Residuals;
use super::retired::RetiredInformation;
use super::sizes::{PACKED, ParameterNormal};
use super::statics::Statics;
use super::summary::Summary;
use crate::chain::linearise::LinearisationError;
use crate::sought::Coordinates;
use crate::spectrum::Experiment;

/// The sum of squares of a fit. The seams of the records are fitted at every point.
pub(super) struct SumOfSquares<'a, const B: usize> {
    problem: &'a Problem<'a>,
    experiments: &'a [Experiment<B>],
    retired: &'a RetiredInformation<PACKED>,
    workspace: &'a mut Workspace,
    /// Distance of the bins that count.
    every: usize,
}

impl<const B: usize> Objective<Coordinates, PACKED> for SumOfSquares<'_, B> {
    type Error = LinearisationError;

    fn cost(&mut self, coordinates: &Coordinates) -> f64 {
        let retired = self.retired.sum_at(self.problem.sought, coordinates);
        self.fit_seams(coordinates) + (self.others(coordinates).sum_of_squares() + retired)
    }

    fn linearise(
        &mut self,
        coordinates: &Coordinates,
        normal: &mut ParameterNormal,
    ) -> Result<(), LinearisationError> {
        let Self { problem, experiments, workspace, every, .. } = self;
        normal.reset(problem.sought.unknowns());
        workspace.summary = Summary::default();
        let mut seams = 0..;
        for (record, experiment) in experiments.iter().enumerate() {
            let mut residuals = Residuals::default();
            for (part, number) in experiment.parts().zip(&mut seams) {
                let place = Place { coordinates, site: part.site, record };
                let model = workspace.model(problem, place)?;
                let bins = || Bins::thinned(experiment, &part, *every);
                let seam = match workspace.seams.get(number) {
                    Some(seam) => *seam,
                    None => workspace.fit_seam(problem, &model, bins()).0,
                };
                let equations = Equations::All(&seam);
                residuals.add(&workspace.assemble(problem, (place, &model), bins(), equations)?);
                normal.add_complement(&workspace.record, problem.seam_unknowns());
            }
            workspace.summary.push(&residuals, experiment.is_whole());
        }
        self.others(coordinates).add_to(normal)?;
        let Self { problem, retired, .. } = self;
        retired.add_at(normal, problem.sought, coordinates);
        Ok(())
    }
}

impl<'a, const B: usize> SumOfSquares<'a, B> {
    /// The objective of one out of `every` bin of these experiments. Seams of others are forgotten.
    pub(super) fn new(
        problem: &'a Problem<'a>,
        experiments: &'a [Experiment<B>],
        retired: &'a RetiredInformation<PACKED>,
        workspace: &'a mut Workspace,
        every: usize,
    ) -> Self {
        workspace.seams.clear();
        Self { problem, experiments, retired, workspace, every }
    }

    /// Priors and static tests, of a robot with the imperfections of the model.
    fn others(&self, coordinates: &Coordinates) -> Others<'a> {
        let correction = self.workspace.correction.values().iter().copied();
        Others::new(self.problem, coordinates, Statics::at(self.problem, coordinates, correction))
    }

    /// Finds the seams that fit best. Returns the sum of squares that remains, infinite where gravity leaves the robot no
    /// equilibrium.
    fn fit_seams(&mut self, coordinates: &Coordinates) -> f64 {
        self.workspace.seams.clear();
        let mut sum_of_squares = 0.0;
        for (record, experiment) in self.experiments.iter().enumerate() {
            for part in experiment.parts() {
                let place = Place { coordinates, site: part.site, record };
                let model = self.workspace.model(self.problem, place);
                let Ok(model) = model else { return f64::INFINITY };
                let bins = Bins::thinned(experiment, &part, self.every);
                let (seam, remaining) = self.workspace.fit_seam(self.problem, &model, bins);
                // A seam for which there is no room is fitted again.
                let _ = self.workspace.seams.push(seam);
                sum_of_squares += remaining;
            }
        }
        sum_of_squares
    }
}
