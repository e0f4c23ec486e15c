//! The branches of a minimum on which two springs in series share their compliance or exchange it.
//!
//! Where axes of two neighbouring joints are parallel, a force along them passes through both bushings, and so does a torque:
//!
//! ```text
//!     1/k = 1/k₁ + 1/k₂
//! ```
//!
//! The inertia of the link between them distinguishes the two, and for a torque the offset of the joints. In wrists both are small,
//! so that a search may find the compliance in the wrong joint.

use crate::chain::Chain;
use crate::parameters::Bounds;
use crate::sought::{Coordinate, Coordinates, MAX_UNKNOWNS, Sought};
use crate::spectrum::Experiment;

/// Cosine of the angle between two axes from which on they count as parallel, in the poses of all records. Chosen: 37 degrees, where a force
/// along the one axis has four fifths of its size along the other.
const PARALLEL: f64 = 0.8;
/// Least difference of the logarithms of two stiffnesses for which they are changed. Chosen: one step of a refinement may be twice as long (its
/// `LONGEST_STEP`).
const DIFFERENT: f64 = 0.5;

/// A spring of one joint's bushing and one of the next joint's, either along two axes or about them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Pair {
    /// The joint nearer to the base.
    joint: usize,
    /// Degrees of freedom of the two springs.
    dofs: [usize; 2],
}

/// How two springs are changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Change {
    /// Both have twice the stiffness that they have in series.
    Share,
    /// Each has the stiffness and the damping of the other.
    Exchange,
}

/// The changes of a minimum at `from` that lead to its branches, each with its place among all changes of the chain, without the
/// first `tried` places.
pub(super) fn branches<'a, const B: usize>(
    chain: &'a Chain,
    sought: &'a Sought,
    bounds: &'a Bounds,
    from: &'a Coordinates,
    experiments: &'a [Experiment<B>],
    tried: usize,
) -> impl Iterator<Item = (usize, Coordinates)> + 'a {
    let poses = || experiments.iter().map(|experiment| experiment.pose.as_slice());
    let changes = [Change::Share, Change::Exchange].into_iter();
    let all = changes.flat_map(|change| pairs(chain).map(move |pair| (change, pair)));
    let untried = all.enumerate().skip(tried);
    untried.filter(move |(_, (_, pair))| pair.is_in_series(chain, poses())).filter_map(
        |(place, (change, pair))| Some((place, changed(sought, bounds, from, pair, change)?)),
    )
}

/// All pairs, whether their axes are parallel or not.
fn pairs(chain: &Chain) -> impl Iterator<Item = Pair> + use<> {
    (1..chain.joints().len()).flat_map(|next| {
        // Two along their axes, or two about them.
        let alike = [0, 3].into_iter().flat_map(|first| {
            (first..first + 3).flat_map(move |a| (first..first + 3).map(move |b| [a, b]))
        });
        alike.map(move |dofs| Pair { joint: next - 1, dofs })
    })
}

impl Pair {
    /// Returns whether the axes are parallel in all `poses`, rad (m).
    fn is_in_series<'a>(&self, chain: &Chain, mut poses: impl Iterator<Item = &'a [f64]>) -> bool {
        let next = self.joint + 1;
        let [row, column] = self.dofs.map(|dof| dof % 3);
        poses.all(|pose| {
            let q = chain.angles(pose).nth(next).unwrap_or_default();
            let axes = chain.joints()[next].frame(q).rotation.to_rotation_matrix();
            axes[(row, column)].abs() >= PARALLEL
        })
    }
}

