//! The sum of squares over unknowns and imperfections.

use super::super::basis::Asked;
use super::super::batch::Bins;
use super::super::equations::{Assembly, Equations};
use super::super::model::Model;
use super::super::objective::Objective;
use super::super::others::Others;
use super::super::problem::Problem;
use super::super::record::Workspace;
use super::super::residuals::Residuals;
use super::super::seam::Seam;
use super::super::sizes::{OF_ALL, WIDE, WIDE_OF_RECORD};
use super::super::statics::Statics;
use super::super::summary::Summary;
use super::domain::Point;
use super::imperfections::Imperfections;
use super::retired::RetiredOfPlant;
use crate::chain::linearise::LinearisationError;
use crate::linear::normal::Normal;
use crate::spectrum::{Experiment, Part};

/// A part of a record.
pub(super) struct PartOf<'a, const B: usize> {
    pub(super) experiment: &'a Experiment<B>,
    pub(super) part: Part<'a>,
    /// Number of the record.
    pub(super) record: usize,
    /// Number of the part among those of all records.
    pub(super) seam: usize,
}

/// Sum of squares of records, imperfections, static tests, priors and retired records.
pub(super) struct PlantSumOfSquares<'a, const B: usize> {
    pub(super) problem: &'a Problem<'a>,
    pub(super) experiments: &'a [Experiment<B>],
    pub(super) retired: Option<&'a RetiredOfPlant>,
    pub(super) workspace: &'a mut Workspace,
    pub(super) imperfections: &'a mut Imperfections,
    /// Normal equations of the record that was assembled last.
    pub(super) record: &'a mut Normal<WIDE_OF_RECORD>,
    /// Relative error of the model that the weights allow for.
    pub(super) relative_error: f64,
    /// Distance of the bins that count.
    pub(super) every: usize,
    /// Sums over the residuals at the last [`Objective::linearise`].
    pub(super) summary: &'a mut Summary,
}

impl<const B: usize> Objective<Point, OF_ALL> for PlantSumOfSquares<'_, B> {
    type Error = LinearisationError;

    fn cost(&mut self, point: &Point) -> f64 {
        let Self { problem, experiments, workspace, .. } = self;
        workspace.seams.clear();
        let mut sum_of_squares = 0.0;
        for (record, experiment) in experiments.iter().enumerate() {
            for part in experiment.parts() {
                let model = self.imperfections.model(problem, point, part.site, record);
                let Ok(mut model) = model else { return f64::INFINITY };
                model.relative_error = self.relative_error;
                let bins = Bins::thinned(experiment, &part, self.every);
                let (seam, remaining) = workspace.fit_seam(problem, &model, bins);
                // A seam for which there is no room is fitted again.
                let _ = workspace.seams.push(seam);
                sum_of_squares += remaining;
            }
        }
        let count = self.imperfections.all.len();
        sum_of_squares
            + point.imperfections[..count].iter().map(|value| value * value).sum::<f64>()
            + (self.others(point).sum_of_squares() + self.of_retired(point))
    }

    fn linearise(
        &mut self,
        point: &Point,
        normal: &mut Normal<OF_ALL>,
    ) -> Result<(), LinearisationError> {
        let count = self.imperfections.all.len();
        let unknowns = self.problem.sought.unknowns();
        normal.reset(count + unknowns);
        *self.summary = Summary::default();
        let mut seams = 0..;
        for (record, experiment) in self.experiments.iter().enumerate() {
            let mut residuals = Residuals::default();
            for (part, seam) in experiment.parts().zip(&mut seams) {
                let place = PartOf { experiment, part, record, seam };
                residuals.add(&self.assemble(point, &place)?);
                normal.add_complement(self.record, self.problem.seam_unknowns());
            }
            self.summary.push(&residuals, experiment.is_whole());
        }
        for (index, value) in point.imperfections[..count].iter().enumerate() {
            normal.add_prior(index, *value);
        }
        self.others(point).add_to(normal)?;
        if let Some(retired) = self.retired {
            retired.add_to(normal, self.problem.sought, point, &self.imperfections.all);
        }
        Ok(())
    }
}

