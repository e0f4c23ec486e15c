//! Terms of a fit beside its records: the priors of unknowns, and static tests.

use super::problem::Problem;
use super::statics::Statics;
use crate::chain::linearise::LinearisationError;
use crate::linear::normal::Normal;
use crate::sought::{Coordinates, Expected};

/// Priors and static tests of a problem at a point.
pub(super) struct Others<'a> {
    problem: &'a Problem<'a>,
    coordinates: Coordinates,
    statics: Statics<'a>,
}

impl<'a> Others<'a> {
    pub(super) fn new(
        problem: &'a Problem<'a>,
        coordinates: &Coordinates,
        statics: Statics<'a>,
    ) -> Self {
        Self { problem, coordinates: *coordinates, statics }
    }

    /// Their sum of squares; infinite where the robot has no equilibrium in a static test.
    pub(super) fn sum_of_squares(&self) -> f64 {
        let Self { problem, coordinates, statics } = self;
        let Problem { sought, bounds, .. } = **problem;
        let priors = sought.priors(coordinates).map(|(_, value)| value * value);
        let expected = sought.expected(coordinates, bounds);
        priors.sum::<f64>()
            + expected.map(|stiffness| stiffness.value * stiffness.value).sum::<f64>()
            + statics.sum_of_squares()
    }

    /// Adds their normal equations. The columns of the imperfections that the static tests seek come before those of the unknowns.
    ///
    /// # Errors
    /// The robot has no equilibrium in a static test.
    pub(super) fn add_to<const L: usize>(
        &self,
        normal: &mut Normal<L>,
    ) -> Result<(), LinearisationError> {
        let Self { problem, coordinates, statics } = self;
        let Problem { sought, bounds, .. } = **problem;
        let first = statics.first();
        for (unknown, value) in sought.priors(coordinates) {
            normal.add_prior(first + unknown, value);
        }
        for Expected { unknown, value, slope } in sought.expected(coordinates, bounds) {
            normal.add_sparse(&[(first + unknown, slope)], value);
        }
        statics.add_to(normal)
    }
}
