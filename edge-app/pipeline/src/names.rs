//! Names and units of unknowns.

use flexid_core::sought::{Coordinate, Sought};
pub use flexid_core::{DAMPING_UNITS, DOF_NAMES, STIFFNESS_UNITS};
use flexid_wire::text::{Label, Name, clipped};

use crate::model::Model;

/// Returns the name of a coordinate, for example `joint_1 tx stiffness` or `delay`.
pub fn name(model: &Model, coordinate: Coordinate) -> Label {
    match coordinate {
        Coordinate::Stiffness { joint, dof } => {
            clipped(format_args!("{} {} stiffness", joint_name(model, joint), DOF_NAMES[dof]))
        }
        Coordinate::Damping { joint, dof } => {
            clipped(format_args!("{} {} damping", joint_name(model, joint), DOF_NAMES[dof]))
        }
        Coordinate::Mass(link) => {
            clipped(format_args!("mass of {}'s link", joint_name(model, link)))
        }
        of_the_sensors => clipped(of_the_sensors),
    }
}

/// Returns the name of a joint, clipped as in a report. It is empty for a joint that the model does not have.
pub(super) fn joint_name(model: &Model, joint: usize) -> Name {
    model.joints.get(joint).map_or_else(Name::new, |joint| clipped(&joint.name))
}

/// Returns the names of all unknowns of a fit, in their order.
pub(super) fn names(model: &Model, sought: &Sought) -> Vec<Label> {
    let coordinates = (0..sought.unknowns()).filter_map(|unknown| sought.coordinate(unknown));
    coordinates.map(|coordinate| name(model, coordinate)).collect()
}
