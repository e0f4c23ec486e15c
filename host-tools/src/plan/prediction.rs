//! The precision that `flexid identify` is expected to report for the parameters.

use flexid_core::refine::Information;
use flexid_core::sought::Sought;
use flexid_core::verdict::{Trust, Verdict};
use flexid_pipeline::model::Model;
use flexid_pipeline::names::name;
use serde::Serialize;

use super::parameters::parameters;

/// Expected precision of all parameters; tied parameters count once. Standard deviations are relative to the value.
/// They are infinite (`null` in JSON) where the experiments do not determine the parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Prediction {
    /// [`super::greedy::Criterion::uncertainty`] if no parameter lies beyond its bounds.
    pub uncertainty: f64,
    /// Median of the standard deviations.
    pub median: f64,
    /// Largest standard deviation.
    pub worst: f64,
    /// Parameter with the largest standard deviation.
    pub worst_parameter: String,
    /// Parameters that will be `identified`.
    pub identified: usize,
    /// Parameters that will be `weak`.
    pub weak: usize,
    /// Parameters that will be `not_observable`.
    pub not_observable: usize,
}

impl Prediction {
    /// The prediction for a fit with the `information` of experiments and of the nuisances' priors. The bounds
    /// enter only `uncertainty`.
    pub fn new(
        model: &Model,
        sought: &Sought,
        information: &Information,
        uncertainty: f64,
    ) -> Self {
        let deviations = deviations(sought, information);
        let worst = (0..deviations.len()).max_by(|&a, &b| deviations[a].total_cmp(&deviations[b]));
        let coordinate = worst.and_then(|worst| sought.coordinate(worst));
        let mut sorted = deviations;
        sorted.sort_unstable_by(f64::total_cmp);
        // The upper median of an even number of values, so that the prediction is not too good.
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(f64::INFINITY);
        let count =
            |own: Verdict| sorted.iter().filter(|deviation| verdict(**deviation) == own).count();
        Self {
            uncertainty,
            median,
            worst: sorted.last().copied().unwrap_or(f64::INFINITY),
            worst_parameter: coordinate.map(|own| name(model, own).to_string()).unwrap_or_default(),
            identified: count(Verdict::Identified),
            weak: count(Verdict::Weak),
            not_observable: count(Verdict::NotObservable),
        }
    }
}

/// Expected relative standard deviation of each parameter, in the order of the unknowns. It is infinite (`null` in JSON) where the experiments do not
/// determine it.
pub fn deviations(sought: &Sought, information: &Information) -> Vec<f64> {
    let covariance = information.covariance();
    (0..parameters(sought)).map(|unknown| covariance.deviation(unknown)).collect()
}

/// The verdict that a parameter will have, from its relative standard deviation.
pub fn verdict(deviation: f64) -> Verdict {
    Trust::new(1.0, true).verdict(1.0, deviation).0
}
