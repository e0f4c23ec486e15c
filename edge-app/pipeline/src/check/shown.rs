//! What records show of the parameters: their Fisher information, before any fit.
//!
//! A parameter shows the better the more the poses differ, the more of the band is excited, and the less noise there is. The information counts all of
//! these. It is that of the records' own forces and noises, about a robot in the middle of its bounds.

use std::io;

use fearless_simd::Level;
use flexid_core::chain::Chain;
use flexid_core::parameters::Bushings;
use flexid_core::refine::{Basis, Information, Plant, Problem, Refinement};
use flexid_core::spectrum::Measurement;

use crate::config::Config;
use crate::knowledge::Knowledge;
use crate::record::Experiment;
use crate::unchecked;

/// What the records so far show.
pub(super) struct Shown<'a> {
    config: &'a Config,
    chain: Chain,
    measurement: Measurement,
    bushings: Bushings,
    known: Option<Knowledge>,
}

impl<'a> Shown<'a> {
    /// # Errors
    /// A checked config gives no error.
    pub(super) fn new(config: &'a Config) -> io::Result<Self> {
        let mut bushings = config.bounds.middle(config.sought.joints());
        config.sought.impose(&mut bushings);
        let chain = config.model.chain().map_err(unchecked)?;
        let measurement = config.measurement();
        let mut own = Self { config, chain, measurement, bushings, known: None };
        own.known = own.at_start();
        Ok(own)
    }

    /// What the static tests and the priors of the imperfections say.
    fn at_start(&self) -> Option<Knowledge> {
        let Self { config, chain, bushings, .. } = self;
        let mut plant = Box::new(Plant::new(&config.accuracies, chain));
        let problem = Problem { statics: &config.statics.tests, ..self.problem() };
        let refinement = Box::new(Refinement::new(&config.sought, bushings));
        let statics =
            Knowledge::of(&refinement.information_of_statics(&problem, &mut plant).ok()?)?;
        let mut known = Knowledge::of_priors(&statics);
        known.add(&statics);
        Some(known)
    }

    /// Adds a record. One in which a robot in the middle of its bounds has no equilibrium says nothing.
    pub(super) fn add(&mut self, experiment: &Experiment) {
        let Self { config, chain, bushings, .. } = self;
        let mut plant = Box::new(Plant::new(&config.accuracies, chain));
        let mut refinement = Box::new(Refinement::new(&config.sought, bushings));
        let problem = self.problem();
        let own = refinement
            .information_on_plant(&problem, experiment, Basis::Measured, &mut plant)
            .ok()
            .and_then(|information| Knowledge::of(&information));
        if let (Some(known), Some(own)) = (&mut self.known, own) {
            known.add(&own);
        }
    }

    /// Information about the unknowns. `None` where the static tests have no equilibrium.
    pub(super) fn information(&self) -> Option<Information> {
        let mut information = self.known.as_ref()?.of_unknowns();
        information.add(&Information::of_priors(&self.config.sought));
        Some(information)
    }

    fn problem(&self) -> Problem<'_> {
        Problem {
            chain: &self.chain,
            measurement: &self.measurement,
            bounds: &self.config.bounds,
            sought: &self.config.sought,
            statics: &[],
            level: Level::new(),
        }
    }
}
