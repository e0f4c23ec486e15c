//! The fields of `flexid identify --json` and `flexid watch --json` that the tests rely on. Both may hold more.

use anyhow::{Context, Result};
use serde::Deserialize;
use serde_json::Value;

/// Identified joints, and the result of the fit.
#[derive(Clone, Debug, Deserialize)]
pub struct Report {
    /// Joints, base first.
    pub joints: Vec<Joint>,
    /// Result of the fit.
    pub fit: Fit,
    /// Warnings for people.
    pub warnings: Vec<String>,
    /// Names and counts of each warning.
    pub warning_kinds: Vec<Value>,
    /// Confidence in the report.
    pub confidence: Confidence,
}

/// One joint; DOF order `tx ty tz rx ry rz`, SI units.
#[derive(Clone, Debug, Deserialize)]
pub struct Joint {
    /// Name as in the model.
    pub name: String,
    /// Stiffnesses, N/m, Nm/rad.
    pub stiffness: [f64; 6],
    /// Standard deviations, unit of the stiffness; `None` where it is not observable or fixed.
    pub stiffness_std: [Option<f64>; 6],
    /// Verdicts: `identified`, `weak`, `not_observable` or `fixed`.
    pub stiffness_verdict: [String; 6],
    /// Dampings, Ns/m, Nms/rad.
    pub damping: [f64; 6],
    /// Standard deviations, unit of the damping; `None` where it is not observable or fixed.
    pub damping_std: [Option<f64>; 6],
    /// Verdicts: `identified`, `weak`, `not_observable` or `fixed`.
    pub damping_verdict: [String; 6],
}

/// The result of the fit.
#[derive(Clone, Debug, Deserialize)]
pub struct Fit {
    /// Number of records on which the numbers rest.
    pub records: u64,
    /// Number of force and acceleration frames taken.
    pub frames: u64,
    /// Number of force and acceleration frames that are missing by their counters.
    pub frames_lost: u64,
    /// Surface similarity parameter.
    pub ssp: f64,
    /// χ² per degree of freedom.
    pub consistency: f64,
    /// Number of samples that the search evaluated.
    pub search_evaluations: u64,
    /// Number of Gauss-Newton iterations.
    pub refine_iterations: u64,
    /// Time of the fit, s.
    pub seconds: f64,
}

/// The confidence in a report.
#[derive(Clone, Debug, Deserialize)]
pub struct Confidence {
    /// Intervals of the joints, base first.
    pub joints: Vec<Intervals>,
    /// Correlations of the unknowns.
    pub correlations: Correlations,
    /// Residuals between model and measurement.
    pub residuals: Residuals,
    /// Each record as a fit to all the others predicts it.
    pub held_out: Vec<HeldOut>,
}

/// The 95 % intervals of one joint.
#[derive(Clone, Debug, Deserialize)]
pub struct Intervals {
    /// Name as in the model.
    pub name: String,
    /// Lower and upper ends, N/m, Nm/rad; `None` where there is no valid interval.
    pub stiffness_interval: [Option<[f64; 2]>; 6],
    /// Lower and upper ends, Ns/m, Nms/rad; `None` where there is no valid interval.
    pub damping_interval: [Option<[f64; 2]>; 6],
}

/// The correlation matrix, per cent.
#[derive(Clone, Debug, Deserialize)]
pub struct Correlations {
    /// Names of rows and columns.
    pub unknowns: Vec<String>,
    /// The lower triangle without its diagonal.
    pub percent: Vec<i8>,
}

/// The residuals between model and measurement.
#[derive(Clone, Debug, Deserialize)]
pub struct Residuals {
    /// True if the residuals are larger than noise explains.
    pub size_objects: bool,
    /// True if the residuals have more structure than noise explains.
    pub structure_objects: bool,
}

/// How well a record is predicted from the others, along the axes of the TCP.
#[derive(Clone, Debug, Deserialize)]
pub struct HeldOut {
    /// Frequency response assurance criterion.
    pub frac: [f64; 3],
    /// Variance accounted for.
    pub vaf: [f64; 3],
}

impl Report {
    /// The last of the JSON documents in `text`. Those before may be of another kind.
    pub fn last_of(text: &str) -> Result<Self> {
        let last = serde_json::Deserializer::from_str(text)
            .into_iter::<Value>()
            .last()
            .with_context(|| format!("no report in {text:?}"))?
            .with_context(|| format!("no JSON: {text}"))?;
        serde_json::from_value(last).with_context(|| format!("not a report: {text}"))
    }
}
