//! Sizes of the normal equations of a plant.

use super::super::seam::MAX_SEAM;
use crate::imperfection::MAX_IMPERFECTIONS;
use crate::linear::gram::padded;
use crate::linear::packed::packed;
use crate::sought::MAX_UNKNOWNS;

/// Largest number of imperfections and unknowns.
pub(super) const ALL: usize = MAX_IMPERFECTIONS + MAX_UNKNOWNS;
/// Columns of a row: seam, imperfections, unknowns, residual; padded.
pub(super) const WIDE: usize = padded(MAX_SEAM + ALL + 1);
/// Length of the normal equations of a record.
pub(super) const OF_RECORD: usize = packed(MAX_SEAM + ALL + 1);
/// Length of the normal equations of all records.
pub(super) const OF_ALL: usize = packed(ALL + 1);
