//! Names and units of unknowns.

use flexid_core::imperfection::{Imperfection, Place};
use flexid_core::sought::{Coordinate, Sought};
pub use flexid_core::{DAMPING_UNITS, DOF_NAMES, STIFFNESS_UNITS};
use flexid_wire::text::{Label, Name, clipped};

use crate::model::Model;

const AXES: [&str; 3] = ["x", "y", "z"];
const SPREADS: [&str; 6] = ["x", "y", "z", "xy", "xz", "yz"];

/// Returns the name of a coordinate, for example `joint_1 tx stiffness` or `delay`.
pub fn name(model: &Model, coordinate: Coordinate) -> Label {
    match coordinate {
        Coordinate::Stiffness { joint, dof } => {
            clipped(format_args!("{} {} stiffness", joint_name(model, joint), DOF_NAMES[dof]))
        }
        Coordinate::Damping { joint, dof } => {
            clipped(format_args!("{} {} damping", joint_name(model, joint), DOF_NAMES[dof]))
        }
        Coordinate::Imperfection(own) => of_imperfection(model, own),
    }
}

/// Returns the name of an imperfection, for example `force sensor turned about x`.
pub(crate) fn of_imperfection(model: &Model, imperfection: Imperfection) -> Label {
    let name = imperfection.facts().name;
    let joint = |own| ("{joint}", joint_name(model, own).to_string());
    let word = |mark, word: &str| (mark, word.to_owned());
    let words = match imperfection.place() {
        Place::Only => vec![],
        Place::Axis(axis) => vec![word("{axis}", AXES[axis])],
        Place::Pair(into, from) => vec![word("{axis}", AXES[into]), word("{from}", AXES[from])],
        Place::Joint(own) => vec![joint(own)],
        Place::InJoint(own, entry) if name.contains("{spread}") => {
            vec![word("{spread}", SPREADS[entry]), joint(own)]
        }
        Place::InJoint(own, axis) => vec![word("{axis}", AXES[axis]), joint(own)],
        Place::Dof(dof) => vec![word("{dof}", DOF_NAMES[dof])],
        Place::Record(record) => vec![("{record}", (record + 1).to_string())],
    };
    let written = |name: String, (mark, word): (&str, String)| name.replace(mark, &word);
    clipped(words.into_iter().fold(name.to_owned(), written))
}

/// Returns the name of a joint, clipped as in a report. It is empty for a joint that the model does not have.
pub(crate) fn joint_name(model: &Model, joint: usize) -> Name {
    model.joints.get(joint).map_or_else(Name::new, |joint| clipped(&joint.name))
}

/// Returns the names of all unknowns of a fit, in their order.
pub(super) fn names(model: &Model, sought: &Sought) -> Vec<Label> {
    let coordinates = (0..sought.unknowns()).filter_map(|unknown| sought.coordinate(unknown));
    coordinates.map(|coordinate| name(model, coordinate)).collect()
}
