//! Sizes of the normal equations.

use super::seam::MAX_SEAM;
use crate::imperfection::MAX_IMPERFECTIONS;
use crate::linear::gram::padded;
use crate::linear::normal::Normal;
use crate::linear::packed::packed;
use crate::sought::MAX_UNKNOWNS;

/// Largest number of imperfections and unknowns.
pub(super) const ALL: usize = MAX_IMPERFECTIONS + MAX_UNKNOWNS;
/// Columns of a row: seam, unknowns, residual; padded.
pub(super) const COLUMNS: usize = padded(MAX_SEAM + MAX_UNKNOWNS + 1);
/// Columns of a row: seam, imperfections, unknowns, residual; padded.
pub(super) const WIDE: usize = padded(MAX_SEAM + ALL + 1);
/// Length of the normal equations of the unknowns.
pub(super) const PACKED: usize = packed(MAX_UNKNOWNS + 1);
/// Length of the normal equations of a record: its seam, and the unknowns.
pub(super) const OF_RECORD: usize = packed(MAX_SEAM + MAX_UNKNOWNS + 1);
/// Length of the normal equations of imperfections and unknowns.
pub(super) const OF_ALL: usize = packed(ALL + 1);
/// Length of the normal equations of a record: its seam, imperfections, and the unknowns.
pub(super) const WIDE_OF_RECORD: usize = packed(MAX_SEAM + ALL + 1);

/// Number of seams for which there is memory. Chosen: those of four records of eight parts each; further ones are fitted twice.
pub(super) const MAX_SEAMS: usize = 32;

/// Normal equations of the unknowns.
pub(crate) type ParameterNormal = Normal<PACKED>;
/// Normal equations of a record: its seam, and the unknowns.
pub(super) type RecordNormal = Normal<OF_RECORD>;
