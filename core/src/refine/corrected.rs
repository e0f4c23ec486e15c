//! The fit of a refinement: a perfect model, or one with the imperfections of a correction.

use super::batch::Bins;
use super::equations::Equations;
use super::model::Model;
use super::modelled::{self, Changes, Place};
use super::plant::columns::Columns;
use super::problem::Problem;
use super::record::Workspace;
use super::residuals::Residuals;
use super::retired::RetiredInformation;
use super::seam::Seam;
use super::sizes::{PACKED, ParameterNormal};
use super::statics::Statics;
use super::sum_of_squares::{Fitted, SumOfSquares};
use super::summary::Summary;
use crate::chain::linearise::LinearisationError;
use crate::linear::normal::Normal;
use crate::sought::Coordinates;
use crate::spectrum::{Experiment, Site};

/// The model of a refinement, whose correction is in its workspace.
pub(super) struct Corrected<'a> {
    retired: &'a RetiredInformation<PACKED>,
    workspace: &'a mut Workspace,
    /// Derivatives of the model that was prepared last by the imperfections that are sought.
    changes: Changes,
}

impl Fitted<PACKED> for Corrected<'_> {
    type Point = Coordinates;

    fn coordinates(point: &Coordinates) -> &Coordinates {
        point
    }

    fn before<'p>(&self, _: &'p Coordinates) -> &'p [f64] {
        &[]
    }

    fn model(
        &mut self,
        problem: &Problem<'_>,
        coordinates: &Coordinates,
        (site, record): (Site<'_>, usize),
        has_columns: bool,
    ) -> Result<Model, LinearisationError> {
        let correction = &self.workspace.correction;
        let place = Place { coordinates, site, record };
        let model = modelled::corrected(problem, correction, place)?;
        if has_columns {
            modelled::derive(problem, correction, place, &model, &mut self.changes)?;
        }
        Ok(model)
    }

    fn assemble(
        &mut self,
        problem: &Problem<'_>,
        model: &Model,
        bins: Bins<'_>,
        equations: Equations<'_>,
    ) -> Residuals {
        let columns = Columns { changes: &self.changes, ..Columns::NONE };
        self.workspace.run(problem, model, bins, equations, columns)
    }

    fn add_complement<const M: usize>(
        &mut self,
        problem: &Problem<'_>,
        seam: &Seam,
        normal: &mut Normal<M>,
    ) {
        problem.eliminate_seam(seam, &mut self.workspace.record);
        normal.add_complement(&self.workspace.record, problem.seam_unknowns());
    }

    fn statics<'a>(&'a self, problem: &'a Problem<'_>, point: &Coordinates) -> Statics<'a> {
        Statics::at(problem, point, self.workspace.correction.values().iter().copied())
    }

    fn sum_of_retired(&self, problem: &Problem<'_>, point: &Coordinates) -> f64 {
        self.retired.sum_at(problem.sought, point)
    }

    fn add_retired(
        &self,
        problem: &Problem<'_>,
        point: &Coordinates,
        normal: &mut ParameterNormal,
    ) {
        self.retired.add_at(normal, problem.sought, point);
    }

    fn workspace(&mut self) -> &mut Workspace {
        self.workspace
    }

    fn summary(&mut self) -> &mut Summary {
        &mut self.workspace.summary
    }
}

impl<'a, const B: usize> SumOfSquares<'a, Corrected<'a>, B> {
    /// The objective of one out of `every` bin of these experiments. Seams of others are forgotten.
    pub(super) fn new(
        problem: &'a Problem<'a>,
        experiments: &'a [Experiment<B>],
        retired: &'a RetiredInformation<PACKED>,
        workspace: &'a mut Workspace,
        every: usize,
    ) -> Self {
        workspace.seams.clear();
        let fitted = Corrected { retired, workspace, changes: Changes::new() };
        Self { problem, experiments, fitted, relative_error: 0.0, every }
    }
}
