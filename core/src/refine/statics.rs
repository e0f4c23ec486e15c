//! Rows of the static tests in the normal equations: one for each displacement that was measured, and no seam.
//!
//! The robot has the imperfections of the fit, and its stiffnesses are those at rest. Derivatives by the stiffnesses hold the sag; those by
//! the imperfections are differences, which hold it, too.

use heapless::Vec;

use super::plant::change::STEP;
use super::plant::imperfect::{Imperfect, PerDof};
use super::problem::Problem;
use super::sizes::ALL;
use crate::chain::linearise::LinearisationError;
use crate::imperfection::{Imperfection, MAX_IMPERFECTIONS};
use crate::linear::normal::Normal;
use crate::parameters::Bushings;
use crate::sought::{Coordinate, Coordinates};
use crate::statics::{Deflection, StaticTest};
use crate::{DOF, MAX_JOINTS};

/// Returns whether an imperfection changes how far the robot gives way to a load that rests.
fn shows_at_rest(imperfection: Imperfection) -> bool {
    use Imperfection::{BaseMass, GroundDamping, HoseDamping, Inertia, Servo};
    let moves_only =
        matches!(imperfection, BaseMass | GroundDamping(_) | HoseDamping | Inertia(..) | Servo(_));
    imperfection.is_of_robot() && !moves_only
}

/// Rows of a test, of which three are used: imperfections, unknowns, and the residual.
pub(super) type Rows = [[f64; ALL + 1]; 6];

/// The static tests of a problem, where parameters and imperfections stand.
pub(super) struct Statics<'a> {
    problem: &'a Problem<'a>,
    bushings: Bushings,
    /// Each imperfection, with its value.
    imperfections: Vec<(Imperfection, f64), MAX_IMPERFECTIONS>,
    /// The imperfections that are fitted before the unknowns, each with its standard deviation.
    sought: &'a [(Imperfection, f64)],
}

impl<'a> Statics<'a> {
    /// Rows of a problem, at these coordinates, of a robot whose imperfections have these values.
    pub(super) fn at(
        problem: &'a Problem<'a>,
        coordinates: &Coordinates,
        imperfections: impl Iterator<Item = (Imperfection, f64)>,
    ) -> Self {
        let own = problem.sought.imperfections_at(coordinates);
        let shows = |own: &(Imperfection, f64)| shows_at_rest(own.0) && own.1 != 0.0;
        Self {
            problem,
            bushings: problem.sought.bushings(coordinates),
            imperfections: own.chain(imperfections).filter(shows).collect(),
            sought: &[],
        }
    }

    /// These tests, which also seek these imperfections, each with its standard deviation.
    pub(super) fn seeking(self, sought: &'a [(Imperfection, f64)]) -> Self {
        Self { sought, ..self }
    }

    /// Columns before those of the unknowns.
    pub(super) fn first(&self) -> usize {
        self.sought.len()
    }

    /// Sum of squares of the residuals, each in its standard deviations; infinite where the robot has no equilibrium.
    pub(super) fn sum_of_squares(&self) -> f64 {
        let squares = |test: &StaticTest| {
            let Ok((Deflection { displacement: model, .. }, _)) = self.deflection(test) else {
                return f64::INFINITY;
            };
            let square = |residual: f64| residual * residual;
            test.readings().map(|(a, r)| square((r.value - model[a]) / r.deviation)).sum::<f64>()
        };
        self.problem.statics.iter().map(squares).sum()
    }

    /// Adds them to the normal equations.
    pub(super) fn add_to<const L: usize>(
        &self,
        normal: &mut Normal<L>,
    ) -> Result<(), LinearisationError> {
        for test in self.problem.statics {
            normal.add(&self.rows(test)?);
        }
        Ok(())
    }

    /// The row of each displacement of a test that was measured, in its standard deviations: derivatives by the imperfections that are sought
    /// and by the unknowns, and behind them the residual. The rows of the others are zero.
    pub(super) fn rows(&self, test: &StaticTest) -> Result<Rows, LinearisationError> {
        let unknowns = self.problem.sought;
        let first = self.first();
        let (model, parts) = self.deflection(test)?;
        let mut rows = [[0.0; ALL + 1]; 6];
        for (axis, reading) in test.readings() {
            let row = &mut rows[axis];
            let joints = model.gradient[axis][..self.bushings.len()].iter().enumerate();
            for (joint, gradient) in joints {
                for dof in 0..DOF {
                    // Stiffnesses that are tied add up.
                    if let Some(k) = unknowns.unknown(Coordinate::Stiffness { joint, dof }) {
                        row[first + k] +=
                            gradient[dof] * (1.0 - parts[joint][dof]) / reading.deviation;
                    }
                    if let Some(k) = unknowns.unknown(Coordinate::Damping { joint, dof }) {
                        row[first + k] += gradient[dof] * parts[joint][dof] / reading.deviation;
                    }
                }
            }
            row[first + unknowns.unknowns()] =
                (reading.value - model.displacement[axis]) / reading.deviation;
        }
        self.write_imperfections(test, &model, &mut rows)?;
        Ok(rows)
    }

    /// Writes the derivatives by the imperfections that are sought.
    fn write_imperfections(
        &self,
        test: &StaticTest,
        model: &Deflection,
        rows: &mut Rows,
    ) -> Result<(), LinearisationError> {
        let unknowns = self.problem.sought;
        let first_of_unknowns = self.first() + unknowns.first_imperfection();
        let all =
            || (0..).zip(self.sought).chain((first_of_unknowns..).zip(unknowns.imperfections()));
        let shown = || all().filter(|(_, (own, _))| shows_at_rest(*own));
        if shown().next().is_none() {
            return Ok(());
        }
        let gravity = self.problem.measurement.gravity();
        let rest = self.robot(test).linearise_under(gravity, &self.bushings)?.elongations();
        for (column, &(imperfection, deviation)) in shown() {
            let mut moved = self.robot(test);
            moved.add(imperfection, STEP * deviation);
            let linear = moved.linearise_at(self.problem, &rest);
            let (there, _) = moved.deflection(&linear, &self.bushings, test)?;
            for (axis, reading) in test.readings() {
                let rate = (there.displacement[axis] - model.displacement[axis]) / STEP;
                rows[axis][column] = rate / reading.deviation;
            }
        }
        Ok(())
    }

    /// The robot with its imperfections at the pose of a test.
    fn robot(&self, test: &StaticTest) -> Imperfect {
        let imperfections = self.imperfections.iter().copied();
        Imperfect::at_rest(self.problem, &test.pose, imperfections)
    }

    /// Displacement, and the part of each stiffness that goes with its damping.
    fn deflection(&self, test: &StaticTest) -> Result<(Deflection, PerDof), LinearisationError> {
        if self.imperfections.is_empty() {
            let Problem { chain, measurement, .. } = self.problem;
            let linear = chain.linearise(&test.pose, measurement.gravity(), &self.bushings)?;
            let model = Deflection::new(&linear, &self.bushings, &test.wrench, &test.gauge)?;
            return Ok((model, [[0.0; DOF]; MAX_JOINTS]));
        }
        let robot = self.robot(test);
        let linear = robot.linearise_under(self.problem.measurement.gravity(), &self.bushings)?;
        robot.deflection(&linear, &self.bushings, test)
    }
}
