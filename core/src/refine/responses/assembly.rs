//! The responses of each bin of a record.

use super::products::Columns;
use super::sums::Sums;
use super::{Bin, OTHERS};
use crate::DOF;
use crate::linear::gram::WIDEST;
use crate::receptance::lanes::{Kernel, Lanes, Precision as _};
use crate::receptance::{Response, Terms};
use crate::refine::batch::COLUMNS;
use crate::refine::batch::{Batch, spill};
use crate::refine::equations::{Assembly, OF_RECORD, Reading, by_lane, whiten};
use crate::refine::residuals::Residuals;
use crate::refine::whitening::{Whitening, WhiteningOfLanes};
use crate::sought::{Coordinate, MAX_UNKNOWNS, Sought};

/// Whether all columns are multiples of the responses by the numbers that [`super`] names: dampings go with the velocity, stiffnesses do not
/// change with the frequency, and nothing but parameters is sought.
pub(in crate::refine) fn has_plain_columns(terms: &Terms<f64>, sought: &Sought) -> bool {
    terms.has_plain_bushings() && sought.nuisances().next().is_none()
}

/// Assembles the normal equations of a record that [`has_plain_columns`].
pub(in crate::refine) struct ByResponses<'a> {
    pub(in crate::refine) assembly: Assembly<'a, (), COLUMNS, OF_RECORD>,
    pub(in crate::refine) sums: &'a mut Sums,
}

impl ByResponses<'_> {
    /// As [`Assembly::run`], compiled once.
    #[inline(never)]
    pub(in crate::refine) fn run(self) -> Residuals {
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
            let mut batch = Batch::new(like, record, model, first);
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
            Columns {
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
