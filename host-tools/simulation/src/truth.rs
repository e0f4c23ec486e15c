//! The file of a simulated robot's true parameters, and of the frames that its simulation lost on purpose.

use std::collections::BTreeMap;
use std::path::Path;

use flexid_core::imperfection::REFERENCE_HZ;
use flexid_core::parameters::Bushing;
use flexid_pipeline::config::Config;
use flexid_pipeline::dynamics::Robot;
use flexid_pipeline::input::{self, BadInput};
use flexid_pipeline::model::Model;
use serde::{Deserialize, Serialize};

use crate::plant::Joints;
use crate::scenario;
use crate::simulator::Simulator;
use crate::true_robot::TrueRobot;

/// The file that `simulate --truth-json` writes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TruthFile {
    /// True bushings by the name of the joint.
    pub truth: BTreeMap<String, TrueBushing>,
    /// Hysteresis of their dampings.
    #[serde(flatten)]
    pub hysteresis: Hysteresis,
    /// Experiments in the order in which they were done.
    pub experiments: Vec<TrueExperiment>,
    /// The robot that moved. `None` if no model describes it.
    pub robot: Option<TrueRobot>,
}

/// Springs and dampers of a joint, SI units, order `tx ty tz rx ry rz`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueBushing {
    /// Stiffnesses, N/m, Nm/rad.
    pub stiffness: [f64; 6],
    /// Dampings, Ns/m, Nms/rad.
    pub damping: [f64; 6],
}

/// Hysteresis of all joints, as [`Joints`] state it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Hysteresis {
    /// Part of each damping that is hysteretic.
    pub hysteretic: f64,
    /// Frequency at which stiffnesses and dampings are those of the file, Hz.
    pub hysteretic_at_hz: f64,
}

impl Hysteresis {
    /// The hysteresis of these joints.
    fn of(joints: &Joints) -> Self {
        let Joints { hysteretic, hysteretic_at_hz, .. } = *joints;
        Self { hysteretic, hysteretic_at_hz }
    }

    /// Joints with this hysteresis, and nothing else beside their bushings.
    fn joints(self) -> Joints {
        let Self { hysteretic, hysteretic_at_hz } = self;
        Joints { hysteretic, hysteretic_at_hz, ..Joints::default() }
    }
}

/// Files that do not state it have none.
impl Default for Hysteresis {
    fn default() -> Self {
        Self::of(&Joints::default())
    }
}

/// One experiment as it was simulated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrueExperiment {
    /// Name of the experiment in the scenario.
    pub name: String,
    /// Joint angles, rad (m).
    pub pose: Vec<f64>,
    /// Counter of the first sample.
    pub seq_start: u32,
    /// Number of frames on the bus.
    pub frames: u64,
    /// Number of force frames left out.
    pub dropped_force: u64,
    /// Number of acceleration frames left out.
    pub dropped_acc: u64,
}

/// The part of the file that `identify --truth` reads.
#[derive(Deserialize)]
struct Truth {
    truth: BTreeMap<String, TrueBushing>,
    #[serde(flatten)]
    hysteresis: Hysteresis,
    /// Files that do not state it are of a robot of which nothing else is known.
    #[serde(default)]
    robot: Option<TrueRobot>,
}

impl TruthFile {
    /// The truth of the joints of `model`, base first, in a plant with such joints, and the robot that moves.
    pub fn new(
        model: &Model,
        truth: &[Bushing],
        joints: &Joints,
        robot: Option<TrueRobot>,
    ) -> Self {
        let truth = model.joints.iter().zip(truth).map(|(joint, bushing)| {
            let Bushing { stiffness, damping } = *bushing;
            (joint.name.clone(), TrueBushing { stiffness, damping })
        });
        let hysteresis = Hysteresis::of(joints);
        Self { truth: truth.collect(), hysteresis, experiments: Vec::new(), robot }
    }
}

/// The truth of the joints that the file and a model share.
#[derive(Clone, Debug)]
pub struct Shared {
    /// Truth of each joint of the model, base first. `None` if the file lacks it.
    pub bushings: Vec<Option<Bushing>>,
    /// Joints that only the file or only the model has.
    pub left_out: Vec<String>,
    /// The robot that moved. `None` if it is not known.
    pub robot: Option<Robot>,
}

impl Shared {
    /// The truth of a robot that is simulated without a plant.
    ///
    /// # Errors
    /// A config that was loaded gives no error.
    pub fn of(simulator: &Simulator, config: &Config) -> Result<Self, BadInput> {
        let truth = simulator.truth();
        let robot = simulator.robot(&config.model).map(|own| own.of(truth, config.band_hz));
        let robot = robot.transpose().map_err(|error| BadInput::new(&config.file, error))?;
        let bushings = truth.iter().copied().map(Some).collect();
        Ok(Self { bushings, left_out: Vec::new(), robot })
    }

    /// The truth of all joints, if the file has all of them.
    pub fn whole(&self) -> Option<Vec<Bushing>> {
        self.bushings.iter().copied().collect()
    }
}

/// Reads the truth of the joints of the model of `config`, base first, within its bounds, and states it at the frequency at which a fit states
/// its parameters, [`REFERENCE_HZ`]. The model may have a pedestal that the file
/// lacks, and the file one that the model lacks.
///
/// # Errors
/// The file is wrong, or it is of a robot without any of these joints. The error is one line that names the file, the joint, and the
/// right input.
pub fn load(file: &Path, config: &Config) -> Result<Shared, BadInput> {
    parse(file, &input::read(file)?, config)
}

