//! The fleet of result files.

use flexid_core::imperfection::Imperfection;
use serde::Serialize;

use super::judging::{Shown, populations};
use crate::document::Found;
use crate::findings::epochs;
use crate::parameter::{IncomparableError, Quantity, places, same_joints};

/// Robots of one type as a population.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fleet {
    /// Parameters that the findings of a robot determine, base first.
    pub parameters: Vec<Parameter>,
    /// Number of all parameters.
    pub all: usize,
    /// Frequency at which the values are those of all robots, where stiffness and damping depend on it, Hz.
    pub reference_hz: f64,
}

/// A parameter in the robots of a type.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Parameter {
    /// Name of its joint.
    pub joint: String,
    /// Degree of freedom, 0 to 5: `tx ty tz rx ry rz`.
    pub dof: usize,
    /// Stiffness or damping.
    pub quantity: Quantity,
    /// Robots and population.
    #[serde(flatten)]
    pub shown: Shown,
}

/// The fleet of robots, each with one finding. `level` is the chance that a fleet without a robot outside has one called so. What a finding holds at a prior
/// or does not determine is no part of it.
///
/// # Errors
/// A finding, by its number from 0, has other joints than the first; or no finding determines a parameter.
pub fn fleet(findings: &[&Found], level: f64) -> Result<Fleet, (usize, IncomparableError)> {
    let nothing = || (findings.len().saturating_sub(1), IncomparableError::Nothing);
    let first = *findings.first().ok_or_else(nothing)?;
    for (number, own) in findings.iter().enumerate() {
        same_joints(first, own).map_err(|error| (number, error))?;
    }
    let places = places(first.joints.len());
    let hz = first.robot.reference_hz();
    let epochs = epochs(findings, hz, &places, is_of_type).ok_or_else(nothing)?;
    let shown = populations(&epochs, level);
    let parameters = places.iter().zip(shown).filter(|(_, own)| !own.members.is_empty());
    let parameters = parameters.map(|(place, shown)| {
        let joint = first.joints[place.joint].name.to_string();
        Parameter { joint, dof: place.dof, quantity: place.quantity, shown }
    });
    let parameters: Vec<Parameter> = parameters.collect();
    if parameters.is_empty() {
        return Err(nothing());
    }
    Ok(Fleet { parameters, all: places.len(), reference_hz: hz })
}

/// Returns whether all robots of a type share the error: it is one of their model.
fn is_of_type(imperfection: Imperfection) -> bool {
    use Imperfection::{CentreOfMass, ElasticCentre, Inertia, Mass};
    matches!(imperfection, Mass(_) | CentreOfMass(..) | Inertia(..) | ElasticCentre(..))
}
