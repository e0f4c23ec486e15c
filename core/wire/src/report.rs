//! Identified parameters for the screen, the wire and the result file.
//!
//! [`joints`](Report::joints) and [`fit`](Report::fit) stand under these names in the result file of `flexid identify --json`.
//! The field names are part of the contract. Vectors of six have the order `tx ty tz rx ry rz` of the joint frame. All values are
//! in SI units.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::text::Name;
pub use crate::verdict::{MAX_JOINTS, Verdict};
use crate::warning::Warning;

/// Largest number of warnings of a report.
pub const MAX_WARNINGS: usize = 32;

/// How far a fit as a whole can be believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum Acceptance {
    /// The residuals are as large as the noise explains, and intervals allow for what structure they have; or they are random and up to ten
    /// times as large.
    Consistent,
    /// One minimum was reached more than once, and its residuals are larger than the noise explains, or have more
    /// structure than intervals allow for.
    ModelSuspect,
    /// The work ended before the fit proved to be consistent or suspect; or the residuals are too few to test the model, or far
    /// smaller than the stated noise.
    Unsettled,
}

/// Parameters of one joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct JointReport {
    /// Name of the joint in the model.
    pub name: Name,
    /// Stiffness: N/m for translations, Nm/rad for rotations.
    pub stiffness: [f64; 6],
    /// Standard deviation in the unit of the stiffness; `None` for a stiffness that is not observable or fixed.
    pub stiffness_std: [Option<f64>; 6],
    /// Verdict on each stiffness.
    pub stiffness_verdict: [Verdict; 6],
    /// Damping: Ns/m for translations, Nms/rad for rotations.
    pub damping: [f64; 6],
    /// Standard deviation in the unit of the damping; `None` for a damping that is not observable or fixed.
    pub damping_std: [Option<f64>; 6],
    /// Verdict on each damping.
    pub damping_verdict: [Verdict; 6],
}

/// Data and work behind the parameters, and quality of the fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Fit {
    /// Number of records that the numbers rest on: kept and retired records.
    pub records: u64,
    /// Number of force and acceleration frames taken.
    pub frames: u64,
    /// Number of force and acceleration frames that are missing by their counters.
    pub frames_lost: u64,
    /// Median of the surface similarity parameters of all directions and experiments, 0 (equal) to 2 (opposite).
    pub ssp: f64,
    /// Largest surface similarity parameter of all directions and experiments.
    pub ssp_max: f64,
    /// χ² per degree of freedom; 1 if noise alone explains the residuals. If it is larger, all standard deviations have been
    /// multiplied by its square root.
    pub consistency: f64,
    /// Number of steps of the descents and samples of the random searches.
    pub search_evaluations: u64,
    /// Number of refinement iterations.
    pub refine_iterations: u64,
    /// Number of searches begun.
    pub starts: u32,
    /// Number of missing samples that were bridged, force and acceleration each counted.
    pub bridged: u64,
    /// Computing time, s. It is the only field that differs between two equal runs.
    pub seconds: f64,
    /// How far the fit can be believed.
    pub acceptance: Acceptance,
    /// Method that found the fit. Later records refine the fit from there.
    pub found_by: FoundBy,
    /// Number of searches that were the paper's random search; the others were descents from low to high frequencies.
    pub random_searches: u32,
    /// Number of branches of minima that have been refined.
    pub branches: u32,
}

/// Method that found a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum FoundBy {
    /// The refinement alone, from static tests.
    Refinement,
    /// A descent from low to high frequencies.
    Descent,
    /// The paper's random search.
    RandomSearch,
    /// The refinement of another minimum's branch.
    Branch,
}

/// Present result of the identification.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Report {
    /// Parameters of each joint, base first.
    pub joints: Vec<JointReport, MAX_JOINTS>,
    /// Data and work behind the parameters, and quality of the fit.
    pub fit: Fit,
    /// Warnings, the gravest first.
    pub warnings: Vec<Warning, MAX_WARNINGS>,
}
