//! Further columns of a record's normal equations, between those of the seam and those of the unknowns.

use super::batch::Batch;
use super::rows::Rows;
use crate::linear::gram::WIDEST;
use crate::receptance::lanes::Lanes;
use crate::receptance::{PerDof, Response};

/// Columns of a linear dependence of the reading.
pub(super) trait Further {
    /// Number of columns.
    fn count(&self) -> usize;

    /// Writes the columns of each lane, from `first` on. `response` is that of the model at `batch`; `seam` holds the loads of the seam.
    fn write<V: Lanes<Scalar = f64>, const W: usize>(
        &mut self,
        rows: &mut [Rows<W>],
        first: usize,
        response: &Response<V>,
        batch: &Batch<V>,
        seam: &PerDof<V>,
    );

    /// Subtracts from the unexplained reading what the present values of the columns explain of it, if the terms leave it out.
    fn explain<const W: usize>(
        &self,
        rows: &[Rows<W>],
        first: usize,
        unexplained: &mut [[[f64; 2]; 3]; WIDEST],
    );
}

/// No further columns.
impl Further for () {
    #[inline(always)]
    fn count(&self) -> usize {
        0
    }

    #[inline(always)]
    fn write<V: Lanes<Scalar = f64>, const W: usize>(
        &mut self,
        _: &mut [Rows<W>],
        _: usize,
        _: &Response<V>,
        _: &Batch<V>,
        _: &PerDof<V>,
    ) {
    }

    #[inline(always)]
    fn explain<const W: usize>(&self, _: &[Rows<W>], _: usize, _: &mut [[[f64; 2]; 3]; WIDEST]) {}
}
