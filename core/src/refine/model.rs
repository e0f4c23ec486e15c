//! What the rows of a record need of the model.

use super::Problem;
use super::plant::Correction;
use super::plant::imperfect::Imperfect;
use crate::calibration::Calibration;
use crate::chain::linearise::LinearisationError;
use crate::receptance::{Filter, Terms};
use crate::sought::Coordinates;
use crate::spectrum::Site;

/// A model at the pose of a record.
#[derive(Clone, Debug)]
pub(super) struct Model {
    pub(super) terms: Terms<f64>,
    /// The nuisances as they stand.
    pub(super) calibration: Calibration,
    /// Filter of the force sensor.
    pub(super) force_filter: Filter<f64>,
    /// Growth of the delay of the acceleration over a record.
    pub(super) drift: f64,
    /// Relative error η of the model that the weights of the residuals allow for.
    pub(super) relative_error: f64,
}

impl Model {
    /// The model at the site of a record, of this number, with the unknowns at these coordinates and the imperfections of a correction.
    pub(super) fn corrected(
        problem: &Problem<'_>,
        correction: &Correction,
        coordinates: &Coordinates,
        site: Site<'_>,
        record: usize,
    ) -> Result<Self, LinearisationError> {
        if correction.is_none() {
            return Self::perfect(problem, coordinates, site);
        }
        let calibration = problem.sought.calibration(coordinates);
        let mut imperfect = Imperfect::new(problem, &calibration, site, record);
        correction.add_to(&mut imperfect);
        let bushings = problem.sought.bushings(coordinates);
        let linear = imperfect.linearise(problem, &bushings)?;
        imperfect.model(problem, &linear, &bushings)
    }

    /// The model without imperfections, with the unknowns at these coordinates.
    pub(super) fn perfect(
        problem: &Problem<'_>,
        coordinates: &Coordinates,
        site: Site<'_>,
    ) -> Result<Self, LinearisationError> {
        let Problem { measurement, sought, .. } = *problem;
        let bushings = sought.bushings(coordinates);
        let calibration = sought.calibration(coordinates);
        let linear = problem.linearise(site.pose, &bushings, &calibration)?;
        let terms = Terms::new(&linear, &bushings, &measurement.sensors(&calibration, site.point))?;
        let terms = if sought.seeks_masses() { terms.with_masses() } else { terms };
        let force_filter = Filter::default();
        Ok(Self { terms, calibration, force_filter, drift: 0.0, relative_error: 0.0 })
    }
}
