//! The normal equations of one record: its seam, and with it the parameters.

use fearless_simd::Level;

use super::normal::{Normal, packed};
use super::seam::{MAX_SEAM, Seam, unknowns};
use super::whitening::Whitening;
use crate::parameters::MAX_PARAMETERS;
use crate::receptance::gradient::PerDof;
use crate::receptance::lanes::{Kernel, Lanes, Precision, Scalar};
use crate::receptance::{Complex, Response, Terms};
use crate::spectrum::Experiment;
use crate::{DOF, MAX_JOINTS};

/// Columns of a row: seam, parameters, residual.
const COLUMNS: usize = MAX_SEAM + MAX_PARAMETERS + 1;
/// Normal equations of one record.
pub(super) type RecordNormal = Normal<{ packed(COLUMNS) }>;
/// Widest vector of any precision.
const MAX_WIDTH: usize = 16;

/// What an assembly is to find.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unknowns {
    /// The seam, at fixed parameters.
    Seam,
    /// The seam and, behind it, the logarithms of the parameters: joint by joint, six stiffnesses, six dampings.
    SeamAndParameters,
}

/// Surface similarity parameter per direction.
pub(super) type Similarity = [f64; 3];

/// Assembles the normal equations of one record.
pub(super) struct Assembly<'a, T, const B: usize> {
    pub(super) terms: &'a Terms<T>,
    pub(super) experiment: &'a mut Experiment<B>,
    pub(super) unknowns: Unknowns,
    /// Whether the weights follow the parameters, else they stay as they are.
    pub(super) reweigh: bool,
    pub(super) normal: &'a mut RecordNormal,
}

impl<T: Precision, const B: usize> Assembly<'_, T, B> {
    /// Fills `normal` (not yet eliminated). Returns the SSP per direction at the seam as it stands.
    pub(super) fn run(self, level: Level) -> Similarity {
        T::dispatch(level, self)
    }
}

impl<T: Scalar, const B: usize> Kernel<T> for Assembly<'_, T, B> {
    type Output = Similarity;

    #[inline(always)]
    fn run<V: Lanes<Scalar = T>>(self, like: V) -> Similarity {
        let Self { terms, experiment, unknowns: sought, reweigh, normal } = self;
        let joints = terms.joints.len();
        let seam_columns = unknowns(joints);
        let with_parameters = sought == Unknowns::SeamAndParameters;
        let columns = seam_columns + if with_parameters { 2 * DOF * joints } else { 0 };
        normal.reset(columns);
        let bins = experiment.bins();
        if reweigh {
            experiment.whitening.clear();
        }
        // The seam is linear: alone it is found from zero, with the parameters q must contain it.
        let seam = if with_parameters { experiment.seam } else { Seam::default() };
        let mut similarity = [0.0; 3];
        let mut rows = [[[0.0; COLUMNS]; 6]; MAX_WIDTH];
        let mut response = Response::new(like);
        for first in (0..bins).step_by(V::WIDTH) {
            let batch = Batch::new(like, experiment, &seam, joints, first);
            response.evaluate(terms, batch.s, &batch.force, &batch.seam);
            write_seam(&mut rows, &response, &batch, joints);
            if with_parameters {
                write_parameters(&mut rows, &response, terms, &batch, seam_columns);
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
                let ratio = experiment.omega(bin) / experiment.spacing;
                for axis in 0..3 {
                    let model = [
                        reading[axis][0][lane] + seam.constant[axis],
                        reading[axis][1][lane] + seam.slope[axis] * ratio,
                    ];
                    let measured = [
                        f64::from(experiment.acceleration.re[axis][bin]),
                        f64::from(experiment.acceleration.im[axis][bin]),
                    ];
                    rows[2 * axis][columns] = measured[0] - model[0];
                    rows[2 * axis + 1][columns] = measured[1] - model[1];
                    similarity[axis] += crate::loss::ssp_term(measured, model) / bins as f64;
                }
                if reweigh {
                    let at = |z: &[[f64; MAX_WIDTH]; 2]| Complex { re: z[0][lane], im: z[1][lane] };
                    let accelerance = accelerance.each_ref().map(|row| row.each_ref().map(at));
                    let _ = experiment.whitening.push(Whitening::new(
                        &experiment.acceleration_noise,
                        &experiment.force_noise,
                        &accelerance,
                    ));
                }
                experiment.whitening[bin].apply(rows, columns + 1);
                normal.add(rows);
            }
        }
        similarity
    }
}

