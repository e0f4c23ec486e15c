//! The normal equations of one record: its seam, and with it the parameters.
//!
//! The force is measured with noise, too, and is itself unknown. For given parameters its best value is
//!
//! ```text
//! F̂ = F + Σ_F Hᴴ C⁻¹ r        C = Σ_a + H Σ_F Hᴴ        r = A − H F − …
//! ```
//!
//! and the sum of squares that is left of both sensors is `rᴴ C⁻¹ r`, whose derivatives are those of `H F̂`. With those of `H F`
//! the estimate would be biased: the noise in F is in r as well.

use fearless_simd::Level;

use super::batch::{Batch, Bins, COLUMNS, spill};
use super::residuals::Residuals;
use super::rows::{Derivatives, write_seam};
use super::seam::{MAX_SEAM, Seam, unknowns};
use super::whitening::Whitening;
use crate::calibration::Calibration;
use crate::linear::gram::WIDEST;
use crate::linear::normal::Normal;
use crate::linear::packed::packed;
use crate::receptance::lanes::{Kernel, Lanes, Precision};
use crate::receptance::{Complex, PerDof, Response, Terms};
use crate::sought::{MAX_UNKNOWNS, Sought};
use crate::{DOF, MAX_JOINTS};

/// Normal equations of one record.
pub(super) type RecordNormal = Normal<{ packed(MAX_SEAM + MAX_UNKNOWNS + 1) }>;

/// What an assembly is to find.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unknowns {
    /// The seam, all else fixed.
    Seam,
    /// The seam and, behind it, all unknowns that are sought.
    All,
    /// The same of a record whose acceleration nobody has measured: the force is taken as it is.
    Foretold,
}

/// Assembles the normal equations of one record.
pub(super) struct Assembly<'a> {
    pub(super) terms: &'a Terms<f64>,
    pub(super) record: Bins<'a>,
    /// Where the derivatives are taken. The equations of the seam alone are linear, and have its zero.
    pub(super) seam: &'a Seam,
    pub(super) sought: &'a Sought,
    /// The nuisances as they stand.
    pub(super) calibration: &'a Calibration,
    pub(super) unknowns: Unknowns,
    pub(super) normal: &'a mut RecordNormal,
    /// Instruction set.
    pub(super) level: Level,
}

impl Assembly<'_> {
    /// Fills `normal` (not yet eliminated). Returns the residuals of all unknowns; of the seam alone there are none.
    pub(super) fn run(self) -> Residuals {
        f64::dispatch(self.level, self)
    }
}

impl Kernel<f64> for Assembly<'_> {
    type Output = Residuals;

    #[inline(always)]
    fn run<V: Lanes<Scalar = f64>>(self, like: V) -> Residuals {
        let Self { terms, record, seam, sought, calibration, unknowns: wanted, normal, level } =
            self;
        let joints = terms.joints.len();
        let seam_columns = unknowns(joints, terms.feels_gravity());
        let all = wanted != Unknowns::Seam;
        let columns = seam_columns + if all { sought.unknowns() } else { 0 };
        let derivatives = Derivatives::new(sought, calibration, seam_columns);
        normal.reset(columns);
        let bins = record.bins();
        let mut residuals = Residuals::new(bins);
        let gain = &calibration.force_gain;
        let mut rows = V::each([[0.0; COLUMNS]; 6]);
        let rows = rows.as_mut();
        let mut loads = [[Complex::zero(like); DOF]; MAX_JOINTS];
        let mut response = Response::new(like);
        for first in (0..bins).step_by(V::WIDTH) {
            let lanes = V::WIDTH.min(bins - first);
            let mut batch = Batch::new(like, &record, gain, first);
            if all {
                seam_loads(seam, batch.inverse_s, joints, &mut loads);
            }
            response.read(terms, batch.s, &batch.force, all.then_some(&loads));

            let mut unexplained = [[[0.0; 2]; 3]; WIDEST];
            let mut weights = [Whitening::default(); WIDEST];
            let mut force_error = [[[0.0; WIDEST]; 2]; 3];
            let reading = response.observed.map(spill);
            let mut accelerance = [[[[0.0; WIDEST]; 2]; 3]; 3];
            for (spilled, row) in accelerance.iter_mut().zip(&response.per_force) {
                *spilled = row.map(spill);
            }
            for lane in 0..lanes {
                let measured = record.measured(first + lane);
                for axis in 0..3 {
                    let jump = seam.jump(axis, &batch.powers[lane]);
                    for part in 0..2 {
                        unexplained[lane][axis][part] =
                            measured[axis][part] - reading[axis][part][lane] - jump[part];
                    }
                }
                let at = |z: &[[f64; WIDEST]; 2]| Complex { re: z[0][lane], im: z[1][lane] };
                let accelerance = accelerance.each_ref().map(|row| row.each_ref().map(at));
                let [force_noise, acceleration_noise] = record.noise(gain, first + lane);
                weights[lane] = Whitening::new(&acceleration_noise, &force_noise, &accelerance);
                if wanted == Unknowns::All {
                    let errors =
                        weights[lane].force_error(&force_noise, &accelerance, &unexplained[lane]);
                    for (axis, error) in errors.into_iter().enumerate() {
                        force_error[axis][0][lane] = error.re;
                        force_error[axis][1][lane] = error.im;
                    }
                }
            }

            let mut better = [Complex::zero(like); 3];
            for axis in 0..3 {
                let [re, im] = &force_error[axis];
                better[axis] = Complex::new(like.load(re), like.load(im));
                batch.force[axis] = batch.force[axis] + better[axis];
            }
            response.elongate(terms, batch.s, all.then_some(&better));
            write_seam(rows, &response, &batch, joints);
            if all {
                derivatives.write(rows, &response, terms, &batch);
            }
            for lane in 0..lanes {
                let rows = &mut rows[lane];
                for axis in 0..3 {
                    for part in 0..2 {
                        rows[2 * axis + part][columns] = unexplained[lane][axis][part];
                    }
                }
                weights[lane].apply(rows, columns + 1);
                if !all {
                    continue;
                }
                let white = [0, 2, 4].map(|row| [rows[row][columns], rows[row + 1][columns]]);
                let measured = record.measured(first + lane);
                let mut model = measured;
                for axis in 0..3 {
                    for part in 0..2 {
                        model[axis][part] -= unexplained[lane][axis][part];
                    }
                }
                residuals.take(&measured, &model, &white);
            }
            normal.add_all(level, rows[..lanes].as_flattened());
        }
        residuals
    }
}

/// What the seam loads every bushing with: impulses, and steps by `1/s`.
#[inline(always)]
fn seam_loads<V: Lanes<Scalar = f64>>(
    seam: &Seam,
    inverse_s: Complex<V>,
    joints: usize,
    loads: &mut PerDof<V>,
) {
    let like = inverse_s.im;
    for joint in 0..joints {
        for dof in 0..DOF {
            let step = inverse_s.im * like.fill(seam.step[joint][dof]);
            loads[joint][dof] = Complex::new(like.fill(seam.impulse[joint][dof]), step);
        }
    }
}
