//! The unknowns that are parameters of the joints.

use flexid_core::sought::{Coordinate, Sought};

/// Number of unknowns that are parameters of the joints. They come first, before the nuisances.
pub(crate) fn parameters(sought: &Sought) -> usize {
    let parameter = |unknown: &usize| {
        let coordinate = sought.coordinate(*unknown);
        matches!(coordinate, Some(Coordinate::Stiffness { .. } | Coordinate::Damping { .. }))
    };
    (0..sought.unknowns()).take_while(parameter).count()
}
