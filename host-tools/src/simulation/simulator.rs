//! Experiment after experiment, as a robot would do them.

use std::str::FromStr;

use flexid_core::chain::Chain;
use flexid_core::parameters::Bushing;
use flexid_edge::config::{Accelerometer, Config};
use flexid_edge::input::BadInput;
use flexid_edge::signals::SignalTable;
use flexid_wire::signal::SignalError;
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::experiment::Cut;
use super::scenario::{Experiment, Scenario};
use super::sensor::{self, Quality, Transmission};

/// Which robot is simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Truth {
    /// That of the scenario file.
    Nominal,
    /// Drawn uniformly from the scenario's bounds with this seed.
    Drawn(u64),
}

impl FromStr for Truth {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "write nominal, or drawn:SEED such as drawn:7".to_owned();
        match text.split_once(':') {
            None if text == "nominal" => Ok(Self::Nominal),
            Some(("drawn", seed)) => seed.parse().map(Self::Drawn).map_err(|_| wrong()),
            _ => Err(wrong()),
        }
    }
}

/// The robot, its work and its sensors.
#[derive(Clone, Debug)]
pub struct Simulator {
    chain: Chain,
    scenario: Scenario,
    truth: Vec<Bushing>,
    signals: SignalTable,
    quality: Quality,
    rng: Xoshiro256PlusPlus,
}

impl Simulator {
    /// The robot and the scenario that `config` names.
    ///
    /// # Errors
    /// The config names no scenario, or asks for what the simulator does not have, or the scenario is wrong.
    pub fn new(
        config: &Config,
        truth: Truth,
        quality: Quality,
        seed: u64,
    ) -> Result<Self, BadInput> {
        let bad = |message: &str| BadInput::new(&config.file, message);
        let file = config.scenario.as_deref().ok_or_else(|| {
            bad("[simulation] is missing: write [simulation] scenario = \"FILE.toml\"")
        })?;
        if config.gravity != [0.0; 3] {
            return Err(bad("[model] gravity_m_per_s2: the simulated robot knows no gravity: \
                            write [0.0, 0.0, 0.0]"));
        }
        if config.accelerometer != Accelerometer::Inertial {
            return Err(bad(
                "[measurement] accelerometer: the simulated one is \"inertial\": write that",
            ));
        }
        let scenario = Scenario::load(file, &config.model)?;
        if scenario.measurement.rate_hz != config.rate_hz {
            return Err(bad(&format!(
                "[measurement] rate_hz is {}, but {} has {}: make them equal",
                config.rate_hz,
                file.display(),
                scenario.measurement.rate_hz
            )));
        }
        let chain = config.model.chain().map_err(|error| BadInput::new(&config.file, error))?;
        let truth = match truth {
            Truth::Nominal => scenario.truth.clone(),
            Truth::Drawn(seed) => scenario.draw_truth(&mut Xoshiro256PlusPlus::seed_from_u64(seed)),
        };
        let rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        Ok(Self { chain, scenario, truth, signals: config.signals.clone(), quality, rng })
    }

    /// Does one experiment.
    ///
    /// # Errors
    /// A signal of the frame layout cannot be written.
    pub fn perform(&mut self, experiment: &Experiment) -> Result<Transmission, SignalError> {
        let Scenario { cutting, measurement, .. } = &self.scenario;
        let cut = Cut::new(experiment, cutting, measurement, &mut self.rng);
        let response = cut.response(&self.chain, &self.truth);
        let rng = &mut self.rng;
        sensor::transmit(&response, &cut.pose, measurement, self.quality, &self.signals, rng)
    }

    /// The robot's true bushings, base first.
    pub fn truth(&self) -> &[Bushing] {
        &self.truth
    }

    /// What it does.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }
}
