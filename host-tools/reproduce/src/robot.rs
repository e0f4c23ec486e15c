//! A robot drawn from the bounds, the experiments to identify it from, and those to test a fit on.

use std::path::PathBuf;

use flexid_core::chain::Chain;
use flexid_core::chain::linearise::LinearisationError;
use flexid_core::parameters::{Bounds, Bushing};
use flexid_core::search::MAX_EXPERIMENTS;
use flexid_pipeline::config::Config;
use flexid_pipeline::input::BadInput;
use flexid_pipeline::model::Model;
use flexid_simulation::experiment::{Cut, Response};
use flexid_simulation::scenario::{Experiment, Scenario};
use rand_core::{Rng as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::displacement::Reference;

/// Number of experiments of a robot on which fits are tested.
pub const UNSEEN: usize = 5;

/// The data that all robots share.
#[derive(Clone, Debug)]
pub struct Study {
    /// File of the scenario.
    pub file: PathBuf,
    /// True if the scenario is the reference scenario.
    pub is_reference: bool,
    /// Kinematics, masses, inertias.
    pub chain: Chain,
    /// The chain with the limits of the joints.
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
    /// Displacement of the reference model, for comparison.
    pub reference: Reference,
}

/// An experiment to test a fit on.
pub struct Unseen {
    /// Pose and force.
    pub cut: Cut,
    /// Force and motion of the reference model at the sensors' instants.
    pub response: Response,
}

/// A robot to be found.
pub struct Robot {
    /// Number of the robot, from 0.
    pub number: u64,
    /// True bushings, base first.
    pub truth: Vec<Bushing>,
    /// The scenario's experiments.
    pub seen: Vec<Trial>,
    /// Other experiments, at poses drawn within the joints' limits.
    pub unseen: Vec<Unseen>,
}

impl Study {
    /// The robot and the scenario that `config` names; `is_reference` is true for those that come with flexid.
    ///
    /// # Errors
    /// `config` names no scenario, or the scenario is wrong, or has more experiments than the search weighs.
    pub fn new(config: &Config, is_reference: bool) -> Result<Self, BadInput> {
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
        Ok(Self {
            file: file.to_owned(),
            is_reference,
            chain,
            model: config.model.clone(),
            scenario,
        })
    }

    /// Bounds in which parameters are sought.
    pub fn bounds(&self) -> &Bounds {
        &self.scenario.bounds
    }

    /// Number of parameters of a robot, P.
    pub fn parameters(&self) -> usize {
        12 * self.chain.joints().len()
    }

    /// Draws robot `number` of the series of `seed`, with its experiments, of which `unseen` are unseen.
    ///
    /// # Errors
    /// The robot does not withstand the cutting force.
    pub fn draw(&self, seed: u64, number: u64, unseen: usize) -> Result<Robot, BadInput> {
        let mut rng = generator(seed, number, Purpose::Robot);
        let scenario = &self.scenario;
        let truth = scenario.draw_truth(&mut rng);
        let sampling = &scenario.measurement;
        let mut cut =
            |experiment: &Experiment| Cut::new(experiment, &scenario.cutting, sampling, &mut rng);
        let trial = |cut: Cut| {
            let response = cut.response(&self.chain, &truth);
            let reference = Reference::new(&self.chain, &cut.pose, &response, sampling)?;
            Ok(Trial { pose: cut.pose, response, reference })
        };
        let seen: Result<Vec<_>, LinearisationError> =
            scenario.experiments.iter().map(&mut cut).map(trial).collect();
        let seen = seen.map_err(|error| BadInput::new(&self.file, error))?;
        let mut poses = generator(seed, number, Purpose::Poses);
        let unseen = (0..unseen).map(|_| {
            let cut = cut(&scenario.draw_experiment(&self.model, &mut poses));
            let response = cut.response(&self.chain, &truth);
            Unseen { cut, response }
        });
        let robot = Robot { number, unseen: unseen.collect(), seen, truth };
        if robot.stands() {
            Ok(robot)
        } else {
            let message =
                "a robot drawn from [bounds] gives way altogether: stiffer bounds, or less [force]";
            Err(BadInput::new(&self.file, message))
        }
    }
}

impl Robot {
    /// Returns whether the robot has withstood all of its experiments.
    fn stands(&self) -> bool {
        let seen = self.seen.iter().map(|trial| &trial.response);
        let unseen = self.unseen.iter().map(|unseen| &unseen.response);
        seen.chain(unseen).all(Response::is_finite)
    }
}

/// Purpose of random numbers. Each purpose has its own numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// Truth and cuts.
    Robot,
    /// Poses of the unseen experiments.
    Poses,
    /// The random search: the same numbers for every variant, so that robots make pairs.
    Search,
    /// A rival.
    Rival,
    /// The samples of the global sensitivity analysis.
    Analysis,
    /// The noise of flexid's sensors, and its own search.
    Flexid,
    /// Fig. 3.
    Illustration,
}

/// The generator for one purpose and one robot of the series of `seed`. It has nothing in common with any other.
pub(super) fn generator(seed: u64, number: u64, purpose: Purpose) -> Xoshiro256PlusPlus {
    let hash = |word: u64, next: u64| Xoshiro256PlusPlus::seed_from_u64(word).next_u64() ^ next;
    Xoshiro256PlusPlus::seed_from_u64(hash(hash(seed, number), purpose as u64))
}

/// Median of any number of values; NaN of none.
pub(super) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        len => 0.5 * (sorted[(len - 1) / 2] + sorted[len / 2]),
    }
}

#[cfg(test)]
mod tests {
    use crate::reference::{mill3, model};

    use super::*;

    #[test]
    fn a_robot_that_gives_way_is_an_error() {
        let (mut scenario, chain) = mill3();
        scenario.bounds = Bounds::new([1e7, 2e8], [1.0, 2.0], [1e3, 1e5], [1.0, 2.0]).unwrap();
        scenario.cutting.peak_tangential_n = 1e5;
        let (file, is_reference) = (PathBuf::from("s.toml"), false);
        let study = Study { file, is_reference, chain, model: model(), scenario };
        let Err(error) = study.draw(1, 0, UNSEEN) else { panic!("it stands") };
        assert!(error.to_string().starts_with("s.toml: a robot drawn from [bounds] gives way"));
    }

    #[test]
    fn nothing_random_has_anything_in_common() {
        let purposes = [Purpose::Robot, Purpose::Search, Purpose::Rival, Purpose::Flexid];
        let mut firsts = Vec::new();
        for seed in [0, 1, 1 << 32] {
            for number in [0, 1, 2] {
                firsts.extend(purposes.map(|purpose| generator(seed, number, purpose).next_u64()));
            }
        }
        let count = firsts.len();
        firsts.sort_unstable();
        firsts.dedup();
        assert_eq!(firsts.len(), count);
        let again = || generator(5, 6, Purpose::Rival).next_u64();
        assert_eq!(again(), again());
    }
}
