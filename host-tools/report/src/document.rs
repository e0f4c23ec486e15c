//! A result file, read for the page.
//!
//! Files of older programs lack entries. The page then leaves out the parts that need them and says so. Without the robot there is no
//! page.

use std::path::Path;

use flexid_pipeline::input::{self, BadInput};
use flexid_prediction::document::{COMMAND, Found};
use flexid_wire::answer::Answer;
use flexid_wire::confidence::{Correlations, HeldOut, Nuisance};
use flexid_wire::residuals::Meaning;
use serde::Deserialize;
use serde_json::Value;

use crate::evidence::{DataQuality, MeasuredReceptance, Origin, RecordEvidence, Step};
use crate::imperfection::Size;

/// A result, as far as the page shows it.
#[derive(Debug)]
pub struct Document {
    /// Parameters, fit, warnings and robot.
    pub found: Found,
    /// Entries that the page shows beside them.
    pub further: Further,
}

/// Entries of a file that [`Found`] leaves out. Those that are `None` are not in the file.
#[derive(Debug, Deserialize)]
pub struct Further {
    /// The robot as a whole.
    pub answer: Option<Answer>,
    /// Doubts about the model of the robot, a line each.
    #[serde(default)]
    pub model_warnings: Vec<String>,
    /// The kind of each of the warnings of the fit.
    #[serde(default)]
    pub warning_kinds: Vec<Value>,
    /// Trust in the numbers, as the file states it.
    pub confidence: Option<Confidence>,
    /// Records that the fit rests on.
    pub records: Option<Vec<RecordEvidence>>,
    /// Receptance of each pose, from the records alone.
    pub measured_receptance: Option<Vec<MeasuredReceptance>>,
    /// Course of the work.
    pub course: Option<Vec<Step>>,
    /// Counts of what has come in.
    pub data_quality: Option<DataQuality>,
    /// Origin of the result.
    pub origin: Option<Origin>,
}

/// How far the result can be trusted. Lines of text are the file's.
#[derive(Debug, Deserialize)]
pub struct Confidence {
    /// 95 % intervals of each joint.
    #[serde(default)]
    pub joints: Vec<Intervals>,
    /// Nuisances and imperfections.
    #[serde(default)]
    pub nuisances: Vec<Nuisance>,
    /// Explanation of the residuals.
    #[serde(default)]
    pub explanations: Vec<Explanation>,
    /// Correlations between the unknowns.
    pub correlations: Correlations,
    /// Combinations of unknowns that the data determine badly.
    #[serde(default)]
    pub weak_directions: Vec<WeakDirection>,
    /// Residuals of the fit.
    pub residuals: Residuals,
    /// Places where more is left than elsewhere.
    #[serde(default)]
    pub left_over: Vec<Line>,
    /// Agreement of each record with its prediction by the others.
    #[serde(default)]
    pub held_out: Vec<HeldOut>,
    /// By how many times robust intervals are wider. `None` where they are not robust, and in files that do not state it.
    #[serde(default)]
    pub robust_widening: Option<f64>,
}

/// 95 % intervals of a joint, `tx ty tz rx ry rz`.
#[derive(Debug, Deserialize)]
pub struct Intervals {
    /// Interval of each stiffness, N/m and Nm/rad.
    pub stiffness_interval: [Option<[f64; 2]>; 6],
    /// Interval of each damping, Ns/m and Nms/rad.
    pub damping_interval: [Option<[f64; 2]>; 6],
}

/// An explanation in words.
#[derive(Debug, Deserialize)]
pub struct Explanation {
    /// The explanation, and how much it explains.
    pub text: String,
    /// Part of the misfit that its kind explains.
    #[serde(default)]
    pub share: f64,
    /// Other errors of this kind.
    #[serde(default)]
    pub alike: Option<String>,
    /// Errors that explain the records as well in its place.
    #[serde(default)]
    pub alternatives: Option<String>,
    /// The mend.
    #[serde(default)]
    pub remedy: Option<String>,
    /// Its size. `None` in files that do not state it.
    #[serde(default)]
    pub deviation: Option<Size>,
}

