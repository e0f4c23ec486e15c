//! Priors that hold the parameters that a level does not determine. Their means are the start of the descent and the middle
//! of the bounds' damping ratios. Descents with different starts therefore end apart where the data leave the end open.

use crate::parameters::Bounds;
use crate::refine::ParameterNormal;
use crate::sought::{Coordinate, Coordinates, Sought};
use crate::{DOF, MAX_JOINTS};

/// Standard deviation of ln d − ½ ln k, which for a known inertia is that of the logarithm of the damping ratio. Chosen: a factor of seven, so
/// that 95 % of the ratios lie within a factor of fifty of the middle.
const DAMPING_RATIO: f64 = 2.0;

/// Adds the priors at `coordinates`. The prior of a parameter has its mean at `start`, and half the width of the bounds as
/// its standard deviation.
pub(super) fn add(
    normal: &mut ParameterNormal,
    coordinates: &Coordinates,
    start: &Coordinates,
    sought: &Sought,
    bounds: &Bounds,
) {
    let (lower, upper) = bounds.logarithms(sought.joints());
    let off = |index: usize| coordinates[index] - 0.5 * (lower[index] + upper[index]);
    for joint in 0..sought.joints().min(MAX_JOINTS) {
        for dof in 0..DOF {
            let pair = [Coordinate::Stiffness { joint, dof }, Coordinate::Damping { joint, dof }];
            let [k, d] = pair.map(Coordinate::index);
            let unknowns = pair.map(|coordinate| sought.unknown(coordinate));
            for (index, unknown) in [k, d].into_iter().zip(unknowns) {
                let width = 0.5 * (upper[index] - lower[index]);
                if let Some(unknown) = unknown {
                    let moved = coordinates[index] - start[index];
                    normal.add_sparse(&[(unknown, 1.0 / width)], moved / width);
                }
            }
            let value = (off(d) - 0.5 * off(k)) / DAMPING_RATIO;
            match unknowns {
                [Some(own), Some(other)] => normal.add_sparse(
                    &[(own, -0.5 / DAMPING_RATIO), (other, 1.0 / DAMPING_RATIO)],
                    value,
                ),
                [None, Some(other)] => {
                    normal.add_sparse(&[(other, 1.0 / DAMPING_RATIO)], value);
                }
                _ => {}
            }
        }
    }
    for (unknown, value) in sought.priors(coordinates) {
        normal.add_prior(unknown, value);
    }
}
