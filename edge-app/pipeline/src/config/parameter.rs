//! Joints and parameters by their names.

use flexid_core::sought::Coordinate;

use crate::model::Model;
use crate::names::DOF_NAMES;

/// Returns the index of the joint `name`, base first.
pub(super) fn joint(name: &str, model: &Model) -> Result<usize, String> {
    model.joints.iter().position(|own| own.name == name).ok_or_else(|| {
        let names: Vec<_> = model.joints.iter().map(|joint| joint.name.as_str()).collect();
        format!("the model has no joint {name:?}, it has {}", names.join(", "))
    })
}

/// Parses the name of a parameter, for example `joint_1.stiffness.tx`. The name of the joint may contain points. `place` names
/// the section in errors.
pub(super) fn parameter(place: &str, name: &str, model: &Model) -> Result<Coordinate, String> {
    let wrong = |mend: String| format!("{place} has {name:?}: {mend}");
    let shape = || wrong("write it like \"joint_1.stiffness.tx\"".into());
    let mut parts = name.rsplitn(3, '.');
    let (Some(dof), Some(kind), Some(joint)) = (parts.next(), parts.next(), parts.next()) else {
        return Err(shape());
    };
    let joint = self::joint(joint, model).map_err(wrong)?;
    let dof = DOF_NAMES.iter().position(|own| *own == dof).ok_or_else(|| {
        wrong(format!("{dof:?} is no degree of freedom: one of {}", DOF_NAMES.join(", ")))
    })?;
    match kind {
        "stiffness" => Ok(Coordinate::Stiffness { joint, dof }),
        "damping" => Ok(Coordinate::Damping { joint, dof }),
        _ => Err(wrong(format!("{kind:?} is neither \"stiffness\" nor \"damping\""))),
    }
}
