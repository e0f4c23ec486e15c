//! The branch of a minimum on which every undetermined damping has a typical ratio.
//!
//! A fit lets a damping that the data hardly determine go to where it has no effect. Another minimum may lie where it has one.

use crate::identify::start::typical_damping;
use crate::parameters::Bounds;
use crate::sought::{Coordinate, Coordinates, MAX_UNKNOWNS, Sought};
use crate::verdict::WEAK;

/// Moves the damping ratio of every undetermined damping to the middle of its bounds; `None` if none is undetermined. `deviation` is the standard
/// deviation of an unknown.
pub(in crate::identify) fn typically_damped(
    sought: &Sought,
    bounds: &Bounds,
    from: &Coordinates,
    deviation: impl Fn(usize) -> f64,
) -> Option<Coordinates> {
    let ranges = sought.ranges(from, bounds);
    let (lower, upper) = bounds.logarithms(sought.joints());
    let mut step = [0.0; MAX_UNKNOWNS];
    let mut found = false;
    for unknown in (0..sought.unknowns()).filter(|&one| deviation(one) > WEAK) {
        if let Some(Coordinate::Damping { joint, dof }) = sought.coordinate(unknown) {
            let k = Coordinate::Stiffness { joint, dof }.index();
            let [value, least, most] = ranges[unknown];
            let typical = typical_damping([least, most], [lower[k], upper[k]], from[k]);
            step[unknown] = typical - value;
            found = true;
        }
    }
    let mut typical = *from;
    sought.advance(&mut typical, &step);
    found.then_some(typical)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::DOF;
    use crate::identify::start::tests::{two_joints, within_the_bounds};

    proptest! {
        /// Every undetermined damping has the ratio of the middle, or lies on the bound that is nearest to it; nothing else has
        /// changed.
        #[test]
        fn undetermined_dampings_become_typical_and_nothing_else_changes(
            deviations in prop::array::uniform24(1e-2..1.0_f64),
            places in prop::array::uniform24(0.0..1.0_f64),
        ) {
            let (sought, bounds) = two_joints();
            let (lower, upper) = bounds.logarithms(2);
            let from = within_the_bounds(&places);
            let is_moved = |index: &usize| index % (2 * DOF) >= DOF && deviations[*index] > 0.3;
            let typical = typically_damped(&sought, &bounds, &from, |unknown| deviations[unknown]);
            prop_assert_eq!(typical.is_some(), (0..24).any(|index| is_moved(&index)));
            let Some(typical) = typical else { return Ok(()) };
            let middle = |index: usize| 0.5 * (lower[index] + upper[index]);
            for d in 0..24 {
                let expected = if is_moved(&d) {
                    let k = d - DOF;
                    (middle(d) + 0.5 * (from[k] - middle(k))).clamp(lower[d], upper[d])
                } else {
                    from[d]
                };
                prop_assert!((typical[d] - expected).abs() < 1e-9, "{}", d);
            }
        }
    }
}
