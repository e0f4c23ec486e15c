//! The minimum with which a screened branch is compared.

use crate::sought::Coordinates;

/// A minimum refined on some of the bins.
#[derive(Clone, Copy, Debug)]
pub(super) struct Screen {
    /// The minimum of all bins.
    pub(super) of: Coordinates,
    /// The minimum of some of the bins.
    pub(super) coordinates: Coordinates,
    /// Its sum of squares.
    pub(super) objective: f64,
    /// Distance of the bins that count.
    pub(super) every: usize,
}