fn parse(file: &Path, text: &str, config: &Config) -> Result<Shared, BadInput> {
    let bad = |message: String| BadInput::new(file, message);
    let Truth { mut truth, hysteresis, robot } =
        input::parse_json(file, text, "flexid simulate --truth-json")?;
    let plant = hysteresis.joints();
    plant.check().map_err(|error| bad(error.replace("[joints] ", "")))?;
    let stated = |TrueBushing { stiffness, damping }| Bushing { stiffness, damping };
    let robot = robot.map(|robot| {
        let own = robot.model.joints.iter().map(|joint| truth.get(&joint.name).cloned());
        let own: Option<Vec<_>> =
            own.map(|own| Some(plant.at(&stated(own?), REFERENCE_HZ))).collect();
        let own =
            own.ok_or_else(|| bad("\"robot\" has a joint that \"truth\" lacks".to_owned()))?;
        robot.of(&own, config.band_hz).map_err(|error| bad(format!("\"robot\" {error}")))
    });
    let robot = robot.transpose()?;
    let joints = &config.model.joints;
    let by_mass = scenario::by_mass(&config.model);
    let section = format!("[bounds] of {}", config.file.display());
    let mut left_out = Vec::new();
    let mut bushings = Vec::new();
    for (index, joint) in joints.iter().enumerate() {
        let name = &joint.name;
        let bushing = truth.remove(name).map(stated);
        match &bushing {
            Some(bushing) => {
                let by_mass = by_mass.as_ref().map(|own| &own.joints[index]);
                scenario::check(bushing, &config.bounds.joints[index], by_mass, &section)
                    .map_err(|error| bad(format!("\"truth\" \"{name}\" {error}")))?;
            }
            None => left_out.push(format!("{name}, which only the model has")),
        }
        bushings.push(bushing.map(|own| plant.at(&own, REFERENCE_HZ)));
    }
    if bushings.iter().all(Option::is_none) {
        let known: Vec<&str> = joints.iter().map(|joint| joint.name.as_str()).collect();
        return Err(bad(format!(
            "\"truth\" has none of the joints of the model, {}: name the file of this robot",
            known.join(", ")
        )));
    }
    left_out.extend(truth.into_keys().map(|name| format!("{name}, which only the file has")));
    Ok(Shared { bushings, left_out, robot })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mistakes_are_named_with_place_and_mend() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenario");
        let config = Config::load(&folder.join("mill3-edge.toml")).unwrap();
        let model = folder.join("mill3.toml");
        let truth = scenario::Scenario::load(&model, &config.model).unwrap().truth;
        let right =
            serde_json::to_string(&TruthFile::new(&config.model, &truth, &Joints::default(), None))
                .unwrap();
        let read = |text: &str| parse(Path::new("t.json"), text, &config);
        let all = read(&right).unwrap();
        assert_eq!((all.whole().unwrap(), all.left_out.len()), (truth, 0));
        let other = read(&right.replacen("joint_2", "elbow", 1)).unwrap();
        assert_eq!(other.bushings.iter().flatten().count(), 2);
        assert!(other.whole().is_none());
        let sides = ["joint_2, which only the model has", "elbow, which only the file has"];
        assert_eq!(other.left_out, sides);
        for (from, to, message) in [
            ("60000000.0", "0.0", "\"truth\" \"joint_1\" stiffness tx is 0e0: must lie within"),
            ("60000000.0", "-6.0e7", "stiffness tx is -6e7: must lie within"),
            ("21000.0", "2e6", "mill3-edge.toml, 1e3 to 1e5: correct it, or widen the range"),
            ("21000.0", "2e6", "damping tx is 2e6: must lie within [bounds] of "),
            (
                "joint_",
                "axis",
                "has none of the joints of the model, joint_1, joint_2, joint_3: name",
            ),
            ("{", "", "give a file as `flexid simulate --truth-json` writes it"),
        ] {
            assert!(right.contains(from), "{from}");
            // Only the names are in it more than once.
            let times = if from == "joint_" { 3 } else { 1 };
            let error = read(&right.replacen(from, to, times)).unwrap_err().to_string();
            assert!(error.starts_with("t.json: ") && error.contains(message), "{error}");
            assert!(!error.contains('\n'), "{error}");
        }
    }

    /// A hysteresis that is stated at 40 Hz is another stiffness and damping at 20 Hz, at which a fit states them.
    #[test]
    fn a_truth_of_another_frequency_is_restated() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenario");
        let config = Config::load(&folder.join("mill3-edge.toml")).unwrap();
        let model = folder.join("mill3.toml");
        let truth = scenario::Scenario::load(&model, &config.model).unwrap().truth;
        let load = |hysteretic, hysteretic_at_hz| {
            let joints = Joints { hysteretic, hysteretic_at_hz, ..Joints::default() };
            let text = serde_json::to_string(&TruthFile::new(&config.model, &truth, &joints, None));
            parse(Path::new("t.json"), &text.unwrap(), &config).unwrap().whole().unwrap()
        };
        for (part, hz) in [(0.0, 40.0), (0.3, 20.0)] {
            assert_eq!(load(part, hz), truth);
        }
        for (own, truth) in load(0.3, 40.0).iter().zip(&truth) {
            for dof in 0..6 {
                let softer = 0.3 * truth.damping[dof] * 80.0 * 2.0_f64.ln() * 2.0;
                assert!((own.stiffness[dof] / (truth.stiffness[dof] - softer) - 1.0).abs() < 1e-9);
                assert!((own.damping[dof] / (1.3 * truth.damping[dof]) - 1.0).abs() < 1e-9);
            }
        }
    }
}
