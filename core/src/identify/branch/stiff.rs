//! The branches of a minimum on which one bushing of badly determined stiffness is stiff.
//!
//! Above its resonance a soft bushing carries nothing: in the band it shows the compliance `1/(k − mω²)` of its mass whatever k
//! is, and a stiff one shows next to none. Where other joints can make up for the difference, noise explains either. From the
//! soft side the resonance, which would have to cross the band, is a barrier; from the stiff side the way is straight, since the
//! receptance is linear in a small compliance.

use crate::identify::start;
use crate::parameters::Bounds;
use crate::sought::{Coordinate, Coordinates, Sought};

/// Relative standard deviation above which a stiffness is unsure. Chosen: the wrong ones of six-joint robots had 2 % and more.
const UNSURE: f64 = 0.02;
/// Distance of the stiffened one below its upper bound, by logarithms. Chosen: one step of a refinement reaches the bound (its `LONGEST_STEP`).
const STIFF: f64 = 1.0;

/// The unknowns that are stiffnesses, tip first.
pub(super) fn stiffnesses(sought: &Sought) -> impl Iterator<Item = usize> {
    let is_stiffness =
        |unknown: &usize| matches!(sought.coordinate(*unknown), Some(Coordinate::Stiffness { .. }));
    (0..sought.unknowns()).rev().filter(is_stiffness)
}

/// The badly determined ones of them, by the standard deviation of an unknown.
pub(super) fn unsure(
    sought: &Sought,
    deviation: impl Fn(usize) -> f64,
) -> impl Iterator<Item = usize> {
    stiffnesses(sought).filter(move |unknown| deviation(*unknown) > UNSURE)
}

/// Makes the stiffness of one unknown stiff, with its damping ratio in the middle of its bounds.
pub(super) fn stiffened(
    sought: &Sought,
    bounds: &Bounds,
    soft: &Coordinates,
    unknown: usize,
) -> Coordinates {
    let [_, _, upper] = sought.ranges(soft, bounds)[unknown];
    start::with_stiffness(sought, bounds, soft, unknown, upper - STIFF)
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::*;
    use crate::DOF;
    use crate::identify::start::tests::{two_joints, within_the_bounds};

    proptest! {
        /// Unsure are stiffnesses of more than 2 %, tip first, and no dampings.
        #[test]
        fn stiffnesses_are_unsure_above_two_percent(
            deviations in prop::array::uniform24(1e-4..0.1_f64),
        ) {
            let sought = Sought::new(2).unwrap();
            let is_stiffness = |index: &usize| index % (2 * DOF) < DOF;
            let expected: Vec<usize> =
                (0..24).rev().filter(is_stiffness).filter(|&k| deviations[k] > 0.02).collect();
            let found: Vec<usize> = unsure(&sought, |k| deviations[k]).collect();
            prop_assert_eq!(found, expected);
        }

        /// The stiffness lies just below its upper bound.
        #[test]
        fn one_bushing_becomes_stiff(
            bushing in 0..12_usize, places in prop::array::uniform24(0.0..1.0_f64),
        ) {
            let (sought, bounds) = two_joints();
            let (_, upper) = bounds.logarithms(2);
            let k = 2 * DOF * (bushing / DOF) + bushing % DOF;
            let stiff = stiffened(&sought, &bounds, &within_the_bounds(&places), k);
            prop_assert!((stiff[k] - (upper[k] - 1.0)).abs() < 1e-9);
        }
    }
}
