//! Further columns of a record's normal equations, between those of the seam and those of the unknowns.

use super::batch::Batch;
use super::model::Model;
use super::rows::Rows;
use crate::receptance::lanes::Lanes;
use crate::receptance::{PerDof, Response};

/// Columns of a linear dependence of the reading. By default there are none.
pub(super) trait Further {
    /// Number of columns.
    #[inline(always)]
    fn count(&self) -> usize {
        0
    }

    /// Writes the columns of each lane, from `first` on. It may add to those of the unknowns, which follow and have been written.
    /// `response` is that of `model` at `batch`; `seam` holds the loads of the seam.
    #[inline(always)]
    fn write<V: Lanes<Scalar = f64>, const W: usize>(
        &self,
        _rows: &mut [Rows<W>],
        _first: usize,
        _response: &Response<V>,
        _model: &Model,
        _batch: &Batch<V>,
        _seam: &PerDof<V>,
    ) {
    }
}

/// No further columns.
impl Further for () {}
