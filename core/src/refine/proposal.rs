//! A step: damped, and within a box.
//!
//! The damped sum of squares is a strictly convex quadratic of the step, and the step is its least point in the box. An active-set
//! method finds it, from the standing point on (Stark and Parker, "Bounded-variable least-squares: an algorithm and applications",
//! 1995): unknowns that meet an end of the box are held there, and released when the gradient points back inside. All unknowns that a round
//! leads beyond their ends are held at once where that lowers the quadratic (Moré and Toraldo, "On the solution of large quadratic programming
//! problems with bound constraints", SIAM Journal on Optimization 1, 1991), else the first that meets its end. Every round lowers the
//! quadratic, so that the gain it promises is never negative. The first unknowns, as far as they have no ends, are eliminated once, before
//! all rounds.

use fearless_simd::Level;

use crate::linear::normal::Normal;
use crate::sought::MAX_UNKNOWNS;

/// Change of each unknown.
pub(crate) type Step<const N: usize = MAX_UNKNOWNS> = [f64; N];
/// Box of a step: how far each unknown may go, `[least, most]`, 0 between them.
pub(crate) type Room<const N: usize = MAX_UNKNOWNS> = [[f64; 2]; N];

/// Information that each unknown is given beside that of the data, so that an undetermined one stays put. Chosen: that of a
/// standard deviation of 1000, which no determined logarithm nears.
pub(super) const FLOOR: f64 = 1e-6;
/// Gain for which an unknown is released from its end of the box. Chosen: a hundred unknowns that stay held cost less than a
/// hundredth of the gain that ends a refinement.
const WORTH_RELEASING: f64 = 1e-8;
/// Rounds for each unknown after which the search of the box ends wherever it is. Chosen: most unknowns are held once and never
/// released.
const MAX_ROUNDS: usize = 4;

/// The damped step in the box, and the gain it promises: at least 0.
// A copy of normal equations is large: inlined, it would take room on the stack of the caller.
#[inline(never)]
pub(super) fn propose<const L: usize, const N: usize>(
    level: Level,
    normal: &Normal<L>,
    room: &Room<N>,
    damping: f64,
) -> (Step<N>, f64) {
    let mut damped = normal.clone();
    for i in 0..normal.unknowns() {
        let diagonal = damped.entry(i, i);
        *diagonal += damping * (*diagonal + FLOOR) + FLOOR;
    }
    let step = least_within(level, &damped, room);
    (step, normal.gain(&step))
}

/// The step in the box that gains most.
pub(crate) fn least_within<const L: usize, const N: usize>(
    level: Level,
    normal: &Normal<L>,
    room: &Room<N>,
) -> Step<N> {
    let unknowns = normal.unknowns();
    let is_open = |room: &&[f64; 2]| **room == [f64::NEG_INFINITY, f64::INFINITY];
    let open = room[..unknowns].iter().take_while(is_open).count();
    let mut factor = normal.clone();
    factor.eliminate_with(level, open);
    let mut step = [0.0; N];
    let mut held: [bool; N] =
        core::array::from_fn(|i| i < unknowns && !has_way(normal.right()[i], 0.0, room[i]));
    for _ in 0..MAX_ROUNDS * N {
        let aim = solve_beside(level, &factor, open, &step, &held);
        // The part of the way to the aim that stays in the box, and the unknown that meets its end first.
        let (mut part, mut meets) = (1.0, None);
        let mut clamped = step;
        for i in (0..unknowns).filter(|&i| !held[i]) {
            let [least, most] = room[i];
            let end = aim[i].max(least).min(most);
            clamped[i] = end;
            if end != aim[i] {
                let own = ((end - step[i]) / (aim[i] - step[i])).max(0.0);
                if own < part {
                    (part, meets) = (own, Some((i, end)));
                }
            }
        }
        if meets.is_some() && normal.gain(&clamped) > normal.gain(&step) {
            for i in 0..unknowns {
                held[i] |= clamped[i] != aim[i];
            }
            step = clamped;
            continue;
        }
        for i in (0..unknowns).filter(|&i| !held[i]) {
            step[i] += part * (aim[i] - step[i]);
        }
        if let Some((i, end)) = meets {
            (step[i], held[i]) = (end, true);
            continue;
        }
        let gain = |i: usize| {
            let slope = normal.slope(i, &step);
            let gain = slope * slope / normal.row(i)[i];
            if has_way(slope, step[i], room[i]) { gain } else { 0.0 }
        };
        let released = (0..unknowns).filter(|&i| held[i]).map(|i| (i, gain(i)));
        let released = released.filter(|(_, gain)| *gain > WORTH_RELEASING);
        match released.max_by(|(_, one), (_, other)| one.total_cmp(other)) {
            Some((i, _)) => held[i] = false,
            None => break,
        }
    }
    step
}

