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
//!
//! As many bins as a vector has lanes pass through five steps: read, whiten, correct, rows, accumulate.

use core::ops::Range;

use fearless_simd::Level;

use super::batch::{Batch, Bins, spill};
use super::model::Model;
use super::plant::columns::Columns;
use super::residuals::Residuals;
use super::rows::{Derivatives, Rows, write_seam};
use super::seam::{Seam, unknowns};
use super::whitening::Whitening;
use crate::linear::gram::WIDEST;
use crate::linear::normal::Normal;
use crate::receptance::lanes::{Kernel, Lanes, Precision};
use crate::receptance::{Complex, PerDof, Response};
use crate::sought::Sought;
use crate::{DOF, MAX_JOINTS};

/// Real and imaginary part along each axis of the accelerometer.
pub(super) type Reading = [[f64; 2]; 3];
/// Reading `[row]` per force `[column]`.
pub(super) type Accelerance = [[Complex<f64>; 3]; 3];
/// Mean squares along each axis: of the force's noise, of the acceleration's.
pub(super) type Noise = [[f64; 3]; 2];

/// The normal equations of a record, and the seam at which they are taken.
#[derive(Clone, Copy, Debug)]
pub(super) enum Equations<'a> {
    /// Equations of the seam alone. They are linear, and taken at zero.
    Seam,
    /// Equations of the seam and, behind it, of all unknowns.
    All(&'a Seam),
    /// Equations of all unknowns for a record whose acceleration nobody has measured: the force has no error.
    Planned(&'a Seam),
    /// Equations of all unknowns where nothing but a seam moves the robot.
    Noise(&'a Seam),
}

impl<'a> Equations<'a> {
    /// The seam at which the equations are taken.
    pub(super) fn seam(self) -> &'a Seam {
        match self {
            Self::Seam => &Seam::ZERO,
            Self::All(seam) | Self::Planned(seam) | Self::Noise(seam) => seam,
        }
    }

    /// Returns whether the unknowns are among those of the equations.
    pub(super) fn has_unknowns(self) -> bool {
        !matches!(self, Self::Seam)
    }
}

/// Assembles the normal equations of one record.
///
/// A row has `W` columns, and `L` is the length of the normal equations.
pub(super) struct Assembly<'a, const W: usize, const L: usize> {
    pub(super) model: &'a Model,
    pub(super) record: Bins<'a>,
    pub(super) equations: Equations<'a>,
    pub(super) sought: &'a Sought,
    /// Columns of imperfections, between those of the seam and those of the unknowns, and among the latter.
    pub(super) columns: Columns<'a>,
    pub(super) normal: &'a mut Normal<L>,
    /// Instruction set.
    pub(super) level: Level,
}

impl<const W: usize, const L: usize> Assembly<'_, W, L> {
    /// Fills `normal` (not yet eliminated). Returns the residuals of all unknowns; of the seam alone there are none.
    pub(super) fn run(self) -> Residuals {
        f64::dispatch(self.level, self)
    }
}

impl<const W: usize, const L: usize> Kernel<f64> for Assembly<'_, W, L> {
    type Output = Residuals;

    #[inline(always)]
    fn run<V: Lanes<Scalar = f64>>(mut self, like: V) -> Residuals {
        let bins = self.record.bins();
        let columns = self.columns();
        let derivatives = Derivatives::new(self.sought, self.first());
        self.normal.reset(columns);
        let has_imperfections = self.equations.has_unknowns()
            && !(self.columns.before.is_empty() && self.sought.imperfections().is_empty());
        let mut residuals = Residuals::new(bins);
        let mut response = Response::new(like);
        let mut rows = V::each([[0.0; W]; 6]);
        let rows = rows.as_mut();
        for first in (0..bins).step_by(V::WIDTH) {
            let lanes = first..bins.min(first + V::WIDTH);
            let mut batch = self.batch(like, first);
            let unexplained = self.read(&mut response, &batch, lanes.clone());
            let accelerance = by_lane(&response.per_force);
            let noise = self.noise(lanes.clone());
            let weights = whiten(&noise, &accelerance, lanes.len());
            let error =
                self.correct(like, &weights, &noise, &accelerance, &unexplained, lanes.len());
            self.rows(rows, &mut response, &derivatives, &mut batch, &error);
            if has_imperfections {
                let loads = seam_loads(self.equations.seam(), batch.inverse_s);
                if !matches!(self.equations, Equations::Noise(_)) {
                    batch.load_drift(&self.record, first);
                }
                let place = (self.seam_columns(), self.sought);
                self.columns.write(rows, place, &response, self.model, &batch, &loads);
            }
            self.accumulate(rows, &weights, &unexplained, lanes, &mut residuals);
        }
        residuals
    }
}

