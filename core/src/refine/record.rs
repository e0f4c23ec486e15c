//! The normal equations of one record, its seam projected out.

#[cfg(test)]
mod tests;

use heapless::Vec;

use super::basis::Basis;
use super::batch::{Batch, Bins, spill};
use super::equations::{Assembly, Equations, Reading, by_lane, whiten};
use super::model::Model;
use super::modelled::{self, Place};
use super::plant::columns::Columns;
use super::problem::Problem;
use super::residuals::Residuals;
use super::responses::{self, Bin, OTHERS, Sums};
use super::seam::{MAX_SEAM, NO_SEAM, Seam, cost_of};
use super::sizes::{COLUMNS, MAX_SEAMS, OF_RECORD, RecordNormal};
use super::summary::Summary;
use super::whitening::{Whitening, WhiteningOfLanes};
use crate::DOF;
use crate::chain::{linearise::LinearisationError, poses_agree};
use crate::imperfection::Correction;
use crate::linear::gram::WIDEST;
use crate::linear::normal::Normal;
use crate::receptance::lanes::{Kernel, Lanes, Precision as _};
use crate::receptance::{Response, Terms};
use crate::sought::{Coordinate, MAX_UNKNOWNS, Sought};

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
    /// Seams of the first parts of records, each at its best, at the point where the cost was evaluated last.
    pub(super) seams: Vec<Seam, MAX_SEAMS>,
    /// Sums over the residuals where the normal equations of all unknowns were assembled last.
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

    /// The model in a part of a record.
    pub(super) fn model(
        &self,
        problem: &Problem<'_>,
        place: Place<'_>,
    ) -> Result<Model, LinearisationError> {
        modelled::corrected(problem, &self.correction, place)
    }

    /// The seam that fits a record best, and the sum of squares that remains.
    pub(super) fn fit_seam(
        &mut self,
        problem: &Problem<'_>,
        model: &Model,
        record: Bins<'_>,
    ) -> (Seam, f64) {
        if !record.has_seam() {
            self.run(problem, model, record, Equations::Seam, Columns::NONE);
            let seam = Seam { cost: NO_SEAM, ..Seam::ZERO };
            return (seam, self.record.sum_of_squares());
        }
        let cost = cost_of(record.square(), record.parts());
        self.run(problem, model, record, Equations::Seam, Columns::NONE);
        let (unknowns, normal) = (problem.seam_unknowns(), &mut self.record);
        problem.eliminate_seam(&Seam { cost, ..Seam::ZERO }, normal);
        let mut solution = [0.0; MAX_SEAM];
        normal.substitute(unknowns, &mut solution);
        let seam = Seam::from_solution(&solution[..unknowns], problem.chain.joints().len());
        (Seam { cost, ..seam }, normal.sum_of_squares())
    }

    /// A seam of zero of a record whose acceleration nobody has measured: its reading is the modelled one.
    fn planned_seam(&mut self, problem: &Problem<'_>, model: &Model, record: Bins<'_>) -> Seam {
        let (has_seam, parts) = (record.has_seam(), record.parts());
        self.run(problem, model, record, Equations::Seam, Columns::NONE);
        let cost = if has_seam { cost_of(self.record.sum_of_squares(), parts) } else { NO_SEAM };
        Seam { cost, ..Seam::ZERO }
    }

    /// The seam of a record that is measured or planned.
    pub(super) fn seam(
        &mut self,
        problem: &Problem<'_>,
        model: &Model,
        record: Bins<'_>,
        basis: Basis,
    ) -> Seam {
        match basis {
            Basis::Measured => self.fit_seam(problem, model, record).0,
            Basis::Planned => self.planned_seam(problem, model, record),
        }
    }

    /// Fills the record's normal equations.
    pub(super) fn run(
        &mut self,
        problem: &Problem<'_>,
        model: &Model,
        record: Bins<'_>,
        equations: Equations<'_>,
        columns: Columns<'_>,
    ) -> Residuals {
        let assembly = Assembly::<COLUMNS, _> {
            model,
            record,
            equations,
            sought: problem.sought,
            columns,
            normal: &mut self.record,
            level: problem.level,
        };
        if assembly.record.is_on_axis() && has_plain_columns(&model.terms, problem.sought) {
            ByResponses { assembly, sums: &mut self.sums }.run()
        } else {
            run(assembly)
        }
    }
}

/// [`Assembly::run`], compiled once: not again for each number of bins, in each crate.
#[inline(never)]
fn run(assembly: Assembly<'_, COLUMNS, OF_RECORD>) -> Residuals {
    assembly.run()
}

/// Returns whether all columns are multiples of the responses by the numbers that [`super::responses`] names: dampings go with the velocity,
/// stiffnesses do not change with the frequency, and nothing but parameters is sought.
pub(super) fn has_plain_columns(terms: &Terms<f64>, sought: &Sought) -> bool {
    terms.has_plain_bushings() && sought.imperfections().is_empty()
}

