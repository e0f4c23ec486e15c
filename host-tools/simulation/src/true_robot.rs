//! The robot that moves in a simulation, as the model of a result describes it.

use flexid_core::MAX_JOINTS;
use flexid_core::imperfection::REFERENCE_HZ;
use flexid_core::parameters::Bushing;
use flexid_pipeline::dynamics::{OF_JOINT, Robot, RobotError};
use flexid_pipeline::model::Model;
use flexid_pipeline::robot::{FoundRobot, JointBounds};
use serde::{Deserialize, Serialize};

/// The robot that moved, apart from its bushings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueRobot {
    /// The robot as modelled.
    pub model: Model,
    /// Gravity in base axes, m/s².
    pub gravity_m_per_s2: [f64; 3],
}

impl TrueRobot {
    /// A robot of this model, under this gravity.
    pub fn new(model: &Model, gravity_m_per_s2: [f64; 3]) -> Self {
        Self { model: model.clone(), gravity_m_per_s2 }
    }

    /// The robot with these bushings, base first, as they are at [`REFERENCE_HZ`], of which nothing is uncertain. Its static stiffness is that
    /// at the lower edge of `band_hz`.
    ///
    /// # Errors
    /// An entry is wrong, or of another robot.
    pub fn of(&self, bushings: &[Bushing], band_hz: [f64; 2]) -> Result<Robot, RobotError> {
        let Self { model, gravity_m_per_s2 } = self.clone();
        let (joints, parameters) = (model.joints.len(), bushings.len());
        if parameters > MAX_JOINTS {
            return Err(RobotError::Joints { model: joints, parameters });
        }
        let size = OF_JOINT * parameters;
        let bounds = bushings.iter().map(|own| JointBounds {
            stiffness: own.stiffness.map(|k| [k; 2]),
            damping: own.damping.map(|d| [d; 2]),
        });
        let found = FoundRobot {
            bounds: bounds.collect(),
            model,
            gravity_m_per_s2,
            band_hz,
            reference_hz: Some(REFERENCE_HZ),
            poses: Vec::new(),
            imperfections: Vec::new(),
            covariance: vec![0.0; size * (size + 1) / 2],
        };
        Robot::new(found, bushings.iter().copied().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::{mill3, model};

    #[test]
    fn bushings_of_another_robot_are_refused() {
        let (scenario, _) = mill3();
        let of = |bushings: &[Bushing]| {
            let robot = TrueRobot::new(&model(), [0.0; 3]);
            robot.of(bushings, [2.0, 200.0]).map(|_| ())
        };
        assert_eq!(of(&scenario.truth), Ok(()));
        for parameters in [2, MAX_JOINTS + 1] {
            let bushings = vec![scenario.truth[0]; parameters];
            assert_eq!(of(&bushings), Err(RobotError::Joints { model: 3, parameters }));
        }
    }
}
