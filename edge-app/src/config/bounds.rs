//! Where the parameters may lie: section `[bounds]`, of the configuration as of a scenario. What it leaves out comes from the
//! robot's masses ([`Bounds::of`]).

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use flexid_core::parameters::Bounds;
use flexid_core::unknowns::Coordinate;
use serde::Deserialize;

use super::sought::{joint, parameter};
use crate::model::Model;

/// No bushing of a robot is softer or harder, SI units: what is beyond is a slip of the pen, and the numbers
/// that follow from it leave the range of floating point.
pub(super) const CONCEIVABLE: RangeInclusive<f64> = 1e-3..=1e12;

/// Ranges `[lower, upper]` of the parameters: those of every joint, then of single joints, then of single parameters.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoundsSection {
    /// N/m.
    pub stiffness_translation_n_per_m: Option<[f64; 2]>,
    /// Nm/rad.
    pub stiffness_rotation_nm_per_rad: Option<[f64; 2]>,
    /// Ns/m.
    pub damping_translation_ns_per_m: Option<[f64; 2]>,
    /// Nms/rad.
    pub damping_rotation_nms_per_rad: Option<[f64; 2]>,
    /// By the joint's name.
    #[serde(default)]
    pub joints: BTreeMap<String, JointBounds>,
    /// By the parameter's name, such as `joint_1.stiffness.tx`.
    #[serde(default)]
    pub parameters: BTreeMap<String, [f64; 2]>,
}

/// Ranges `[lower, upper]` of one joint's parameters.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointBounds {
    /// N/m.
    pub stiffness_translation_n_per_m: Option<[f64; 2]>,
    /// Nm/rad.
    pub stiffness_rotation_nm_per_rad: Option<[f64; 2]>,
    /// Ns/m.
    pub damping_translation_ns_per_m: Option<[f64; 2]>,
    /// Nms/rad.
    pub damping_rotation_nms_per_rad: Option<[f64; 2]>,
}

impl BoundsSection {
    /// The bounds of a robot.
    ///
    /// # Errors
    /// One line with the section, the key, and what would be right.
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
            None => format!("[bounds]: {empty:?}"),
        })
    }
}

impl JointBounds {
    /// Sets those that are given, of the joint with this `index`; `place` is where they stand.
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

/// The range, if a robot can have such parameters.
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
