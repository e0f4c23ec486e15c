//! The objective of a fit: the sum of squares of records, imperfections, static tests, priors, and what is retired.

use super::basis::Asked;
use super::batch::Bins;
use super::equations::Equations;
use super::model::Model;
use super::objective::Objective;
use super::others::Others;
use super::problem::Problem;
use super::record::Workspace;
use super::residuals::Residuals;
use super::seam::Seam;
use super::statics::Statics;
use super::summary::Summary;
use crate::chain::linearise::LinearisationError;
use crate::linear::normal::Normal;
use crate::sought::Coordinates;
use crate::spectrum::{Experiment, Part, Site};

/// The model that is fitted, with the memory of its equations: that of a refinement, whose imperfections are fixed unless they are unknowns, or a plant,
/// which fits them before the unknowns. `L` is the length of the normal equations of all that is fitted.
pub(super) trait Fitted<const L: usize> {
    /// Values of the unknowns and of the imperfections before them.
    type Point: Copy;

    fn coordinates(point: &Self::Point) -> &Coordinates;

    /// Values of the imperfections before the unknowns, in their standard deviations.
    fn before<'p>(&self, point: &'p Self::Point) -> &'p [f64];

    /// The model in a record of this number at a site. Prepares its columns if it `has_columns`.
    ///
    /// # Errors
    /// The robot has no equilibrium there.
    fn model(
        &mut self,
        problem: &Problem<'_>,
        point: &Self::Point,
        place: (Site<'_>, usize),
        has_columns: bool,
    ) -> Result<Model, LinearisationError>;

    /// Assembles the equations of some bins in the model that was prepared last.
    fn assemble(
        &mut self,
        problem: &Problem<'_>,
        model: &Model,
        bins: Bins<'_>,
        equations: Equations<'_>,
    ) -> Residuals;

    /// Eliminates the seam, at which the equations that were assembled last were taken, and adds the others.
    fn add_complement<const M: usize>(
        &mut self,
        problem: &Problem<'_>,
        seam: &Seam,
        normal: &mut Normal<M>,
    );

    /// The static tests.
    fn statics<'a>(&'a self, problem: &'a Problem<'_>, point: &Self::Point) -> Statics<'a>;

    /// Sum of squares of the retired records.
    fn sum_of_retired(&self, problem: &Problem<'_>, point: &Self::Point) -> f64;

    /// Adds the normal equations of the retired records.
    fn add_retired(&self, problem: &Problem<'_>, point: &Self::Point, normal: &mut Normal<L>);

    /// Memory of the seams.
    fn workspace(&mut self) -> &mut Workspace;

    /// Sums over the residuals at the last [`Objective::linearise`].
    fn summary(&mut self) -> &mut Summary;
}

/// A part of a record.
pub(super) struct PartOf<'a, const B: usize> {
    pub(super) experiment: &'a Experiment<B>,
    pub(super) part: Part<'a>,
    /// Number of the record.
    pub(super) record: usize,
    /// Number of the part among those of all records.
    pub(super) seam: usize,
}

/// The sum of squares of a fit. The seams of the records are fitted at every point.
pub(super) struct SumOfSquares<'a, F, const B: usize> {
    pub(super) problem: &'a Problem<'a>,
    pub(super) experiments: &'a [Experiment<B>],
    pub(super) fitted: F,
    /// Relative error of the model that the weights allow for.
    pub(super) relative_error: f64,
    /// Distance of the bins that count.
    pub(super) every: usize,
}

