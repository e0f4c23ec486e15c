//! The normal equations of one record: its seam, and with it the parameters.

use fearless_simd::Level;
use nalgebra::Matrix3;

use super::normal::{Normal, packed};
use super::residuals::Residuals;
use super::seam::{MAX_SEAM, Seam, unknowns};
use super::whitening::Whitening;
use crate::calibration::Calibration;
use crate::receptance::gradient::PerDof;
use crate::receptance::lanes::{Kernel, Lanes, Precision};
use crate::receptance::{Complex, Response, Terms};
use crate::spectrum::{Experiment, Spectrum};
use crate::unknowns::{Coordinate, MAX_UNKNOWNS, Sought};
use crate::{DOF, MAX_JOINTS};

/// Columns of a row: seam, what is sought, residual.
const COLUMNS: usize = MAX_SEAM + MAX_UNKNOWNS + 1;
/// Normal equations of one record.
pub(super) type RecordNormal = Normal<{ packed(COLUMNS) }>;
/// Widest vector.
const MAX_WIDTH: usize = 8;

/// The bins of one record.
pub(super) struct Bins<'a> {
    spacing: f64,
    first_bin: usize,
    /// Per axis real and imaginary parts.
    force: [[&'a [f32]; 2]; 3],
    acceleration: [[&'a [f32]; 2]; 3],
    force_noise: [f64; 3],
    acceleration_noise: [f64; 3],
    seam: Seam,
    whitening: &'a mut [Whitening],
}

impl<'a> Bins<'a> {
    pub(super) fn of<const B: usize>(experiment: &'a mut Experiment<B>) -> Self {
        let parts = |spectrum: &'a Spectrum<B>| {
            core::array::from_fn(|axis| [&spectrum.re[axis][..], &spectrum.im[axis][..]])
        };
        // There are as many bins as there is room for at most.
        let _ = experiment.whitening.resize_default(experiment.force.re[0].len());
        Self {
            spacing: experiment.spacing,
            first_bin: experiment.first_bin,
            force: parts(&experiment.force),
            acceleration: parts(&experiment.acceleration),
            force_noise: experiment.force_noise,
            acceleration_noise: experiment.acceleration_noise,
            seam: experiment.seam,
            whitening: &mut experiment.whitening,
        }
    }

    fn bins(&self) -> usize {
        self.whitening.len()
    }

    fn omega(&self, bin: usize) -> f64 {
        (self.first_bin + bin) as f64 * self.spacing
    }
}

/// What an assembly is to find.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unknowns {
    /// The seam, all else fixed.
    Seam,
    /// The seam and, behind it, all unknowns that are sought.
    All,
}

/// Assembles the normal equations of one record.
pub(super) struct Assembly<'a> {
    pub(super) terms: &'a Terms<f64>,
    pub(super) record: Bins<'a>,
    pub(super) sought: &'a Sought,
    /// The nuisances as they stand.
    pub(super) calibration: &'a Calibration,
    pub(super) unknowns: Unknowns,
    /// Whether the weights follow the parameters, else they stay as they are.
    pub(super) reweigh: bool,
    pub(super) normal: &'a mut RecordNormal,
}

impl Assembly<'_> {
    /// Fills `normal` (not yet eliminated). Returns what is left: with all unknowns, at the seam as it stands.
    pub(super) fn run(self, level: Level) -> Residuals {
        f64::dispatch(level, self)
    }
}