/// One bin per lane; the last bin is repeated where the band ends.
struct Batch<V> {
    s: Complex<V>,
    inverse_s: Complex<V>,
    force: [Complex<V>; 3],
    seam: PerDof<V>,
    /// ω/ω₀ of each lane.
    ratio: [f64; MAX_WIDTH],
}

impl<V: Lanes> Batch<V> {
    #[inline(always)]
    fn new<const B: usize>(
        like: V,
        experiment: &Experiment<B>,
        seam: &Seam,
        joints: usize,
        first: usize,
    ) -> Self {
        let last = experiment.bins() - 1;
        let gather = |value: &dyn Fn(usize) -> f64| {
            let mut lanes = [V::Scalar::default(); MAX_WIDTH];
            for (lane, target) in lanes[..V::WIDTH].iter_mut().enumerate() {
                *target = V::Scalar::from_f64(value((first + lane).min(last)));
            }
            like.load(&lanes)
        };
        let zero = like.fill(V::Scalar::default());
        let omega = gather(&|bin| experiment.omega(bin));
        let inverse = gather(&|bin| -1.0 / experiment.omega(bin));
        let force = core::array::from_fn(|axis| Complex {
            re: gather(&|bin| f64::from(experiment.force.re[axis][bin])),
            im: gather(&|bin| f64::from(experiment.force.im[axis][bin])),
        });
        let mut loads = [[Complex::zero(like); DOF]; MAX_JOINTS];
        for joint in 0..joints {
            for dof in 0..DOF {
                let fill = |value: f64| like.fill(V::Scalar::from_f64(value));
                loads[joint][dof] = Complex::new(
                    fill(seam.impulse[joint][dof]),
                    inverse * fill(seam.step[joint][dof]),
                );
            }
        }
        let mut ratio = [0.0; MAX_WIDTH];
        for (lane, ratio) in ratio[..V::WIDTH].iter_mut().enumerate() {
            *ratio = (experiment.first_bin + (first + lane).min(last)) as f64;
        }
        Self {
            s: Complex::new(zero, omega),
            inverse_s: Complex::new(zero, inverse),
            force,
            seam: loads,
            ratio,
        }
    }
}

type Rows = [[[f64; COLUMNS]; 6]; MAX_WIDTH];

#[inline(always)]
fn write_seam<V: Lanes>(rows: &mut Rows, response: &Response<V>, batch: &Batch<V>, joints: usize) {
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

#[inline(always)]
fn write_parameters<V: Lanes>(
    rows: &mut Rows,
    response: &Response<V>,
    terms: &Terms<V::Scalar>,
    batch: &Batch<V>,
    first: usize,
) {
    for joint in 0..terms.joints.len() {
        for dof in 0..DOF {
            let derivatives = response.derivatives(terms, batch.s, joint, dof);
            let column = first + 2 * DOF * joint + dof;
            for (axis, [stiffness, damping]) in derivatives.into_iter().enumerate() {
                write(rows, axis, column, stiffness);
                write(rows, axis, column + DOF, damping);
            }
        }
    }
}

#[inline(always)]
fn write<V: Lanes>(rows: &mut Rows, axis: usize, column: usize, value: Complex<V>) {
    let [re, im] = spill(value);
    for (lane, rows) in rows[..V::WIDTH].iter_mut().enumerate() {
        rows[2 * axis][column] = re[lane];
        rows[2 * axis + 1][column] = im[lane];
    }
}

/// Real and imaginary parts, lane by lane.
#[inline(always)]
fn spill<V: Lanes>(value: Complex<V>) -> [[f64; MAX_WIDTH]; 2] {
    [value.re, value.im].map(|part| {
        let mut lanes = [V::Scalar::default(); MAX_WIDTH];
        part.store(&mut lanes);
        lanes.map(Scalar::to_f64)
    })
}
