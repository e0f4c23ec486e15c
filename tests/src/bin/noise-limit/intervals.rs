//! How many 95 % intervals hold the truth.

use crate::figure::Figure;
use crate::spread;

/// Half of an interval that holds 95 %, in standard deviations.
const HALF: f64 = 1.96;
/// Limits of the share that covers, of each parameter, percent.
pub(crate) const EACH: [f64; 2] = [92.0, 98.0];

/// Intervals of one run rest on the same noise: the share that covers scatters from run to run like that of so many
/// independent ones per interval.
const INDEPENDENT: f64 = 0.6;

/// Intervals of many runs.
#[derive(Default)]
pub(crate) struct Intervals {
    runs: usize,
    count: usize,
    covered: usize,
    /// Sum of the squares of the errors in standard deviations.
    squares: f64,
}

impl Intervals {
    /// Takes in those of one run, by its errors in standard deviations.
    pub(crate) fn push(&mut self, scores: impl Iterator<Item = f64>) {
        let scores: Vec<f64> = scores.collect();
        self.runs += 1;
        self.count += scores.len();
        self.covered += covered(&scores);
        self.squares += scores.iter().map(|score| score * score).sum::<f64>();
    }

    /// Share of all that covers, which may be `off` 95 % or as far as so few runs scatter; if one error moves all intervals of a
    /// run, each run counts as one. Where any share would do, so few are they, the errors' size is judged instead.
    pub(crate) fn figure(&self, what: String, off: f64, one_error: bool) -> Figure {
        let Self { runs, count, covered, squares } = self;
        let share = *covered as f64 / *count as f64;
        let independent =
            if one_error { *runs } else { (INDEPENDENT * *count as f64).round() as usize };
        let limits = spread::percentages(independent, 0.95, [95.0 - off, 95.0 + off]);
        if limits[0] <= 0.0 {
            let what = format!("{what}: too few, their errors' root mean square instead");
            let limit = spread::root_mean_square(independent, 1.0);
            return Figure::at_most(what, *runs, limit, (squares / *count as f64).sqrt(), " σ");
        }
        Figure::within(what, *runs, limits, 100.0 * share, " %")
            .remark(format_args!("{count} intervals"))
    }
}

/// Share of the intervals that hold the truth, percent.
pub(crate) fn percent(scores: &[f64]) -> f64 {
    100.0 * covered(scores) as f64 / scores.len() as f64
}

fn covered(scores: &[f64]) -> usize {
    scores.iter().filter(|score| score.abs() <= HALF).count()
}
