//! Section `[bounds]` of the configuration and of a scenario: the ranges of the parameters. A range that the section leaves out
//! follows from the robot's masses ([`Bounds::of`]).

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use flexid_core::parameters::Bounds;
use flexid_core::sought::Coordinate;
use serde::Deserialize;

use super::parameter::{joint, parameter};
use crate::model::Model;

/// Range of the stiffnesses and dampings that are accepted, SI units. No bushing of a robot lies outside. A value outside is a
/// typing error, and the results that follow from it leave the range of floating point.
pub(super) const CONCEIVABLE: RangeInclusive<f64> = 1e-3..=1e12;

/// Ranges `[lower, upper]` of the parameters. The range of a joint overrides that of all joints, and the range of a parameter
/// overrides that of its joint.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoundsSection {
    /// Range of the translational stiffnesses of all joints, N/m.
    pub stiffness_translation_n_per_m: Option<[f64; 2]>,
    /// Range of the rotational stiffnesses of all joints, Nm/rad.
    pub stiffness_rotation_nm_per_rad: Option<[f64; 2]>,
    /// Range of the translational dampings of all joints, Ns/m.
    pub damping_translation_ns_per_m: Option<[f64; 2]>,
    /// Range of the rotational dampings of all joints, Nms/rad.
    pub damping_rotation_nms_per_rad: Option<[f64; 2]>,
    /// Ranges of single joints, by the joint's name.
    #[serde(default)]
    pub joints: BTreeMap<String, JointBounds>,
    /// Ranges of single parameters, by the parameter's name, for example `joint_1.stiffness.tx`.
    #[serde(default)]
    pub parameters: BTreeMap<String, [f64; 2]>,
}

/// Ranges `[lower, upper]` of one joint's parameters.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointBounds {
    /// Range of the translational stiffnesses, N/m.
    pub stiffness_translation_n_per_m: Option<[f64; 2]>,
    /// Range of the rotational stiffnesses, Nm/rad.
    pub stiffness_rotation_nm_per_rad: Option<[f64; 2]>,
    /// Range of the translational dampings, Ns/m.
    pub damping_translation_ns_per_m: Option<[f64; 2]>,
    /// Range of the rotational dampings, Nms/rad.
    pub damping_rotation_nms_per_rad: Option<[f64; 2]>,
}

impl BoundsSection {
    /// Checks the section and returns the bounds of `model`.
    ///
    /// # Errors
    /// The error is one line that names the section, the key and the correction.
    pub fn check(&self, model: &Model) -> Result<Bounds, String> {
        let chain = model.chain().map_err(|error| format!("[model]: {error}"))?;
        let mut bounds = Bounds::of(&chain);
        let all = JointBounds {
            stiffness_translation_n_per_m: self.stiffness_translation_n_per_m,
            stiffness_rotation_nm_per_rad: self.stiffness_rotation_nm_per_rad,
            damping_translation_ns_per_m: self.damping_translation_ns_per_m,
            damping_rotation_nms_per_rad: self.damping_rotation_nms_per_rad,
        };
        for index in 0..model.joints.len() {
            all.set("[bounds]", index, &mut bounds)?;
        }
        for (name, own) in &self.joints {
            let index = joint(name, model).map_err(|mend| format!("[bounds.joints]: {mend}"))?;
            own.set(&format!("[bounds.joints.{name}]"), index, &mut bounds)?;
        }
        for (name, &range) in &self.parameters {
            let coordinate = parameter("[bounds.parameters]", name, model)?;
            let range = conceivable(&format!("[bounds.parameters] {name:?}"), range)?;
            match coordinate {
                Coordinate::Damping { joint, dof } => bounds.joints[joint].damping[dof] = range,
                Coordinate::Stiffness { joint, dof } => bounds.joints[joint].stiffness[dof] = range,
                _ => return Err(format!("[bounds.parameters] {name:?} is no parameter")),
            }
        }
        bounds.check().map(|()| bounds).map_err(|empty| match model.joints.get(empty.joint) {
            Some(joint) => format!(
                "[bounds] is left out for {}, and no link beyond it has a mass: give masses in [model] file, or bounds",
                joint.name
            ),
            None => format!("[bounds]: {empty}"),
        })
    }
}

impl JointBounds {
    /// Sets the given ranges of the joint `index`. `place` names the section in errors.
    fn set(&self, place: &str, index: usize, bounds: &mut Bounds) -> Result<(), String> {
        let own = &mut bounds.joints[index];
        let (stiffness, rotational_stiffness) = own.stiffness.split_at_mut(3);
        let (damping, rotational_damping) = own.damping.split_at_mut(3);
        for (key, range, targets) in [
            ("stiffness_translation_n_per_m", self.stiffness_translation_n_per_m, stiffness),
            (
                "stiffness_rotation_nm_per_rad",
                self.stiffness_rotation_nm_per_rad,
                rotational_stiffness,
            ),
            ("damping_translation_ns_per_m", self.damping_translation_ns_per_m, damping),
            ("damping_rotation_nms_per_rad", self.damping_rotation_nms_per_rad, rotational_damping),
        ] {
            if let Some(range) = range {
                targets.fill(conceivable(&format!("{place} {key}"), range)?);
            }
        }
        Ok(())
    }
}

/// Returns the range if both ends lie in `CONCEIVABLE` and the lower is below the upper.
fn conceivable(place: &str, [lower, upper]: [f64; 2]) -> Result<[f64; 2], String> {
    let both = CONCEIVABLE.contains(&lower) && CONCEIVABLE.contains(&upper);
    if both && lower < upper {
        return Ok([lower, upper]);
    }
    let (least, most) = CONCEIVABLE.into_inner();
    Err(format!(
        "{place} is [{lower:e}, {upper:e}]: must be {least:e} <= lower < upper <= {most:e}"
    ))
}