impl<const W: usize, const L: usize> Assembly<'_, W, L> {
    pub(super) fn seam_columns(&self) -> usize {
        unknowns(self.model.terms.joints.len(), self.model.terms.feels_gravity())
    }

    /// Unknowns, and the column of the residual behind theirs.
    pub(super) fn columns(&self) -> usize {
        if self.equations.has_unknowns() {
            self.first() + self.sought.unknowns()
        } else {
            self.seam_columns()
        }
    }

    /// Column of the first unknown.
    pub(super) fn first(&self) -> usize {
        self.seam_columns() + self.columns.before.len()
    }

    /// The bins from `first` on, and the force there.
    #[inline(always)]
    pub(super) fn batch<V: Lanes<Scalar = f64>>(&self, like: V, first: usize) -> Batch<V> {
        let batch = Batch::new(like, &self.record, self.model, first);
        match self.equations {
            Equations::Noise(_) => Batch { force: [Complex::zero(like); 3], ..batch },
            _ => batch,
        }
    }

    /// Evaluates the model, and returns what it leaves of the measured acceleration: `r = A − H F − …`. The model has no time, so that the drift
    /// of its delay is subtracted from A.
    #[inline(always)]
    pub(super) fn read<V: Lanes<Scalar = f64>>(
        &self,
        response: &mut Response<V>,
        batch: &Batch<V>,
        lanes: Range<usize>,
    ) -> [Reading; WIDEST] {
        // The seam alone is found from zero. For the other unknowns, q must contain it.
        let seam = self.equations.seam();
        let loads = self.equations.has_unknowns().then(|| seam_loads(seam, batch.inverse_s));
        response.read(&self.model.terms, batch.s, &batch.force, loads.as_ref());
        let modelled = response.observed.map(spill);
        let mut unexplained = [[[0.0; 2]; 3]; WIDEST];
        for (lane, bin) in lanes.enumerate() {
            let measured = self.record.measured(bin);
            let drifted = self.record.drifted(self.model.drift, bin);
            for axis in 0..3 {
                let jump = seam.jump(axis, &batch.powers[lane]);
                for part in 0..2 {
                    unexplained[lane][axis][part] = measured[axis][part]
                        - drifted[axis][part]
                        - modelled[axis][part][lane]
                        - jump[part];
                }
            }
        }
        unexplained
    }

    #[inline(always)]
    pub(super) fn noise(&self, lanes: Range<usize>) -> [Noise; WIDEST] {
        let mut noise = [[[0.0; 3]; 2]; WIDEST];
        for (lane, bin) in lanes.enumerate() {
            noise[lane] = self.record.noise(self.model, bin);
        }
        noise
    }

    /// Most likely error of the force, `F̂ − F`. It counts as zero for the seam alone, and where no acceleration was measured.
    #[inline(always)]
    pub(super) fn correct<V: Lanes<Scalar = f64>>(
        &self,
        like: V,
        weights: &[Whitening; WIDEST],
        noise: &[Noise; WIDEST],
        accelerance: &[Accelerance; WIDEST],
        unexplained: &[Reading; WIDEST],
        lanes: usize,
    ) -> [Complex<V>; 3] {
        if !matches!(self.equations, Equations::All(_)) {
            return [Complex::zero(like); 3];
        }
        let mut errors = [[[0.0; WIDEST]; 2]; 3];
        for lane in 0..lanes {
            let [force, _] = &noise[lane];
            let error = weights[lane].force_error(force, &accelerance[lane], &unexplained[lane]);
            for (axis, error) in error.into_iter().enumerate() {
                errors[axis][0][lane] = error.re;
                errors[axis][1][lane] = error.im;
            }
        }
        errors.map(|[re, im]| Complex::new(like.load(&re), like.load(&im)))
    }

    /// Corrects the force, and evaluates the derivatives there.
    #[inline(always)]
    pub(super) fn elongate<V: Lanes<Scalar = f64>>(
        &self,
        response: &mut Response<V>,
        batch: &mut Batch<V>,
        error: &[Complex<V>; 3],
    ) {
        for axis in 0..3 {
            batch.force[axis] = batch.force[axis] + error[axis];
        }
        let error = self.equations.has_unknowns().then_some(error);
        response.elongate(&self.model.terms, batch.s, error);
    }

    /// Takes the residual of a bin.
    #[inline(always)]
    pub(super) fn take_residual(
        &self,
        residuals: &mut Residuals,
        bin: usize,
        unexplained: &Reading,
        white: &Reading,
    ) {
        let measured = self.record.measured(bin);
        let mut model = measured;
        for axis in 0..3 {
            for part in 0..2 {
                model[axis][part] -= unexplained[axis][part];
            }
        }
        residuals.take(&measured, &model, white);
    }

    /// Writes the derivatives of the reading at the corrected force.
    #[inline(always)]
    fn rows<V: Lanes<Scalar = f64>>(
        &self,
        rows: &mut [Rows<W>],
        response: &mut Response<V>,
        derivatives: &Derivatives,
        batch: &mut Batch<V>,
        error: &[Complex<V>; 3],
    ) {
        self.elongate(response, batch, error);
        write_seam(rows, response, batch, self.model.terms.joints.len());
        if self.equations.has_unknowns() {
            derivatives.write(rows, response, &self.model.terms);
        }
    }

    /// Adds the whitened rows, the residual in their last column, to the normal equations.
    #[inline(always)]
    fn accumulate(
        &mut self,
        rows: &mut [Rows<W>],
        weights: &[Whitening; WIDEST],
        unexplained: &[Reading; WIDEST],
        lanes: Range<usize>,
        residuals: &mut Residuals,
    ) {
        let columns = self.columns();
        let rows = &mut rows[..lanes.len()];
        for (lane, bin) in lanes.enumerate() {
            let (rows, unexplained) = (&mut rows[lane], &unexplained[lane]);
            for (row, value) in rows.iter_mut().zip(unexplained.as_flattened()) {
                row[columns] = *value;
            }
            weights[lane].apply(rows, columns + 1);
            if self.equations.has_unknowns() {
                let white = [0, 2, 4].map(|row| [rows[row][columns], rows[row + 1][columns]]);
                self.take_residual(residuals, bin, unexplained, &white);
            }
        }
        self.normal.add_all(self.level, rows.as_flattened());
    }
}

