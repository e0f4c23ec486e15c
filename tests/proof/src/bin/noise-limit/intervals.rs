//! Counts of the 95 % intervals that hold the truth.

use crate::figure::Figure;
use crate::spread;

/// Half the width of an interval that holds 95 %, in standard deviations.
const HALF: f64 = 1.96;
/// Limits of the share that covers, of each parameter, percent.
pub(crate) const EACH: [f64; 2] = [92.0, 98.0];

/// Numbers of independent intervals per interval, for the share that covers and for the errors' size, as measured
/// over the thousand runs of `--only coverage --details`. Intervals of one run rest on the same noise, so that both
/// scatter from run to run like those of fewer independent intervals.
const INDEPENDENT: [f64; 2] = [0.49, 0.39];
/// The first of these for intervals of fits to a plant, where an imperfection moves many parameters together: by draws from the
/// covariances of `oracle`, four robots each of three and of six joints, 0.13 to 0.20.
const INDEPENDENT_ON_PLANTS: f64 = 0.17;

/// Intervals of many runs.
#[derive(Default)]
pub(crate) struct Intervals {
    runs: usize,
    count: usize,
    covered: usize,
    /// Sum of the squares of the errors in standard deviations.
    squares: f64,
    /// Sums over the runs of two squares: the difference of the covered intervals from their expectation, and that of
    /// the sum of squared errors.
    scatter: [f64; 2],
}

impl Intervals {
    /// Adds the intervals of one run, by its errors in standard deviations.
    pub(crate) fn push(&mut self, scores: impl Iterator<Item = f64>) {
        let scores: Vec<f64> = scores.collect();
        let (count, covered) = (scores.len() as f64, covered(&scores));
        let squares = scores.iter().map(|score| score * score).sum::<f64>();
        self.runs += 1;
        self.count += scores.len();
        self.covered += covered;
        self.squares += squares;
        self.scatter[0] += (covered as f64 - 0.95 * count).powi(2);
        self.scatter[1] += (squares - count).powi(2);
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Share of all intervals that cover. It may differ from 95 % by `off`, or by the scatter of few runs. If one
    /// error moves all intervals of a run, each run counts as one interval.
    pub(crate) fn cover(&self, what: &str, off: f64, one_error: bool) -> Figure {
        self.cover_as(what, [95.0 - off, 95.0 + off], self.independent(0, one_error))
    }

    /// Share of all intervals that cover, within `limits` in percent or the scatter of few runs.
    pub(crate) fn cover_within(&self, what: &str, limits: [f64; 2]) -> Figure {
        self.cover_as(what, limits, self.independent(0, false))
    }

    /// The share of fits to plants.
    pub(crate) fn cover_on_plants(&self, what: &str, limits: [f64; 2]) -> Figure {
        let independent = (INDEPENDENT_ON_PLANTS * self.count as f64).round() as usize;
        self.cover_as(what, limits, independent.max(self.runs))
    }

    fn cover_as(&self, what: &str, limits: [f64; 2], independent: usize) -> Figure {
        let limits = spread::percentages(independent, 0.95, limits);
        let what = format!("{what}: 95 % intervals that cover");
        let share = 100.0 * self.covered as f64 / self.count as f64;
        Figure::within(what, self.runs, limits, share, " %")
            .remark(format_args!("{} intervals", self.count))
    }

    /// Root mean square of the errors. It is more precise than the share, the more so the fewer errors there are.
    pub(crate) fn size(&self, what: &str, one_error: bool) -> Figure {
        let limits = spread::root_mean_squares(self.independent(1, one_error));
        let what = format!("{what}: root-mean-square error");
        let size = (self.squares / self.count as f64).sqrt();
        Figure::within(what, self.runs, limits, size, " σ")
    }

    /// Independent intervals per interval, by the scatter among runs of the share that covers, and of the errors'
    /// size: the variance of independent ones over the measured variance.
    pub(crate) fn independence(&self) -> [f64; 2] {
        let [covered, squares] = self.scatter;
        let count = self.count as f64;
        [0.95 * 0.05 * count / covered, 2.0 * count / squares]
    }

    fn independent(&self, which: usize, one_error: bool) -> usize {
        let independent = (INDEPENDENT[which] * self.count as f64).round() as usize;
        if one_error { self.runs } else { independent.max(self.runs) }
    }
}

/// Share of the intervals that hold the truth, percent.
pub(crate) fn percent(scores: &[f64]) -> f64 {
    100.0 * covered(scores) as f64 / scores.len() as f64
}

fn covered(scores: &[f64]) -> usize {
    scores.iter().filter(|score| score.abs() <= HALF).count()
}
