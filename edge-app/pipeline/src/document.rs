//! A finding as JSON: what `flexid identify --json` writes, and a daemon at the end of each epoch.
//!
//! Lines of text are for people. Beside each stands what it names and counts, for scripts. A kind without numbers or names is a
//! string, `"imposed_parameters"`; any other kind is an object with one entry, `{"bus_errors": {"errors": 3}}`.

use flexid_wire::answer::Answer;
use flexid_wire::confidence::{Confidence, Correlations, HeldOut, JointIntervals, Nuisance};
use flexid_wire::directions::WeakDirection;
use flexid_wire::explanation::Explanation;
use flexid_wire::finding::Finding;
use flexid_wire::left_over::LeftOver;
use flexid_wire::report::{Fit, JointReport, Report};
use flexid_wire::residuals::Residuals;
use flexid_wire::warning::Warning;
use serde::{Deserialize, Serialize};

use crate::robot::FoundRobot;
use crate::shared::Shared;

/// Version of the result. An entry that is added does not change it. An entry that is renamed or removed, or whose meaning
/// changes, does. Version 1 has stiffnesses and dampings at the middle of the band, √(f₁ f₂), where version 2 has them at
/// `robot.reference_hz`.
pub const SCHEMA: u32 = 2;

/// A finding as JSON.
#[derive(Clone, Serialize)]
pub struct FindingJson<'a> {
    schema: u32,
    joints: &'a [JointReport],
    fit: &'a Fit,
    warnings: Vec<String>,
    warning_kinds: &'a [Warning],
    confidence: ConfidenceJson<'a>,
    /// The robot as a whole. Left out if the robot does not stand by these parameters.
    #[serde(skip_serializing_if = "Option::is_none")]
    answer: Option<WithText<'a, Answer>>,
    /// The robot that predicts motion. Left out of what a daemon sends.
    #[serde(skip_serializing_if = "Option::is_none")]
    robot: Option<&'a FoundRobot>,
    /// What it shares with other findings of the robot. Left out without records, and of what a daemon sends.
    #[serde(skip_serializing_if = "Option::is_none")]
    shared: Option<&'a Shared>,
    /// Origin of the result. Left out of what a daemon sends.
    #[serde(skip_serializing_if = "Option::is_none")]
    origin: Option<&'a Origin>,
}

/// The origin of a result. It depends on the files and the command alone: the same run gives the same again.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Version of flexid.
    pub version: String,
    /// Command that gives the same numbers, with the names of the files without their folders. Of a daemon the command that runs it.
    pub command: String,
    /// Date of the first record by the log's clock, ISO 8601, UTC. `None` if that clock shows no date.
    pub date: Option<String>,
    /// Configuration, and the files that it names.
    pub configuration: Vec<OriginFile>,
    /// Logs, in the order in which they were read. Empty of a daemon.
    pub logs: Vec<OriginFile>,
}

/// A file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OriginFile {
    /// Its name, without folder.
    pub name: String,
    /// SHA-256 of its bytes, as they are stored: of a packed log, packed. `None` of what can be read only once, as standard input, or not
    /// again, and of a daemon.
    pub sha256: Option<String>,
}

#[derive(Clone, Serialize)]
struct ConfidenceJson<'a> {
    joints: &'a [JointIntervals],
    nuisances: &'a [Nuisance],
    explanations: Vec<ExplanationJson<'a>>,
    correlations: &'a Correlations,
    weak_directions: Vec<WithText<'a, WeakDirection>>,
    residuals: WithText<'a, Residuals>,
    left_over: Vec<WithText<'a, LeftOver>>,
    held_out: &'a [HeldOut],
    retired: u64,
    left_out: u64,
    robust_widening: Option<f64>,
}

/// Entries of a value, and `text`, its line for people.
#[derive(Clone, Serialize)]
pub struct WithText<'a, T> {
    #[serde(flatten)]
    value: &'a T,
    text: String,
}

/// An explanation with its lines for people.
#[derive(Clone, Serialize)]
struct ExplanationJson<'a> {
    #[serde(flatten)]
    value: &'a Explanation,
    text: String,
    /// Other errors of the same kind. `null` if nothing is.
    alike: Option<String>,
    /// Explanations that are as likely.
    alternatives: Option<String>,
    /// Mend. `null` if the accuracy is not contradicted.
    remedy: Option<String>,
}

impl<'a> From<&'a Finding> for FindingJson<'a> {
    fn from(finding: &'a Finding) -> Self {
        let Finding { report: Report { joints, fit, warnings }, confidence, answer } = finding;
        Self {
            schema: SCHEMA,
            joints,
            fit,
            warnings: warnings.iter().map(ToString::to_string).collect(),
            warning_kinds: warnings,
            confidence: confidence.into(),
            answer: answer.as_ref().map(WithText::from),
            robot: None,
            shared: None,
            origin: None,
        }
    }
}

impl<'a> FindingJson<'a> {
    /// The finding with the robot that predicts motion, and with what it shares with other findings of the robot.
    pub fn of_robot(self, robot: Option<&'a FoundRobot>, shared: Option<&'a Shared>) -> Self {
        Self { robot, shared, ..self }
    }

    /// The finding with its origin.
    pub fn from_origin(self, origin: &'a Origin) -> Self {
        Self { origin: Some(origin), ..self }
    }
}

impl<'a> From<&'a Confidence> for ConfidenceJson<'a> {
    fn from(confidence: &'a Confidence) -> Self {
        let Confidence {
            joints,
            nuisances,
            explanations,
            correlations,
            weak_directions,
            residuals,
            left_over,
            held_out,
            retired,
            left_out,
            robust_widening,
        } = confidence;
        Self {
            joints,
            nuisances,
            explanations: explanations.iter().map(|own| explanation(own, nuisances)).collect(),
            correlations,
            weak_directions: weak_directions.iter().map(WithText::from).collect(),
            residuals: residuals.into(),
            left_over: left_over.iter().map(WithText::from).collect(),
            held_out,
            retired: *retired,
            left_out: *left_out,
            robust_widening: *robust_widening,
        }
    }
}

impl<'a, T: ToString> From<&'a T> for WithText<'a, T> {
    fn from(value: &'a T) -> Self {
        Self { value, text: value.to_string() }
    }
}

fn explanation<'a>(value: &'a Explanation, nuisances: &[Nuisance]) -> ExplanationJson<'a> {
    let alike = value.alike(nuisances).map(|alike| alike.to_string());
    let alternatives = value.alternatives().map(|rivals| rivals.to_string());
    let remedy = value.remedy().map(|remedy| remedy.to_string());
    ExplanationJson { value, text: value.to_string(), alike, alternatives, remedy }
}