/// Returns `C^(−1/2)` of each bin, which makes its residual white.
#[inline(always)]
pub(super) fn whiten(
    noise: &[Noise; WIDEST],
    accelerance: &[Accelerance; WIDEST],
    lanes: usize,
) -> [Whitening; WIDEST] {
    let mut weights = [Whitening::default(); WIDEST];
    for lane in 0..lanes {
        let [force, acceleration] = &noise[lane];
        weights[lane] = Whitening::new(acceleration, force, &accelerance[lane]);
    }
    weights
}

/// Accelerances, lane by lane.
#[inline(always)]
pub(super) fn by_lane<V: Lanes<Scalar = f64>>(
    accelerance: &[[Complex<V>; 3]; 3],
) -> [Accelerance; WIDEST] {
    let spilled = accelerance.map(|row| row.map(spill));
    core::array::from_fn(|lane| {
        let at = |[re, im]: &[[f64; WIDEST]; 2]| Complex { re: re[lane], im: im[lane] };
        spilled.each_ref().map(|row| row.each_ref().map(at))
    })
}

/// Loads of the seam on every bushing: impulses, and steps by `1/s`.
#[inline(always)]
pub(super) fn seam_loads<V: Lanes<Scalar = f64>>(seam: &Seam, inverse_s: Complex<V>) -> PerDof<V> {
    let like = inverse_s.im;
    let mut loads = [[Complex::zero(like); DOF]; MAX_JOINTS];
    for (joint, loads) in loads.iter_mut().enumerate() {
        for (dof, load) in loads.iter_mut().enumerate() {
            let step = inverse_s.im * like.fill(seam.step[joint][dof]);
            *load = Complex::new(like.fill(seam.impulse[joint][dof]), step);
        }
    }
    loads
}
