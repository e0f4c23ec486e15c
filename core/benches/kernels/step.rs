//! The multiplications of an accepted step of the refinement: the seam at the trial, and then the normal equations of all unknowns.
//!
//! A robot of J joints has L = 6J unit loads, a seam of s unknowns and, with its parameters and the residual, n columns:
//!
//! | what                                                 | of the seam | of all |
//! | ---------------------------------------------------- | ----------- | ------ |
//! | a response, with those to the unit loads             | counted     | counted |
//! | a load, whitened by a triangle of three              | 18          | 18     |
//! | one of L (L + 1)/2 pairs of loads                     | 14          | 32     |
//! | one of 4 L pairs of a load with a jump or the residual | 22          | 22     |
//! | elimination of the seam, a record, i < s             | Σ (s + 1 − i)(s + 2 − i)/2 | Σ (n − i)(n + 1 − i)/2 |

use flexid_core::receptance::lanes::{Kernel, Lanes, Precision};
use flexid_core::receptance::{Complex, Response};
use flexid_core::{DOF, MAX_JOINTS};

use super::counted::operations;
use super::{BINS, Bins};

/// Jumps of the reading that a seam has beside the loads, where gravity does not tilt the accelerometer.
const JUMPS: usize = 6;

/// Returns the multiplications of an accepted step on `records` records with this many bins together.
pub(crate) fn multiplications(joints: usize, bins: usize, records: usize) -> f64 {
    let response = operations(Responses(&Bins::new(joints))).multiplications as f64 / BINS as f64;
    let loads = (DOF * joints) as f64;
    let of_pairs = 0.5 * loads * (loads + 1.0);
    let a_bin = |pair: f64| response + 18.0 * loads + pair * of_pairs + 22.0 * 4.0 * loads;
    let seam = 2 * DOF * joints + JUMPS;
    let of_elimination = |columns: usize| {
        let rest = (0..seam).map(|done| (columns - done) as f64);
        rest.map(|left| 0.5 * left * (left + 1.0)).sum::<f64>()
    };
    let columns = seam + 2 * DOF * joints + 1;
    let eliminations = of_elimination(seam + 1) + of_elimination(columns);
    bins as f64 * (a_bin(14.0) + a_bin(32.0)) + records as f64 * eliminations
}

/// The reading and the responses to unit loads at every bin.
struct Responses<'a, T: Precision>(&'a Bins<T>);

impl<T: Precision> Kernel<T> for Responses<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<V: Lanes<Scalar = T>>(self, like: V) {
        let Bins { terms, omega, .. } = self.0;
        let force = [Complex::new(like, like); 3];
        let loads = [[Complex::new(like, like); DOF]; MAX_JOINTS];
        let mut found = Response::new(like);
        for first in (0..omega.len()).step_by(V::WIDTH) {
            let s = Complex::new(like.fill(T::default()), like.load(&omega[first..]));
            found.evaluate(terms, s, &force, Some(&loads));
        }
    }
}
