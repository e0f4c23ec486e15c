//! One run of the scenario: a robot mills, sensors with noise record it, and it is identified.

use anyhow::Result;
use flexid::simulation::experiment::Cut;
use nalgebra::DMatrix;

use crate::bound::{distance, information};
use crate::find::{Found, Task, find};
use crate::linear::motion;
use crate::records::{SAMPLES, Sensors, Signals};
use crate::study::{Purpose, Study, random};

/// What was found, and how far off it is.
pub(crate) struct Run {
    pub(crate) found: Found,
    /// Errors of the logarithms.
    pub(crate) errors: Vec<f64>,
    /// What the records tell at most.
    pub(crate) information: DMatrix<f64>,
}

impl Run {
    /// Robot `number` in its share of the `cuts`.
    pub(crate) fn new(study: &Study, task: &Task, cuts: &[Vec<Cut>], number: u64) -> Result<Self> {
        let truth = study.robot(number);
        let mut sensors = Sensors::new(study, random(Purpose::Noise, number))?;
        let (mut records, mut told) = (Vec::new(), Vec::new());
        for cut in &cuts[number as usize % cuts.len()] {
            let motion = motion(&study.chain, &truth, cut);
            records.push(sensors.measure(&Signals::new(&cut.pose, &motion))?);
            told.push(information(study, &study.chain, &truth, cut, &motion, 0..SAMPLES)?);
        }
        let found = find(task, &records, random(Purpose::Search, number).0)?;
        Ok(Self { errors: found.errors(&truth), found, information: told.into_iter().sum() })
    }

    /// Errors of all parameters together, over what the bound makes of them: 1 in the mean square.
    pub(crate) fn distance(&self) -> f64 {
        distance(&self.information, &self.errors)
    }
}
