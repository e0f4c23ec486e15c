//! The information about unknowns and imperfections together.

use super::super::sizes::OF_ALL;
use super::Plant;
use crate::imperfection::Imperfection;
use crate::linear::normal::Normal;

/// The inverse covariance of imperfections and unknowns where the last fit to a plant has ended, by records, static tests and priors.
/// Imperfections come first, in units of their standard deviations a priori; the unknowns follow, in their order.
#[derive(Clone, Copy, Debug)]
pub struct PlantInformation<'a> {
    normal: &'a Normal<OF_ALL>,
    imperfections: &'a [(Imperfection, f64)],
}

impl PlantInformation<'_> {
    /// Each imperfection and its unit, the standard deviation of its prior.
    pub fn imperfections(&self) -> &[(Imperfection, f64)] {
        self.imperfections
    }

    /// Number of imperfections and unknowns.
    pub fn size(&self) -> usize {
        self.normal.unknowns()
    }

    /// Entry of the matrix.
    ///
    /// # Panics
    /// If a row or column is not less than [`PlantInformation::size`].
    pub fn get(&self, row: usize, column: usize) -> f64 {
        assert!(row.max(column) < self.size(), "entry ({row}, {column}) of {}", self.size());
        self.normal.row(row.max(column))[row.min(column)]
    }
}

impl Plant {
    /// Normal equations where the last fit has ended.
    pub(in crate::refine) fn normal(&self) -> &Normal<OF_ALL> {
        &self.minimiser.normal
    }

    /// The information where the last fit has ended. It changes with the next step of an identifier.
    pub fn information(&self) -> PlantInformation<'_> {
        PlantInformation { normal: &self.minimiser.normal, imperfections: &self.imperfections.all }
    }
}
