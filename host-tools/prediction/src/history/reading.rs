//! Findings from result files.

use flexid_core::imperfection::Imperfection;
use flexid_pipeline::dynamics::OF_JOINT;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::course::Course;
use super::epoch::{Epoch, Posterior};
use crate::document::Found;
use crate::parameter::{IncomparableError, Place, Quantity, places, same_joints};
use crate::reference;

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

/// An error that findings share, and the largest standard deviation that one of them states for it.
struct Common {
    imperfection: Imperfection,
    prior: f64,
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
    let common = common(findings, hz);
    let epochs = findings.iter().map(|found| {
        let posterior = posterior(found, hz, &places, &common);
        Epoch::new(&posterior, common.len())
    });
    // A result is checked: its factor is that of a covariance.
    let epochs: Vec<Epoch> = epochs.collect::<Option<_>>().ok_or_else(nothing)?;
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

/// The errors that findings share, each once.
fn common(findings: &[&Found], hz: f64) -> Vec<Common> {
    let mut all: Vec<Common> = Vec::new();
    let shared = findings.iter().filter_map(|found| shared(found, hz));
    for own in shared.flat_map(|shared| &shared.imperfections) {
        match all.iter_mut().find(|known| known.imperfection == own.imperfection) {
            Some(known) => known.prior = known.prior.max(own.prior),
            None => all.push(Common { imperfection: own.imperfection, prior: own.prior }),
        }
    }
    all
}

/// What a finding shares with others. `None` of one that does not state it for the parameters at this frequency.
fn shared(found: &Found, hz: f64) -> Option<&flexid_pipeline::shared::Shared> {
    found.shared.as_ref().filter(|_| found.robot.reference_hz() == hz)
}

fn posterior(found: &Found, hz: f64, places: &[Place], common: &[Common]) -> Posterior {
    let restated = reference::at(found, hz);
    let logarithms: Vec<Option<(f64, f64)>> = places
        .iter()
        .map(|place| {
            let std = place.determined(&restated.joints)?;
            Some((place.of(&restated.joints).0.ln(), std))
        })
        .collect();
    let Some(shared) = shared(found, hz) else {
        // Everything is its own.
        let stds = logarithms.iter().map(|own| own.map_or(0.0, |(_, std)| std));
        return Posterior {
            columns: Vec::new(),
            priors: Vec::new(),
            errors: DVector::zeros(0),
            factor: DMatrix::from_diagonal(&DVector::from_iterator(places.len(), stds)),
            logarithms,
            widening: 1.0,
        };
    };
    let own = &shared.imperfections;
    let place_of =
        |imperfection| common.iter().position(|known| known.imperfection == imperfection);
    let columns: Vec<usize> = own.iter().filter_map(|own| place_of(own.imperfection)).collect();
    let size = own.len() + OF_JOINT * found.joints.len();
    let factor = DMatrix::from_fn(size, size, |row, column| match column <= row {
        true => f64::from(shared.factor[row * (row + 1) / 2 + column]),
        false => 0.0,
    });
    Posterior {
        priors: columns
            .iter()
            .zip(own)
            .map(|(place, own)| own.prior / common[*place].prior)
            .collect(),
        columns,
        errors: DVector::from_iterator(own.len(), own.iter().map(|own| own.value / own.prior)),
        logarithms,
        factor,
        widening: shared.widening,
    }
}
