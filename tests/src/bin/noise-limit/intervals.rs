//! How many 95 % intervals hold the truth.

use crate::figure::Figure;
use crate::spread;

/// Half of an interval that holds 95 %, in standard deviations.
const HALF: f64 = 1.96;
/// Limits of the share that covers, of each parameter, percent.
pub(crate) const EACH: [f64; 2] = [92.0, 98.0];

/// Intervals of many runs. Those of one run rest on the same noise, so that the runs count, not the intervals.
#[derive(Default)]
pub(crate) struct Intervals {
    /// Of each run, the share that covers, percent, and how many there are.
    runs: Vec<(f64, usize)>,
}

impl Intervals {
    /// Takes in those of one run, by its errors in standard deviations.
    pub(crate) fn push(&mut self, scores: impl Iterator<Item = f64>) {
        let scores: Vec<f64> = scores.collect();
        if !scores.is_empty() {
            self.runs.push((percent(&scores), scores.len()));
        }
    }

    fn count(&self) -> usize {
        self.runs.iter().map(|(_, count)| count).sum()
    }

    /// Share of all that covers, which may be `off` 95 % or as far as so few runs scatter.
    pub(crate) fn figure(&self, what: String, off: f64) -> Figure {
        let mean = self.count() as f64 / self.runs.len() as f64;
        let weighted: Vec<f64> =
            self.runs.iter().map(|(share, count)| share * *count as f64 / mean).collect();
        let covered = weighted.iter().sum::<f64>() / weighted.len() as f64;
        // A run of more intervals is not one that covers more.
        let around: Vec<f64> =
            self.runs.iter().map(|(share, n)| (share - covered) * *n as f64 / mean).collect();
        let off = off.max(spread::DEVIATIONS * spread::of_mean(&around));
        let limits = [95.0 - off, (95.0 + off).min(100.0)];
        Figure::within(what, self.runs.len(), limits, covered, " %")
            .remark(format_args!("{} intervals", self.count()))
    }
}

/// Share of the intervals that hold the truth, percent.
pub(crate) fn percent(scores: &[f64]) -> f64 {
    let covered = scores.iter().filter(|score| score.abs() <= HALF).count();
    100.0 * covered as f64 / scores.len() as f64
}
