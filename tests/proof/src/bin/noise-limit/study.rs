//! A scenario, from which a part draws its robots and cuts. That of most parts is the reference scenario.

use std::ops::Range;
use std::path::Path;

use anyhow::{Context, Result};
use flexid_core::DOF_NAMES;
use flexid_core::chain::Chain;
use flexid_core::parameters::Bushings;
use flexid_core::spectrum::Measurement;
use flexid_pipeline::config::Config;
use flexid_simulation::experiment::Cut;
use flexid_simulation::scenario::{Experiment, Sampling, Scenario};
use rayon::prelude::*;

use crate::common::Random;
use crate::find::Task;
use crate::records::SAMPLES;

/// Number of cuts that differ in their roughness alone. Robots share them in turn, since making one takes longer than
/// an identification.
const DRAWS: u64 = 8;

/// Samples of a record in the middle of a long cut, without the start and the end of the cut.
pub(crate) const NO_QUIET: Range<usize> = 1434..1434 + SAMPLES;

/// The data that all robots share.
pub(crate) struct Study {
    pub(crate) config: Config,
    pub(crate) chain: Chain,
    pub(crate) scenario: Scenario,
    pub(crate) measurement: Measurement,
    /// Number of the first robot on a drawn plant.
    pub(crate) first: u64,
    robots: Robots,
    /// Number of the scenario's experiments that a robot has.
    experiments: usize,
}

/// The source of drawn robots.
#[derive(Clone, Copy)]
enum Robots {
    /// Uniform within the scenario's bounds.
    WithinBounds,
    /// About the scenario's robot: each parameter times a factor, uniform on the logarithmic scale from its inverse to this one.
    AboutTruth(f64),
}

/// The purpose of a random generator. No two purposes share their numbers.
#[derive(Clone, Copy)]
pub(crate) enum Purpose {
    Robot,
    Cut,
    Noise,
    Search,
    Draw,
    Plant,
}

impl Study {
    /// The study whose drawn plants begin with this robot.
    pub(crate) fn beginning_at(self, first: u64) -> Self {
        Self { first, ..self }
    }

    /// The scenario of six joints, whose drawn plants begin with the same robot.
    pub(crate) fn of_six(&self) -> Result<Self> {
        Ok(Self::of_six_joints()?.beginning_at(self.first))
    }

    /// The reference scenario, of three joints.
    pub(crate) fn load() -> Result<Self> {
        Self::of("mill3-edge.toml", Robots::WithinBounds, 3)
    }

    /// The scenario of six joints, whose bounds follow from the masses: six decades of stiffness, of which most no robot has. The first
    /// three experiments suffice.
    pub(crate) fn of_six_joints() -> Result<Self> {
        Self::of("mill6-edge.toml", Robots::AboutTruth(2.0), 3)
    }

    fn of(edge: &str, robots: Robots, experiments: usize) -> Result<Self> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-tools/scenario");
        let config = Config::load(&folder.join(edge))?;
        let file =
            config.scenario.as_deref().with_context(|| format!("{edge} names no scenario"))?;
        let scenario = Scenario::load(file, &config.model)?;
        let (chain, measurement) = (config.model.chain()?, config.measurement());
        Ok(Self { config, chain, scenario, measurement, first: 0, robots, experiments })
    }

    /// The task to find a robot's bushings, and nothing else.
    pub(crate) fn task(&self) -> Task<'_> {
        Task {
            chain: &self.chain,
            bounds: self.scenario.bounds,
            measurement: self.measurement,
            sought: &[],
            statics: Vec::new(),
        }
    }

    /// Robot `number`.
    pub(crate) fn robot(&self, number: u64) -> Bushings {
        let mut random = random(Purpose::Robot, number);
        let Robots::AboutTruth(factor) = self.robots else {
            return self.scenario.draw_truth(&mut random.0).into_iter().collect();
        };
        let mut robot: Bushings = self.scenario.truth.iter().cloned().collect();
        for bushing in &mut robot {
            for value in bushing.stiffness.iter_mut().chain(&mut bushing.damping) {
                *value *= factor.powf(random.uniform(-1.0, 1.0));
            }
        }
        robot
    }

    /// The scenario's experiments, with eight roughnesses.
    pub(crate) fn cuts(&self) -> Vec<Vec<Cut>> {
        self.draw_cuts(1, self.scenario.measurement, Experiment::clone)
    }

    /// Experiments of twice the duration, from which [`NO_QUIET`] cuts the records. In these records the spindle
    /// speeds up as in the scenario's.
    pub(crate) fn long_cuts(&self) -> Vec<Vec<Cut>> {
        let measurement = self.scenario.measurement;
        let twice = Sampling { duration_s: 2.0 * measurement.duration_s, ..measurement };
        // The cut lasts one and a half records. A twentieth of it has passed when the record starts.
        self.draw_cuts(0, twice, |experiment| {
            let [first, last] = experiment.spindle_rpm;
            let gain = 1.5 * (last - first);
            let start = first - 0.05 * gain;
            Experiment { spindle_rpm: [start, start + gain], ..experiment.clone() }
        })
    }

    fn draw_cuts(
        &self,
        which: u64,
        sampling: Sampling,
        experiment: impl Fn(&Experiment) -> Experiment + Sync,
    ) -> Vec<Vec<Cut>> {
        let draw = |number| {
            let mut random = random(Purpose::Cut, 2 * number + which);
            let cut = |one| {
                let cut =
                    Cut::new(&experiment(one), &self.scenario.cutting, &sampling, &mut random.0);
                let Measurement { gravity, accelerometer, mounting, .. } = self.measurement;
                Cut { gravity: gravity.into(), accelerometer, mounting, ..cut }
            };
            self.scenario.experiments.iter().take(self.experiments).map(cut).collect()
        };
        (0..DRAWS).into_par_iter().map(draw).collect()
    }

    /// Poses of these numbers, drawn within the joints' limits, which no identification sees.
    pub(crate) fn unseen_poses(&self, numbers: Range<u64>) -> Vec<Vec<f64>> {
        let draw = |number| {
            let mut random = random(Purpose::Cut, 2_000_000 + number);
            self.scenario.draw_experiment(&self.config.model, &mut random.0).pose
        };
        numbers.map(draw).collect()
    }

    /// `count` cuts at poses drawn within the joints' limits, which no identification sees.
    pub(crate) fn unseen(&self, count: u64) -> Vec<Cut> {
        let draw = |number| {
            let mut random = random(Purpose::Cut, 1_000_000 + number);
            let experiment = self.scenario.draw_experiment(&self.config.model, &mut random.0);
            let Scenario { cutting, measurement, .. } = &self.scenario;
            Cut::new(&experiment, cutting, measurement, &mut random.0)
        };
        (0..count).into_par_iter().map(draw).collect()
    }
}

/// The generator for one purpose of one run.
pub(crate) fn random(purpose: Purpose, number: u64) -> Random {
    Random::new((number << 3) + purpose as u64)
}

/// Logarithms of all parameters: joint by joint, six stiffnesses, then six dampings.
pub(crate) fn logarithms(bushings: &Bushings) -> Vec<f64> {
    let values = bushings.iter().flat_map(|one| one.stiffness.into_iter().chain(one.damping));
    values.map(f64::ln).collect()
}

/// Parameter `index` in the order of [`logarithms`], for people.
pub(crate) fn name(index: usize) -> String {
    let dof = DOF_NAMES[index % 6];
    let kind = if index % 12 < 6 { "stiffness" } else { "damping" };
    format!("joint {} {dof} {kind}", index / 12 + 1)
}
