//! What records show of the parameters: their Fisher information, before any fit.
//!
//! A parameter shows the better the more the poses differ, the more of the band is excited, and the less noise there is. The information counts all of
//! these. It is that of the records' own forces and noises, about a robot that is assumed.

use std::io;

use flexid_core::chain::Chain;
use flexid_core::parameters::Bushings;
use flexid_core::refine::{Basis, Information};

use crate::config::Config;
use crate::knowledge::{Assumed, Knowledge};
use crate::record::Experiment;
use crate::unchecked;

/// What the records so far show.
pub(super) struct Shown<'a> {
    config: &'a Config,
    chain: Chain,
    bushings: Bushings,
    /// What the records say.
    pub(super) records: Option<Knowledge>,
}

impl<'a> Shown<'a> {
    /// Of a robot with these bushings, base first.
    ///
    /// # Errors
    /// A checked config gives no error.
    pub(super) fn new(config: &'a Config, bushings: Bushings) -> io::Result<Self> {
        let chain = config.model.chain().map_err(unchecked)?;
        Ok(Self { config, chain, bushings, records: None })
    }

    /// Adds a record. One in which the robot has no equilibrium says nothing.
    pub(super) fn add(&mut self, experiment: &Experiment) {
        let Some(own) = self.assumed().of_experiment(experiment, Basis::Measured) else { return };
        match &mut self.records {
            Some(records) => records.add(&own),
            None => self.records = Some(own),
        }
    }

    /// Information about the unknowns, with that of the static tests and of the priors of the imperfections. `None` where the static tests have no
    /// equilibrium.
    pub(super) fn information(&self) -> Option<Information> {
        let assumed = self.assumed();
        let mut known = assumed.of_statics(&self.config.statics.tests)?;
        known.add(&assumed.priors());
        self.records.iter().for_each(|records| known.add(records));
        let mut information = known.of_unknowns();
        information.add(&Information::of_priors(&self.config.sought));
        Some(information)
    }

    fn assumed(&self) -> Assumed<'_> {
        let Self { config, chain, bushings, .. } = self;
        Assumed { config, sought: &config.sought, chain, bushings }
    }
}
