//! The fit to a plant: its imperfections before the unknowns.

use super::super::batch::Bins;
use super::super::equations::{Assembly, Equations};
use super::super::model::Model;
use super::super::problem::Problem;
use super::super::record::Workspace;
use super::super::residuals::Residuals;
use super::super::seam::Seam;
use super::super::sizes::{OF_ALL, WIDE, WIDE_OF_RECORD};
use super::super::statics::Statics;
use super::super::sum_of_squares::Fitted;
use super::super::summary::Summary;
use super::domain::Point;
use super::imperfections::Imperfections;
use super::retired::RetiredOfPlant;
use crate::chain::linearise::LinearisationError;
use crate::linear::normal::Normal;
use crate::sought::Coordinates;
use crate::spectrum::Site;

/// The model of a plant.
pub(super) struct OfPlant<'a> {
    pub(super) retired: Option<&'a RetiredOfPlant>,
    pub(super) workspace: &'a mut Workspace,
    pub(super) imperfections: &'a mut Imperfections,
    /// Normal equations of the record that was assembled last.
    pub(super) record: &'a mut Normal<WIDE_OF_RECORD>,
    pub(super) summary: &'a mut Summary,
}

impl Fitted<OF_ALL> for OfPlant<'_> {
    type Point = Point;

    fn coordinates(point: &Point) -> &Coordinates {
        &point.coordinates
    }

    fn before<'p>(&self, point: &'p Point) -> &'p [f64] {
        &point.imperfections[..self.imperfections.all.len()]
    }

    fn model(
        &mut self,
        problem: &Problem<'_>,
        point: &Point,
        (site, record): (Site<'_>, usize),
        has_columns: bool,
    ) -> Result<Model, LinearisationError> {
        match has_columns {
            true => self.imperfections.prepare(problem, point, site, record),
            false => self.imperfections.model(problem, point, site, record),
        }
    }

    fn assemble(
        &mut self,
        problem: &Problem<'_>,
        model: &Model,
        record: Bins<'_>,
        equations: Equations<'_>,
    ) -> Residuals {
        run(Assembly {
            model,
            record,
            equations,
            sought: problem.sought,
            columns: self.imperfections.columns(),
            normal: self.record,
            level: problem.level,
        })
    }

    fn add_complement<const M: usize>(
        &mut self,
        problem: &Problem<'_>,
        seam: &Seam,
        normal: &mut Normal<M>,
    ) {
        problem.eliminate_seam(seam, self.record);
        normal.add_complement(self.record, problem.seam_unknowns());
    }

    fn statics<'a>(&'a self, problem: &'a Problem<'_>, point: &Point) -> Statics<'a> {
        self.imperfections.statics(problem, point)
    }

    fn sum_of_retired(&self, problem: &Problem<'_>, point: &Point) -> f64 {
        let all = &self.imperfections.all;
        self.retired.map_or(0.0, |own| own.sum_of_squares(problem.sought, point, all))
    }

    fn add_retired(&self, problem: &Problem<'_>, point: &Point, normal: &mut Normal<OF_ALL>) {
        if let Some(retired) = self.retired {
            retired.add_to(normal, problem.sought, point, &self.imperfections.all);
        }
    }

    fn workspace(&mut self) -> &mut Workspace {
        self.workspace
    }

    fn summary(&mut self) -> &mut Summary {
        self.summary
    }
}

/// [`Assembly::run`], compiled once: not again for each number of bins, in each crate.
#[inline(never)]
fn run(assembly: Assembly<'_, WIDE, WIDE_OF_RECORD>) -> Residuals {
    assembly.run()
}
