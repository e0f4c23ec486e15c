//! The motion of an identified robot in a pose.

mod files;
pub(crate) mod table;

use std::sync::atomic::{AtomicUsize, Ordering};

use flexid_prediction::modes::Mode;
use flexid_prediction::receptance::{Grid, ReceptancePoint};
use flexid_prediction::statics::Deflection;
use flexid_prediction::{Estimate, Robot};
use rayon::prelude::*;
use serde::Serialize;

pub(crate) use files::Format;

/// The question to each pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request {
    /// Force on the tool along its axes, N.
    pub(crate) force: Option<[f64; 3]>,
    /// Highest natural frequency, Hz.
    pub(crate) highest_hz: f64,
    /// Frequencies of the receptance, if it is wanted.
    pub(crate) grid: Option<Grid>,
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
    /// Says after each frequency which part of the receptance is done.
    ///
    /// # Errors
    /// The robot does not stand in this pose: a line that says why.
    pub(crate) fn new(
        robot: &Robot,
        pose: &[f64],
        request: &Request,
        done: impl Fn(f64) + Sync,
    ) -> Result<Self, String> {
        let dynamics = robot.at(pose).map_err(|error| error.to_string())?;
        let unstable = || "the robot does not stand there: it has no stiffness".to_owned();
        let compliance = dynamics.compliance().ok_or_else(unstable)?;
        let deflection = request
            .force
            .map(|[x, y, z]| dynamics.deflection(&compliance, [x, y, z, 0.0, 0.0, 0.0]));
        let band_hz = robot.band_hz();
        // Those above the highest that is listed show in the receptance, too.
        let solved_to_hz = match request.grid {
            Some(_) => request.highest_hz.max(band_hz[1]),
            None => request.highest_hz,
        };
        let mut modes = dynamics.modes(solved_to_hz);
        let frequencies = match request.grid {
            None => Vec::new(),
            Some(grid) => grid.frequencies(band_hz, &modes),
        };
        modes.retain(|mode| mode.frequency_hz.value <= request.highest_hz);
        let (all, finished) = (frequencies.len(), AtomicUsize::new(0));
        let receptance = frequencies
            .into_par_iter()
            .map(|frequency| {
                let point = dynamics.receptance(frequency);
                done((1 + finished.fetch_add(1, Ordering::Relaxed)) as f64 / all as f64);
                point
            })
            .collect::<Option<Vec<_>>>()
            .ok_or_else(unstable)?;
        Ok(Self {
            pose: pose.to_vec(),
            modes,
            compliance: dynamics.compliance_estimates(&compliance),
            deflection,
            receptance,
        })
    }
}
