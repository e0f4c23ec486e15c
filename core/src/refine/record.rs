//! The normal equations of one record, its seam projected out.

use heapless::Vec;

use super::Problem;
use super::batch::{Bins, COLUMNS};
use super::equations::{Assembly, Equations, OF_RECORD, RecordNormal};
use super::model::Model;
use super::plant::Correction;
use super::residuals::Residuals;
use super::responses::{ByResponses, Sums, has_plain_columns};
use super::seam::{MAX_SEAM, Seam, cost_of};
use super::summary::Summary;
use crate::chain::{linearise::LinearisationError, poses_agree};
use crate::linear::normal::Normal;
use crate::search::MAX_EXPERIMENTS;
use crate::sought::Coordinates;
use crate::spectrum::Experiment;

/// Largest difference of two joint angles of poses in which a model lacks the same, rad (m). Chosen: it changes a receptance by about 1 %.
const ALIKE: f64 = 0.01;

/// True if the poses of two records are so near that the model lacks the same in both.
pub(super) fn share_pose(one: &[f64], other: &[f64]) -> bool {
    poses_agree(one, other, ALIKE)
}

/// Imperfections of the model, and memory of an assembly.
#[derive(Clone, Debug)]
pub(super) struct Workspace {
    /// None for a perfect model.
    pub(super) correction: Correction,
    /// Normal equations of the record that was assembled last.
    pub(super) record: RecordNormal,
    /// Sums from which these follow.
    sums: Sums,
    /// Seams of the first records, each at its best, at the point where the cost was evaluated last.
    pub(super) seams: Vec<Seam, MAX_EXPERIMENTS>,
    /// Of the residuals where the normal equations of all unknowns were assembled last.
    pub(super) summary: Summary,
}

impl Workspace {
    pub(super) fn new() -> Self {
        Self {
            correction: Correction::NONE,
            record: Normal::new(),
            sums: Sums::new(),
            seams: Vec::new(),
            summary: Summary::default(),
        }
    }

    /// The model at the pose of a record, of this number.
    pub(super) fn model(
        &self,
        problem: &Problem<'_>,
        coordinates: &Coordinates,
        pose: &[f64],
        record: usize,
    ) -> Result<Model, LinearisationError> {
        Model::corrected(problem, &self.correction, coordinates, pose, record)
    }

    /// The seam that fits a record best, and the sum of squares that remains.
    pub(super) fn fit_seam(
        &mut self,
        problem: &Problem<'_>,
        model: &Model,
        record: Bins<'_>,
    ) -> (Seam, f64) {
        let cost = cost_of(record.square());
        self.run(problem, model, record, Equations::Seam);
        let unknowns = problem.seam_unknowns();
        let normal = &mut self.record;
        normal.prefer_small(&[0.0; MAX_SEAM][..unknowns], cost);
        normal.eliminate_with(problem.level, unknowns);
        let mut solution = [0.0; MAX_SEAM];
        normal.substitute(unknowns, &mut solution);
        let seam = Seam::from_solution(&solution[..unknowns], problem.chain.joints().len());
        (Seam { cost, ..seam }, normal.sum_of_squares())
    }

    /// A seam of zero of a record whose acceleration nobody has measured: its reading is the modelled one.
    pub(super) fn planned_seam(
        &mut self,
        problem: &Problem<'_>,
        model: &Model,
        record: Bins<'_>,
    ) -> Seam {
        self.run(problem, model, record, Equations::Seam);
        Seam { cost: cost_of(self.record.sum_of_squares()), ..Seam::ZERO }
    }

    /// These normal equations of one record, its seam eliminated.
    pub(super) fn assemble(
        &mut self,
        problem: &Problem<'_>,
        model: &Model,
        record: Bins<'_>,
        equations: Equations<'_>,
    ) -> Residuals {
        let residuals = self.run(problem, model, record, equations);
        let unknowns = problem.seam_unknowns();
        let seam = equations.seam();
        let standing = seam.to_solution(problem.chain.joints().len());
        self.record.prefer_small(&standing[..unknowns], seam.cost);
        self.record.eliminate_with(problem.level, unknowns);
        residuals
    }

    /// The normal equations of one record, of this number, at its best seam, which is eliminated.
    pub(super) fn assemble_fitted<const B: usize>(
        &mut self,
        problem: &Problem<'_>,
        coordinates: &Coordinates,
        record: usize,
        experiment: &Experiment<B>,
    ) -> Result<Residuals, LinearisationError> {
        let model = self.model(problem, coordinates, &experiment.pose, record)?;
        let (seam, _) = self.fit_seam(problem, &model, Bins::of(experiment));
        Ok(self.assemble(problem, &model, Bins::of(experiment), Equations::All(&seam)))
    }

    /// Fills the record's normal equations.
    fn run(
        &mut self,
        problem: &Problem<'_>,
        model: &Model,
        record: Bins<'_>,
        equations: Equations<'_>,
    ) -> Residuals {
        let assembly = Assembly::<_, COLUMNS, _> {
            model,
            record,
            equations,
            sought: problem.sought,
            further: (),
            normal: &mut self.record,
            level: problem.level,
        };
        if has_plain_columns(&model.terms, problem.sought) {
            ByResponses { assembly, sums: &mut self.sums }.run()
        } else {
            run(assembly)
        }
    }
}

/// [`Assembly::run`], compiled once: not again for each number of bins, in each crate.
#[inline(never)]
fn run(assembly: Assembly<'_, (), COLUMNS, OF_RECORD>) -> Residuals {
    assembly.run()
}
