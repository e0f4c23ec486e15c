//! What a robot that was identified does in a pose.

mod files;
pub(crate) mod table;

use flexid_prediction::modes::Mode;
use flexid_prediction::receptance::{ReceptancePoint, grid};
use flexid_prediction::statics::Deflection;
use flexid_prediction::{Estimate, Robot};
use serde::Serialize;

pub(crate) use files::Format;

/// What is asked of each pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request {
    /// Force on the tool along its axes, N.
    pub(crate) force: Option<[f64; 3]>,
    /// Highest natural frequency, Hz.
    pub(crate) highest_hz: f64,
    /// Number of frequencies of the receptance.
    pub(crate) points: Option<usize>,
}

/// Predictions of one pose.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Prediction {
    /// Joint angles, base first, rad (m).
    pub(crate) pose: Vec<f64>,
    /// Modes, the lowest first.
    pub(crate) modes: Vec<Mode>,
    /// Static compliance at the tool, rows translation and rotation, columns force and torque: m/N, rad/N, m/Nm, rad/Nm.
    pub(crate) compliance: [[Estimate; 6]; 6],
    /// Deflection under the force that was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) deflection: Option<Deflection>,
    /// Receptance along the band.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) receptance: Vec<ReceptancePoint>,
}

impl Prediction {
    /// Calls `done` once for each frequency of the receptance.
    ///
    /// # Errors
    /// The robot does not stand in this pose: a line that says why.
    pub(crate) fn new(
        robot: &Robot,
        pose: &[f64],
        request: &Request,
        done: impl Fn(),
    ) -> Result<Self, String> {
        let dynamics = robot.at(pose).map_err(|error| error.to_string())?;
        let unstable = || "the robot does not stand there: it has no stiffness".to_owned();
        let compliance = dynamics.compliance().ok_or_else(unstable)?;
        let deflection = request
            .force
            .map(|[x, y, z]| dynamics.deflection(&compliance, [x, y, z, 0.0, 0.0, 0.0]));
        let points = grid(robot.band_hz(), request.points.unwrap_or(0));
        let receptance = points
            .map(|frequency| dynamics.receptance(frequency))
            .inspect(|_| done())
            .collect::<Option<Vec<_>>>()
            .ok_or_else(unstable)?;
        Ok(Self {
            pose: pose.to_vec(),
            modes: dynamics.modes(request.highest_hz),
            compliance: dynamics.compliance_estimates(&compliance),
            deflection,
            receptance,
        })
    }
}
