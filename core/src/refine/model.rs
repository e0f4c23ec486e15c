//! The part of the model that the rows of a record need.

use crate::calibration::Calibration;
use crate::receptance::{Filter, Terms};

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