/// Returns whether an unknown at `step` may go where the sum of squares falls; `slope` is half its fall per step.
fn has_way(slope: f64, step: f64, [least, most]: [f64; 2]) -> bool {
    if slope > 0.0 { step < most } else { step > least }
}

/// The step that gains most while the unknowns that are `held` stay where they are. Of the equations the first `open` unknowns have been
/// eliminated, of which none is held.
fn solve_beside<const L: usize, const N: usize>(
    level: Level,
    factor: &Normal<L>,
    open: usize,
    step: &Step<N>,
    held: &[bool; N],
) -> Step<N> {
    let unknowns = factor.unknowns();
    let put: [Option<f64>; N] = core::array::from_fn(|i| held[i].then_some(step[i]));
    let mut pinned = Normal::<L>::new();
    pinned.reset(unknowns - open);
    pinned.add_complement(factor, open);
    pinned.fix(&put[open..unknowns]);
    pinned.eliminate_with(level, unknowns - open);
    let mut aim = [0.0; N];
    let (first, others) = aim.split_at_mut(open);
    pinned.substitute(unknowns - open, others);
    factor.substitute_at(open, &others[..unknowns - open], first);
    aim
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use proptest::collection::vec;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    use super::*;
    use crate::linear::packed::packed;

    const UNKNOWNS: usize = 9;

    /// The least point of `xᵀNx − 2gᵀx` in the box by cyclic coordinate descent, which converges for every convex quadratic.
    fn by_coordinates(n: &DMatrix<f64>, g: &DVector<f64>, room: &Room) -> DVector<f64> {
        let mut x = DVector::zeros(UNKNOWNS);
        for _ in 0..20_000 {
            for i in 0..UNKNOWNS {
                let slope = g[i] - n.row(i).transpose().dot(&x);
                x[i] = (x[i] + slope / n[(i, i)]).clamp(room[i][0], room[i][1]);
            }
        }
        x
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(3), ..ProptestConfig::with_cases(64) })]

        /// Correlated unknowns, the first of them without ends, some of the others at an end of the box from the beginning.
        #[test]
        fn the_least_point_of_the_box_is_found(
            entries in vec(-1.0_f64..1.0, 12 * UNKNOWNS),
            pull in vec(-3.0_f64..3.0, UNKNOWNS),
            below in vec(prop_oneof![Just(0.0), 0.0_f64..1.0], UNKNOWNS),
            above in vec(prop_oneof![Just(0.0), 0.0_f64..1.0], UNKNOWNS),
            common in 0.0_f64..2.0,
            open in 0..UNKNOWNS,
        ) {
            // A common part makes the columns alike.
            let jacobian = DMatrix::from_fn(12, UNKNOWNS, |i, j| entries[i * UNKNOWNS + j] + common);
            let n = jacobian.transpose() * &jacobian + DMatrix::identity(UNKNOWNS, UNKNOWNS) * 0.05;
            let g = DVector::from_vec(pull);
            let mut normal = Normal::<{ packed(UNKNOWNS + 1) }>::new();
            normal.reset(UNKNOWNS);
            for i in 0..UNKNOWNS {
                for j in 0..=i {
                    *normal.entry(i, j) = n[(i, j)];
                }
                *normal.entry(UNKNOWNS, i) = g[i];
            }
            let mut room: Room = [[0.0; 2]; MAX_UNKNOWNS];
            for i in 0..UNKNOWNS {
                let is_open = i < open;
                room[i] = if is_open { [f64::NEG_INFINITY, f64::INFINITY] } else { [-below[i], above[i]] };
            }
            let expected = by_coordinates(&n, &g, &room);
            let step = least_within(Level::new(), &normal, &room);
            for i in 0..UNKNOWNS {
                prop_assert!((room[i][0]..=room[i][1]).contains(&step[i]), "{} of {:?}", step[i], room[i]);
            }
            let best = 2.0 * g.dot(&expected) - expected.dot(&(&n * &expected));
            let gain = normal.gain(&step);
            prop_assert!(gain >= 0.0 && (best - gain).abs() < 1e-6, "gain {gain}, {best} is possible");
        }
    }
}
