//! Parts of a report beside the fit itself, as the result file carries it: spectra, measured receptance, course, data quality, origin.
//!
//! Everything but the origin follows from the records by the fit. Curves have at most [`POINTS`] points, of five digits.

mod curve;
mod frf;
mod origin;
mod quality;
mod spectra;

use flexid_pipeline::solver::{CoursePoint, FittedRecord};
use flexid_pipeline::{Counts, Outcome, same_pose};
use serde::{Deserialize, Serialize};

pub use curve::POINTS;
use curve::rounded;
pub use flexid_pipeline::document::{Origin, OriginFile};
pub use frf::{MeasuredPoint, MeasuredReceptance, Signals, estimate};
pub use origin::{days, file, origin, quoted, sha256};
pub use quality::DataQuality;
pub use spectra::{Octave, RecordEvidence, RecordSpectra};

/// Evidence of the records, beside the parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Records that the fit rests on.
    pub records: Vec<RecordEvidence>,
    /// Receptance of each pose, from the records alone.
    pub measured_receptance: Vec<MeasuredReceptance>,
    /// Points at which the refinements stood in the course of the work.
    pub course: Vec<Step>,
    /// Counts of what has come in.
    pub data_quality: DataQuality,
}

/// A point of the course.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// Number of steps of all searches and refinements before.
    pub step: u64,
    /// Number of searches begun.
    pub starts: u32,
    /// Number of records that the step fits.
    pub records: u64,
    /// Sum of squares of the whitened residuals and priors per real residual.
    pub misfit: f64,
}

impl Evidence {
    /// The evidence of the records of an outcome.
    pub fn of(outcome: &Outcome) -> Self {
        let Outcome { records, course, counts, .. } = outcome;
        Self::new(records, course, counts)
    }

    /// Time at which the first record begins, on the clock of the readings, s.
    pub fn start_s(&self) -> Option<f64> {
        self.records.iter().map(|record| record.start_s).min_by(f64::total_cmp)
    }

    fn new(records: &[FittedRecord], course: &[CoursePoint], counts: &Counts) -> Self {
        let mut poses: Vec<Vec<&FittedRecord>> = Vec::new();
        let mut of_pose = Vec::new();
        for record in records {
            let place = poses.iter().position(|own| same_pose(&own[0].pose, &record.pose));
            let place = place.unwrap_or_else(|| {
                poses.push(Vec::new());
                poses.len() - 1
            });
            poses[place].push(record);
            of_pose.push(place + 1);
        }
        let every = course.len().div_ceil(POINTS).max(1);
        let last = course.len().saturating_sub(1);
        let kept =
            course.iter().enumerate().filter(|(index, _)| index % every == 0 || *index == last);
        Self {
            records: records
                .iter()
                .zip(of_pose)
                .map(|(record, pose)| RecordEvidence::new(record, pose))
                .collect(),
            measured_receptance: poses
                .iter()
                .filter_map(|own| {
                    MeasuredReceptance::of_tests(own).or_else(|| MeasuredReceptance::of(own))
                })
                .collect(),
            course: kept.map(|(_, point)| Step::from(point)).collect(),
            data_quality: DataQuality::from(counts),
        }
    }
}

impl From<&CoursePoint> for Step {
    fn from(point: &CoursePoint) -> Self {
        let CoursePoint { step, starts, records, misfit } = *point;
        Self { step, starts, records, misfit: rounded(misfit) }
    }
}
