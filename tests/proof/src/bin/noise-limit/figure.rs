//! A number with its limit, and the table of all numbers.

use std::fmt;

use crate::spread;

/// Largest share of runs that the noise need not explain, percent.
const UNEXPLAINED: f64 = 1.0;
/// Largest part of right runs that the noise does not explain. The noise itself is estimated from a few hundred
/// samples.
const MISJUDGED: f64 = 1e-3;

/// A measured number and its limit.
pub(crate) struct Figure {
    pub(crate) what: String,
    pub(crate) limit: String,
    pub(crate) measured: String,
    pub(crate) held: bool,
    /// Number of runs behind the figure, and what they are made of if not of one robot each.
    pub(crate) runs: String,
}

/// Result of a part of the proof.
pub(crate) struct Proven {
    pub(crate) part: &'static str,
    pub(crate) figures: Vec<Figure>,
}

/// All parts as a Markdown table.
pub(crate) struct Table(pub(crate) Vec<Proven>);

impl Figure {
    /// A number that must not pass `limit`.
    pub(crate) fn at_most(
        what: impl Into<String>,
        runs: usize,
        limit: f64,
        measured: f64,
        unit: &str,
    ) -> Self {
        Self {
            what: what.into(),
            limit: format!("≤ {limit:.3}{unit}"),
            measured: format!("{measured:.3}{unit}"),
            held: measured <= limit,
            runs: runs.to_string(),
        }
    }

    /// A number that must lie within `[least, most]`.
    pub(crate) fn within(
        what: impl Into<String>,
        runs: usize,
        [least, most]: [f64; 2],
        measured: f64,
        unit: &str,
    ) -> Self {
        Self {
            measured: format!("{measured:.3}{unit}"),
            ..Self::all_within(what, runs, [least, most], [measured; 2], unit)
        }
    }

    /// The lowest and the highest of numbers that must all lie within `[least, most]`.
    pub(crate) fn all_within(
        what: impl Into<String>,
        runs: usize,
        [least, most]: [f64; 2],
        [lowest, highest]: [f64; 2],
        unit: &str,
    ) -> Self {
        Self {
            what: what.into(),
            limit: format!("{least:.3} to {most:.3}{unit}"),
            measured: format!("{lowest:.3} to {highest:.3}{unit}"),
            held: least <= lowest && highest <= most,
            runs: runs.to_string(),
        }
    }

    /// A count of runs.
    pub(crate) fn count(
        what: impl Into<String>,
        runs: usize,
        held: bool,
        count: usize,
        limit: &str,
    ) -> Self {
        Self {
            what: what.into(),
            limit: limit.into(),
            measured: format!("{count} of {runs}"),
            held,
            runs: runs.to_string(),
        }
    }

    /// Share of runs that the noise does not explain, although they contain nothing else. The other figures leave
    /// them out.
    pub(crate) fn unexplained(what: &str, runs: usize, unexplained: usize) -> Self {
        let [_, most] = spread::percentages(runs, MISJUDGED, [0.0, UNEXPLAINED]);
        let what = format!("{what}: runs that the noise does not explain");
        let share = 100.0 * unexplained as f64 / runs as f64;
        Self::at_most(what, runs, most, share, " %").remark(unexplained)
    }

    /// Sets what the runs are made of.
    pub(crate) fn made_of(self, runs: impl fmt::Display) -> Self {
        Self { runs: runs.to_string(), ..self }
    }

    /// Adds a remark to the measured number.
    pub(crate) fn remark(mut self, remark: impl fmt::Display) -> Self {
        self.measured = format!("{} ({remark})", self.measured);
        self
    }
}

impl Table {
    pub(crate) fn held(&self) -> bool {
        self.0.iter().flat_map(|proven| &proven.figures).all(|figure| figure.held)
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "| part | figure | limit | measured | | runs |")?;
        writeln!(f, "| ---- | ------ | ----- | -------- | --- | ---- |")?;
        for Proven { part, figures, .. } in &self.0 {
            for Figure { what, limit, measured, held, runs } in figures {
                let held = if *held { "pass" } else { "**FAIL**" };
                writeln!(f, "| {part} | {what} | {limit} | {measured} | {held} | {runs} |")?;
            }
        }
        Ok(())
    }
}

/// The middle of values; of an even number the mean of the two in the middle.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let len = values.len();
    if len == 0 { f64::NAN } else { 0.5 * (values[(len - 1) / 2] + values[len / 2]) }
}

/// Root of the mean of the squares.
pub(crate) fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}
