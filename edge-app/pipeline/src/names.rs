//! Names and units of unknowns.

pub use flexid_core::DOF_NAMES;
use flexid_core::sought::{Coordinate, Sought};
use flexid_wire::text::{Label, Name, clipped};

use crate::model::Model;

/// Units of the stiffnesses of a joint, in the order of [`DOF_NAMES`].
pub const STIFFNESS_UNITS: [&str; 6] = ["N/m", "N/m", "N/m", "Nm/rad", "Nm/rad", "Nm/rad"];
/// Units of the dampings of a joint, in the order of [`DOF_NAMES`].
pub const DAMPING_UNITS: [&str; 6] = ["Ns/m", "Ns/m", "Ns/m", "Nms/rad", "Nms/rad", "Nms/rad"];

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
