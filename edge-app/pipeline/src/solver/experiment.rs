//! Makes the experiment of a record, or says why the record is of no use.

use flexid_core::chain::Chain;
use flexid_core::parameters::Bushings;
use flexid_wire::unused::RecordFault;

use crate::config::Config;
use crate::receptance::Receptance;
use crate::record::{Experiment, Record, SAMPLES};
use crate::report::{without_equilibrium, without_spectrum};

use super::Fingerprint;

/// A record that has been examined.
pub(crate) struct Candidate<'a> {
    pub(crate) record: &'a Record,
    pub(crate) fingerprint: Fingerprint,
    /// The experiment of the record, or the fault for which a fit refuses it.
    pub(crate) experiment: Result<Experiment, RecordFault>,
    /// Ratio of its acceleration to that of the model's masses. `None` of a record that is refused, or that repeats another one.
    pub(crate) ratio: Option<f64>,
}

/// Makes the experiment of a record. `chain` is that of the config's model, `stiffest` the robot at the upper ends of its bounds.
/// `buffer` is overwritten.
///
/// # Errors
/// The record is of no use: this robot has no equilibrium at its pose, or the record has no spectrum.
pub(crate) fn experiment(
    config: &Config,
    chain: &Chain,
    stiffest: &Bushings,
    record: &Record,
    buffer: &mut [f32; SAMPLES],
) -> Result<Experiment, RecordFault> {
    if let Err(error) = chain.linearise(&record.pose, config.gravity.into(), stiffest) {
        return Err(without_equilibrium(error, &config.model, &record.pose));
    }
    Experiment::new(chain, &config.measurement(), record, buffer).map_err(without_spectrum)
}

/// Makes the experiment of a measured receptance, like [`experiment`].
///
/// # Errors
/// The robot has no equilibrium at its pose, or the band holds too few or too many bins.
pub(crate) fn of_receptance(
    config: &Config,
    chain: &Chain,
    stiffest: &Bushings,
    receptance: &Receptance,
) -> Result<Experiment, RecordFault> {
    if let Err(error) = chain.linearise(&receptance.pose, config.gravity.into(), stiffest) {
        return Err(without_equilibrium(error, &config.model, &receptance.pose));
    }
    Experiment::of_receptance(chain, &config.measurement(), &receptance.measured())
        .map_err(without_spectrum)
}
