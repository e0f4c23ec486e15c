//! What the rows of a record need of the model.

use super::Problem;
use crate::calibration::Calibration;
use crate::chain::linearise::LinearisationError;
use crate::receptance::{Filter, Terms};
use crate::sought::Coordinates;

/// A model at the pose of a record.
#[derive(Clone, Debug)]
pub(super) struct Model {
    pub(super) terms: Terms<f64>,
    /// The nuisances as they stand.
    pub(super) calibration: Calibration,
    /// Filter of the force sensor.
    pub(super) force_filter: Filter<f64>,
}

impl Model {
    /// The model without imperfections, with the unknowns at these coordinates.
    pub(super) fn perfect(
        problem: &Problem<'_>,
        coordinates: &Coordinates,
        pose: &[f64],
    ) -> Result<Self, LinearisationError> {
        let Problem { measurement, sought, .. } = *problem;
        let bushings = sought.bushings(coordinates);
        let calibration = sought.calibration(coordinates);
        let linear = problem.linearise(pose, &bushings, &calibration)?;
        let terms = Terms::new(&linear, &bushings, &measurement.sensors(&calibration))?;
        let terms = if sought.seeks_masses() { terms.with_masses() } else { terms };
        Ok(Self { terms, calibration, force_filter: Filter::default() })
    }
}
