//! One run of the scenario: a robot mills, sensors with noise record it, and it is identified.

use anyhow::Result;
use flexid_simulation::experiment::Cut;
use nalgebra::DMatrix;

use crate::bound::{distance, information};
use crate::find::{Found, Task, find};
use crate::linear::motion;
use crate::records::{SAMPLES, Sensors, Signals};
use crate::study::{Purpose, Study, random};

/// The result of a run, and its errors.
pub(crate) struct Run {
    pub(crate) found: Found,
    /// Errors of the logarithms.
    pub(crate) errors: Vec<f64>,
    /// Information of the records, the most that a fit can have.
    pub(crate) information: DMatrix<f64>,
}

impl Run {
    /// Runs robot `number` with its share of the `cuts`.
    pub(crate) fn new(study: &Study, task: &Task, cuts: &[Vec<Cut>], number: u64) -> Result<Self> {
        let truth = study.robot(number);
        let mut sensors = Sensors::new(study, random(Purpose::Noise, number))?;
        let (mut records, mut informations) = (Vec::new(), Vec::new());
        for cut in &cuts[number as usize % cuts.len()] {
            let motion = motion(&study.chain, &truth, cut);
            records.push(sensors.measure(&Signals::new(&cut.pose, &motion))?);
            informations.push(information(study, &study.chain, &truth, cut, &motion, 0..SAMPLES)?);
        }
        let found = find(task, &records, random(Purpose::Search, number).0)?;
        Ok(Self {
            errors: found.errors(&truth),
            found,
            information: informations.into_iter().sum(),
        })
    }

    /// Error of all parameters together, over that of the bound; its mean square is 1.
    pub(crate) fn distance(&self) -> f64 {
        distance(&self.information, &self.errors)
    }
}
