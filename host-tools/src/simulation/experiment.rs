//! One cut, from rest: what happens at the TCP, at the instants that the sensors sample.

use flexid_core::chain::Chain;
use flexid_core::parameters::Bushing;
use nalgebra::Vector3;
use rand_core::Rng;

use super::force::{self, OVERSAMPLING};
use super::plant::{EquationOfMotion, Plant};
use super::scenario::{Cutting, Experiment, Sampling};

/// Force and motion at the sensors' instants, TCP axes, without noise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Response {
    /// N.
    pub force: Vec<Vector3<f64>>,
    /// m.
    pub displacement: Vec<Vector3<f64>>,
    /// m/s².
    pub acceleration: Vec<Vector3<f64>>,
}

/// A cut to be done to one or more robots: the same force for each.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// Joint angles, rad (m).
    pub pose: Vec<f64>,
    /// Samples of the sensors per second.
    pub rate_hz: f64,
    /// On the robot, N, TCP axes, [`OVERSAMPLING`] values a sample.
    pub force: Vec<Vector3<f64>>,
}

impl Cut {
    /// The cut of `experiment`, its roughness drawn from `rng`.
    pub fn new(
        experiment: &Experiment,
        cutting: &Cutting,
        sampling: &Sampling,
        rng: &mut impl Rng,
    ) -> Self {
        Self {
            pose: experiment.pose.clone(),
            rate_hz: sampling.rate_hz,
            force: force::milling(cutting, experiment, sampling, rng),
        }
    }

    /// What it does to a robot with one of `bushings` a joint.
    pub fn response(&self, chain: &Chain, bushings: &[Bushing]) -> Response {
        let motion = EquationOfMotion::new(chain, &self.pose, bushings);
        let step = 1.0 / (self.rate_hz * OVERSAMPLING as f64);
        // A chain's masses are positive: there always is a plant.
        let Some(mut plant) = Plant::new(&motion, step) else { return Response::default() };
        let mut response = Response::default();
        for (index, &force) in self.force.iter().enumerate() {
            plant.advance(force);
            if index % OVERSAMPLING == 0 {
                let motion = plant.motion();
                response.force.push(force);
                response.displacement.push(motion.displacement);
                response.acceleration.push(motion.acceleration);
            }
        }
        response
    }
}