/// Changes one pair of springs, as far as the bounds allow; `None` if the pair is not sought or the change is small.
fn changed(
    sought: &Sought,
    bounds: &Bounds,
    from: &Coordinates,
    pair: Pair,
    change: Change,
) -> Option<Coordinates> {
    let Pair { joint, dofs: [a, b] } = pair;
    let k1 = Coordinate::Stiffness { joint, dof: a };
    let k2 = Coordinate::Stiffness { joint: joint + 1, dof: b };
    let d1 = Coordinate::Damping { joint, dof: a };
    let d2 = Coordinate::Damping { joint: joint + 1, dof: b };
    let unknowns = [sought.unknown(k1)?, sought.unknown(k2)?];
    let [ln_k1, ln_k2, ln_d1, ln_d2] = [k1, k2, d1, d2].map(|one| from[one.index()]);
    if unknowns[0] == unknowns[1] || (ln_k1 - ln_k2).abs() < DIFFERENT {
        return None;
    }
    let target = match change {
        Change::Exchange => [ln_k2, ln_k1, ln_d2, ln_d1],
        Change::Share => {
            // k = 2/(1/k₁ + 1/k₂), d/k as in the softer one.
            let ln_k = core::f64::consts::LN_2 - libm::log(libm::exp(-ln_k1) + libm::exp(-ln_k2));
            let loss = if ln_k1 < ln_k2 { ln_d1 - ln_k1 } else { ln_d2 - ln_k2 };
            [ln_k, ln_k, loss + ln_k, loss + ln_k]
        }
    };
    let ranges = sought.ranges(from, bounds);
    let mut step = [0.0; MAX_UNKNOWNS];
    for (coordinate, target) in [k1, k2, d1, d2].into_iter().zip(target) {
        if let Some(unknown) = sought.unknown(coordinate) {
            let [value, lower, upper] = ranges[unknown];
            step[unknown] = target.clamp(lower, upper) - value;
        }
    }
    let mut changed = *from;
    sought.advance(&mut changed, &step);
    Some(changed)
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::*;
    use crate::DOF;
    use crate::identify::branch::tests::chain;
    use crate::identify::start::tests::{two_joints, within_the_bounds};

    /// The coordinates of the stiffnesses and the dampings of a pair of two joints.
    fn indices([a, b]: [usize; 2]) -> [usize; 4] {
        [a, 2 * DOF + b, a + DOF, 2 * DOF + b + DOF]
    }

    proptest! {
        /// `1/k₁ + 1/k₂` remains, and so does `d/k` of the softer one. Nothing else changes.
        #[test]
        fn springs_that_share_have_the_same_compliance_in_series(
            axes in prop::array::uniform2(0..3_usize), first in prop::sample::select(&[0, 3][..]),
            places in prop::array::uniform24(0.2..0.8_f64),
        ) {
            let (sought, bounds) = two_joints();
            let dofs = axes.map(|axis| first + axis);
            let from = within_the_bounds(&places);
            let [k1, k2, d1, d2] = indices(dofs);
            let pair = Pair { joint: 0, dofs };
            let Some(shared) = changed(&sought, &bounds, &from, pair, Change::Share) else {
                prop_assert!((from[k1] - from[k2]).abs() < 0.5);
                return Ok(());
            };
            let compliance = |at: &Coordinates| (-at[k1]).exp() + (-at[k2]).exp();
            prop_assert!((compliance(&shared) / compliance(&from) - 1.0).abs() < 1e-9);
            prop_assert!((shared[k1] - shared[k2]).abs() < 1e-9);
            let (k, d) = if from[k1] < from[k2] { (k1, d1) } else { (k2, d2) };
            prop_assert!((shared[d] - shared[k] - (from[d] - from[k])).abs() < 1e-9);
            prop_assert!((shared[d1] - shared[d2]).abs() < 1e-9);
            for index in (0..24).filter(|index| !indices(dofs).contains(index)) {
                prop_assert_eq!(shared[index], from[index]);
            }
        }

        /// Each has what the other had, or the bound that is nearest to it. Nothing else changes.
        #[test]
        fn springs_exchange_stiffness_and_damping_within_the_bounds(
            axes in prop::array::uniform2(0..3_usize), first in prop::sample::select(&[0, 3][..]),
            places in prop::array::uniform24(0.0..1.0_f64),
        ) {
            let (sought, bounds) = two_joints();
            let dofs = axes.map(|axis| first + axis);
            let (lower, upper) = bounds.logarithms(2);
            let from = within_the_bounds(&places);
            let exchange = |from: &Coordinates| {
                changed(&sought, &bounds, from, Pair { joint: 0, dofs }, Change::Exchange)
            };
            let [k1, k2, d1, d2] = indices(dofs);
            let exchanged = exchange(&from);
            prop_assert_eq!(exchanged.is_some(), (from[k1] - from[k2]).abs() >= DIFFERENT);
            let Some(exchanged) = exchanged else { return Ok(()) };
            for (own, other) in [(k1, k2), (k2, k1), (d1, d2), (d2, d1)] {
                let wanted = from[other].clamp(lower[own], upper[own]);
                prop_assert!((exchanged[own] - wanted).abs() < 1e-9);
            }
            for index in (0..24).filter(|index| !indices(dofs).contains(index)) {
                prop_assert_eq!(exchanged[index], from[index]);
            }
        }
    }

    /// Both joints turn about z: their z axes are parallel always, the two others while the angle of the second joint is small or
    /// near half a turn, or crosswise near a quarter turn; in all poses.
    #[test]
    fn springs_are_in_series_if_their_axes_are_parallel_in_every_pose() {
        let chain = chain();
        let parallel = |angles: &[f64]| {
            let poses: Vec<[f64; 2]> = angles.iter().map(|angle| [0.7, *angle]).collect();
            let in_series = pairs(&chain)
                .filter(|pair| pair.is_in_series(&chain, poses.iter().map(|pose| &pose[..])));
            in_series.map(|pair| pair.dofs).collect::<Vec<_>>()
        };
        let both = |axes: &[[usize; 2]]| {
            let turns = axes.iter().map(|axes| axes.map(|axis| axis + 3));
            axes.iter().copied().chain(turns).collect::<Vec<_>>()
        };
        assert_eq!(parallel(&[0.0]), both(&[[0, 0], [1, 1], [2, 2]]));
        assert_eq!(parallel(&[0.0, 3.0]), both(&[[0, 0], [1, 1], [2, 2]]));
        assert_eq!(parallel(&[0.0, 0.7]), both(&[[2, 2]]));
        assert_eq!(parallel(&[1.5]), both(&[[0, 1], [1, 0], [2, 2]]));
        assert_eq!(parallel(&[0.0, 1.5]), both(&[[2, 2]]));
    }
}
