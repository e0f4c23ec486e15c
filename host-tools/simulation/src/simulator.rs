//! The simulator, which does one experiment after the other like a robot.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use flexid_core::chain::Chain;
use flexid_core::mounting::Mounting;
use flexid_core::parameters::Bushing;
use flexid_core::sensors::Accelerometer;
use flexid_pipeline::config::Config;
use flexid_pipeline::input::BadInput;
use flexid_pipeline::model::Model;
use flexid_pipeline::signals::SignalTable;
use nalgebra::Vector3;
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::experiment::{Cut, Response};
use super::force;
use super::plant::motion::{Surroundings, Work};
use super::plant::{Joints, Plant};
use super::plausible;
use super::scenario::{Experiment, Scenario};
use super::transmission::{self, Quality, Transmission};
use super::true_robot::TrueRobot;

/// Which robot is simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Truth {
    /// The robot of the scenario file.
    Nominal,
    /// A robot drawn with this seed: uniformly from the scenario's bounds, plausibly where it states none.
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

/// Peak of a blow, N, and its width, s: a hammer of a kilogramme with a soft tip, whose force has half of its spectrum left at 200 Hz.
pub const BLOW: (f64, f64) = (500.0, 4e-3);

/// The robot, its work and its sensors.
#[derive(Clone, Debug)]
pub struct Simulator {
    /// File of the scenario.
    file: PathBuf,
    chain: Chain,
    scenario: Scenario,
    truth: Vec<Bushing>,
    /// Gravity, base axes, m/s².
    gravity: Vector3<f64>,
    accelerometer: Accelerometer,
    mounting: Mounting,
    signals: SignalTable,
    quality: Quality,
    /// Errors of the plant; `None` for a perfect one.
    plant: Option<Plant>,
    /// Cuts done so far.
    cuts: u64,
    rng: Xoshiro256PlusPlus,
}

impl Simulator {
    /// The robot and the scenario that `config` names.
    ///
    /// # Errors
    /// The config names no scenario, or the scenario is wrong.
    pub fn new(
        config: &Config,
        truth: Truth,
        quality: Quality,
        seed: u64,
    ) -> Result<Self, BadInput> {
        Self::of(config, Scenario::of(config)?, truth, quality, seed)
    }

    /// The robot that `config` names, in this scenario of it.
    ///
    /// # Errors
    /// The model has no chain.
    pub fn of(
        config: &Config,
        scenario: Scenario,
        truth: Truth,
        quality: Quality,
        seed: u64,
    ) -> Result<Self, BadInput> {
        let chain = config.model.chain().map_err(|error| BadInput::new(&config.file, error))?;
        let truth = match truth {
            Truth::Nominal => scenario.truth.clone(),
            Truth::Drawn(seed) => {
                let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
                plausible::of(&scenario, &config.model, &chain, &mut rng)
            }
        };
        let rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        Ok(Self {
            file: config.scenario.clone().unwrap_or_else(|| config.file.clone()),
            chain,
            scenario,
            truth,
            gravity: config.gravity.into(),
            accelerometer: config.accelerometer,
            mounting: config.mounting,
            signals: config.signals.clone(),
            quality,
            plant: None,
            cuts: 0,
            rng,
        })
    }

    /// The robot with everything off that the plant file holds.
    ///
    /// # Errors
    /// The file is wrong, or the robot cannot have this plant. The error is one line that names the file, the place, and the right
    /// input.
    pub fn with_plant(self, file: &Path, model: &Model) -> Result<Self, BadInput> {
        let plant = Plant::load(file, model)?;
        let feeds = self.scenario.experiments.iter().any(|one| one.course.is_some());
        let checked = plant.check_bushings(&self.truth).and_then(|()| plant.check_path(feeds));
        checked.map_err(|error| BadInput::new(file, error))?;
        Ok(Self { plant: Some(plant), ..self })
    }

