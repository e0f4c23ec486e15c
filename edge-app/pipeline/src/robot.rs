//! The robot as it was found, with the covariance of all that predicts its motion.

use flexid_core::identify::{Estimate, PlantEstimate};
use flexid_core::imperfection::{Imperfection, REFERENCE_HZ};
use flexid_core::refine::{Mechanics, Plant};
use flexid_core::sought::Sought;
use serde::{Deserialize, Serialize};

use crate::config::Config;
use crate::model::Model;
use crate::posterior::{Posterior, Uncertain};
use crate::record::same_pose;

/// All that predicts how a robot moves: its model, its bushings, its imperfections, and how far each may be off.
///
/// The covariance is that of the logarithms of all parameters, joint by joint the stiffnesses and the dampings, and behind them of the
/// imperfections, each in its unit. What is fixed has variance zero. What the records do not determine has the variance of a logarithm
/// that may lie anywhere within its bounds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FoundRobot {
    /// The robot without imperfections.
    pub model: Model,
    /// Gravity in base axes, m/s².
    pub gravity_m_per_s2: [f64; 3],
    /// Lower and upper edge of the band that was fitted, Hz.
    pub band_hz: [f64; 2],
    /// Frequency at which stiffness and damping are stated where they depend on it, Hz. Files that do not name it have the middle of the band,
    /// on a logarithmic scale.
    #[serde(default)]
    pub reference_hz: Option<f64>,
    /// Poses of the records, rad (m).
    pub poses: Vec<Vec<f64>>,
    /// Lower and upper bound of the stiffnesses and of the dampings of each joint.
    pub bounds: Vec<JointBounds>,
    /// Imperfections of the robot, and their most likely values.
    pub imperfections: Vec<FoundValue>,
    /// Lower triangle of the covariance, row by row.
    pub covariance: Vec<f64>,
}

/// Bounds of a joint's parameters, in SI units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointBounds {
    /// Ends for each stiffness, N/m and Nm/rad.
    pub stiffness: [[f64; 2]; 6],
    /// Ends for each damping, Ns/m and Nms/rad.
    pub damping: [[f64; 2]; 6],
}

/// An imperfection and its value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FoundValue {
    /// The imperfection.
    pub imperfection: Imperfection,
    /// By how much, in the unit of the imperfection.
    pub value: f64,
}

impl FoundRobot {
    /// Returns whether there are records, and all of them are of one pose.
    pub fn has_one_pose(&self) -> bool {
        self.poses.first().is_some_and(|first| self.poses.iter().all(|pose| same_pose(first, pose)))
    }

    /// The robot of an estimate, with the information of the fit to a `plant` that gave it, unless that is perfect. The plant must stand
    /// where this fit has ended. `poses` are those of the records.
    pub fn new(
        config: &Config,
        sought: &Sought,
        estimate: &Estimate,
        plant: Option<(&Plant, &PlantEstimate)>,
        poses: &[impl AsRef<[f64]>],
    ) -> Self {
        let joints = config.model.joints.len();
        let posterior = Posterior::new(config, sought, estimate, plant);
        let own = posterior.imperfections.iter();
        let own: Vec<&Uncertain> = own.filter(|own| own.imperfection.is_of_robot()).collect();
        // Row of the covariance and unit of each coordinate of the robot. `None` of one that does not vary.
        let parameters = posterior.parameters.iter().map(|row| row.map(|row| (row, 1.0)));
        let of_imperfections = own.iter().map(|own| Some((own.row, own.prior)));
        let places: Vec<Option<(usize, f64)>> = parameters.chain(of_imperfections).collect();
        let widening = posterior.widening;
        let entry = |row: usize, column: usize| match (places[row], places[column]) {
            (Some((i, of_i)), Some((j, of_j))) => {
                posterior.covariance[(i, j)] * of_i * of_j * widening * widening
            }
            _ => 0.0,
        };
        let size = places.len();
        let lower = (0..size).flat_map(|row| (0..=row).map(move |column| (row, column)));
        let mut covariance: Vec<f64> = lower.map(|(row, column)| entry(row, column)).collect();
        let values = own.iter();
        let mut imperfections: Vec<FoundValue> = values
            .map(|own| FoundValue { imperfection: own.imperfection, value: own.value })
            .collect();
        if let Some(std) = plant.and_then(|(plant, _)| plant.record_stiffness()) {
            let imperfection = Imperfection::RecordStiffness(Mechanics::RECORD);
            imperfections.push(FoundValue { imperfection, value: 0.0 });
            covariance.resize(covariance.len() + size, 0.0);
            covariance.push(std * std);
        }
        let bounds = config.bounds.joints.iter().take(joints);
        Self {
            model: config.model.clone(),
            gravity_m_per_s2: config.gravity,
            band_hz: config.band_hz,
            reference_hz: Some(REFERENCE_HZ),
            poses: poses.iter().map(|pose| pose.as_ref().to_vec()).collect(),
            bounds: bounds
                .map(|own| JointBounds { stiffness: own.stiffness, damping: own.damping })
                .collect(),
            imperfections,
            covariance,
        }
    }
}
