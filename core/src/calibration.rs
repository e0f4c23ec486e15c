//! What sensors and the model of the masses may be off by, beside the joints that are sought.

use nalgebra::{Matrix3, Vector3};

use crate::MAX_JOINTS;

/// How the measurement differs from what it is taken for. The default differs in nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// By how much the acceleration comes later than the force of the same counter, s.
    pub delay: f64,
    /// Reading per acceleration, of each axis.
    pub acceleration_gain: [f64; 3],
    /// Reading per force, of each axis.
    pub force_gain: [f64; 3],
    /// Rotation vector that turns the accelerometer's axes, as mounted, into what they are, along these axes, rad.
    pub misalignment: [f64; 3],
    /// True mass and inertia of each link per those of the model.
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
    /// How a reading changes per rad of misalignment about each axis: matrices on the reading.
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

/// How far each may be off: one standard deviation of what is known beforehand. `None` takes it as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Nuisances {
    /// s.
    pub delay: Option<f64>,
    /// Of the logarithm of each axis's gain.
    pub acceleration_gain: Option<f64>,
    /// Of the logarithm of each axis's gain.
    pub force_gain: Option<f64>,
    /// Of the angle about each axis, rad.
    pub misalignment: Option<f64>,
    /// Of the logarithm of each link's mass.
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
