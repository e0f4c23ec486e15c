//! Sections `[calibration]` and `[parameters]`: what is sought.

use flexid_core::calibration::Nuisances;
use flexid_core::sought::{Coordinate, Sought};

use super::bounds::CONCEIVABLE;
use super::parameter::parameter;
use super::sections::{CalibrationSection, ParametersSection};
use crate::model::Model;

/// Makes `Sought` of the nuisances and of the parameters that are fixed or tied to others.
pub(super) fn sought(
    calibration: &CalibrationSection,
    parameters: &ParametersSection,
    model: &Model,
) -> Result<Sought, String> {
    let mut sought = Sought::new(model.joints.len(), &nuisances(calibration)?)
        .map_err(|error| format!("[model]: {error}"))?;
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

fn nuisances(section: &CalibrationSection) -> Result<Nuisances, String> {
    // The fit is linear about the nominal value. Beyond these widths the model must be corrected.
    let width = |key: &str, width: Option<f64>, most: f64, unit: &str| match width {
        Some(width) if !(width > 0.0 && width <= most) => Err(format!(
            "[calibration] {key} is {width}: must be above 0 and at most {most} ({unit})"
        )),
        _ => Ok(width),
    };
    let part = "0.1 is 10 %";
    Ok(Nuisances {
        delay: width("delay_s", section.delay_s, 0.1, "in s")?,
        acceleration_gain: width("acceleration_gain", section.acceleration_gain, 1.0, part)?,
        force_gain: width("force_gain", section.force_gain, 1.0, part)?,
        misalignment: width("misalignment_rad", section.misalignment_rad, 0.5, "in rad")?,
        mass: width("link_mass", section.link_mass, 1.0, part)?,
    })
}

/// Returns whether a parameter is a damping, and whether it belongs to a rotation. Its unit and its bounds depend on both.
/// Returns `None` for a nuisance.
fn kind(parameter: Coordinate) -> Option<[bool; 2]> {
    match parameter {
        Coordinate::Stiffness { dof, .. } => Some([false, dof >= 3]),
        Coordinate::Damping { dof, .. } => Some([true, dof >= 3]),
        _ => None,
    }
}
