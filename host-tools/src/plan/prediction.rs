//! How well the parameters will be known: what `flexid identify` can be expected to report.

use flexid_core::refine::Information;
use flexid_core::unknowns::Sought;
use flexid_core::verdict::{Trust, Verdict};
use flexid_edge::model::Model;
use flexid_edge::pipeline::name;
use serde::Serialize;

use super::parameters;

/// Of all parameters, those that are tied counted once. Standard deviations are relative to the value, and infinite (`null` in JSON) where the
/// experiments do not tell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Prediction {
    /// [`super::greedy::Criterion::uncertainty`] where no parameter lies beyond its bounds.
    pub uncertainty: f64,
    /// Median of the standard deviations.
    pub median: f64,
    /// The largest of them.
    pub worst: f64,
    /// Whose that is.
    pub worst_parameter: String,
    /// Parameters that will be `identified`.
    pub identified: usize,
    /// Parameters that will be `weak`.
    pub weak: usize,
    /// Parameters that will be `not_observable`.
    pub not_observable: usize,
}

impl Prediction {
    /// From what a fit will be `told`: by experiments, and by the nuisances' priors. The bounds have no part in it but in
    /// `uncertainty`.
    pub fn new(model: &Model, sought: &Sought, told: &Information, uncertainty: f64) -> Self {
        let covariance = told.covariance();
        let deviations: Vec<f64> =
            (0..parameters(sought)).map(|unknown| covariance.deviation(unknown)).collect();
        let worst = (0..deviations.len()).max_by(|&a, &b| deviations[a].total_cmp(&deviations[b]));
        let coordinate = worst.and_then(|worst| sought.coordinate(worst));
        let mut sorted = deviations;
        sorted.sort_unstable_by(f64::total_cmp);
        // Of an even number the upper: never better than it is.
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(f64::INFINITY);
        let trust = Trust::new(1.0, true);
        let count = |verdict: Verdict| {
            sorted.iter().filter(|deviation| trust.verdict(1.0, **deviation).0 == verdict).count()
        };
        Self {
            uncertainty,
            median,
            worst: sorted.last().copied().unwrap_or(f64::INFINITY),
            worst_parameter: coordinate.map(|own| name(model, own)).unwrap_or_default(),
            identified: count(Verdict::Identified),
            weak: count(Verdict::Weak),
            not_observable: count(Verdict::NotObservable),
        }
    }
}
