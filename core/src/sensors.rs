//! The sensors of a measurement, as a model needs them.

use nalgebra::Vector3;

use crate::mounting::Mounting;

/// Kind of accelerometer: how its axes move, and whether it measures gravity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Accelerometer {
    /// The axes stay fixed in space. Gravity is not in the reading, or has been removed.
    Inertial,
    /// The axes turn with the tool. Gravity is in the reading; the reading at rest has been removed.
    Strapdown,
}

impl Accelerometer {
    /// Returns whether `gravity` (m/s², any axes) shows in the reading as the tool turns.
    pub(crate) fn feels(self, gravity: &Vector3<f64>) -> bool {
        self == Self::Strapdown && *gravity != Vector3::zeros()
    }
}

/// A force sensor and an accelerometer. The default has both at the TCP, along its axes and without errors, and the accelerometer
/// inertial. The force acts at the TCP.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensors {
    /// Kind of accelerometer.
    pub accelerometer: Accelerometer,
    /// Places and axes of both sensors.
    pub mounting: Mounting,
    /// Delay of the acceleration after the force of the same counter, s.
    pub delay: f64,
    /// Gain of each axis of the accelerometer, reading per acceleration.
    pub acceleration_gain: [f64; 3],
    /// Point of the tool at which the force acts, from the TCP, TCP axes, m.
    pub point: Vector3<f64>,
}

impl Default for Sensors {
    fn default() -> Self {
        Self {
            accelerometer: Accelerometer::Inertial,
            mounting: Mounting::AT_TCP,
            delay: 0.0,
            acceleration_gain: [1.0; 3],
            point: Vector3::zeros(),
        }
    }
}
