//! The scenarios' robots with their true parameters.

use std::path::PathBuf;

use flexid_core::imperfection::Imperfection;
use flexid_export::Robot;
use flexid_pipeline::model::{Kind, Model};
use flexid_wire::report::{JointReport, Verdict};
use flexid_wire::text::clipped;
use serde::Deserialize;

pub(crate) const EARTH: [f64; 3] = [0.0, 0.0, -9.80665];

/// The entries of a scenario file that the tests need.
#[derive(Deserialize)]
struct File {
    truth: Vec<Truth>,
    experiment: Vec<Experiment>,
}

#[derive(Deserialize)]
struct Truth {
    joint: String,
    stiffness: [f64; 6],
    damping: [f64; 6],
}

#[derive(Deserialize)]
struct Experiment {
    pose: Vec<f64>,
}

/// A robot, its true parameters and the poses of its experiments.
pub(crate) struct Scenario {
    pub(crate) model: Model,
    pub(crate) joints: Vec<JointReport>,
    pub(crate) gravity: [f64; 3],
    pub(crate) poses: Vec<Vec<f64>>,
    pub(crate) imperfections: Vec<(Imperfection, f64)>,
    /// Frequency at which springs and dampers are exported, Hz.
    pub(crate) at_hz: f64,
    pub(crate) verdict: String,
}

impl Scenario {
    /// Loads `<name>-model.toml` and `<name>.toml` of the scenario folder.
    pub(crate) fn load(name: &str, gravity: [f64; 3]) -> Self {
        let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../scenario"));
        let model = Model::load(&folder.join(format!("{name}-model.toml"))).unwrap();
        let text = std::fs::read_to_string(folder.join(format!("{name}.toml"))).unwrap();
        let file: File = toml::from_str(&text).unwrap();
        let joints = file.truth.iter().map(report).collect();
        let poses = file.experiment.into_iter().map(|experiment| experiment.pose).collect();
        let verdict = "consistent".to_string();
        Self { model, joints, gravity, poses, imperfections: Vec::new(), at_hz: 20.0, verdict }
    }

    /// A robot of six joints in gravity with a pedestal, a slide, skewed axes, turned frames and gravity askew.
    pub(crate) fn skewed() -> Self {
        let mut scenario = Self::load("mill6", [2.0, -3.0, -9.0]);
        let joints = &mut scenario.model.joints;
        (joints[0].kind, joints[0].axis, joints[0].limits) = (Kind::Fixed, [0.0; 3], [0.0; 2]);
        (joints[3].kind, joints[3].axis) = (Kind::Prismatic, [1.0, 2.0, 0.5]);
        joints[1].axis = [0.2, 1.0, -0.4];
        joints[1].origin_rpy_rad = [0.3, -0.7, 1.1];
        joints[4].origin_rpy_rad = [-1.2, 0.4, 2.0];
        scenario.model.tcp.rpy_rad = [0.5, 1.0, -0.6];
        scenario.poses = vec![vec![-0.35, 0.7, 0.2, 0.75, -0.3], vec![0.6, -0.9, -0.15, 1.4, 2.2]];
        scenario
    }

    /// The robot at the pose of this experiment.
    pub(crate) fn robot(&self, experiment: usize) -> Robot<'_> {
        Robot {
            model: &self.model,
            joints: &self.joints,
            gravity_m_per_s2: self.gravity,
            pose: &self.poses[experiment],
            imperfections: &self.imperfections,
            band_hz: [2.0, 200.0],
            reference_hz: 20.0,
            at_hz: self.at_hz,
            verdict: &self.verdict,
            note: None,
        }
    }
}

fn report(truth: &Truth) -> JointReport {
    JointReport {
        name: clipped(&truth.joint),
        stiffness: truth.stiffness,
        stiffness_std: truth.stiffness.map(|value| Some(0.01 * value)),
        stiffness_verdict: [Verdict::Identified; 6],
        damping: truth.damping,
        damping_std: truth.damping.map(|value| Some(0.02 * value)),
        damping_verdict: [Verdict::Identified; 6],
    }
}
