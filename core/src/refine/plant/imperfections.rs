//! The imperfections of a fit, and the model that has them.

use heapless::Vec;

use super::super::model::Model;
use super::super::problem::Problem;
use super::super::statics::Statics;
use super::change::{Change, STEP};
use super::columns::Columns;
use super::derived::{Base, derive};
use super::domain::Point;
use super::imperfect::Imperfect;
use super::sag::{self, Sags};
use crate::chain::linearise::LinearisationError;
use crate::imperfection::{Imperfection, MAX_IMPERFECTIONS};
use crate::parameters::MAX_PARAMETERS;
use crate::spectrum::Site;

/// Imperfections that are fitted before the unknowns, and derivatives of the model of a record by them and by those that are sought.
#[derive(Clone, Debug)]
pub(super) struct Imperfections {
    /// Each imperfection, with its standard deviation.
    pub(super) all: Vec<(Imperfection, f64), MAX_IMPERFECTIONS>,
    /// Derivative of the model by each imperfection of the model, in its standard deviation.
    pub(super) changes: Vec<Change, MAX_IMPERFECTIONS>,
    /// Sags of the bushings.
    pub(super) sags: Sags,
    /// Number of the record.
    record: usize,
}

impl Imperfections {
    /// These imperfections, each with its standard deviation, in no record yet.
    pub(super) fn new(all: Vec<(Imperfection, f64), MAX_IMPERFECTIONS>) -> Self {
        Self { all, changes: Vec::new(), sags: Vec::new(), record: 0 }
    }

    /// Each imperfection, with its value at a point.
    pub(super) fn values(&self, point: &Point) -> impl Iterator<Item = (Imperfection, f64)> {
        values(&self.all, point)
    }

    /// The static tests of a problem at a point, which also seek these imperfections.
    pub(super) fn statics<'a>(&'a self, problem: &'a Problem<'_>, point: &Point) -> Statics<'a> {
        Statics::at(problem, &point.coordinates, self.values(point)).seeking(&self.all)
    }

    /// The columns in the record that was prepared last.
    pub(super) fn columns(&self) -> Columns<'_> {
        let Self { all, changes, sags, record } = self;
        Columns { before: all, changes, sags, record: *record }
    }

    /// The model at a point, in a record of this number at a site.
    pub(super) fn model(
        &self,
        problem: &Problem<'_>,
        point: &Point,
        site: Site<'_>,
        record: usize,
    ) -> Result<Model, LinearisationError> {
        let bushings = problem.sought.bushings(&point.coordinates);
        let imperfect =
            Imperfect::new(problem, &point.coordinates, self.values(point), site, record);
        imperfect.model(&imperfect.linearise(problem, &bushings)?, &bushings)
    }

    /// The model at a point, in a record of this number at a site. Prepares the columns.
    pub(super) fn prepare(
        &mut self,
        problem: &Problem<'_>,
        point: &Point,
        site: Site<'_>,
        record: usize,
    ) -> Result<Model, LinearisationError> {
        let Self { all, changes, sags, record: of_columns } = self;
        *of_columns = record;
        let at = |point: &Point| {
            Imperfect::new(problem, &point.coordinates, values(all, point), site, record)
        };
        let bushings = &problem.sought.bushings(&point.coordinates);
        let imperfect = at(point);
        let linear = &imperfect.linearise(problem, bushings)?;
        let model = imperfect.model(linear, bushings)?;
        sag::renew(sags, problem, &imperfect, linear, &model, bushings)?;
        let moved = |index: usize| {
            let mut moved = *point;
            match index.checked_sub(all.len()) {
                None => moved.imperfections[index] += STEP,
                Some(place) => moved.coordinates[MAX_PARAMETERS + place] += STEP,
            }
            at(&moved)
        };
        let own = all.iter().chain(problem.sought.imperfections()).map(|(own, _)| *own);
        derive(
            &Base { problem, record, linear, model: &model, bushings },
            own,
            moved,
            sags,
            changes,
        )?;
        Ok(model)
    }
}

/// Each imperfection, with its value at a point, from its standard deviation.
fn values(all: &[(Imperfection, f64)], point: &Point) -> impl Iterator<Item = (Imperfection, f64)> {
    let values = all.iter().zip(&point.imperfections);
    values.map(|(&(imperfection, deviation), p)| (imperfection, p * deviation))
}
