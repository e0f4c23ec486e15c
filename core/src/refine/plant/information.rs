//! The information about unknowns and imperfections together.

use super::super::Refinement;
use super::super::basis::{Asked, Basis};
use super::super::problem::Problem;
use super::super::sizes::OF_ALL;
use super::super::sum_of_squares::SumOfSquares;
use super::Plant;
use super::objective::OfPlant;
use crate::chain::linearise::LinearisationError;
use crate::imperfection::Imperfection;
use crate::linear::normal::Normal;
use crate::spectrum::Experiment;

/// Number of the record that an experiment is.
const OWN: usize = 0;

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

impl Refinement {
    /// Fisher information of an experiment at the present parameters of a robot without imperfections. Its seam is projected out, and the
    /// imperfections of a single record are, with their priors. Without the other priors.
    ///
    /// # Errors
    /// The pose is that of another chain, or the robot has no equilibrium there.
    pub fn information_on_plant<'p, const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &Experiment<B>,
        basis: Basis,
        plant: &'p mut Plant,
    ) -> Result<PlantInformation<'p>, LinearisationError> {
        // Imperfections of a single record differ from those of a second one.
        self.restart_plant(plant, 2, true);
        let asked = Asked::Information(basis);
        self.assemble_on_plant(problem, experiment, OWN, plant, asked)?;
        Ok(PlantInformation { normal: &plant.factor, imperfections: &plant.imperfections.all })
    }

    /// Assembles the equations of a record, of this number, where the plant stands. Its seam and the imperfections of the record alone are
    /// eliminated. What is left is in the `factor` of the plant.
    pub(super) fn assemble_on_plant<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        experiment: &Experiment<B>,
        record: usize,
        plant: &mut Plant,
        asked: Asked,
    ) -> Result<(), LinearisationError> {
        let Plant { imperfections, point, summary, factor, relative_error, every, .. } = plant;
        factor.reset(imperfections.all.len() + problem.sought.unknowns());
        let (workspace, normal) = (&mut self.workspace, &mut plant.record);
        let fitted = OfPlant { retired: None, workspace, imperfections, record: normal, summary };
        let (relative_error, every) = (*relative_error, *every);
        let mut objective =
            SumOfSquares { problem, experiments: &[], fitted, relative_error, every };
        objective.add_record(point, (record, experiment), asked, factor)?;
        for (index, (imperfection, _)) in imperfections.all.iter().enumerate() {
            if imperfection.is_of_record(record) {
                factor.add_prior(index, point.imperfections[index]);
                factor.eliminate_one(index);
            }
        }
        Ok(())
    }

    /// Fisher information of the static tests of a problem at the same parameters.
    ///
    /// # Errors
    /// The robot has no equilibrium in a test.
    pub fn information_of_statics<'p>(
        &self,
        problem: &Problem<'_>,
        plant: &'p mut Plant,
    ) -> Result<PlantInformation<'p>, LinearisationError> {
        self.restart_plant(plant, 2, true);
        let unknowns = problem.sought.unknowns();
        let (statics, normal) = plant.statics_and_factor(problem);
        normal.reset(statics.first() + unknowns);
        statics.add_to(normal)?;
        Ok(PlantInformation { normal: &plant.factor, imperfections: &plant.imperfections.all })
    }
}

impl Plant {
    /// The information where the last fit has ended. It changes with the next step of an identifier.
    pub fn information(&self) -> PlantInformation<'_> {
        PlantInformation { normal: &self.minimiser.normal, imperfections: &self.imperfections.all }
    }
}
