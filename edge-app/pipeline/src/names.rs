//! Names of unknowns, and enumerations of names in a line.

pub use flexid_core::DOF_NAMES;
use flexid_core::sought::{Coordinate, Sought};
use flexid_wire::text::{Name, clipped};

use crate::model::Model;

/// Returns the name of a coordinate, for example `joint_1 tx stiffness` or `delay`.
pub fn name(model: &Model, coordinate: Coordinate) -> String {
    let joint = |index: usize| {
        model.joints.get(index).map_or_else(String::new, |joint| clipped_name(&joint.name))
    };
    match coordinate {
        Coordinate::Stiffness { joint: index, dof } => {
            format!("{} {} stiffness", joint(index), DOF_NAMES[dof])
        }
        Coordinate::Damping { joint: index, dof } => {
            format!("{} {} damping", joint(index), DOF_NAMES[dof])
        }
        Coordinate::Mass(link) => format!("mass of {}'s link", joint(link)),
        of_the_sensors => of_the_sensors.to_string(),
    }
}

/// Clips the name of a joint or a signal as in a report, so that a line with a few names is never cut.
pub(super) fn clipped_name(name: &str) -> String {
    let name: Name = clipped(name);
    name.as_str().to_owned()
}

/// Returns the names of all unknowns of a fit, in their order.
pub(super) fn names(model: &Model, sought: &Sought) -> Vec<String> {
    let coordinates = (0..sought.unknowns()).filter_map(|unknown| sought.coordinate(unknown));
    coordinates.map(|coordinate| name(model, coordinate)).collect()
}

/// Joins names to `a`, `a and b` or `a, b and c`. If all names together are longer than `room` bytes, it lists the first ones
/// and counts the others: `a, b and 3 more`.
pub(super) fn enumerate(names: &[impl AsRef<str>], room: usize) -> String {
    let mut used = 0;
    let fitting = names.iter().take_while(|name| {
        used += name.as_ref().len() + 2;
        used <= room
    });
    let shown = fitting.count().max(1).min(names.len());
    let (shown, rest) = names.split_at(shown);
    let more = format!("{} more", rest.len());
    let mut parts: Vec<&str> = shown.iter().map(AsRef::as_ref).collect();
    if !rest.is_empty() {
        parts.push(&more);
    }
    match parts.split_last() {
        Some((last, before)) if !before.is_empty() => format!("{} and {last}", before.join(", ")),
        _ => parts.concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn enumerates_what_there_is_room_for() {
        let abcd = ["aaaa", "bbbb", "cccc", "dddd"];
        assert_eq!(enumerate(&abcd[..0], 100), "");
        assert_eq!(enumerate(&abcd[..1], 100), "aaaa");
        assert_eq!(enumerate(&abcd[..2], 100), "aaaa and bbbb");
        assert_eq!(enumerate(&abcd[..3], 100), "aaaa, bbbb and cccc");
        assert_eq!(enumerate(&abcd, 14), "aaaa, bbbb and 2 more");
        assert_eq!(enumerate(&abcd, 1), "aaaa and 3 more");
    }
}
