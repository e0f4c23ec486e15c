//! The robot that was found, and the covariance of all that is uncertain in it.

use crate::model::{Model, ModelError};
use crate::robot::FoundRobot;
use flexid_core::chain::Chain;
use flexid_core::chain::linearise::LinearisationError;
use flexid_core::imperfection::Imperfection;
use flexid_core::parameters::Bushings;
use flexid_core::refine::Mechanics;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::estimate::root;

/// Parameters of a joint.
pub const OF_JOINT: usize = 12;
/// Least lower edge of a band, as a part of its upper edge.
const LEAST: f64 = 1e-3;
/// Highest upper edge of a band, Hz. Chosen: above what any accelerometer reads.
const HIGHEST: f64 = 1e6;
/// Largest logarithm of a factor on a mass or on stiffnesses. Chosen: no file is off by 3000 times.
const LARGEST_LOGARITHM: f64 = 8.0;
/// Most iterations for the eigenvalues of a covariance. Chosen: a few for each of two hundred.
const ITERATIONS: usize = 100_000;
/// Largest negative eigenvalue of a correlation matrix, and largest excess of a correlation, that is rounding.
const ROUNDING: f64 = 1e-6;

/// A robot that was identified.
#[derive(Clone, Debug)]
pub struct Robot {
    found: FoundRobot,
    chain: Chain,
    bushings: Bushings,
    imperfections: Vec<(Imperfection, f64)>,
    covariance: DMatrix<f64>,
}

/// Why a robot in a file is none.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RobotError {
    /// The model is wrong.
    #[error("model {0}")]
    Model(#[from] ModelError),
    /// A parameter is no positive number.
    #[error(
        "joint {0}: a stiffness or damping is not positive: run `flexid identify --json` again"
    )]
    Parameter(String),
    /// A pose of a record is none of this robot.
    #[error(
        "poses[{index}] must have {wanted} angles, one for each driven joint: run `flexid identify --json` again"
    )]
    Pose {
        /// Place of the pose, from 0.
        index: usize,
        /// Number of driven joints.
        wanted: usize,
    },
    /// The file has parameters of another number of joints.
    #[error("has {model} joints, and the parameters are of {parameters}")]
    Joints {
        /// Joints of the model.
        model: usize,
        /// Joints that have parameters.
        parameters: usize,
    },
    /// The robot cannot have such an imperfection.
    #[error(
        "imperfections[{0}] is of another robot, or out of its range: run `flexid identify --json` again"
    )]
    Imperfection(usize),
    /// The covariance has a wrong number of entries.
    #[error(
        "covariance has {given} entries, and this robot has {wanted}: run `flexid identify --json` again"
    )]
    CovarianceLength {
        /// Entries in the file.
        given: usize,
        /// Entries of the lower triangle.
        wanted: usize,
    },
    /// The covariance is none.
    #[error(
        "covariance is none: a variance is negative or no number: run `flexid identify --json` again"
    )]
    Covariance,
    /// The band is none.
    #[error("band_hz must be two positive numbers up to {HIGHEST:e}, the lower first")]
    Band,
    /// The frequency that the parameters are stated at is none.
    #[error("reference_hz must be a positive number up to {HIGHEST:e}")]
    Reference,
    /// Gravity is no vector.
    #[error("gravity_m_per_s2 has a number that is not finite")]
    Gravity,
}

impl Robot {
    /// The robot of a result with these bushings, base first.
    ///
    /// # Errors
    /// An entry is wrong, or of another robot.
    pub fn new(found: FoundRobot, bushings: Bushings) -> Result<Self, RobotError> {
        let chain = found.model.chain()?;
        if bushings.len() != chain.joints().len() {
            let (model, parameters) = (chain.joints().len(), bushings.len());
            return Err(RobotError::Joints { model, parameters });
        }
        let [lower, upper] = found.band_hz;
        if !(lower >= 0.0 && lower < upper && upper <= HIGHEST) {
            return Err(RobotError::Band);
        }
        if found.reference_hz.is_some_and(|hz| !(hz > 0.0 && hz <= HIGHEST)) {
            return Err(RobotError::Reference);
        }
        if !found.gravity_m_per_s2.iter().all(|component| component.is_finite()) {
            return Err(RobotError::Gravity);
        }
        for (bushing, joint) in bushings.iter().zip(&found.model.joints) {
            let mut values = bushing.stiffness.iter().chain(&bushing.damping);
            if !values.all(|value| *value > 0.0 && value.is_finite()) {
                return Err(RobotError::Parameter(joint.name.clone()));
            }
        }
        let imperfections: Vec<(Imperfection, f64)> =
            found.imperfections.iter().map(|own| (own.imperfection, own.value)).collect();
        let is_right =
            |(own, value): &(Imperfection, f64)| own.is_of(&chain) && is_in_range(*own, *value);
        if let Some(wrong) = imperfections.iter().position(|own| !is_right(own)) {
            return Err(RobotError::Imperfection(wrong));
        }
        let wanted = found.model.driven().count();
        let is_pose = |pose: &Vec<f64>| pose.len() == wanted && pose.iter().all(|q| q.is_finite());
        if let Some(index) = found.poses.iter().position(|pose| !is_pose(pose)) {
            return Err(RobotError::Pose { index, wanted });
        }
        let size = OF_JOINT * bushings.len() + imperfections.len();
        let covariance = symmetric(size, &found.covariance)?;
        Ok(Self { found, chain, bushings, imperfections, covariance })
    }

