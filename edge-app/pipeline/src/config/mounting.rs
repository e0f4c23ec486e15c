//! Section `[mounting]`: position and axes of the sensors, and the tool.

use std::f64::consts::TAU;

use flexid_core::mounting::Mounting;
use nalgebra::{Rotation3, Vector3};

use super::sections::MountingSection;
use crate::model::Model;

/// Largest distance from the TCP that is accepted for a sensor or a tool, along each axis, m.
const FARTHEST_M: f64 = 10.0;

/// Checks the section. The tool is a part of the last link, so that its mass must be at most the link's.
pub(super) fn mounting(section: &MountingSection, model: &Model) -> Result<Mounting, String> {
    if section.tool_centre_m.is_some() && section.tool_mass_kg.is_none() {
        return Err("[mounting] tool_centre_m needs a mass: give tool_mass_kg, too".into());
    }
    Ok(Mounting {
        accelerometer: place("accelerometer_xyz_m", section.accelerometer_xyz_m)?,
        accelerometer_axes: axes("accelerometer_rpy_rad", section.accelerometer_rpy_rad)?,
        force_axes: axes("force_rpy_rad", section.force_rpy_rad)?,
        tool_mass: tool_mass(section.tool_mass_kg.unwrap_or_default(), model)?,
        tool_centre: place("tool_centre_m", section.tool_centre_m.unwrap_or_default())?,
    })
}

fn tool_mass(mass_kg: f64, model: &Model) -> Result<f64, String> {
    let wrong = |mend: String| Err(format!("[mounting] tool_mass_kg is {mass_kg}: {mend}"));
    if !(mass_kg.is_finite() && mass_kg >= 0.0) {
        return wrong("must be 0 or positive, and finite".into());
    }
    match model.joints.last() {
        Some(last) if mass_kg > last.mass_kg => wrong(format!(
            "the tool is a part of the link of {:?}, must be at most its {} kg",
            last.name, last.mass_kg
        )),
        _ => Ok(mass_kg),
    }
}

fn place(key: &str, place: [f64; 3]) -> Result<Vector3<f64>, String> {
    if place.iter().all(|along| along.abs() <= FARTHEST_M) {
        Ok(place.into())
    } else {
        Err(format!(
            "[mounting] {key} is {place:?}: must be in m, and within {FARTHEST_M} m of the TCP"
        ))
    }
}

fn axes(key: &str, [roll, pitch, yaw]: [f64; 3]) -> Result<Rotation3<f64>, String> {
    // A larger angle is meant in degrees.
    if [roll, pitch, yaw].iter().all(|angle| angle.abs() <= TAU) {
        Ok(Rotation3::from_euler_angles(roll, pitch, yaw))
    } else {
        Err(format!(
            "[mounting] {key} is [{roll}, {pitch}, {yaw}]: must be in rad, and within -2π to 2π"
        ))
    }
}
