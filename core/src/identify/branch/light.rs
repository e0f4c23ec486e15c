//! The lightly damped branch of a minimum.
//!
//! In series with others a bushing adds `1/(k + iωd)` to the receptance. What it dissipates grows with d up to `ωd = k` and
//! falls beyond, so that a light damping and a heavy one give a mode the same decay. The sum of squares can have a minimum at
//! each, with the same stiffnesses.

use crate::DOF;
use crate::chain::Chain;
use crate::parameters::Bounds;
use crate::sought::{Coordinate, Coordinates, MAX_UNKNOWNS, Sought};

/// Damping ratio, with the inertia that the joint carries, above which a bushing is heavily damped. Chosen: wrong dampings of drawn six-joint
/// arms had ratios of 0.2 to 0.6.
const HEAVY: f64 = 0.05;
/// The ratio that replaces it. Chosen: a decade below, from where the refinement finds either branch.
const LIGHT: f64 = 0.005;

/// Damps every heavily damped bushing lightly, within the bounds; `None` if there is none.
pub(super) fn lightly_damped(
    chain: &Chain,
    sought: &Sought,
    bounds: &Bounds,
    heavy: &Coordinates,
) -> Option<Coordinates> {
    let ranges = sought.ranges(heavy, bounds);
    let mut step = [0.0; MAX_UNKNOWNS];
    let mut found = false;
    for (joint, (bushing, inertia)) in
        sought.bushings(heavy).iter().zip(chain.carried()).enumerate()
    {
        for dof in 0..DOF {
            let critical = 2.0 * libm::sqrt(bushing.stiffness[dof] * inertia[dof]);
            let ratio = bushing.damping[dof] / critical;
            let unknown = sought.unknown(Coordinate::Damping { joint, dof });
            if let Some(unknown) = unknown.filter(|_| ratio > HEAVY) {
                let [value, lower, _] = ranges[unknown];
                step[unknown] = libm::log(LIGHT / ratio).max(lower - value);
                found |= step[unknown] < 0.0;
            }
        }
    }
    let mut light = *heavy;
    sought.advance(&mut light, &step);
    found.then_some(light)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::identify::branch::tests::chain;

    proptest! {
        /// Of every heavily damped bushing the ratio is the light one, and nothing else has changed.
        #[test]
        fn heavy_dampings_become_light_and_nothing_else_changes(
            ratios in prop::array::uniform24(1e-3..0.3_f64), hz in prop::array::uniform12(5.0..500.0_f64),
        ) {
            let chain = chain();
            let sought = Sought::new(2).unwrap();
            let critical = |index: usize| {
                let (joint, dof) = (index / DOF, index % DOF);
                let inertia = [[5.0, 0.05], [2.0, 0.02]][joint][dof / 3];
                let omega = core::f64::consts::TAU * hz[index];
                (inertia * omega * omega, 2.0 * inertia * omega)
            };
            let mut bushings = Bounds::of(&chain).middle(sought.joints());
            for index in 0..2 * DOF {
                let (k, d) = critical(index);
                bushings[index / DOF].stiffness[index % DOF] = k;
                bushings[index / DOF].damping[index % DOF] = ratios[index] * d;
            }
            let bounds = Bounds::of(&chain);
            let light = lightly_damped(&chain, &sought, &bounds, &sought.coordinates(&bushings));
            let heavy = (0..2 * DOF).any(|index| ratios[index] > HEAVY);
            prop_assert_eq!(light.is_some(), heavy);
            let Some(light) = light.map(|light| sought.bushings(&light)) else { return Ok(()) };
            for index in 0..2 * DOF {
                let (k, d) = critical(index);
                let ratio = if ratios[index] > HEAVY { LIGHT } else { ratios[index] };
                let (found, dof) = (&light[index / DOF], index % DOF);
                prop_assert!((found.stiffness[dof] / k - 1.0).abs() < 1e-9);
                prop_assert!((found.damping[dof] / (ratio * d) - 1.0).abs() < 1e-9);
            }
        }
    }
}