/// Assembles the normal equations of a record that [`has_plain_columns`], from its responses to unit loads.
pub(super) struct ByResponses<'a> {
    pub(super) assembly: Assembly<'a, COLUMNS, OF_RECORD>,
    pub(super) sums: &'a mut Sums,
}

impl ByResponses<'_> {
    /// Runs as [`Assembly::run`], compiled once.
    #[inline(never)]
    pub(super) fn run(self) -> Residuals {
        f64::dispatch(self.assembly.level, self)
    }
}

impl Kernel<f64> for ByResponses<'_> {
    type Output = Residuals;

    #[inline(always)]
    fn run<V: Lanes<Scalar = f64>>(self, like: V) -> Residuals {
        let Self { assembly, sums } = self;
        let (model, record) = (assembly.model, &assembly.record);
        let joints = model.terms.joints.len();
        let has_unknowns = assembly.equations.has_unknowns();
        let jumps = assembly.seam_columns() - 2 * DOF * joints;
        sums.reset(joints, jumps, has_unknowns, record.lowest());
        let count = record.bins();
        let mut residuals = Residuals::new(count);
        let mut response = Response::new(like);
        let mut bins = V::each(Bin::ZERO);
        let bins = bins.as_mut();
        for first in (0..count).step_by(V::WIDTH) {
            let lanes = first..count.min(first + V::WIDTH);
            let mut batch = assembly.batch(like, first);
            let unexplained = assembly.read(&mut response, &batch, lanes.clone());
            let accelerance = by_lane(&response.per_force);
            let noise = assembly.noise(lanes.clone());
            let weights = whiten(&noise, &accelerance, lanes.len());
            let error =
                assembly.correct(like, &weights, &noise, &accelerance, &unexplained, lanes.len());
            assembly.elongate(&mut response, &mut batch, &error);
            write_loads(
                bins,
                &response,
                &WhiteningOfLanes::new(like, &weights),
                joints,
                has_unknowns,
            );
            let bins = &mut bins[..lanes.len()];
            write_others(bins, &batch, &weights, &unexplained);
            if has_unknowns {
                for (lane, bin) in lanes.enumerate() {
                    let white = bins[lane].others[OTHERS - 1];
                    assembly.take_residual(&mut residuals, bin, &unexplained[lane], &white);
                }
            }
            sums.add(assembly.level, bins);
        }
        let mut columns = [None; MAX_UNKNOWNS];
        for (index, unknown) in assembly.sought.sought().filter(|_| has_unknowns) {
            columns[index] = Some(assembly.first() + unknown);
        }
        assembly.normal.reset(assembly.columns());
        sums.write(assembly.normal, |load| {
            let (joint, dof) = (load / DOF, load % DOF);
            let bushing = &model.terms.joints[joint];
            let impulse = 2 * DOF * joint + dof;
            let index = Coordinate::Stiffness { joint, dof }.index();
            responses::Columns {
                impulse,
                step: impulse + DOF,
                stiffness: columns[index].map(|column| (column, -bushing.stiffness[dof])),
                damping: columns[index + DOF].map(|column| (column, -bushing.damping[dof])),
            }
        });
        residuals
    }
}

/// Whitened responses to unit loads, and elongations.
#[inline(always)]
fn write_loads<V: Lanes<Scalar = f64>>(
    bins: &mut [Bin],
    response: &Response<V>,
    weights: &WhiteningOfLanes<V>,
    joints: usize,
    has_unknowns: bool,
) {
    for joint in 0..joints {
        for dof in 0..DOF {
            let load = DOF * joint + dof;
            let white = weights.white([0, 1, 2].map(|axis| response.per_load[axis][joint][dof]));
            for (axis, value) in white.into_iter().enumerate() {
                let spilled = spill(value);
                for (lane, bin) in bins.iter_mut().enumerate() {
                    for part in 0..2 {
                        bin.loads[axis][part][load] = spilled[part][lane];
                    }
                }
            }
            if has_unknowns {
                let spilled = spill(response.elongation[joint][dof]);
                for (lane, bin) in bins.iter_mut().enumerate() {
                    for part in 0..2 {
                        bin.elongations[part][load] = spilled[part][lane];
                    }
                }
            }
        }
    }
}

/// Whitened jumps, and the residual.
#[inline(always)]
fn write_others<V: Lanes<Scalar = f64>>(
    bins: &mut [Bin],
    batch: &Batch<V>,
    weights: &[Whitening; WIDEST],
    unexplained: &[Reading; WIDEST],
) {
    let [_, omega] = spill(batch.s);
    for (lane, bin) in bins.iter_mut().enumerate() {
        bin.omega = omega[lane];
        let white =
            |reading: &Reading| weights[lane].white(reading).map(|value| [value.re, value.im]);
        for axis in 0..3 {
            let mut unit = [[0.0; 2]; 3];
            unit[axis][0] = 1.0;
            bin.others[axis] = white(&unit);
        }
        bin.others[OTHERS - 1] = white(&unexplained[lane]);
    }
}
