//! Derivatives of a reading by the imperfections, each in its standard deviation.
//!
//! An imperfection of the model is differentiated by differences of the whole model. The others act on the reading A or on the
//! measured force F, with H the accelerance:
//!
//! ```text
//! delay −s A        gain of A  A_a          crosstalk of A  A_b        resonance of A  −s² A        high-pass of A  −A/s
//!                   gain of F  −H_a F_a     crosstalk of F  −H_a F_b   resonance of F  s² H F       high-pass of F  H F/s
//! ```

use heapless::Vec;

use super::super::batch::Batch;
use super::super::further::Further;
use super::super::rows::{Rows, write};
use crate::imperfection::{Imperfection, MAX_IMPERFECTIONS, Sensor};
use crate::linear::gram::WIDEST;
use crate::receptance::lanes::Lanes;
use crate::receptance::{Complex, PerDof, Response, Terms};

/// Step of a difference, in standard deviations of the imperfection. Chosen: rounding changes a derivative by less than 1e-6 of it, and
/// curvature by a thousandth of what it changes over a standard deviation.
pub(super) const STEP: f64 = 1e-3;

/// Columns of the imperfections of a record.
#[derive(Clone, Debug)]
pub(super) struct Imperfections {
    /// Each imperfection, with its standard deviation.
    pub(super) all: Vec<(Imperfection, f64), MAX_IMPERFECTIONS>,
    /// Present value of each, in its standard deviation.
    pub(super) values: [f64; MAX_IMPERFECTIONS],
    /// Terms with each imperfection of the model [`STEP`] above its value.
    pub(super) beside: Vec<Terms<f64>, MAX_IMPERFECTIONS>,
}

impl Imperfections {
    /// Derivative of the reading along each axis by an imperfection that is not of the model.
    #[inline(always)]
    fn of_reading<V: Lanes<Scalar = f64>>(
        &self,
        imperfection: Imperfection,
        response: &Response<V>,
        batch: &Batch<V>,
    ) -> [Complex<V>; 3] {
        let like = batch.s.re;
        let s2 = batch.s * batch.s;
        let by_force = |factor: Complex<V>| -> [Complex<V>; 3] {
            core::array::from_fn(|axis| {
                let mut sum = Complex::zero(like);
                for push in 0..3 {
                    sum = sum.add_mul(response.per_force[axis][push], batch.force[push]);
                }
                sum * factor
            })
        };
        let by_reading = |factor: Complex<V>| response.observed.map(|reading| -(reading * factor));
        let mut derivative = [Complex::zero(like); 3];
        match imperfection {
            Imperfection::Delay => return by_reading(batch.s),
            Imperfection::Resonance(Sensor::Accelerometer) => return by_reading(s2),
            Imperfection::HighPass(Sensor::Accelerometer) => return by_reading(batch.inverse_s),
            Imperfection::Resonance(Sensor::Force) => return by_force(s2),
            Imperfection::HighPass(Sensor::Force) => return by_force(batch.inverse_s),
            Imperfection::Gain(Sensor::Accelerometer, axis) => {
                derivative[axis] = response.observed[axis];
            }
            Imperfection::Crosstalk(Sensor::Accelerometer, of, by) => {
                derivative[of] = response.observed[by];
            }
            Imperfection::Gain(Sensor::Force, push) => {
                for axis in 0..3 {
                    derivative[axis] = -(response.per_force[axis][push] * batch.force[push]);
                }
            }
            Imperfection::Crosstalk(Sensor::Force, of, by) => {
                for axis in 0..3 {
                    derivative[axis] = -(response.per_force[axis][of] * batch.force[by]);
                }
            }
            _ => {}
        }
        derivative
    }
}

impl Further for &mut Imperfections {
    #[inline(always)]
    fn count(&self) -> usize {
        self.all.len()
    }

    #[inline(always)]
    fn write<V: Lanes<Scalar = f64>, const W: usize>(
        &mut self,
        rows: &mut [Rows<W>],
        first: usize,
        response: &Response<V>,
        batch: &Batch<V>,
        seam: &PerDof<V>,
    ) {
        let like = batch.s.re;
        let mut beside = self.beside.iter();
        let mut moved = Response::new(like);
        for (index, &(imperfection, deviation)) in self.all.iter().enumerate() {
            let derivative = if imperfection.is_of_model() {
                let Some(terms) = beside.next() else { continue };
                moved.read(terms, batch.s, &batch.force, Some(seam));
                let scale = like.fill(1.0 / STEP);
                core::array::from_fn(|axis| {
                    (moved.observed[axis] - response.observed[axis]).scale(scale)
                })
            } else {
                let derivative = self.of_reading(imperfection, response, batch);
                derivative.map(|value| value.scale(like.fill(deviation)))
            };
            for (axis, value) in derivative.into_iter().enumerate() {
                write(rows, axis, first + index, value);
            }
        }
    }

    #[inline(always)]
    fn explain<const W: usize>(
        &self,
        rows: &[Rows<W>],
        first: usize,
        unexplained: &mut [[[f64; 2]; 3]; WIDEST],
    ) {
        for (index, (imperfection, _)) in self.all.iter().enumerate() {
            if imperfection.is_in_terms() {
                continue;
            }
            let value = self.values[index];
            for (rows, unexplained) in rows.iter().zip(unexplained.iter_mut()) {
                for (row, unexplained) in rows.iter().zip(unexplained.as_flattened_mut()) {
                    *unexplained -= row[first + index] * value;
                }
            }
        }
    }
}
