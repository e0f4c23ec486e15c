//! What `flexid identify --json` and `flexid watch --json` are relied upon to hold; they may hold more.

use anyhow::{Context, Result};
use serde::Deserialize;
use serde_json::Value;

/// Identified joints, and how the fit went.
#[derive(Clone, Debug, Deserialize)]
pub struct Report {
    /// Base first.
    pub joints: Vec<Joint>,
    /// How the fit went.
    pub fit: Fit,
    /// What a person should know.
    pub warnings: Vec<String>,
    /// How far to trust it.
    pub confidence: Confidence,
}

/// One joint; DOF order `tx ty tz rx ry rz`, SI units.
#[derive(Clone, Debug, Deserialize)]
pub struct Joint {
    /// As in the model.
    pub name: String,
    /// N/m, Nm/rad.
    pub stiffness: [f64; 6],
    /// Unit of the stiffness; none where it is not observable or fixed.
    pub stiffness_std: [Option<f64>; 6],
    /// `identified`, `weak`, `not_observable` or `fixed`.
    pub stiffness_verdict: [String; 6],
    /// Ns/m, Nms/rad.
    pub damping: [f64; 6],
    /// Unit of the damping; none where it is not observable or fixed.
    pub damping_std: [Option<f64>; 6],
    /// `identified`, `weak`, `not_observable` or `fixed`.
    pub damping_verdict: [String; 6],
}

/// How the fit went.
#[derive(Clone, Debug, Deserialize)]
pub struct Fit {
    /// Records that the numbers rest on.
    pub records: u64,
    /// Force and acceleration frames taken.
    pub frames: u64,
    /// Force and acceleration frames that their counters say are missing.
    pub frames_lost: u64,
    /// Surface similarity parameter.
    pub ssp: f64,
    /// χ² per degree of freedom.
    pub consistency: f64,
    /// Samples that the search cost.
    pub search_evaluations: u64,
    /// Gauss-Newton iterations.
    pub refine_iterations: u64,
    /// Time that it took, s.
    pub seconds: f64,
}

/// How far to trust a report.
#[derive(Clone, Debug, Deserialize)]
pub struct Confidence {
    /// Base first.
    pub joints: Vec<Intervals>,
    /// How what was sought depends on each other.
    pub correlations: Correlations,
    /// What is left between model and measurement.
    pub residuals: Residuals,
    /// Each record as a fit to all the others predicts it.
    pub held_out: Vec<HeldOut>,
}

/// The 95 % intervals of one joint.
#[derive(Clone, Debug, Deserialize)]
pub struct Intervals {
    /// As in the model.
    pub name: String,
    /// Least and most, N/m, Nm/rad; none where there is no honest one.
    pub stiffness_interval: [Option<[f64; 2]>; 6],
    /// Least and most, Ns/m, Nms/rad; none where there is no honest one.
    pub damping_interval: [Option<[f64; 2]>; 6],
}

/// The correlation matrix, per cent.
#[derive(Clone, Debug, Deserialize)]
pub struct Correlations {
    /// Of rows and columns.
    pub unknowns: Vec<String>,
    /// The lower triangle without its diagonal.
    pub percent: Vec<i8>,
}

/// What is left between model and measurement.
#[derive(Clone, Debug, Deserialize)]
pub struct Residuals {
    /// They are larger than noise explains.
    pub size_objects: bool,
    /// They have more structure than noise explains.
    pub whiteness_objects: bool,
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
    /// The last of the JSON documents in `text`; those before may be news of another kind.
    pub fn last_of(text: &str) -> Result<Self> {
        let last = serde_json::Deserializer::from_str(text)
            .into_iter::<Value>()
            .last()
            .with_context(|| format!("no report in {text:?}"))?
            .with_context(|| format!("no JSON: {text}"))?;
        serde_json::from_value(last).with_context(|| format!("not a report: {text}"))
    }
}
