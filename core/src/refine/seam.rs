//! The seam: the jump from the end of a record to its start.
//!
//! Over exactly T, a record is one period of a periodic motion whose state jumps at the seam, by Δq and Δq̇. With C and G, what
//! the accelerometer reads of q̈ and, as gravity tilts it, of q, and with `Z = s² M + s D + K`:
//!
//! ```text
//! Q = Z⁻¹ (F + M (s Δq + Δq̇) + D Δq) = Z⁻¹ (F + g + h/s) + Δq/s                  g = M Δq̇,    h = −K Δq
//! C (s² Q − s Δq − Δq̇) + G Q = (C s² + G) Z⁻¹ (F + g + h/s) + c₋₁/s + c₀          c₋₁ = G Δq,  c₀ = −C Δq̇
//! ```
//!
//! So an impulse g and a step h load every bushing, and the reading itself jumps. What sampling folds back into the band is
//! taken by `c₁ s`. All of it is linear in its unknowns, which are the same at every bin.
//!
//! With many joints some unknowns hardly differ in the band, and would grow against each other without bound. A jump of the state is no
//! larger than the motion of the record. So each unknown has a normal prior: by one standard deviation it adds to the reading as
//! much as the whole reading is. Its derivative by the parameters is left out, since it is small beside that of readings which
//! stand clear of their noise.
//!
//! The fundamental frequency of a part of a divided record, ω₀, is as many times that of the record, ω₁, as the record has parts. A motion of
//! acceleration a at ω₁ jumps by `Δq̇ = a/ω₁`, while the part reads no more than `a/ω₀`: the deviation is as many times larger.
//!
//! A measured receptance has no end. Its seam has a prior of no width.

use crate::{DOF, MAX_JOINTS};

/// Orders of the reading's jump: c₀ and c₁, and c₋₁ where gravity tilts the reading.
pub(crate) const ORDERS: usize = 3;
/// Part of each power of s = iω, order by order: 0 if it is real, 1 if imaginary.
pub(crate) const PARTS: [usize; ORDERS] = [0, 1, 1];
/// Real unknowns per joint: g and h.
const PER_JOINT: usize = 2 * DOF;
/// Most real unknowns of a seam.
pub(crate) const MAX_SEAM: usize = unknowns(MAX_JOINTS, true);

/// The unknowns of one record's seam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seam {
    /// g: impulse on each bushing, Ns and Nms.
    pub(crate) impulse: [[f64; DOF]; MAX_JOINTS],
    /// h: step on each bushing, N and Nm.
    pub(crate) step: [[f64; DOF]; MAX_JOINTS],
    /// c₀, c₁ ω₀ and c₋₁/ω₀ along each axis, m/s; ω₀ is the lowest angular frequency of the band.
    pub(crate) jumps: [[f64; 3]; ORDERS],
    /// Information of the prior, as a part of each unknown's information: the inverse square of the reading, in standard deviations of its noise.
    pub(crate) cost: f64,
}

/// Number of real unknowns for a chain of `joints`, and an accelerometer that gravity tilts or not.
pub(crate) const fn unknowns(joints: usize, tilted: bool) -> usize {
    PER_JOINT * joints + 3 * if tilted { ORDERS } else { ORDERS - 1 }
}

/// `(s/ω₀)ⁿ` at s = iω, order by order, each its one [part](PARTS), where ω is `ratio` times ω₀.
#[inline(always)]
pub(crate) fn powers(ratio: f64) -> [f64; ORDERS] {
    [1.0, ratio, -1.0 / ratio]
}

/// The cost of a seam that is none: its unknowns are zero to 1e-12 of what they would be.
pub(crate) const NO_SEAM: f64 = 1e12;

/// The cost in a record of so many parts, where the square of the reading is this, in standard deviations of its noise; no reading is smaller
/// than one.
pub(crate) fn cost_of(square: f64, parts: f64) -> f64 {
    1.0 / (parts * parts * square.max(1.0))
}

impl Seam {
    /// No impulse, no step, no jump.
    pub(crate) const ZERO: Self = Self {
        impulse: [[0.0; DOF]; MAX_JOINTS],
        step: [[0.0; DOF]; MAX_JOINTS],
        jumps: [[0.0; 3]; ORDERS],
        cost: 0.0,
    };

    /// Returns what the jump adds to the reading of an axis, from [`powers`]: real and imaginary part.
    #[inline(always)]
    pub(crate) fn jump(&self, axis: usize, powers: &[f64; ORDERS]) -> [f64; 2] {
        let mut jump = [0.0; 2];
        for order in 0..ORDERS {
            jump[PARTS[order]] += self.jumps[order][axis] * powers[order];
        }
        jump
    }

    /// Seam from the solution of the normal equations: per joint g then h, then the jumps, order by order.
    pub(crate) fn from_solution(solution: &[f64], joints: usize) -> Self {
        let mut seam = Self::ZERO;
        for joint in 0..joints {
            let own = &solution[PER_JOINT * joint..PER_JOINT * (joint + 1)];
            seam.impulse[joint].copy_from_slice(&own[..DOF]);
            seam.step[joint].copy_from_slice(&own[DOF..]);
        }
        let jumps = &solution[PER_JOINT * joints..];
        seam.jumps.as_flattened_mut()[..jumps.len()].copy_from_slice(jumps);
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
        let jumps = &mut solution[PER_JOINT * joints..][..3 * ORDERS];
        jumps.copy_from_slice(self.jumps.as_flattened());
        solution
    }
}
