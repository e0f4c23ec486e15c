//! The true parameters of a robot, and how far a report is from them.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde::Deserialize;

use crate::report::Report;

/// Six stiffnesses and six dampings, SI, in the order `tx ty tz rx ry rz`.
#[derive(Clone, Debug, Deserialize)]
pub struct Bushing {
    /// Stiffnesses, N/m, Nm/rad.
    pub stiffness: [f64; 6],
    /// Dampings, Ns/m, Nms/rad.
    pub damping: [f64; 6],
}

/// The ranges that the parameters are sought in, `[lower, upper]`.
#[derive(Clone, Debug, Deserialize)]
pub struct Bounds {
    stiffness_translation_n_per_m: [f64; 2],
    stiffness_rotation_nm_per_rad: [f64; 2],
    damping_translation_ns_per_m: [f64; 2],
    damping_rotation_nms_per_rad: [f64; 2],
}

/// True bushings by the name of their joint.
#[derive(Clone, Debug)]
pub struct Truth(BTreeMap<String, Bushing>);

impl Truth {
    /// The truth of a scenario file, with a table `[[truth]]` per joint.
    pub fn of_scenario(file: &Path) -> Result<Self> {
        #[derive(Deserialize)]
        struct Scenario {
            truth: Vec<Joint>,
        }
        #[derive(Deserialize)]
        struct Joint {
            joint: String,
            #[serde(flatten)]
            bushing: Bushing,
        }
        let scenario: Scenario = toml::from_str(&fs::read_to_string(file)?)?;
        Ok(Self(scenario.truth.into_iter().map(|joint| (joint.joint, joint.bushing)).collect()))
    }

    /// The truth of the `truth.json` of a recording.
    pub fn of_recording(truth: &serde_json::Value) -> Result<Self> {
        Ok(Self(serde_json::from_value(truth["truth"].clone())?))
    }

    /// The true bushing of a joint.
    pub fn joint(&self, name: &str) -> Result<&Bushing> {
        self.0.get(name).with_context(|| format!("no joint is called {name}"))
    }

    /// The paper's E: mean over the parameters of |identified − true| / (upper − lower bound).
    pub fn parameter_deviation(&self, report: &Report, bounds: &Bounds) -> Result<f64> {
        ensure!(
            report.joints.len() == self.0.len(),
            "the report has {} joints",
            report.joints.len()
        );
        let stiffness =
            [bounds.stiffness_translation_n_per_m, bounds.stiffness_rotation_nm_per_rad];
        let damping = [bounds.damping_translation_ns_per_m, bounds.damping_rotation_nms_per_rad];
        let mut sum = 0.0;
        for joint in &report.joints {
            let truth = self.joint(&joint.name)?;
            sum += deviations(&joint.stiffness, &truth.stiffness, stiffness);
            sum += deviations(&joint.damping, &truth.damping, damping);
        }
        Ok(sum / (12 * self.0.len()) as f64)
    }
}

impl Bounds {
    /// The bounds of the section `[bounds]` of an `edge.toml` or a scenario.
    pub fn of(file: &Path) -> Result<Self> {
        #[derive(Deserialize)]
        struct Section {
            bounds: Bounds,
        }
        let section: Section = toml::from_str(&fs::read_to_string(file)?)?;
        Ok(section.bounds)
    }
}

fn deviations(found: &[f64; 6], truth: &[f64; 6], ranges: [[f64; 2]; 2]) -> f64 {
    let deviation = |dof: usize| {
        let [lower, upper] = ranges[dof / 3];
        (found[dof] - truth[dof]).abs() / (upper - lower)
    };
    (0..6).map(deviation).sum()
}
