//! Nuisances: errors of the sensors and of the masses of the model, beside the parameters of the joints.

use nalgebra::{Matrix3, Vector3};

use crate::MAX_JOINTS;

/// Errors of a measurement and of the model's masses. The default has no errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Delay of the acceleration after the force of the same counter, s.
    pub delay: f64,
    /// Gain of each axis of the acceleration, reading per acceleration.
    pub acceleration_gain: [f64; 3],
    /// Gain of each axis of the force, reading per force.
    pub force_gain: [f64; 3],
    /// Rotation vector that turns the accelerometer's axes as mounted into its true axes, along the axes as mounted, rad.
    pub misalignment: [f64; 3],
    /// True mass and inertia of each link, over those of the model.
    pub mass: [f64; MAX_JOINTS],
}

impl Default for Calibration {
    fn default() -> Self {
        Self {
            delay: 0.0,
            acceleration_gain: [1.0; 3],
            force_gain: [1.0; 3],
            misalignment: [0.0; 3],
            mass: [1.0; MAX_JOINTS],
        }
    }
}

impl Calibration {
    /// Derivatives of a reading by the misalignment about each axis, per rad: matrices on the reading.
    pub(crate) fn turning(&self) -> [Matrix3<f64>; 3] {
        let turn = Vector3::from(self.misalignment);
        let angle = turn.norm();
        // Right Jacobian of the rotation group (Sola, 2018, eq. 143); its series where the angle vanishes.
        let (first, second) = if angle < 1e-4 {
            (0.5, 1.0 / 6.0)
        } else {
            let square = angle * angle;
            ((1.0 - libm::cos(angle)) / square, (angle - libm::sin(angle)) / (square * angle))
        };
        let cross = turn.cross_matrix();
        let jacobian = Matrix3::identity() - cross * first + cross * cross * second;
        let gain = Matrix3::from_diagonal(&self.acceleration_gain.into());
        let bare = Matrix3::from_diagonal(&self.acceleration_gain.map(|gain| 1.0 / gain).into());
        // x × w is −[w]× x.
        core::array::from_fn(|axis| gain * -jacobian.column(axis).cross_matrix() * bare)
    }
}

/// Standard deviation of each nuisance's prior. A nuisance with `None` is not sought.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Nuisances {
    /// Delay, s.
    pub delay: Option<f64>,
    /// Logarithm of the acceleration gain of each axis.
    pub acceleration_gain: Option<f64>,
    /// Logarithm of the force gain of each axis.
    pub force_gain: Option<f64>,
    /// Angle of misalignment about each axis, rad.
    pub misalignment: Option<f64>,
    /// Logarithm of the mass of each link.
    pub mass: Option<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

        /// The reading's derivatives by the misalignment, against central differences of the turned reading.
        #[test]
        fn turning_equals_finite_differences(
            turn in proptest::array::uniform3(-0.5_f64..0.5),
            gain in proptest::array::uniform3(0.5_f64..2.0),
            acceleration in proptest::array::uniform3(-3.0_f64..3.0),
        ) {
            let acceleration = Vector3::from(acceleration);
            let reading = |turn: [f64; 3]| -> Vector3<f64> {
                let turned = Rotation3::new(turn.into()).inverse() * acceleration;
                turned.component_mul(&Vector3::from(gain))
            };
            let own = Calibration { misalignment: turn, acceleration_gain: gain, ..Calibration::default() };
            for (axis, matrix) in own.turning().iter().enumerate() {
                let moved = |by: f64| {
                    let mut turn = turn;
                    turn[axis] += by;
                    reading(turn)
                };
                let numeric: Vector3<f64> = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                prop_assert!((matrix * reading(turn) - numeric).norm() < 1e-8);
            }
        }
    }
}
