//! Sections `[calibration]` and `[parameters]`: what is sought.

use flexid_core::sought::{Coordinate, Sought};

use super::bounds::CONCEIVABLE;
use super::parameter::parameter;
use super::sections::{CalibrationSection, ParametersSection};
use crate::model::Model;

/// A key of `[calibration]`.
pub(super) struct Calibrated {
    pub(super) key: &'static str,
    /// The key of `[accuracy]` that speaks of the same imperfections.
    pub(super) accuracy: &'static str,
    stated: fn(&CalibrationSection) -> Option<f64>,
    /// Largest standard deviation of a prior. The fit is linear about the nominal value; beyond this the model must be corrected.
    most: f64,
    unit: &'static str,
}

const PART: &str = "0.1 is 10 %";

/// All keys of `[calibration]`, in the order of their unknowns.
#[rustfmt::skip]
pub(super) const CALIBRATED: [Calibrated; 5] = [
    Calibrated { key: "delay_s", accuracy: "delay_s", stated: |own| own.delay_s, most: 0.1, unit: "in s" },
    Calibrated { key: "acceleration_gain", accuracy: "acceleration_gain", stated: |own| own.acceleration_gain, most: 1.0, unit: PART },
    Calibrated { key: "force_gain", accuracy: "force_gain", stated: |own| own.force_gain, most: 1.0, unit: PART },
    Calibrated { key: "misalignment_rad", accuracy: "accelerometer_angle_rad", stated: |own| own.misalignment_rad, most: 0.5, unit: "in rad" },
    Calibrated { key: "link_mass", accuracy: "link_mass", stated: |own| own.link_mass, most: 1.0, unit: PART },
];

/// Makes `Sought` of the parameters, of which some are fixed or tied to others, and of the imperfections that `calibration` names.
pub(super) fn sought(
    calibration: &CalibrationSection,
    parameters: &ParametersSection,
    model: &Model,
) -> Result<Sought, String> {
    let mut sought =
        Sought::new(model.joints.len()).map_err(|error| format!("[model]: {error}"))?;
    for Calibrated { key, accuracy, stated, most, unit } in CALIBRATED {
        let Some(width) = stated(calibration) else { continue };
        if !(width > 0.0 && width <= most) {
            return Err(format!(
                "[calibration] {key} is {width}: must be above 0 and at most {most} ({unit})"
            ));
        }
        sought.seek(accuracy, width).map_err(|error| format!("[calibration] {key}: {error}"))?;
    }
    let mut taken = Vec::new();
    let mut once = |place: &str, name: &str, coordinate: Coordinate| {
        if taken.contains(&coordinate) {
            return Err(format!(
                "[parameters] {place}: {name:?} is there twice: fix or tie it once"
            ));
        }
        taken.push(coordinate);
        Ok(coordinate)
    };
    for (name, &value) in &parameters.fixed {
        if !CONCEIVABLE.contains(&value) {
            let (least, most) = CONCEIVABLE.into_inner();
            return Err(format!(
                "[parameters] fixed {name:?} is {value:e}: must lie between {least:e} and {most:e}"
            ));
        }
        let coordinate = once("fixed", name, parameter("[parameters] fixed", name, model)?)?;
        let unfit = |error| format!("[parameters] fixed {name:?}: {error}");
        sought.fix(coordinate, value).map_err(unfit)?;
    }
    for names in &parameters.tied {
        let mut coordinates = Vec::new();
        for name in names {
            coordinates.push(once("tied", name, parameter("[parameters] tied", name, model)?)?);
        }
        let [first, others @ ..] = coordinates.as_slice() else {
            return Err("[parameters] tied has a group without a name: name two or more".into());
        };
        if others.is_empty() {
            return Err(format!(
                "[parameters] tied: {:?} is alone in its group: name two or more",
                names[0]
            ));
        }
        for (other, name) in others.iter().zip(&names[1..]) {
            if kind(*first) != kind(*other) {
                return Err(format!(
                    "[parameters] tied: {:?} and {name:?} are of different units: tie like to like",
                    names[0]
                ));
            }
            let unfit = |error| format!("[parameters] tied {name:?}: {error}");
            sought.tie(*other, *first).map_err(unfit)?;
        }
    }
    if parameters.drive_only {
        let chain = model.chain().map_err(|error| format!("[model]: {error}"))?;
        sought.seek_drives(&chain).map_err(|error| format!("[parameters] drive_only: {error}"))?;
    }
    if sought.unknowns() == 0 {
        return Err("[parameters] fixed names every parameter: leave one to be sought".into());
    }
    Ok(sought)
}

/// Returns whether a parameter is a damping, and whether it belongs to a rotation. Its unit and its bounds depend on both.
/// Returns `None` for an imperfection.
fn kind(parameter: Coordinate) -> Option<[bool; 2]> {
    match parameter {
        Coordinate::Stiffness { dof, .. } => Some([false, dof >= 3]),
        Coordinate::Damping { dof, .. } => Some([true, dof >= 3]),
        _ => None,
    }
}
