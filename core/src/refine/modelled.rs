//! The model at the site of a record.

use super::model::Model;
use super::plant::imperfect::Imperfect;
use super::problem::Problem;
use crate::chain::linearise::LinearisationError;
use crate::imperfection::Correction;
use crate::receptance::{Filter, Terms};
use crate::sought::Coordinates;
use crate::spectrum::Site;

/// The model at the site of a record, of this number, with the unknowns at these coordinates and the imperfections of a correction.
pub(super) fn corrected(
    problem: &Problem<'_>,
    correction: &Correction,
    coordinates: &Coordinates,
    site: Site<'_>,
    record: usize,
) -> Result<Model, LinearisationError> {
    if correction.is_none() {
        return perfect(problem, coordinates, site);
    }
    let calibration = problem.sought.calibration(coordinates);
    let mut imperfect = Imperfect::new(problem, &calibration, site, record);
    for &(imperfection, value) in correction.values() {
        imperfect.add(imperfection, value);
    }
    let bushings = problem.sought.bushings(coordinates);
    let linear = imperfect.linearise(problem, &bushings)?;
    imperfect.model(problem, &linear, &bushings)
}

/// The model without imperfections, with the unknowns at these coordinates.
pub(super) fn perfect(
    problem: &Problem<'_>,
    coordinates: &Coordinates,
    site: Site<'_>,
) -> Result<Model, LinearisationError> {
    let Problem { measurement, sought, .. } = *problem;
    let bushings = sought.bushings(coordinates);
    let calibration = sought.calibration(coordinates);
    let linear = problem.linearise(site.pose, &bushings, &calibration)?;
    let terms = Terms::new(&linear, &bushings, &measurement.sensors(&calibration, &site))?;
    let terms = if sought.seeks_masses() { terms.with_masses() } else { terms };
    let force_filter = Filter::default();
    Ok(Model { terms, calibration, force_filter, drift: 0.0, relative_error: 0.0 })
}
