//! What joins the end of a record to its start.
//!
//! Over exactly T, a record is one period of a periodic motion, if at the seam an impulse and a step load every
//! bushing (`γ = g + h/s`: the robot's state jumps from that of the end to that of the start) and the reading
//! itself jumps (`c₀ + c₁ s/ω₀`, which also takes what sampling folds back into the band). All of it is
//! linear and the same at every bin.

use crate::{DOF, MAX_JOINTS};

/// Real unknowns that do not belong to a joint: c₀ and c₁ of three axes.
const JUMPS: usize = 6;
/// Real unknowns per joint: g and h.
const PER_JOINT: usize = 2 * DOF;
/// Most real unknowns of a seam.
pub(crate) const MAX_SEAM: usize = PER_JOINT * MAX_JOINTS + JUMPS;

/// The unknowns of one record's seam.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Seam {
    /// g: impulse on each bushing, Ns and Nms.
    pub(crate) impulse: [[f64; DOF]; MAX_JOINTS],
    /// h: step on each bushing, N and Nm.
    pub(crate) step: [[f64; DOF]; MAX_JOINTS],
    /// c₀, m/s.
    pub(crate) constant: [f64; 3],
    /// c₁, m/s.
    pub(crate) slope: [f64; 3],
}

/// Number of real unknowns for a chain of `joints`.
pub(crate) const fn unknowns(joints: usize) -> usize {
    PER_JOINT * joints + JUMPS
}

impl Seam {
    /// From the solution of the normal equations: per joint g then h, then c₀, then c₁.
    pub(crate) fn from_solution(solution: &[f64], joints: usize) -> Self {
        let mut seam = Self::default();
        for joint in 0..joints {
            let own = &solution[PER_JOINT * joint..PER_JOINT * (joint + 1)];
            seam.impulse[joint].copy_from_slice(&own[..DOF]);
            seam.step[joint].copy_from_slice(&own[DOF..]);
        }
        let jumps = &solution[PER_JOINT * joints..];
        seam.constant.copy_from_slice(&jumps[..3]);
        seam.slope.copy_from_slice(&jumps[3..JUMPS]);
        seam
    }

    /// The inverse of [`Seam::from_solution`].
    pub(crate) fn to_solution(self, joints: usize) -> [f64; MAX_SEAM] {
        let mut solution = [0.0; MAX_SEAM];
        for joint in 0..joints {
            let own = &mut solution[PER_JOINT * joint..PER_JOINT * (joint + 1)];
            own[..DOF].copy_from_slice(&self.impulse[joint]);
            own[DOF..].copy_from_slice(&self.step[joint]);
        }
        let jumps = &mut solution[PER_JOINT * joints..];
        jumps[..3].copy_from_slice(&self.constant);
        jumps[3..JUMPS].copy_from_slice(&self.slope);
        solution
    }
}
