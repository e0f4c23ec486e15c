//! The model at the site of a record, and its derivatives by the imperfections that are sought.

use heapless::Vec;

use super::model::Model;
use super::plant::change::{Change, STEP};
use super::plant::derived::{self, Base};
use super::plant::imperfect::Imperfect;
use super::problem::Problem;
use crate::chain::linearise::LinearisationError;
use crate::imperfection::Correction;
use crate::parameters::MAX_PARAMETERS;
use crate::receptance::Terms;
use crate::sought::{Coordinates, MAX_SOUGHT};
use crate::spectrum::Site;

/// Derivatives of a model by the imperfections that are sought, those of the model.
pub(super) type Changes = Vec<Change, MAX_SOUGHT>;

/// A part of a record among the equations of a fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<'a> {
    pub(super) coordinates: &'a Coordinates,
    pub(super) site: Site<'a>,
    /// Number of the record.
    pub(super) record: usize,
}

/// The model in a part of a record, with the imperfections of a correction.
pub(super) fn corrected(
    problem: &Problem<'_>,
    correction: &Correction,
    place: Place<'_>,
) -> Result<Model, LinearisationError> {
    let Place { coordinates, site, .. } = place;
    let Problem { chain, measurement, sought, .. } = *problem;
    let bushings = sought.bushings(coordinates);
    if correction.is_none() && sought.imperfections().is_empty() {
        let linear = chain.linearise(site.pose, measurement.gravity(), &bushings)?;
        let terms = Terms::new(&linear, &bushings, &measurement.sensors(&site))?;
        return Ok(Model::perfect(terms, &linear, chain));
    }
    let imperfect = imperfect(problem, correction, place);
    imperfect.model(&imperfect.linearise(problem, &bushings)?, &bushings)
}

fn imperfect(problem: &Problem<'_>, correction: &Correction, place: Place<'_>) -> Imperfect {
    let Place { coordinates, site, record } = place;
    Imperfect::new(problem, coordinates, correction.values().iter().copied(), site, record)
}

/// Fills `changes` with the derivatives of such a model.
#[inline(never)]
pub(super) fn derive(
    problem: &Problem<'_>,
    correction: &Correction,
    place: Place<'_>,
    model: &Model,
    changes: &mut Changes,
) -> Result<(), LinearisationError> {
    changes.clear();
    let own = problem.sought.imperfections();
    if own.is_empty() {
        return Ok(());
    }
    let bushings = &problem.sought.bushings(place.coordinates);
    let linear = &imperfect(problem, correction, place).linearise(problem, bushings)?;
    let moved = |index: usize| {
        let mut moved = *place.coordinates;
        moved[MAX_PARAMETERS + index] += STEP;
        imperfect(problem, correction, Place { coordinates: &moved, ..place })
    };
    let base = Base { problem, record: place.record, linear, model, bushings };
    derived::derive(&base, own.iter().map(|(own, _)| *own), moved, &mut [], changes)
}

/// The model without imperfections but those that are sought, with the unknowns at these coordinates.
#[cfg(test)]
pub(super) fn perfect(
    problem: &Problem<'_>,
    coordinates: &Coordinates,
    site: Site<'_>,
) -> Result<Model, LinearisationError> {
    corrected(problem, &Correction::NONE, Place { coordinates, site, record: 0 })
}