impl<F: Fitted<L>, const B: usize, const L: usize> Objective<F::Point, L>
    for SumOfSquares<'_, F, B>
{
    type Error = LinearisationError;

    fn cost(&mut self, point: &F::Point) -> f64 {
        self.fitted.workspace().seams.clear();
        let mut sum_of_squares = 0.0;
        for (record, experiment) in self.experiments.iter().enumerate() {
            for part in experiment.parts() {
                let model = self.model(point, (part.site, record), false);
                let Ok(model) = model else { return f64::INFINITY };
                let bins = Bins::thinned(experiment, &part, self.every);
                let workspace = self.fitted.workspace();
                let (seam, remaining) = workspace.fit_seam(self.problem, &model, bins);
                // A seam for which there is no room is fitted again.
                let _ = workspace.seams.push(seam);
                sum_of_squares += remaining;
            }
        }
        let before = self.fitted.before(point).iter().map(|value| value * value);
        let retired = self.fitted.sum_of_retired(self.problem, point);
        sum_of_squares + before.sum::<f64>() + (self.others(point).sum_of_squares() + retired)
    }

    fn linearise(
        &mut self,
        point: &F::Point,
        normal: &mut Normal<L>,
    ) -> Result<(), LinearisationError> {
        let Self { problem, experiments, .. } = *self;
        let count = self.fitted.before(point).len();
        normal.reset(count + problem.sought.unknowns());
        *self.fitted.summary() = Summary::default();
        let mut seams = 0..;
        for (record, experiment) in experiments.iter().enumerate() {
            let mut residuals = Residuals::default();
            for (part, seam) in experiment.parts().zip(&mut seams) {
                let place = PartOf { experiment, part, record, seam };
                let (model, seam) = self.prepare(point, &place)?;
                let bins = Bins::thinned(experiment, &place.part, self.every);
                let equations = Equations::All(&seam);
                residuals.add(&self.fitted.assemble(problem, &model, bins, equations));
                self.fitted.add_complement(problem, &seam, normal);
            }
            self.fitted.summary().push(&residuals, experiment.is_whole());
        }
        for (index, value) in self.fitted.before(point).iter().enumerate() {
            normal.add_prior(index, *value);
        }
        self.others(point).add_to(normal)?;
        self.fitted.add_retired(problem, point, normal);
        Ok(())
    }
}

impl<F, const B: usize> SumOfSquares<'_, F, B> {
    /// The model in a record of this number at a site.
    pub(super) fn model<const L: usize>(
        &mut self,
        point: &F::Point,
        place: (Site<'_>, usize),
        has_columns: bool,
    ) -> Result<Model, LinearisationError>
    where
        F: Fitted<L>,
    {
        let model = self.fitted.model(self.problem, point, place, has_columns)?;
        Ok(Model { relative_error: self.relative_error, ..model })
    }

    /// Priors of unknowns, and static tests.
    fn others<const L: usize>(&self, point: &F::Point) -> Others<'_>
    where
        F: Fitted<L>,
    {
        let statics = self.fitted.statics(self.problem, point);
        Others::new(self.problem, F::coordinates(point), statics)
    }

    /// Model and seam of a part of a record, with its columns.
    pub(super) fn prepare<const L: usize>(
        &mut self,
        point: &F::Point,
        place: &PartOf<'_, B>,
    ) -> Result<(Model, Seam), LinearisationError>
    where
        F: Fitted<L>,
    {
        let PartOf { experiment, part, record, seam } = place;
        let model = self.model(point, (part.site, *record), true)?;
        let bins = Bins::thinned(experiment, part, self.every);
        let workspace = self.fitted.workspace();
        let seam = match workspace.seams.get(*seam) {
            Some(seam) => *seam,
            None => workspace.fit_seam(self.problem, &model, bins).0,
        };
        Ok((model, seam))
    }

    /// Adds the equations of a record of this number to `normal`, its seams eliminated. Returns its residuals.
    pub(super) fn add_record<const L: usize>(
        &mut self,
        point: &F::Point,
        (record, experiment): (usize, &Experiment<B>),
        asked: Asked,
        normal: &mut Normal<L>,
    ) -> Result<Residuals, LinearisationError>
    where
        F: Fitted<L>,
    {
        let mut residuals = Residuals::default();
        for part in experiment.parts() {
            let model = self.model(point, (part.site, record), true)?;
            let Self { problem, fitted, every, .. } = self;
            let bins = || Bins::thinned(experiment, &part, *every);
            let seam = fitted.workspace().seam(problem, &model, bins(), asked.basis());
            let equations = match asked {
                Asked::Fit => Equations::All(&seam),
                Asked::Information(_) => Equations::Planned(&seam),
            };
            residuals.add(&fitted.assemble(problem, &model, bins(), equations));
            fitted.add_complement(problem, &seam, normal);
        }
        Ok(residuals)
    }
}
