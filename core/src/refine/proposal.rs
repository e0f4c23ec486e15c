//! A step: damped, within the bounds, and not too far.

use super::{ParameterNormal, Problem, Refinement};
use crate::unknowns::MAX_UNKNOWNS;

/// A step may not change a parameter by more than this factor's logarithm.
const LONGEST_STEP: f64 = 1.0;
/// Information per parameter that damping starts from, so that an unobserved one stays put.
const FLOOR: f64 = 1e-6;

impl Refinement {
    /// The damped step within the bounds, and the gain it promises.
    pub(super) fn propose(
        &self,
        problem: &Problem<'_>,
        normal: &ParameterNormal,
        damping: f64,
    ) -> ([f64; MAX_UNKNOWNS], f64) {
        let unknowns = normal.unknowns();
        let ranges = problem.sought.ranges(&self.coordinates, problem.bounds);
        // An unknown that would pass its bound, or go too far, is put there, and the others are solved for again.
        let mut put = [None; MAX_UNKNOWNS];
        let mut step = [0.0; MAX_UNKNOWNS];
        loop {
            let mut damped = normal.clone();
            for i in 0..unknowns {
                let diagonal = damped.entry(i, i);
                *diagonal += damping * (*diagonal + FLOOR) + FLOOR;
            }
            damped.fix(&put[..unknowns]);
            damped.eliminate(unknowns);
            damped.substitute(unknowns, &mut step);
            let mut beyond = false;
            for i in 0..unknowns {
                let [value, lower, upper] = ranges[i];
                let (least, most) = (lower - value, upper - value);
                let inside =
                    step[i].max(least.clamp(-LONGEST_STEP, 0.0)).min(most.clamp(0.0, LONGEST_STEP));
                if let Some(value) = put[i] {
                    step[i] = value;
                } else if inside != step[i] {
                    put[i] = Some(inside);
                    beyond = true;
                }
            }
            if !beyond {
                break;
            }
        }
        (step, normal.gain(&step))
    }
}
