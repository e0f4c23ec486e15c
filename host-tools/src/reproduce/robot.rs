//! A robot drawn from the bounds, and what it does: the experiments to identify it from, and those to try a fit on.

use flexid_core::chain::Chain;
use flexid_core::parameters::{Bounds, Bushing};
use flexid_core::search::MAX_EXPERIMENTS;
use flexid_edge::config::Config;
use flexid_edge::input::BadInput;
use flexid_edge::model::Model;
use nalgebra::Vector3;
use rand_core::SeedableRng as _;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::displacement::Reference;
use crate::simulation::experiment::{Cut, Response};
use crate::simulation::scenario::{Experiment, Scenario};
use crate::validation;

/// Experiments that a fit is tried on.
pub const UNSEEN: usize = 5;

/// What is known of every robot.
#[derive(Clone, Debug)]
pub struct Study {
    /// Kinematics, masses, inertias.
    pub chain: Chain,
    /// The same, with the limits of the joints.
    pub model: Model,
    /// Bounds, experiments, cutting force, noise.
    pub scenario: Scenario,
}

/// One experiment of one robot.
pub struct Trial {
    /// Joint angles, rad (m).
    pub pose: Vec<f64>,
    /// Force and motion of the reference model at the sensors' instants.
    pub response: Response,
    /// Its displacement, to be compared with.
    pub reference: Reference,
}

/// An experiment to try a fit on.
pub struct Unseen {
    /// Pose and force.
    pub cut: Cut,
    /// Of the reference model, m.
    pub displacement: Vec<Vector3<f64>>,
}

/// A robot that is to be found.
pub struct Robot {
    /// From 0.
    pub number: u64,
    /// Its bushings, base first.
    pub truth: Vec<Bushing>,
    /// The scenario's experiments.
    pub seen: Vec<Trial>,
    /// [`UNSEEN`] others, at poses drawn within the joints' limits.
    pub unseen: Vec<Unseen>,
}

impl Study {
    /// The robot and the scenario that `config` names.
    ///
    /// # Errors
    /// It names no scenario, or the scenario is wrong, or has more experiments than the search weighs.
    pub fn new(config: &Config) -> Result<Self, BadInput> {
        let bad = |message: &str| BadInput::new(&config.file, message);
        let file = config.scenario.as_deref().ok_or_else(|| {
            bad("[simulation] is missing: write [simulation] scenario = \"FILE.toml\"")
        })?;
        let scenario = Scenario::load(file, &config.model)?;
        let experiments = scenario.experiments.len();
        if experiments > MAX_EXPERIMENTS {
            let message =
                format!("{experiments} [[experiment]]s: must be at most {MAX_EXPERIMENTS}");
            return Err(BadInput::new(file, message));
        }
        let chain = config.model.chain().map_err(|error| bad(&error.to_string()))?;
        Ok(Self { chain, model: config.model.clone(), scenario })
    }

    /// Where parameters are sought.
    pub fn bounds(&self) -> &Bounds {
        &self.scenario.bounds
    }

    /// Parameters of a robot, P.
    pub fn parameters(&self) -> usize {
        12 * self.chain.joints().len()
    }

    /// Robot `number` of those that `seed` stands for, and what it does.
    pub fn draw(&self, seed: u64, number: u64) -> Robot {
        let mut rng = generator(seed, number);
        let scenario = &self.scenario;
        let truth = scenario.draw_truth(&mut rng);
        let sampling = &scenario.measurement;
        let mut cut =
            |experiment: &Experiment| Cut::new(experiment, &scenario.cutting, sampling, &mut rng);
        let trial = |cut: Cut| {
            let response = cut.response(&self.chain, &truth);
            let reference = Reference::new(&self.chain, &cut.pose, &response, sampling);
            Trial { pose: cut.pose, response, reference }
        };
        let seen = scenario.experiments.iter().map(&mut cut).map(trial).collect();
        let mut poses = generator(seed, number);
        poses.jump();
        let unseen = (0..UNSEEN).map(|_| {
            let cut = cut(&scenario.draw_experiment(&self.model, &mut poses));
            let displacement = validation::displacement(&self.chain, &truth, &cut);
            Unseen { cut, displacement }
        });
        let unseen = unseen.collect();
        Robot { number, truth, seen, unseen }
    }
}

/// Of everything random about robot `number`.
pub(super) fn generator(seed: u64, number: u64) -> Xoshiro256PlusPlus {
    // Seeded through SplitMix64, so that neighbours have nothing in common.
    Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_mul(1 << 32).wrapping_add(number))
}

/// Of any number of values; NaN of none.
pub(super) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        len => 0.5 * (sorted[(len - 1) / 2] + sorted[len / 2]),
    }
}
