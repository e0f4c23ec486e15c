//! The rows of a record's normal equations: per bin real and imaginary part of each axis, the derivatives in the seam and
//! behind them those in what is sought.

use super::batch::{Batch, spill};
use super::seam::{ORDERS, PARTS};
use super::sizes::COLUMNS;
use crate::DOF;
use crate::parameters::MAX_PARAMETERS;
use crate::receptance::lanes::Lanes;
use crate::receptance::{Complex, Response, Terms};
use crate::sought::{Coordinate, Sought};

/// Rows of one lane, `W` columns wide.
pub(super) type Rows<const W: usize = COLUMNS> = [[f64; W]; 6];

#[inline(always)]
pub(super) fn write_seam<V: Lanes<Scalar = f64>, const W: usize>(
    rows: &mut [Rows<W>],
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
        for (lane, rows) in rows.iter_mut().enumerate() {
            // Orders that do not count stand where other columns are written later.
            for part in 0..2 {
                let row = &mut rows[2 * axis + part][jumps..jumps + 3 * ORDERS];
                for order in 0..ORDERS {
                    for other in 0..3 {
                        let own = other == axis && PARTS[order] == part;
                        row[3 * order + other] = if own { batch.powers[lane][order] } else { 0.0 };
                    }
                }
            }
        }
    }
}

/// Column of the derivatives by each parameter, and whether it is added to what another has written there.
pub(super) struct Derivatives([Option<(usize, bool)>; MAX_PARAMETERS]);

impl Derivatives {
    pub(super) fn new(sought: &Sought, first: usize) -> Self {
        let mut columns = [None; MAX_PARAMETERS];
        for (index, unknown) in sought.parameters() {
            columns[index] = Some((first + unknown, !sought.leads(index)));
        }
        Self(columns)
    }

    #[inline(always)]
    pub(super) fn write<V: Lanes<Scalar = f64>, const W: usize>(
        &self,
        rows: &mut [Rows<W>],
        response: &Response<V>,
        terms: &Terms<f64>,
    ) {
        for joint in 0..terms.joints.len() {
            for dof in 0..DOF {
                let derivatives = response.derivatives(terms, joint, dof);
                let index = Coordinate::Stiffness { joint, dof }.index();
                for (axis, [stiffness, damping]) in derivatives.into_iter().enumerate() {
                    self.put(rows, axis, index, stiffness);
                    self.put(rows, axis, index + DOF, damping);
                }
            }
        }
    }

    #[inline(always)]
    fn put<V: Lanes<Scalar = f64>, const W: usize>(
        &self,
        rows: &mut [Rows<W>],
        axis: usize,
        index: usize,
        value: Complex<V>,
    ) {
        match self.0[index] {
            Some((column, false)) => write(rows, axis, column, value),
            Some((column, true)) => add(rows, axis, column, value),
            None => {}
        }
    }
}

#[inline(always)]
pub(super) fn write<V: Lanes<Scalar = f64>, const W: usize>(
    rows: &mut [Rows<W>],
    axis: usize,
    column: usize,
    value: Complex<V>,
) {
    let [re, im] = spill(value);
    for (lane, rows) in rows.iter_mut().enumerate() {
        rows[2 * axis][column] = re[lane];
        rows[2 * axis + 1][column] = im[lane];
    }
}

#[inline(always)]
pub(super) fn add<V: Lanes<Scalar = f64>, const W: usize>(
    rows: &mut [Rows<W>],
    axis: usize,
    column: usize,
    value: Complex<V>,
) {
    let [re, im] = spill(value);
    for (lane, rows) in rows.iter_mut().enumerate() {
        rows[2 * axis][column] += re[lane];
        rows[2 * axis + 1][column] += im[lane];
    }
}

#[cfg(test)]
mod tests;
