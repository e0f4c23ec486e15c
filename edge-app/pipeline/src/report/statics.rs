//! Findings of a fit about each static test.

use std::cmp::Ordering;

use flexid_core::identify::Estimate;
use flexid_core::statics::{DIAL_GAUGE, LeftOut};
use flexid_wire::warning::Warning;
use serde::Serialize;

use crate::statics::StaticTests;

/// Static tests in a fit. It is the entry `static_tests` of the result file of `flexid identify --json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StaticReport {
    /// Standard deviation of the displacements that state none, m; `None` if all state theirs.
    pub deviation_m: Option<f64>,
    /// True if this deviation is that of the residuals. If not, they are too few, and it is assumed.
    pub deviation_is_estimated: bool,
    /// Each test, in its order in the file.
    pub tests: Vec<StaticTestReport>,
}

/// A static test in a fit. Residuals are measured less model, in standard deviations of the displacement, along the axes in which it was
/// measured; `None` where it was not.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StaticTestReport {
    /// Line in the file, from 1.
    pub line: usize,
    /// Residual of the fit to all.
    pub residual: [Option<f64>; 3],
    /// Residual of a fit to all but this test; `None` also where nothing else predicts it.
    pub left_out: [Option<f64>; 3],
    /// How far the test lies from that prediction, by the scatter of the others, in standard deviations. `None` where they are too few.
    pub deviations: Option<f64>,
    /// Largest probability that noise alone puts any of the tests as far out. Below 0.05 the test is an outlier.
    pub chance: Option<f64>,
}

impl StaticReport {
    /// `deviation_m` is that of the residuals, if it could be estimated. Returns `None` without static tests.
    pub(crate) fn new(
        statics: &StaticTests,
        estimate: &Estimate,
        deviation_m: Option<f64>,
    ) -> Option<Self> {
        let is_unstated =
            statics.tests.iter().any(|test| test.readings().any(|(_, reading)| !reading.is_stated));
        let tests = statics.lines.iter().zip(&estimate.static_tests).map(|(line, test)| {
            let LeftOut { residual, left_out, deviations, chance, .. } = *test;
            StaticTestReport { line: *line, residual, left_out, deviations, chance }
        });
        (!statics.tests.is_empty()).then(|| Self {
            deviation_m: is_unstated.then(|| deviation_m.unwrap_or(DIAL_GAUGE)),
            deviation_is_estimated: deviation_m.is_some(),
            tests: tests.collect(),
        })
    }
}

/// Returns the warning that names the test that is farthest out, if noise alone hardly puts one there. Only one is named: an error of
/// one test moves the prediction of the others.
pub(super) fn outlier(statics: &StaticTests, estimate: &Estimate) -> Option<Warning> {
    let tests = statics.lines.iter().zip(&estimate.static_tests);
    let outliers = tests.filter(|(_, test)| test.is_outlier());
    // Of tests with the same chance, which may be too small to be told from 0, the farthest.
    let out = |test: &LeftOut| (-test.chance.unwrap_or(1.0), test.deviations.unwrap_or(0.0));
    let farther = |a: &LeftOut, b: &LeftOut| out(a).partial_cmp(&out(b)).unwrap_or(Ordering::Equal);
    let (line, worst) = outliers.max_by(|(_, a), (_, b)| farther(a, b))?;
    Some(Warning::StaticOutlier {
        line: *line as u64,
        deviations: worst.deviations?,
        chance: worst.chance?,
    })
}