/// A combination of unknowns that the data determine badly.
#[derive(Debug, Deserialize)]
pub struct WeakDirection {
    /// It in words.
    pub text: String,
    /// Its largest components.
    #[serde(default)]
    pub shares: Vec<Share>,
}

/// A component of a direction.
#[derive(Debug, Deserialize)]
pub struct Share {
    /// Name of the unknown.
    pub name: String,
    /// Component; the direction has the length 1.
    pub weight: f64,
}

/// Residuals of the fit.
#[derive(Debug, Deserialize)]
pub struct Residuals {
    /// They in words.
    pub text: String,
    /// Their meaning. `None` in files that do not state it.
    #[serde(default)]
    pub meaning: Option<Meaning>,
}

/// Something in words.
#[derive(Debug, Deserialize)]
pub struct Line {
    /// The words.
    pub text: String,
}

impl Document {
    /// Reads and checks a result file.
    ///
    /// # Errors
    /// The file cannot be read, is no result, or has no robot. The error is one line that names file, place and mend.
    pub fn load(file: &Path) -> Result<Self, BadInput> {
        Self::parse(file, &input::read(file)?)
    }

    /// [`Document::load`] for the `text` of a file.
    ///
    /// # Errors
    /// Those of [`Document::load`].
    pub fn parse(file: &Path, text: &str) -> Result<Self, BadInput> {
        let found = Found::parse(file, text)?;
        let document = Self { found, further: input::parse_json(file, text, COMMAND)? };
        match document.fault() {
            Some(fault) => Err(BadInput::new(file, fault)),
            None => Ok(document),
        }
    }

    /// Returns whether the result rests on static tests alone: there are no dampings, no modes with intervals, and no band.
    pub fn is_static(&self) -> bool {
        self.found.fit.records == 0
    }

    /// Entries that the page needs in full and that the file lacks, by their names.
    ///
    /// That of static tests alone needs no records.
    pub fn missing(&self) -> Vec<&'static str> {
        let of_records = |entry: &str| !matches!(entry, "answer" | "confidence" | "origin");
        let entries = [
            ("answer", self.further.answer.is_none()),
            ("confidence", self.further.confidence.is_none()),
            ("records", self.further.records.is_none()),
            ("measured_receptance", self.further.measured_receptance.is_none()),
            ("course", self.further.course.is_none()),
            ("data_quality", self.further.data_quality.is_none()),
            ("origin", self.further.origin.is_none()),
        ];
        let missing =
            entries.into_iter().filter(|(_, is_missing)| *is_missing).map(|(name, _)| name);
        missing.filter(|entry| !(self.is_static() && of_records(entry))).collect()
    }

    /// The first entry that does not go with the others.
    fn fault(&self) -> Option<String> {
        let again = "run `flexid identify --json` again";
        let joints = self.found.joints.len();
        if let Some(Confidence { joints: intervals, correlations, .. }) = &self.further.confidence {
            let unknowns = correlations.unknowns.len();
            if !intervals.is_empty() && intervals.len() != joints {
                return Some(format!("confidence.joints is of another robot: {again}"));
            }
            if correlations.percent.len() != unknowns * unknowns.saturating_sub(1) / 2 {
                return Some(format!(
                    "confidence.correlations.percent does not go with its unknowns: {again}"
                ));
            }
        }
        for (index, record) in self.further.records.iter().flatten().enumerate() {
            let spectra = &record.spectra;
            let curves = [
                &spectra.force,
                &spectra.force_noise,
                &spectra.measured,
                &spectra.modelled,
                &spectra.residual,
                &spectra.noise,
            ];
            let points = spectra.frequency_hz.len();
            if curves.into_iter().flatten().any(|curve| curve.len() != points) {
                return Some(format!(
                    "records[{index}].spectra has curves of different lengths: {again}"
                ));
            }
        }
        None
    }
}
