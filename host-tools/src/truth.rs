//! The file of a simulated robot's true parameters, and what its simulation lost on purpose.

use std::collections::BTreeMap;
use std::path::Path;

use flexid_core::parameters::Bushing;
use flexid_edge::input::BadInput;
use flexid_edge::model::Model;
use serde::{Deserialize, Serialize};

/// What `simulate --truth-json` writes and `identify --truth` reads.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TruthFile {
    /// By the name of the joint.
    pub truth: BTreeMap<String, TrueBushing>,
    /// What was done, in order.
    #[serde(default)]
    pub experiments: Vec<TrueExperiment>,
}

/// Springs and dampers of a joint, SI units, order `tx ty tz rx ry rz`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueBushing {
    /// N/m, Nm/rad.
    pub stiffness: [f64; 6],
    /// Ns/m, Nms/rad.
    pub damping: [f64; 6],
}

/// One experiment as it was simulated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueExperiment {
    /// As in the scenario.
    pub name: String,
    /// Joint angles, rad (m).
    pub pose: Vec<f64>,
    /// Counter of the first sample.
    pub seq_start: u32,
    /// Frames on the bus.
    pub frames: u64,
    /// Force frames left out.
    pub dropped_force: u64,
    /// Acceleration frames left out.
    pub dropped_acc: u64,
}

impl TruthFile {
    /// The truth of the joints of `model`, base first.
    pub fn new(model: &Model, truth: &[Bushing]) -> Self {
        let truth = model.joints.iter().zip(truth).map(|(joint, bushing)| {
            let Bushing { stiffness, damping } = *bushing;
            (joint.name.clone(), TrueBushing { stiffness, damping })
        });
        Self { truth: truth.collect(), experiments: Vec::new() }
    }

    /// Reads the truth of the joints of `model`, base first.
    ///
    /// # Errors
    /// One line that names the file, and the joint that is missing.
    pub fn load(file: &Path, model: &Model) -> Result<Vec<Bushing>, BadInput> {
        let text = std::fs::read_to_string(file)
            .map_err(|error| BadInput::new(file, format!("cannot be read: {error}")))?;
        let mut read: Self =
            serde_json::from_str(&text).map_err(|error| BadInput::new(file, error))?;
        let joints = model.joints.iter().map(|joint| {
            let bushing = read.truth.remove(&joint.name).ok_or_else(|| {
                BadInput::new(file, format!("\"truth\" has no joint \"{}\"", joint.name))
            })?;
            Ok(Bushing { stiffness: bushing.stiffness, damping: bushing.damping })
        });
        joints.collect()
    }
}
