//! The robot as it was found, with the covariance of all that predicts its motion.

use flexid_core::identify::{Estimate, PlantEstimate};
use flexid_core::imperfection::{FoundImperfection, Imperfection, REFERENCE_HZ};
use flexid_core::parameters::Bounds;
use flexid_core::refine::{Mechanics, Plant, PlantInformation};
use flexid_core::sought::{Coordinate, Sought};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use crate::config::Config;
use crate::model::Model;
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

/// Smallest eigenvalue of a scaled information matrix that is more than rounding: a hundred unknowns, each with the rounding of a double.
const ROUNDING: f64 = 1e-14;

/// Unknowns of a fit, and the way from them to the coordinates of the robot.
struct Unknowns<'a> {
    sought: &'a Sought,
    bounds: &'a Bounds,
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
        let unknowns = Unknowns { sought, bounds: &config.bounds };
        let (covariance, widening) = match plant {
            Some((plant, found)) => {
                (unknowns.covariance_on_plant(&plant.information()), found.widening)
            }
            None => (unknowns.covariance(estimate), estimate.consistency.max(1.0).sqrt()),
        };
        let all = plant.map_or(&[][..], |(_, found)| &found.imperfections);
        let joints = config.model.joints.len();
        // Row of the covariance and unit of each coordinate of the robot. `None` of one that does not vary.
        let mut places: Vec<Option<(usize, f64)>> = (0..joints)
            .flat_map(coordinates)
            .map(|own| sought.unknown(own).map(|unknown| (all.len() + unknown, 1.0)))
            .collect();
        let mut imperfections = Vec::new();
        if let Some((plant, _)) = plant {
            let information = plant.information();
            for (row, (found, (_, unit))) in all.iter().zip(information.imperfections()).enumerate()
            {
                let FoundImperfection { imperfection, value, .. } = *found;
                if imperfection.is_of_robot() {
                    imperfections.push(FoundValue { imperfection, value });
                    places.push(Some((row, *unit)));
                }
            }
        }
        for &FoundImperfection { imperfection, value, prior, .. } in &estimate.imperfections {
            let unknown = sought.unknown(Coordinate::Imperfection(imperfection));
            if let Some(unknown) = unknown.filter(|_| imperfection.is_of_robot()) {
                imperfections.push(FoundValue { imperfection, value });
                places.push(Some((all.len() + unknown, prior)));
            }
        }
        let size = places.len();
        let entry = |row: usize, column: usize| match (places[row], places[column]) {
            (Some((i, of_i)), Some((j, of_j))) => {
                covariance[(i, j)] * of_i * of_j * widening * widening
            }
            _ => 0.0,
        };
        let lower = (0..size).flat_map(|row| (0..=row).map(move |column| (row, column)));
        let mut covariance: Vec<f64> = lower.map(|(row, column)| entry(row, column)).collect();
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

/// Parameters of a joint: stiffnesses, then dampings.
fn coordinates(joint: usize) -> impl Iterator<Item = Coordinate> {
    let stiffnesses = (0..6).map(move |dof| Coordinate::Stiffness { joint, dof });
    stiffnesses.chain((0..6).map(move |dof| Coordinate::Damping { joint, dof }))
}

impl Unknowns<'_> {
    /// Variance of the logarithm of a parameter that may lie anywhere within its bounds: that of a uniform distribution. `None` of what
    /// has no bounds.
    fn anywhere(&self, unknown: usize) -> Option<f64> {
        let of = |joint: usize| self.bounds.joints.get(joint);
        let [lower, upper] = match self.sought.coordinate(unknown)? {
            Coordinate::Stiffness { joint, dof } => of(joint)?.stiffness[dof],
            Coordinate::Damping { joint, dof } => of(joint)?.damping[dof],
            _ => return None,
        };
        let width = (upper / lower).ln();
        (width > 0.0 && width.is_finite()).then_some(width * width / 12.0)
    }

    /// The inverse of the information about imperfections and unknowns, and of that of the bounds.
    fn covariance_on_plant(&self, information: &PlantInformation<'_>) -> DMatrix<f64> {
        let (size, count) = (information.size(), information.imperfections().len());
        let mut all = DMatrix::from_fn(size, size, |i, j| information.get(i, j));
        for unknown in 0..size - count {
            if let Some(variance) = self.anywhere(unknown) {
                all[(count + unknown, count + unknown)] += 1.0 / variance;
            }
        }
        // Scaled to a unit diagonal: information spans twenty decades.
        let scale: Vec<f64> = (0..size)
            .map(|i| if all[(i, i)] > 0.0 { all[(i, i)].sqrt().recip() } else { 0.0 })
            .collect();
        let scaled = DMatrix::from_fn(size, size, |i, j| match i == j {
            true => 1.0,
            false => all[(i, j)] * scale[i] * scale[j],
        });
        let mut eigen = scaled.symmetric_eigen();
        eigen.eigenvalues.apply(|value| *value = value.max(ROUNDING).recip());
        let inverse = eigen.recompose();
        DMatrix::from_fn(size, size, |i, j| inverse[(i, j)] * scale[i] * scale[j])
    }

    /// The covariance of the unknowns alone.
    fn covariance(&self, estimate: &Estimate) -> DMatrix<f64> {
        let covariance = &estimate.covariance;
        let size = covariance.unknowns();
        let deviation = |unknown: usize| {
            let most = self.anywhere(unknown).map_or(f64::INFINITY, f64::sqrt);
            let own = covariance.deviation(unknown).min(most);
            if own.is_finite() { own } else { 0.0 }
        };
        DMatrix::from_fn(size, size, |i, j| {
            let correlation = if i == j { 1.0 } else { covariance.correlation(i, j) };
            correlation * deviation(i) * deviation(j)
        })
    }
}
