//! Reason why a record is not used at a pose at which the robot has no equilibrium.

use flexid_core::chain::linearise::LinearisationError;
use flexid_wire::text::{Name, clipped};

use crate::model::Model;

/// Returns in words why a robot as stiff as the bounds allow has no equilibrium at a pose.
pub(crate) fn no_equilibrium(error: LinearisationError, model: &Model, pose: &[f64]) -> String {
    let name = |joint: usize| -> Name {
        model.joints.get(joint).map_or_else(Name::new, |joint| clipped(&joint.name))
    };
    let angles: Vec<String> = pose.iter().map(|angle| format!("{angle:.2}")).collect();
    let angles = angles.join(", ");
    match error {
        LinearisationError::Angles(_) | LinearisationError::Bushings(_) => error.to_string(),
        LinearisationError::NoEquilibrium(joint) | LinearisationError::QuarterTurn(joint) => {
            let name = name(joint);
            format!("{name} gives way under gravity at ({angles}): raise [bounds] or check masses")
        }
    }
}
