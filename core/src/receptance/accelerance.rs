//! Reading of an accelerometer per measured force, for any place of the two sensors.

use super::complex::Complex;
use super::lanes::Lanes;
use super::recursion::tip_stiffness;
use super::terms::Terms;
use super::tool::{ToolReaction, products, tip_displacements};
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
    s.re.apart(
        #[inline(always)]
        || accelerance_inlined(terms, s, accelerance),
    );
}

#[inline(always)]
fn accelerance_inlined<V: Lanes>(
    terms: &Terms<V::Scalar>,
    s: Complex<V>,
    accelerance: &mut [[Complex<V>; 3]; 3],
) {
    let tip = tip_stiffness(terms, s);
    let displacements = tip_displacements(&terms.force_loads, &tip, s.re);
    let mut readings = [[Complex::zero(s.re); DOF]; 3];
    terms.observation.loads(s, &mut readings);
    *accelerance = products(&readings, &displacements);
    if let Some(tool) = &terms.tool {
        let mut reaction = ToolReaction::new(s.re);
        reaction.evaluate(tool, s * s, &displacements);
        *accelerance = reaction.per_measured_force(accelerance);
    }
}
