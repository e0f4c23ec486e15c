//! A robot found from its records, and what its user is told.

use anyhow::{Context, Result};
use fearless_simd::Level;
use flexid_core::chain::Chain;
use flexid_core::identify::{Acceptance, Estimate, Identifier, Phase};
use flexid_core::parameters::{Bounds, Bushings};
use flexid_core::spectrum::Measurement;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::records::{Record, experiment};
use crate::study::logarithms;

/// Up to this relative standard deviation a parameter is called identified.
const IDENTIFIED: f64 = 0.05;

/// What the identification is to find, and in what.
pub(crate) struct Task<'a> {
    pub(crate) chain: &'a Chain,
    pub(crate) bounds: Bounds,
    pub(crate) measurement: Measurement,
}

/// What was found.
pub(crate) struct Found {
    pub(crate) bushings: Bushings,
    /// Standard deviation of each logarithm, as reported; infinite where the data do not tell.
    pub(crate) deviations: Vec<f64>,
    /// Which parameters are called identified.
    pub(crate) identified: Vec<bool>,
    pub(crate) acceptance: Acceptance,
    /// χ² per degree of freedom.
    pub(crate) consistency: f64,
    /// Searches that it took.
    pub(crate) starts: u32,
}

/// From records to the end of the identification, as the daemon does it.
pub(crate) fn find(task: &Task, records: &[Record], random: Xoshiro256PlusPlus) -> Result<Found> {
    let Task { chain, bounds, measurement } = task;
    let experiments = records.iter().map(|record| experiment(chain, measurement, record));
    let mut experiments = experiments.collect::<Result<Vec<_>>>()?;
    let mut identifier =
        Box::new(Identifier::new((*chain).clone(), *bounds, *measurement, Level::new(), random));
    identifier.renew(&experiments);
    while identifier.step(&mut experiments) != Phase::Settled {}
    let estimate = identifier.estimate().context("a settled identifier without an estimate")?;
    Ok(Found::new(estimate, identifier.progress().starts))
}

impl Found {
    /// The verdicts are those of the reports that users read: residuals larger than the noise explains come with
    /// deviations as much larger, and what did not settle identifies nothing.
    fn new(estimate: &Estimate, starts: u32) -> Self {
        let deviations: Vec<f64> = estimate
            .standard_deviations
            .iter()
            .zip(&estimate.bushings)
            .flat_map(|(deviation, value)| {
                let all = deviation.stiffness.into_iter().chain(deviation.damping);
                all.zip(value.stiffness.into_iter().chain(value.damping)).map(|(d, v)| d / v)
            })
            .collect();
        let settled = estimate.acceptance != Acceptance::Unsettled;
        let inflation = estimate.consistency.max(1.0).sqrt();
        let identified =
            deviations.iter().map(|deviation| settled && inflation * deviation <= IDENTIFIED);
        Self {
            identified: identified.collect(),
            deviations,
            bushings: estimate.bushings.clone(),
            acceptance: estimate.acceptance,
            consistency: estimate.consistency,
            starts,
        }
    }

    /// Errors of the logarithms.
    pub(crate) fn errors(&self, truth: &Bushings) -> Vec<f64> {
        let found = logarithms(&self.bushings);
        found.iter().zip(logarithms(truth)).map(|(found, truth)| found - truth).collect()
    }
}
