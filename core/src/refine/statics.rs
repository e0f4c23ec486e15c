//! What static tests add to the normal equations: a row for each displacement that was measured, and no seam.

use super::problem::Problem;
use super::sizes::ParameterNormal;
use crate::DOF;
use crate::calibration::Calibration;
use crate::chain::linearise::LinearisationError;
use crate::parameters::Bushings;
use crate::sought::{Coordinate, Coordinates, MAX_UNKNOWNS};
use crate::statics::{Deflection, StaticTest};

/// Unknowns and residual.
const COLUMNS: usize = MAX_UNKNOWNS + 1;
/// Rows of a test: three are used.
pub(super) type Rows = [[f64; COLUMNS]; 6];

/// The static tests of a problem, where the parameters stand.
pub(super) struct Statics<'a> {
    problem: &'a Problem<'a>,
    bushings: Bushings,
    calibration: Calibration,
}

impl<'a> Statics<'a> {
    /// Of a problem, at these coordinates.
    pub(super) fn at(problem: &'a Problem<'a>, coordinates: &Coordinates) -> Self {
        let sought = problem.sought;
        let (bushings, calibration) =
            (sought.bushings(coordinates), sought.calibration(coordinates));
        Self { problem, bushings, calibration }
    }

    /// Sum of squares of the residuals, each in its standard deviations; infinite where the robot has no equilibrium.
    pub(super) fn sum_of_squares(&self) -> f64 {
        let squares = |test: &StaticTest| {
            let Ok(Deflection { displacement: model, .. }) = self.deflection(test) else {
                return f64::INFINITY;
            };
            let square = |residual: f64| residual * residual;
            test.readings().map(|(a, r)| square((r.value - model[a]) / r.deviation)).sum::<f64>()
        };
        self.problem.statics.iter().map(squares).sum()
    }

    /// Adds them to the normal equations.
    pub(super) fn add_to(&self, normal: &mut ParameterNormal) -> Result<(), LinearisationError> {
        for test in self.problem.statics {
            normal.add(&self.rows(test)?);
        }
        Ok(())
    }

    /// The row of each displacement of a test that was measured, in its standard deviations: derivatives by the unknowns, and behind
    /// them the residual. The rows of the others are zero.
    pub(super) fn rows(&self, test: &StaticTest) -> Result<Rows, LinearisationError> {
        let sought = self.problem.sought;
        let model = self.deflection(test)?;
        let mut rows = [[0.0; COLUMNS]; 6];
        for (axis, reading) in test.readings() {
            let row = &mut rows[axis];
            let joints = model.gradient[axis][..self.bushings.len()].iter().enumerate();
            for (joint, gradient) in joints {
                for dof in 0..DOF {
                    // Stiffnesses that are tied add up.
                    if let Some(k) = sought.unknown(Coordinate::Stiffness { joint, dof }) {
                        row[k] += gradient[dof] / reading.deviation;
                    }
                }
            }
            row[sought.unknowns()] = (reading.value - model.displacement[axis]) / reading.deviation;
        }
        Ok(rows)
    }

    fn deflection(&self, test: &StaticTest) -> Result<Deflection, LinearisationError> {
        let linear = self.problem.linearise(&test.pose, &self.bushings, &self.calibration)?;
        Deflection::new(&linear, &self.bushings, &test.wrench, &test.gauge)
    }
}
