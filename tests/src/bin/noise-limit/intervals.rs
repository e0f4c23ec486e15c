//! How many 95 % intervals hold the truth.

use crate::figure::Figure;
use crate::spread;

/// Half of an interval that holds 95 %, in standard deviations.
const HALF: f64 = 1.96;
/// Limits of the share that covers, of each parameter, percent.
pub(crate) const EACH: [f64; 2] = [92.0, 98.0];

/// Intervals of one run rest on the same noise: their share scatters from run to run like that of so many independent ones
/// per interval.
const INDEPENDENT: f64 = 0.6;

/// Intervals of many runs.
#[derive(Default)]
pub(crate) struct Intervals {
    /// Of each run, how many there are, and how many cover.
    runs: Vec<[usize; 2]>,
}

impl Intervals {
    /// Takes in those of one run, by its errors in standard deviations.
    pub(crate) fn push(&mut self, scores: impl Iterator<Item = f64>) {
        let scores: Vec<f64> = scores.collect();
        self.runs.push([scores.len(), covered(&scores)]);
    }

    /// Share of all that covers, which may be `off` 95 % or as far as so few runs scatter.
    pub(crate) fn figure(&self, what: String, off: f64) -> Figure {
        let [count, covered] =
            [0, 1].map(|which| self.runs.iter().map(|run| run[which]).sum::<usize>());
        let share = covered as f64 / count as f64;
        let independent = (INDEPENDENT * count as f64).round() as usize;
        let limits = spread::percentages(independent, 0.95, [95.0 - off, 95.0 + off]);
        Figure::within(what, self.runs.len(), limits, 100.0 * share, " %").remark(format_args!(
            "{count} intervals, of which those of a run scatter like {:.2} of them",
            self.independent()
        ))
    }

    /// [`INDEPENDENT`] as these runs have it.
    fn independent(&self) -> f64 {
        let total = |of: &dyn Fn(&[usize; 2]) -> f64| self.runs.iter().map(of).sum::<f64>();
        let count = total(&|run| run[0] as f64);
        let share = total(&|run| run[1] as f64) / count;
        let spread = total(&|run| (run[1] as f64 - share * run[0] as f64).powi(2));
        count * share * (1.0 - share) / spread
    }
}

/// Share of the intervals that hold the truth, percent.
pub(crate) fn percent(scores: &[f64]) -> f64 {
    100.0 * covered(scores) as f64 / scores.len() as f64
}

fn covered(scores: &[f64]) -> usize {
    scores.iter().filter(|score| score.abs() <= HALF).count()
}
