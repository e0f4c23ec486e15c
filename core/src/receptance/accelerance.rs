//! Reading of an accelerometer per measured force, for any place of the two sensors.

use super::complex::Complex;
use super::gradient::sense;
use super::lanes::Lanes;
use super::recursion::tip_stiffness;
use super::terms::Terms;
use super::tool::{move_by, per_measured, see};
use crate::DOF;

/// Accelerance at one complex frequency per lane, m/s²/N: reading along the accelerometer's axis `[row]` per force that is
/// measured along the force sensor's axis `[column]`. The terms hold the mounting of the sensors.
///
/// `s` is `iω`, or `α + iω`, rad/s. If both sensors sit at the TCP and along the same axes, [`receptance`](super::receptance)
/// costs less.
#[inline(always)]
pub fn accelerance<V: Lanes>(
    terms: &Terms<V::Scalar>,
    s: Complex<V>,
    accelerance: &mut [[Complex<V>; 3]; 3],
) {
    let tip = tip_stiffness(terms, s);
    let mut moved = [[Complex::zero(s.re); DOF]; 3];
    let mut readings = moved;
    move_by(&terms.force, &tip, &mut moved);
    sense(terms, s, &mut readings);
    see(&readings, &moved, accelerance);
    if let Some(tool) = &terms.tool {
        per_measured(tool, s * s, &moved, accelerance);
    }
}
