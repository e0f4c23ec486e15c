//! The normal equations of a record from the responses to unit loads.
//!
//! Each column of a bin is the whitened response z of the reading to a unit load on a bushing, or to a jump of the reading, times a number.
//! q is the elongation of the bushing in the record, ω₀ the lowest angular frequency of the band:
//!
//! | column                     | number                  |
//! | -------------------------- | ----------------------- |
//! | impulse on a bushing       | 1                       |
//! | step on a bushing          | 1/s                     |
//! | logarithm of its stiffness | −k q                    |
//! | logarithm of its damping   | −s d q                  |
//! | jump along an axis         | 1, s/ω₀, ω₀/s           |
//!
//! So all products of two columns follow from the products `M = z_iᴴ z_j` of the responses, `M q_j`, `q_i* M` and `q_i* M q_j`. Since s = iω
//! is imaginary, their sums over the bins are [`KINDS`] real ones a pair of bushings, where the columns themselves have sixteen of six
//! products each.
//!
//! | file       | what                                                                 |
//! | ---------- | -------------------------------------------------------------------- |
//! | `tile`     | their products, summed over the bins                                 |
//! | `sums`     | these sums                                                           |
//! | `products` | the normal equations that follow from them                           |

mod products;
mod sums;
#[cfg(test)]
mod tests;
mod tile;

pub(super) use products::Columns;
pub(super) use sums::Sums;

use crate::linear::gram::WIDEST;
use crate::{DOF, MAX_JOINTS};

/// Most unit loads, in whole vectors.
const LOADS: usize = (DOF * MAX_JOINTS).next_multiple_of(WIDEST);
/// Sums of a pair of bushings.
const KINDS: usize = 12;
/// Sums of a pair of bushings that the seam alone needs.
const KINDS_OF_SEAM: usize = 3;
/// Sums of a bushing, and a jump or the residual.
const OTHER_KINDS: usize = 8;
/// The jumps along three axes, and the residual.
pub(super) const OTHERS: usize = 4;

/// Responses in one bin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bin {
    /// Real and imaginary part along each axis of the whitened response to each unit load.
    pub(super) loads: [[[f64; LOADS]; 2]; 3],
    /// Real and imaginary part of each elongation.
    pub(super) elongations: [[f64; LOADS]; 2],
    /// Real and imaginary part along each axis of the whitened response to a unit jump along each axis; then the whitened residual.
    pub(super) others: [[[f64; 2]; 3]; OTHERS],
    /// Angular frequency, rad/s.
    pub(super) omega: f64,
}

impl Bin {
    pub(super) const ZERO: Self = Self {
        loads: [[[0.0; LOADS]; 2]; 3],
        elongations: [[0.0; LOADS]; 2],
        others: [[[0.0; 2]; 3]; OTHERS],
        omega: 0.0,
    };
}
