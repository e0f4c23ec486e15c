//! Parts of a report beside the fit itself, as the result file carries it: spectra, measured receptance, course, data quality, origin.
//!
//! Everything but the origin follows from the records by the fit. Curves have at most [`POINTS`] points, of five digits.

mod frf;
mod origin;
mod quality;
mod spectra;

use flexid_pipeline::solver::{CoursePoint, FittedRecord};
use flexid_pipeline::{Counts, Outcome, same_pose};
use serde::{Deserialize, Serialize};

pub use frf::{MeasuredPoint, MeasuredReceptance, Signals, estimate};
pub use origin::{Origin, OriginFile, quoted, sha256};
pub use quality::DataQuality;
pub use spectra::{Octave, RecordEvidence, RecordSpectra};

/// Most points of a curve. Chosen: more than a panel of a page has pixels to tell them apart.
pub const POINTS: usize = 240;

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
                .filter_map(|own| MeasuredReceptance::of(own))
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

/// A number to five digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

/// Indices of at most [`POINTS`] of these ascending frequencies: all, or those next to a grid of equal ratios.
fn thinned(frequencies: &[f64]) -> Vec<usize> {
    let (Some(first), Some(last)) = (frequencies.first(), frequencies.last()) else {
        return Vec::new();
    };
    if frequencies.len() <= POINTS {
        return (0..frequencies.len()).collect();
    }
    let ratio = last / first;
    let mut kept: Vec<usize> = (0..POINTS)
        .map(|index| {
            let wanted = first * ratio.powf(index as f64 / (POINTS - 1) as f64);
            let above = frequencies.partition_point(|own| *own < wanted).min(frequencies.len() - 1);
            let below = above.saturating_sub(1);
            if wanted - frequencies[below] < frequencies[above] - wanted { below } else { above }
        })
        .collect();
    kept.dedup();
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_curve_is_thinned_by_equal_ratios() {
        let few: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!(thinned(&few), (0..100).collect::<Vec<_>>());
        let many: Vec<f64> = (8..=4000).map(f64::from).collect();
        let kept = thinned(&many);
        assert!(kept.len() <= POINTS && kept.len() > POINTS / 2, "{}", kept.len());
        assert_eq!((kept[0], kept[kept.len() - 1]), (0, many.len() - 1));
        assert!(kept.windows(2).all(|pair| pair[0] < pair[1]));
        let step = many[kept[kept.len() - 1]] / many[kept[kept.len() - 2]];
        assert!((1.01..1.04).contains(&step), "{step}");
        assert!(thinned(&[]).is_empty());
    }

    #[test]
    fn numbers_keep_five_digits() {
        assert_eq!(rounded(1.234_567_8e-9), 1.2346e-9);
        assert_eq!(rounded(0.0), 0.0);
    }
}
