//! Findings from result files.

use serde::Serialize;

use super::course::Course;
use crate::document::Found;
use crate::findings::epochs;
use crate::parameter::{IncomparableError, Quantity, places, same_joints};

/// What changed in a robot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct History {
    /// Parameters that two findings or more determine, base first.
    pub parameters: Vec<Parameter>,
    /// Number of all parameters.
    pub all: usize,
    /// Frequency at which the values are those of all findings, where stiffness and damping depend on it, Hz.
    pub reference_hz: f64,
}

/// A parameter and how it went.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Name of its joint.
    pub joint: String,
    /// Degree of freedom, 0 to 5: `tx ty tz rx ry rz`.
    pub dof: usize,
    /// Stiffness or damping.
    pub quantity: Quantity,
    /// How it went.
    #[serde(flatten)]
    pub course: Course,
}

/// How the parameters of a robot went over these findings, at these times, in any unit, ascending. `level` is the chance of a false change
/// of any parameter in the robot's life.
///
/// # Errors
/// A finding, by its number from 0, has other joints than the first; or no parameter is determined by two findings.
pub fn history(
    findings: &[&Found],
    times: &[f64],
    level: f64,
) -> Result<History, (usize, IncomparableError)> {
    let nothing = || (findings.len().saturating_sub(1), IncomparableError::Nothing);
    let (Some(first), Some(last)) = (findings.first(), findings.last()) else {
        return Err(nothing());
    };
    for (number, own) in findings.iter().enumerate() {
        same_joints(first, own).map_err(|error| (number, error))?;
    }
    let places = places(first.joints.len());
    let hz = last.robot.reference_hz();
    // Sensors, mounting and masses stay those of the robot.
    let epochs = epochs(findings, hz, &places, |_| true).ok_or_else(nothing)?;
    let courses = super::courses(&epochs, times, level);
    let parameters = places.iter().zip(courses).filter_map(|(place, course)| {
        let course = course.filter(|own| own.points.len() > 1)?;
        let joint = first.joints[place.joint].name.to_string();
        Some(Parameter { joint, dof: place.dof, quantity: place.quantity, course })
    });
    let parameters: Vec<Parameter> = parameters.collect();
    if parameters.is_empty() {
        return Err(nothing());
    }
    Ok(History { parameters, all: places.len(), reference_hz: hz })
}
