//! Further columns of a record's normal equations, between those of the seam and those of the unknowns.

use super::batch::Batch;
use super::rows::Rows;
use crate::linear::gram::WIDEST;
use crate::receptance::lanes::Lanes;
use crate::receptance::{PerDof, Response};

/// Columns of a linear dependence of the reading. By default there are none.
pub(super) trait Further {
    /// Number of columns.
    #[inline(always)]
    fn count(&self) -> usize {
        0
    }

    /// Writes the columns of each lane, from `first` on. `response` is that of the model at `batch`; `seam` holds the loads of the seam.
    #[inline(always)]
    fn write<V: Lanes<Scalar = f64>, const W: usize>(
        &mut self,
        _rows: &mut [Rows<W>],
        _first: usize,
        _response: &Response<V>,
        _batch: &Batch<V>,
        _seam: &PerDof<V>,
    ) {
    }

    /// Subtracts from the unexplained reading what the present values of the columns explain of it, if the terms leave it out.
    #[inline(always)]
    fn explain<const W: usize>(
        &self,
        _rows: &[Rows<W>],
        _first: usize,
        _unexplained: &mut [[[f64; 2]; 3]; WIDEST],
    ) {
    }
}

/// No further columns.
impl Further for () {}