    /// Does one experiment. It calls `tell` with the share that is simulated, 0 to 1, again and again.
    ///
    /// # Errors
    /// The robot gives way, or a signal of the frame layout cannot be written.
    pub fn perform(
        &mut self,
        experiment: &Experiment,
        tell: impl Fn(f64),
    ) -> Result<Transmission, BadInput> {
        let Scenario { cutting, measurement, .. } = &self.scenario;
        let cut = Cut {
            gravity: self.gravity,
            accelerometer: self.accelerometer,
            mounting: self.mounting,
            ..Cut::new(experiment, cutting, measurement, &mut self.rng)
        };
        let sampling = experiment.sampling(measurement);
        let spindle = force::spindle(experiment, &sampling);
        let mut quality = self.quality;
        if self.plant.is_some() {
            // The plant's sensors have added all noise.
            quality.noise = 0.0;
        }
        let response = self.respond(&experiment.name, &cut, spindle, tell)?;
        let robot = self.plant.as_ref().map(|plant| &plant.robot);
        let feed = robot.map_or(&[][..], |robot| &robot.feed_rad_per_s);
        let late_s = robot.map_or(0.0, |robot| robot.joint_delay_s);
        let pose = |seconds: f64| {
            let seconds = (seconds - late_s).max(0.0);
            let rates = feed.iter().chain(std::iter::repeat(&0.0));
            cut.angles(seconds)
                .iter()
                .zip(rates)
                .map(|(angle, rate)| angle + seconds * rate)
                .collect()
        };
        let rng = &mut self.rng;
        transmission::transmit(&response, pose, &sampling, quality, &self.signals, rng)
            .map_err(|error| BadInput::new(&self.file, format!("cannot be sent: {error}")))
    }

    /// Strikes the tool at the TCP once with a hammer, along a direction in the TCP's axes. Returns the readings with their noise. It calls `tell` with
    /// the share that is simulated, 0 to 1, again and again.
    ///
    /// # Errors
    /// The robot gives way.
    pub fn strike(
        &mut self,
        name: &str,
        pose: &[f64],
        direction: &Vector3<f64>,
        tell: impl Fn(f64),
    ) -> Result<Response, BadInput> {
        let measurement = &self.scenario.measurement;
        let cut = Cut {
            pose: pose.to_vec(),
            course: None,
            gravity: self.gravity,
            accelerometer: self.accelerometer,
            mounting: self.mounting,
            rate_hz: measurement.rate_hz,
            force: force::blow(direction, BLOW.0, BLOW.1, measurement),
        };
        let spindle = vec![0.0; measurement.samples()];
        let mut response = self.respond(name, &cut, spindle, tell)?;
        if self.plant.is_none() {
            let [force, acceleration] = self.noises();
            transmission::add_noise(&mut response.force, force, &mut self.rng);
            transmission::add_noise(&mut response.acceleration, acceleration, &mut self.rng);
        }
        Ok(response)
    }

    /// Standard deviations of force, N, and acceleration, m/s².
    fn noises(&self) -> [f64; 2] {
        let measurement = &self.scenario.measurement;
        [measurement.force_noise(), measurement.acceleration_noise()]
            .map(|noise| self.quality.noise * noise)
    }

    /// Readings of a cut: those of a plant with noise.
    fn respond(
        &mut self,
        name: &str,
        cut: &Cut,
        spindle: Vec<f64>,
        tell: impl Fn(f64),
    ) -> Result<Response, BadInput> {
        let [force_noise, acceleration_noise] = self.noises();
        let response = match &self.plant {
            None => Some(cut.response_telling(&self.chain, &self.truth, tell))
                .filter(Response::is_finite),
            Some(plant) => {
                let surroundings = Surroundings { force_noise, acceleration_noise, spindle };
                let (model, bushings, number) = (&self.chain, &self.truth[..], self.cuts);
                let work = Work { cut, model, bushings, number };
                plant.readings(work, &surroundings, &mut self.rng, tell)
            }
        };
        self.cuts += 1;
        response.ok_or_else(|| {
            let message = format!(
                "the robot gives way in {name:?}: make [[truth]], or [bounds], stiffer, or the plant milder"
            );
            BadInput::new(&self.file, message)
        })
    }

    /// The robot's true bushings, base first.
    pub fn truth(&self) -> &[Bushing] {
        &self.truth
    }

    /// Deviations of its joints from springs and dampers.
    pub fn joints(&self) -> Joints {
        self.plant.as_ref().map_or_else(Joints::default, |plant| plant.joints)
    }

    /// The robot that moves, apart from its bushings. `None` of a plant, which no model describes exactly.
    pub fn robot(&self, model: &Model) -> Option<TrueRobot> {
        self.plant.is_none().then(|| TrueRobot::new(model, self.gravity.into()))
    }

    /// The scenario of the robot.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }
}