impl<const B: usize> PlantSumOfSquares<'_, B> {
    /// Priors of unknowns, and static tests.
    fn others(&self, point: &Point) -> Others<'_> {
        let Self { problem, imperfections, .. } = self;
        let statics = Statics::at(problem, &point.coordinates, imperfections.values(point));
        Others::new(problem, &point.coordinates, statics.seeking(&imperfections.all))
    }

    /// Sum of squares of the retired records.
    fn of_retired(&self, point: &Point) -> f64 {
        let sought = self.problem.sought;
        self.retired.map_or(0.0, |own| own.sum_of_squares(sought, point, &self.imperfections.all))
    }

    /// Assembles the normal equations of a part of a record, its seam eliminated.
    fn assemble(
        &mut self,
        point: &Point,
        place: &PartOf<'_, B>,
    ) -> Result<Residuals, LinearisationError> {
        let (model, seam) = self.prepare(point, place)?;
        let bins = Bins::thinned(place.experiment, &place.part, self.every);
        let residuals = self.assemble_bins(&model, &seam, bins);
        eliminate_seam(self.problem, &seam, self.record);
        Ok(residuals)
    }

    /// Adds the equations of a record of this number to `normal`, its seams eliminated.
    pub(super) fn add_record(
        &mut self,
        point: &Point,
        record: usize,
        experiment: &Experiment<B>,
        asked: Asked,
        normal: &mut Normal<OF_ALL>,
    ) -> Result<(), LinearisationError> {
        for part in experiment.parts() {
            let Self { problem, workspace, imperfections, .. } = self;
            let mut model = imperfections.prepare(problem, point, part.site, record)?;
            model.relative_error = self.relative_error;
            let bins = || Bins::thinned(experiment, &part, self.every);
            let seam = workspace.seam(problem, &model, bins(), asked.basis());
            let equations = match asked {
                Asked::Retirement => Equations::All(&seam),
                Asked::Information(_) => Equations::Planned(&seam),
            };
            self.assemble_equations(&model, bins(), equations);
            eliminate_seam(self.problem, &seam, self.record);
            normal.add_complement(self.record, self.problem.seam_unknowns());
        }
        Ok(())
    }

    /// Model and seam of a part of a record. Prepares the columns of the imperfections.
    pub(super) fn prepare(
        &mut self,
        point: &Point,
        place: &PartOf<'_, B>,
    ) -> Result<(Model, Seam), LinearisationError> {
        let PartOf { experiment, part, record, seam } = place;
        let Self { problem, workspace, imperfections, .. } = self;
        let mut model = imperfections.prepare(problem, point, part.site, *record)?;
        model.relative_error = self.relative_error;
        let bins = || Bins::thinned(experiment, part, self.every);
        let seam = match workspace.seams.get(*seam) {
            Some(seam) => *seam,
            None => workspace.fit_seam(problem, &model, bins()).0,
        };
        Ok((model, seam))
    }

    /// Assembles the normal equations of some bins of a part, after [`PlantSumOfSquares::prepare`].
    pub(super) fn assemble_bins(
        &mut self,
        model: &Model,
        seam: &Seam,
        bins: Bins<'_>,
    ) -> Residuals {
        self.assemble_equations(model, bins, Equations::All(seam))
    }

    /// Assembles as [`PlantSumOfSquares::assemble_bins`], these equations.
    fn assemble_equations(
        &mut self,
        model: &Model,
        bins: Bins<'_>,
        equations: Equations<'_>,
    ) -> Residuals {
        let Self { problem, imperfections, record, .. } = self;
        run(Assembly {
            model,
            record: bins,
            equations,
            sought: problem.sought,
            columns: imperfections.columns(),
            normal: record,
            level: problem.level,
        })
    }
}

/// Eliminates the seam, at which the normal equations of a record were taken.
pub(super) fn eliminate_seam(
    problem: &Problem<'_>,
    seam: &Seam,
    record: &mut Normal<WIDE_OF_RECORD>,
) {
    let unknowns = problem.seam_unknowns();
    let standing = seam.to_solution(problem.chain.joints().len());
    record.prefer_small(&standing[..unknowns], seam.cost);
    record.eliminate_with(problem.level, unknowns);
}

/// [`Assembly::run`], compiled once: not again for each number of bins, in each crate.
#[inline(never)]
fn run(assembly: Assembly<'_, WIDE, WIDE_OF_RECORD>) -> Residuals {
    assembly.run()
}
