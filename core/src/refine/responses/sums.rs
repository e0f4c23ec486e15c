//! Sums over the bins of a record.

use super::{Bin, KINDS, LOADS, OTHER_KINDS, OTHERS};
use crate::linear::gram::WIDEST;
use crate::linear::normal::Normal;
use crate::linear::packed::packed;
use crate::refine::seam::{ORDERS, PARTS, powers};
use crate::{DOF, MAX_JOINTS};

/// Length of the sums of all pairs of bushings.
const OF_PAIRS: usize = start(DOF * MAX_JOINTS);
/// Unknown jumps, and the residual behind them.
const JUMPS: usize = 3 * ORDERS;

/// Sums over the bins of a record, from which its normal equations follow.
#[derive(Clone, Debug)]
pub(in crate::refine) struct Sums {
    /// Number of bushings times six.
    pub(super) loads: usize,
    /// True if elongations count.
    pub(super) has_unknowns: bool,
    /// Sums of load i with each load up to it, kind by kind.
    pub(super) pairs: [f64; OF_PAIRS],
    /// Sums of each jump and the residual with each load, kind by kind.
    pub(super) others: [[[f64; LOADS]; OTHER_KINDS]; OTHERS],
    /// Normal equations of the jumps alone.
    pub(super) jumps: Normal<{ packed(JUMPS + 1) }>,
    /// ω₀, rad/s.
    pub(super) lowest: f64,
}

/// Returns where the sums of load i begin.
pub(super) const fn start(i: usize) -> usize {
    let (block, row) = (i / WIDEST, i % WIDEST);
    // Rows of a block are as long as its last one.
    KINDS * WIDEST * (WIDEST * (block * (block + 1) / 2) + row * (block + 1))
}

/// Length of the sums of load i of one kind.
pub(super) const fn length(i: usize) -> usize {
    (i / WIDEST + 1) * WIDEST
}

impl Sums {
    pub(in crate::refine) const fn new() -> Self {
        Self {
            loads: 0,
            has_unknowns: false,
            pairs: [0.0; OF_PAIRS],
            others: [[[0.0; LOADS]; OTHER_KINDS]; OTHERS],
            jumps: Normal::new(),
            lowest: 0.0,
        }
    }

    /// Begins the sums of a chain of so many joints, and of so many jumps.
    pub(in crate::refine) fn reset(
        &mut self,
        joints: usize,
        jumps: usize,
        has_unknowns: bool,
        lowest: f64,
    ) {
        self.loads = DOF * joints;
        self.has_unknowns = has_unknowns;
        self.pairs[..start(self.loads)].fill(0.0);
        self.others = [[[0.0; LOADS]; OTHER_KINDS]; OTHERS];
        self.jumps.reset(jumps);
        self.lowest = lowest;
    }

    /// Adds the jumps of some bins, and the residual.
    pub(super) fn add_jumps(&mut self, bins: &[Bin]) {
        let jumps = self.jumps.unknowns();
        for bin in bins {
            let powers = powers(bin.omega / self.lowest);
            let mut rows = [[0.0; JUMPS + 1]; 6];
            for axis in 0..3 {
                for (column, factor) in (0..jumps).map(|jump| (jump, powers[jump / 3])) {
                    let [re, im] = bin.others[column % 3][axis];
                    let [re, im] = if PARTS[column / 3] == 0 { [re, im] } else { [-im, re] };
                    rows[2 * axis][column] = factor * re;
                    rows[2 * axis + 1][column] = factor * im;
                }
                let [re, im] = bin.others[OTHERS - 1][axis];
                rows[2 * axis][jumps] = re;
                rows[2 * axis + 1][jumps] = im;
            }
            self.jumps.add(&rows);
        }
    }

    /// Sum of one kind of the loads i and j, j ≤ i.
    pub(super) fn pair(&self, i: usize, j: usize, kind: usize) -> f64 {
        self.pairs[start(i) + kind * length(i) + j]
    }
}
