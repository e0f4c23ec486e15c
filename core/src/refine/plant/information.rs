//! The information about unknowns and imperfections together.

use super::super::Refinement;
use super::super::batch::Bins;
use super::super::equations::Equations;
use super::super::problem::Problem;
use super::super::sizes::OF_ALL;
use super::Plant;
use super::objective::eliminate_seam;
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

/// Known part of an experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// It has been done.
    Measured,
    /// Its force is planned. Its acceleration is the modelled one, at a seam of zero.
    Planned,
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
        self.restart_plant(plant, 2);
        let none: &[Experiment<B>] = &[];
        let (_, mut objective, _, point) = self.minimisation(problem, none, plant);
        objective.workspace.seams.clear();
        let (model, fitted) = objective.prepare(point, OWN, experiment)?;
        let bins = Bins::of(experiment);
        let seam = match basis {
            Basis::Measured => fitted,
            Basis::Planned => objective.workspace.planned_seam(problem, &model, bins),
        };
        let equations = Equations::Planned(&seam);
        objective.assemble_equations(&model, Bins::of(experiment), equations);
        eliminate_seam(problem, &seam, objective.record);
        let point = plant.point;
        plant.eliminate_own(problem, &point, OWN);
        Ok(PlantInformation { normal: &plant.factor, imperfections: &plant.imperfections.all })
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
        self.restart_plant(plant, 2);
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
