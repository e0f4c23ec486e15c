//! How well the parameters will be known: what `flexid identify` can be expected to report.

use flexid_core::refine::Information;
use flexid_core::unknowns::{Coordinate, Sought};
use flexid_core::verdict::{Trust, Verdict};
use flexid_edge::config::Config;
use serde::Serialize;

use crate::table::DOF_NAMES;

/// Of all parameters. Standard deviations are relative to the value, and infinite (`null` in JSON) where the
/// experiments do not tell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Prediction {
    /// [`super::greedy::Criterion::uncertainty`], the bounds taken into account.
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
    /// From what experiments `told`; the bounds have no part in it but in `uncertainty`.
    pub fn new(config: &Config, sought: &Sought, told: &Information, uncertainty: f64) -> Self {
        let covariance = told.covariance();
        let parameters: Vec<(f64, Coordinate)> = (0..sought.unknowns())
            .filter_map(|unknown| {
                Some((covariance.deviation(unknown), sought.coordinate(unknown)?))
            })
            .filter(|(_, coordinate)| name(config, *coordinate).is_some())
            .collect();
        let mut sorted: Vec<f64> = parameters.iter().map(|(deviation, _)| *deviation).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        // Of an even number the upper: never better than it is.
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(f64::INFINITY);
        let worst = parameters.iter().max_by(|a, b| a.0.total_cmp(&b.0));
        let trust = Trust::new(1.0, true);
        let count = |verdict: Verdict| {
            sorted.iter().filter(|deviation| trust.verdict(1.0, **deviation).0 == verdict).count()
        };
        Self {
            uncertainty,
            median,
            worst: worst.map_or(f64::INFINITY, |(deviation, _)| *deviation),
            worst_parameter: worst.and_then(|(_, own)| name(config, *own)).unwrap_or_default(),
            identified: count(Verdict::Identified),
            weak: count(Verdict::Weak),
            not_observable: count(Verdict::NotObservable),
        }
    }
}

/// In words; none of what is no parameter of a joint.
fn name(config: &Config, coordinate: Coordinate) -> Option<String> {
    let (joint, kind, dof) = match coordinate {
        Coordinate::Stiffness { joint, dof } => (joint, "stiffness", dof),
        Coordinate::Damping { joint, dof } => (joint, "damping", dof),
        _ => return None,
    };
    Some(format!("{} {kind} {}", config.model.joints.get(joint)?.name, DOF_NAMES[dof]))
}
