//! The identified parameters, as they go to the screen, to the wire and to the JSON file.
//!
//! Serialised with `serde_json`, a [`Report`] is the result file of `flexid identify --json`, but for what stands there
//! under `confidence` ([`crate::confidence`]): field names are part of the contract. Vectors of six are in the order
//! `tx ty tz rx ry rz` of the joint frame, SI units.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::messages::{Name, Text};

/// Most joints that a report holds.
pub const MAX_JOINTS: usize = 7;
/// Most warnings that a report holds (8 before version 3).
pub const MAX_WARNINGS: usize = 32;

/// How far a parameter can be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The data tell it.
    Identified,
    /// The data tell it roughly.
    Weak,
    /// The data do not tell it.
    NotObservable,
    /// It was not sought, but held at the value that the user gave; since version 2.
    Fixed,
}

/// How far a fit as a whole can be believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum Acceptance {
    /// The residuals are as large as the noise explains.
    Consistent,
    /// The same minimum was reached more than once, and its residuals are larger than the noise explains.
    ModelSuspect,
    /// The work ended before either.
    Unsettled,
}

/// The parameters of one joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct JointReport {
    /// The joint's name in the model.
    pub name: Name,
    /// N/m for translations, Nm/rad for rotations.
    pub stiffness: [f64; 6],
    /// Standard deviation in the unit of the stiffness; `None` where it is not observable or fixed.
    pub stiffness_std: [Option<f64>; 6],
    /// How far to trust each stiffness.
    pub stiffness_verdict: [Verdict; 6],
    /// Ns/m for translations, Nms/rad for rotations.
    pub damping: [f64; 6],
    /// Standard deviation in the unit of the damping; `None` where it is not observable or fixed.
    pub damping_std: [Option<f64>; 6],
    /// How far to trust each damping.
    pub damping_verdict: [Verdict; 6],
}

/// What the parameters rest on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Fit {
    /// Records that the numbers rest on: those that are kept, and those that have retired into what is known.
    pub records: u64,
    /// Force and acceleration frames taken.
    pub frames: u64,
    /// Force and acceleration frames missing by their counters.
    pub frames_lost: u64,
    /// Surface similarity parameter per direction and experiment, 0 (equal) to 2 (opposite): the median of them.
    pub ssp: f64,
    /// The largest of them.
    pub ssp_max: f64,
    /// χ² per degree of freedom; 1 when noise alone explains the residuals. Where it is larger, all standard
    /// deviations have been multiplied by its square root.
    pub consistency: f64,
    /// Steps of the descents and samples of the random searches.
    pub search_evaluations: u64,
    /// Refinement iterations done.
    pub refine_iterations: u64,
    /// Searches begun.
    pub starts: u32,
    /// Missing samples that were bridged, force and acceleration each counted.
    pub bridged: u64,
    /// Computing time, s; the one field that differs between two equal runs.
    pub seconds: f64,
    /// How far to believe the fit.
    pub acceptance: Acceptance,
    /// Which method has led to the fit; later records refine it from there.
    pub found_by: FoundBy,
    /// Of the searches, the paper's random searches; the others are descents from low to high frequencies.
    pub random_searches: u32,
    /// Branches of minima that have been refined.
    pub branches: u32,
}

/// Which method has led to a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum FoundBy {
    /// The refinement alone: of static tests.
    Refinement,
    /// A descent from low to high frequencies.
    Descent,
    /// The paper's random search.
    RandomSearch,
    /// The refinement of another minimum's branch.
    Branch,
}

/// The present state of knowledge.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Report {
    /// Base first.
    pub joints: Vec<JointReport, MAX_JOINTS>,
    /// What the parameters rest on.
    pub fit: Fit,
    /// One line each, for people.
    pub warnings: Vec<Text, MAX_WARNINGS>,
}