impl Kernel<f64> for Assembly<'_> {
    type Output = Residuals;

    #[inline(always)]
    fn run<V: Lanes<Scalar = f64>>(self, like: V) -> Residuals {
        let Self { terms, record, sought, calibration, unknowns: wanted, reweigh, normal } = self;
        let joints = terms.joints.len();
        let seam_columns = unknowns(joints);
        let all = wanted == Unknowns::All;
        let columns = seam_columns + if all { sought.unknowns() } else { 0 };
        let derivatives = Derivatives::new(sought, calibration, seam_columns);
        normal.reset(columns);
        let bins = record.bins();
        // The seam is linear: alone it is found from zero, with the parameters q must contain it.
        let seam = if all { record.seam } else { Seam::default() };
        let mut residuals = Residuals::new(bins);
        let force_noise: [f64; 3] = core::array::from_fn(|axis| {
            let gain = calibration.force_gain[axis];
            record.force_noise[axis] / (gain * gain)
        });
        let mut rows = [[[0.0; COLUMNS]; 6]; MAX_WIDTH];
        let mut loads = [[Complex::zero(like); DOF]; MAX_JOINTS];
        let mut response = Response::new(like);
        for first in (0..bins).step_by(V::WIDTH) {
            let gain = &calibration.force_gain;
            let batch = Batch::new(like, &record, gain, first);
            if all {
                seam_loads(&seam, batch.inverse_s, joints, &mut loads);
            }
            response.evaluate(terms, batch.s, &batch.force, all.then_some(&loads));
            write_seam(&mut rows, &response, &batch, joints);
            if all {
                derivatives.write(&mut rows, &response, terms, &batch);
            }
            let mut reading = [[[0.0; MAX_WIDTH]; 2]; 3];
            for axis in 0..3 {
                reading[axis] = spill(response.acceleration[axis]);
            }
            let mut accelerance = [[[[0.0; MAX_WIDTH]; 2]; 3]; 3];
            if reweigh {
                for (spilled, row) in accelerance.iter_mut().zip(&response.accelerance) {
                    *spilled = row.map(spill);
                }
            }
            for lane in 0..V::WIDTH.min(bins - first) {
                let bin = first + lane;
                let rows = &mut rows[lane];
                let ratio = (record.first_bin + bin) as f64;
                let (mut measured, mut model) = ([[0.0; 2]; 3], [[0.0; 2]; 3]);
                for axis in 0..3 {
                    model[axis] = [
                        reading[axis][0][lane] + seam.constant[axis],
                        reading[axis][1][lane] + seam.slope[axis] * ratio,
                    ];
                    measured[axis] = [
                        f64::from(record.acceleration[axis][0][bin]),
                        f64::from(record.acceleration[axis][1][bin]),
                    ];
                    for part in 0..2 {
                        rows[2 * axis + part][columns] = measured[axis][part] - model[axis][part];
                    }
                }
                if reweigh {
                    let at = |z: &[[f64; MAX_WIDTH]; 2]| Complex { re: z[0][lane], im: z[1][lane] };
                    let accelerance = accelerance.each_ref().map(|row| row.each_ref().map(at));
                    record.whitening[bin] =
                        Whitening::new(&record.acceleration_noise, &force_noise, &accelerance);
                }
                record.whitening[bin].apply(rows, columns + 1);
                normal.add(rows);
                let white = [0, 2, 4].map(|row| [rows[row][columns], rows[row + 1][columns]]);
                residuals.take(&measured, &model, &white);
            }
        }
        residuals
    }
}

/// One bin per lane; the last bin is repeated where the band ends.
struct Batch<V> {
    s: Complex<V>,
    inverse_s: Complex<V>,
    force: [Complex<V>; 3],
    /// ω/ω₀ of each lane.
    ratio: [f64; MAX_WIDTH],
}

impl<V: Lanes<Scalar = f64>> Batch<V> {
    #[inline(always)]
    fn new(like: V, record: &Bins<'_>, force_gain: &[f64; 3], first: usize) -> Self {
        let last = record.bins() - 1;
        let gather = |value: &dyn Fn(usize) -> f64| {
            let mut lanes = [0.0; MAX_WIDTH];
            for (lane, target) in lanes[..V::WIDTH].iter_mut().enumerate() {
                *target = value((first + lane).min(last));
            }
            like.load(&lanes)
        };
        let zero = like.fill(0.0);
        let omega = gather(&|bin| record.omega(bin));
        let inverse = gather(&|bin| -1.0 / record.omega(bin));
        let force = core::array::from_fn(|axis| Complex {
            re: gather(&|bin| f64::from(record.force[axis][0][bin]) / force_gain[axis]),
            im: gather(&|bin| f64::from(record.force[axis][1][bin]) / force_gain[axis]),
        });
        let mut ratio = [0.0; MAX_WIDTH];
        for (lane, ratio) in ratio[..V::WIDTH].iter_mut().enumerate() {
            *ratio = (record.first_bin + (first + lane).min(last)) as f64;
        }
        Self { s: Complex::new(zero, omega), inverse_s: Complex::new(zero, inverse), force, ratio }
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

type Rows = [[[f64; COLUMNS]; 6]; MAX_WIDTH];

#[inline(always)]
fn write_seam<V: Lanes<Scalar = f64>>(
    rows: &mut Rows,
    response: &Response<V>,
    batch: &Batch<V>,
    joints: usize,
) {
    for axis in 0..3 {
        for joint in 0..joints {
            for dof in 0..DOF {
                let impulse = response.per_load[axis][joint][dof];
                let column = 2 * DOF * joint + dof;
                write(rows, axis, column, impulse);
                write(rows, axis, column + DOF, impulse * batch.inverse_s);
            }
        }
        let jumps = 2 * DOF * joints;
        for (lane, rows) in rows[..V::WIDTH].iter_mut().enumerate() {
            for other in 0..3 {
                let own = f64::from(u8::from(other == axis));
                rows[2 * axis][jumps + other] = own;
                rows[2 * axis + 1][jumps + other] = 0.0;
                rows[2 * axis][jumps + 3 + other] = 0.0;
                rows[2 * axis + 1][jumps + 3 + other] = own * batch.ratio[lane];
            }
        }
    }
}

/// Where the derivatives in each coordinate go, and what they need.
struct Derivatives<'a> {
    sought: &'a Sought,
    turning: [Matrix3<f64>; 3],
    /// Column of each coordinate, and whether it is added to what another has written there.
    columns: [Option<(usize, bool)>; MAX_UNKNOWNS],
}

impl<'a> Derivatives<'a> {
    fn new(sought: &'a Sought, calibration: &Calibration, first: usize) -> Self {
        let mut columns = [None; MAX_UNKNOWNS];
        for (index, unknown) in sought.sought() {
            columns[index] = Some((first + unknown, !sought.leads(index)));
        }
        Self { sought, turning: calibration.turning(), columns }
    }

