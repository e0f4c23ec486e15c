//! How a parameter went: level, by steps, or along a line.

use flexid_pipeline::dynamics::PositiveEstimate;
use serde::Serialize;

use super::detection::{Alarm, largest_step};
use super::series::{Series, scatter};
use crate::findings::Pool;

/// A parameter over the findings that determine it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Course {
    /// Its value in each of these findings.
    pub points: Vec<Point>,
    /// Its changes, each with the values around it. Empty if none was found.
    pub steps: Vec<Step>,
    /// A line through the logarithms. `None` of a single finding, or of findings at one time.
    pub line: Option<Line>,
    /// True if the changes that were found are a drift: the line describes them better than steps do.
    pub is_drift: bool,
}

/// A parameter in one finding.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Number of the finding, from 0.
    pub finding: usize,
    /// Value, in its unit, with the errors that findings share as all of them have these.
    pub value: f64,
    /// Standard deviation of its logarithm by this finding's own noise.
    pub relative_std: f64,
}

/// A change between two findings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Step {
    /// Number of the first finding behind it, from 0.
    pub since: usize,
    /// Number of the finding with which it was found.
    pub found: usize,
    /// Values before and after, means up to the changes beside it, in the unit of the parameter.
    pub values: [f64; 2],
    /// After over before.
    pub ratio: PositiveEstimate,
    /// Its logarithm in standard deviations.
    pub deviations: f64,
    /// Chance of so large a change of any parameter in the life of a robot that stays the same.
    pub chance: f64,
}

/// A line through the logarithms of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Line {
    /// Last value over first value on it.
    pub ratio: PositiveEstimate,
    /// Growth of the logarithm per unit of time.
    pub growth: f64,
    /// Its standard deviation.
    pub growth_std: f64,
    /// Values at the first and the last finding, in the unit of the parameter.
    pub values: [f64; 2],
    /// χ² of the findings about the line, and its degrees of freedom.
    pub chi_squared: f64,
    /// Findings less 2.
    pub freedoms: usize,
}

impl Course {
    /// The course of a series with these changes. `None` without a finding.
    pub(super) fn new(
        series: &Series,
        alarms: &[Alarm],
        times: &[f64],
        pool: &Pool,
    ) -> Option<Self> {
        let count = series.len();
        let points = (0..count).map(|entry| {
            let (logarithm, relative_std) = series.point(entry, pool);
            Point { finding: series.findings[entry], value: logarithm.exp(), relative_std }
        });
        let points: Vec<Point> = points.collect();
        points.first()?;
        // Where the change lies is told by all findings, not by those up to its discovery alone.
        let mut splits: Vec<usize> = alarms.iter().map(|alarm| alarm.split).collect();
        for own in 0..splits.len() {
            let first = if own == 0 { 0 } else { splits[own - 1] };
            let end = splits.get(own + 1).copied().unwrap_or(count);
            splits[own] = largest_step(series, first, end, pool);
        }
        let bounds: Vec<usize> =
            std::iter::once(0).chain(splits.iter().copied()).chain([count]).collect();
        let of_steps: f64 =
            bounds.windows(2).map(|ends| series.about_mean(ends[0]..ends[1], pool)).sum();
        let own_scatter = scatter(of_steps, count.saturating_sub(bounds.len() - 1));
        let steps: Vec<Step> = alarms
            .iter()
            .enumerate()
            .map(|(own, alarm)| {
                let [first, split, end] = [0, 1, 2].map(|next| bounds[own + next]);
                let step = series.step(first..end, split);
                let (value, std) = (step.value(pool), step.deviation(own_scatter, pool));
                let means = [first..split, split..end].map(|range| series.mean(range).value(pool));
                Step {
                    since: series.findings[split],
                    found: alarm.found,
                    values: means.map(f64::exp),
                    ratio: PositiveEstimate::new(value.exp(), std),
                    deviations: value / std,
                    chance: alarm.chance,
                }
            })
            .collect();
        let line = Line::new(series, times, pool);
        // Schwarz, "Estimating the dimension of a model", Annals of Statistics 6, 1978: a step has a place and a size, a line a slope.
        let each = (count as f64).ln();
        let is_drift = !steps.is_empty()
            && line.is_some_and(|own| {
                own.chi_squared + each < of_steps + 2.0 * each * steps.len() as f64
            });
        Some(Self { points, steps, line, is_drift })
    }
}

impl Line {
    fn new(series: &Series, times: &[f64], pool: &Pool) -> Option<Self> {
        let count = series.len();
        let line = series.line(times)?;
        let (growth, middle) = (line.value(pool), series.middle(times));
        let level = series.mean(0..count).value(pool);
        let at = |entry: usize| level + growth * (times[series.findings[entry]] - middle);
        let chi_squared = series.chi_squared(0..count, pool, at);
        let freedoms = count.saturating_sub(2);
        let growth_std = line.deviation(scatter(chi_squared, freedoms), pool);
        let span = times[series.findings[count - 1]] - times[series.findings[0]];
        Some(Self {
            ratio: PositiveEstimate::new((growth * span).exp(), growth_std * span),
            growth,
            growth_std,
            values: [0, count - 1].map(|entry| at(entry).exp()),
            chi_squared,
            freedoms,
        })
    }
}
