//! Corners that lie together are one.

use super::hull::extent;
use super::{Point, Triangle};

/// Part of the extent within which corners are one. A hundred and seventy times the rounding of single precision, 2^-24.
pub(super) const WELD: f64 = 1e-5;

/// The cell of a corner. Corners that lie together share one.
pub(super) fn cells(triangles: &[Triangle]) -> impl Fn(&Point) -> [i64; 3] + use<> {
    let (lower, upper) = extent(triangles.iter().flatten());
    let step = WELD * (upper - lower).norm();
    move |own: &Point| ((own - lower) / step).map(|own| own.round() as i64).into()
}