    #[inline(always)]
    fn write<V: Lanes<Scalar = f64>>(
        &self,
        rows: &mut Rows,
        response: &Response<V>,
        terms: &Terms<f64>,
        batch: &Batch<V>,
    ) {
        for joint in 0..terms.joints.len() {
            for dof in 0..DOF {
                let derivatives = response.derivatives(terms, batch.s, joint, dof);
                let index = Coordinate::Stiffness { joint, dof }.index();
                for (axis, [stiffness, damping]) in derivatives.into_iter().enumerate() {
                    self.put(rows, axis, index, stiffness);
                    self.put(rows, axis, index + DOF, damping);
                }
            }
        }
        for (index, _) in self.sought.nuisances() {
            let coordinate = Coordinate::of(index);
            let width = self.sought.width(coordinate);
            for axis in 0..3 {
                let derivative = self.nuisance(coordinate, axis, response, batch);
                self.put(rows, axis, index, derivative.scale(batch.s.re.fill(width)));
            }
        }
    }

    #[inline(always)]
    fn nuisance<V: Lanes<Scalar = f64>>(
        &self,
        coordinate: Coordinate,
        axis: usize,
        response: &Response<V>,
        batch: &Batch<V>,
    ) -> Complex<V> {
        let like = batch.s.re;
        let reading = response.acceleration[axis];
        match coordinate {
            Coordinate::Delay => -(batch.s * reading),
            Coordinate::AccelerationGain(own) if own == axis => reading,
            Coordinate::ForceGain(push) => -(response.accelerance[axis][push] * batch.force[push]),
            Coordinate::Misalignment(about) => {
                let row = self.turning[about].row(axis);
                let mut sum = Complex::zero(like);
                for other in 0..3 {
                    let entry = like.fill(row[other]);
                    sum = sum.plus_real(response.acceleration[other], entry);
                }
                sum
            }
            Coordinate::Mass(link) => response.per_mass[axis][link],
            _ => Complex::zero(like),
        }
    }

    #[inline(always)]
    fn put<V: Lanes<Scalar = f64>>(
        &self,
        rows: &mut Rows,
        axis: usize,
        index: usize,
        value: Complex<V>,
    ) {
        match self.columns[index] {
            Some((column, false)) => write(rows, axis, column, value),
            Some((column, true)) => {
                let [re, im] = spill(value);
                for (lane, rows) in rows[..V::WIDTH].iter_mut().enumerate() {
                    rows[2 * axis][column] += re[lane];
                    rows[2 * axis + 1][column] += im[lane];
                }
            }
            None => {}
        }
    }
}

#[inline(always)]
fn write<V: Lanes<Scalar = f64>>(rows: &mut Rows, axis: usize, column: usize, value: Complex<V>) {
    let [re, im] = spill(value);
    for (lane, rows) in rows[..V::WIDTH].iter_mut().enumerate() {
        rows[2 * axis][column] = re[lane];
        rows[2 * axis + 1][column] = im[lane];
    }
}

/// Real and imaginary parts, lane by lane.
#[inline(always)]
fn spill<V: Lanes<Scalar = f64>>(value: Complex<V>) -> [[f64; MAX_WIDTH]; 2] {
    [value.re, value.im].map(|part| {
        let mut lanes = [0.0; MAX_WIDTH];
        part.store(&mut lanes);
        lanes
    })
}

#[cfg(test)]
mod tests;
