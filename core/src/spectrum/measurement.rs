//! How records were measured.

use nalgebra::Vector3;

use crate::calibration::Calibration;
use crate::mounting::Mounting;
use crate::sensors::{Accelerometer, Sensors};

/// Fitted band, gravity and sensors of a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// Lowest and highest frequency that is fitted, Hz.
    pub band_hz: [f64; 2],
    /// Gravity, base axes, m/s².
    pub gravity: [f64; 3],
    /// Kind of accelerometer.
    pub accelerometer: Accelerometer,
    /// Mounting of the sensors.
    pub mounting: Mounting,
}

impl Measurement {
    /// Gravity as a vector, base axes, m/s².
    pub(crate) fn gravity(&self) -> Vector3<f64> {
        Vector3::from(self.gravity)
    }

    /// Returns whether gravity shows in the accelerometer's reading as it turns.
    pub(crate) fn feels_gravity(&self) -> bool {
        self.accelerometer.feels(&self.gravity())
    }

    /// The sensors with the errors in `calibration`, and a force at this point.
    pub(crate) fn sensors(&self, calibration: &Calibration, point: Vector3<f64>) -> Sensors {
        Sensors {
            accelerometer: self.accelerometer,
            mounting: self.mounting,
            calibration: *calibration,
            point,
        }
    }
}
