//! The pose of a command that works in a single one.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use anyhow::Result;
use flexid_console::exit::BadArgument;
use flexid_edge::console::complain;
use flexid_pipeline::input::BadInput;
use flexid_pipeline::model::{Kind, Model, ModelJoint};
use flexid_prediction::document::Found;

use crate::numbers::Numbers;

/// The pose that was given, or that of the first record in the result `file`.
///
/// # Errors
/// There is none, or it has another number of angles than the robot has driven joints.
pub(super) fn given_or_first(
    file: &Path,
    found: &Found,
    given: Option<&Numbers>,
) -> Result<Vec<f64>> {
    match given {
        Some(Numbers(pose)) => {
            check(found.robot.model(), "--pose", pose)?;
            Ok(pose.clone())
        }
        None => found.robot.found().poses.first().cloned().ok_or_else(|| {
            BadInput::new(file, "rests on static tests alone, and names no pose: give --pose")
                .into()
        }),
    }
}

/// Checks a pose that was given by this `option`. Warns of joints beyond their limits, since those of a model file may be narrower than the robot's.
///
/// # Errors
/// The pose has another number of angles than the robot has driven joints.
pub(super) fn check(model: &Model, option: &str, pose: &[f64]) -> Result<(), BadArgument> {
    let driven = model.driven().count();
    if pose.len() != driven {
        let given = pose.len();
        let message = format!("{option} has {given} angles: this robot has {driven} driven joints");
        return Err(BadArgument(message));
    }
    let beyond = model.driven().zip(pose).filter_map(|(joint, at)| beyond(joint, *at));
    beyond.for_each(|fault| complain(&format!("warning: {option}: {fault}")));
    Ok(())
}

/// Says what is wrong with an angle beyond the limits of a joint.
fn beyond(joint: &ModelJoint, angle: f64) -> Option<String> {
    let ModelJoint { name, kind, limits: [least, most], .. } = joint;
    let (is_revolute, within) = (*kind == Kind::Revolute, *least..=*most);
    // A joint without limits may turn more than once, and hardly more than twice.
    let is_of_degrees =
        is_revolute && angle.abs() > 2.0 * TAU && within.contains(&angle.to_radians());
    if within.contains(&angle) && !is_of_degrees {
        return None;
    }
    let unit = if is_revolute { "rad" } else { "m" };
    let degrees = if is_revolute && angle.abs() > PI && within.contains(&angle.to_radians()) {
        ": looks like degrees: give rad"
    } else {
        ""
    };
    Some(format!("{name} is {angle} {unit}, and its limits are {least} to {most} {unit}{degrees}"))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn angles_beyond_the_limits_are_named() {
        let text = include_str!("../../scenario/mill3-model.toml");
        let model = Model::parse(Path::new("m.toml"), text).unwrap();
        let mut joint = model.joints[2].clone();
        let said = |joint: &ModelJoint, angle| beyond(joint, angle).unwrap_or_default();
        assert_eq!(said(&joint, 1.0), "");
        assert_eq!(said(&joint, 3.0), "joint_3 is 3 rad, and its limits are -1.8 to 2.6 rad");
        let degrees =
            "joint_3 is 90 rad, and its limits are -1.8 to 2.6 rad: looks like degrees: give rad";
        assert_eq!(said(&joint, 90.0), degrees);
        assert!(!said(&joint, 1e6).contains("degrees"));
        joint.limits = [f64::NEG_INFINITY, f64::INFINITY];
        assert_eq!(said(&joint, 6.0), "");
        assert!(said(&joint, 45.0).ends_with("looks like degrees: give rad"));
        (joint.kind, joint.limits) = (Kind::Prismatic, [0.0, 1.0]);
        assert_eq!(said(&joint, 45.0), "joint_3 is 45 m, and its limits are 0 to 1 m");
    }
}