    /// Its model.
    pub fn model(&self) -> &Model {
        &self.found.model
    }

    /// Its chain, without imperfections.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// The robot of the file.
    pub fn found(&self) -> &FoundRobot {
        &self.found
    }

    /// Stiffness and damping of every joint, base first.
    pub fn bushings(&self) -> &Bushings {
        &self.bushings
    }

    /// Lower and upper edge of the band that was fitted, Hz. The lower one is above 0: a thousandth of the upper one where the band begins
    /// at 0.
    pub fn band_hz(&self) -> [f64; 2] {
        let [lower, upper] = self.found.band_hz;
        [lower.max(LEAST * upper), upper]
    }

    /// Frequency at which stiffness and damping are stated where they depend on it, Hz.
    pub fn reference_hz(&self) -> f64 {
        let [lower, upper] = self.band_hz();
        self.found.reference_hz.unwrap_or((lower * upper).sqrt())
    }

    /// The mechanics at a pose, where the imperfection of this index, if any, is larger by `shift`.
    pub(crate) fn mechanics(
        &self,
        pose: &[f64],
        shifted: Option<(usize, f64)>,
    ) -> Result<Mechanics, LinearisationError> {
        let mut imperfections = self.imperfections.clone();
        if let Some((index, shift)) = shifted {
            imperfections[index].1 += shift;
        }
        let gravity = self.found.gravity_m_per_s2.into();
        let Self { chain, bushings, .. } = self;
        Mechanics::new(chain, gravity, self.reference_hz(), pose, bushings, &imperfections)
    }

    /// How far imperfection `index` may fall, in its unit.
    pub(crate) fn room_below(&self, index: usize) -> f64 {
        let (imperfection, value) = self.imperfections[index];
        if imperfection.is_positive() { value.max(0.0) } else { f64::INFINITY }
    }

    /// Standard deviations of the imperfections, in the unit of each.
    pub(crate) fn imperfection_stds(&self) -> impl Iterator<Item = f64> {
        let first = OF_JOINT * self.bushings.len();
        (first..self.covariance.nrows()).map(|index| root(self.covariance[(index, index)]))
    }

    /// Number of uncertain coordinates: the logarithms of the parameters, and behind them the imperfections.
    pub fn coordinates(&self) -> usize {
        self.covariance.nrows()
    }

    /// Standard deviation of what has this gradient by the coordinates: `√(gᵀ C g)`.
    ///
    /// # Panics
    /// If the gradient has another length than there are [coordinates](Robot::coordinates).
    pub fn std_of(&self, gradient: &DVector<f64>) -> f64 {
        root(gradient.dot(&(&self.covariance * gradient)))
    }

    /// The [standard deviation](Robot::std_of) of each column.
    pub(crate) fn stds_of(&self, gradients: &DMatrix<f64>) -> Vec<f64> {
        let spread = &self.covariance * gradients;
        let columns = gradients.column_iter().zip(spread.column_iter());
        columns.map(|(gradient, spread)| root(gradient.dot(&spread))).collect()
    }

    /// The covariance of the coordinates.
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }
}

/// Returns whether an imperfection can have this value.
fn is_in_range(imperfection: Imperfection, value: f64) -> bool {
    let facts = imperfection.facts();
    if facts.is_factor || matches!(imperfection, Imperfection::Inertia(..)) {
        value.abs() <= LARGEST_LOGARITHM
    } else {
        value.is_finite() && !(facts.is_positive && value < 0.0)
    }
}

/// The symmetric matrix of this lower triangle, given row by row.
fn symmetric(size: usize, entries: &[f64]) -> Result<DMatrix<f64>, RobotError> {
    let wanted = size * (size + 1) / 2;
    if entries.len() != wanted {
        return Err(RobotError::CovarianceLength { given: entries.len(), wanted });
    }
    if !entries.iter().all(|entry| entry.is_finite()) {
        return Err(RobotError::Covariance);
    }
    let at = |i: usize, j: usize| entries[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)];
    let matrix = DMatrix::from_fn(size, size, at);
    // Scaled: a delay's variance is twenty decades below that of a logarithm.
    let scale: Vec<f64> = (0..size)
        .map(|i| if matrix[(i, i)] > 0.0 { matrix[(i, i)].sqrt().recip() } else { 0.0 })
        .collect();
    let scaled = DMatrix::from_fn(size, size, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let is_scaled = scaled.iter().all(|entry| entry.abs() <= 1.0 + ROUNDING);
    let least = || {
        SymmetricEigen::try_new(scaled, f64::EPSILON, ITERATIONS).map(|own| own.eigenvalues.min())
    };
    let is_covariance = matrix.diagonal().iter().all(|variance| *variance >= 0.0)
        && is_scaled
        && least().is_some_and(|least| least >= -ROUNDING);
    if is_covariance { Ok(matrix) } else { Err(RobotError::Covariance) }
}
