//! How records were measured.

use core::ops::Range;

use nalgebra::{Rotation3, Vector3};

use super::site::Site;
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

    /// Numbers of the bins of so many samples that lie in the band, from 1 on.
    pub(super) fn bins(&self, rate_hz: f64, samples: usize) -> Range<usize> {
        let hz_per_bin = rate_hz / samples as f64;
        let first = libm::ceil(self.band_hz[0] / hz_per_bin).max(1.0) as usize;
        let last = (libm::floor(self.band_hz[1] / hz_per_bin) as usize).min(samples / 2 - 1);
        first..(last + 1).max(first)
    }

    /// The sensors without errors, and the force of this site.
    pub(crate) fn sensors(&self, site: &Site<'_>) -> Sensors {
        let mut mounting = self.mounting;
        if site.is_of_test {
            (mounting.force_axes, mounting.tool_mass) = (Rotation3::identity(), 0.0);
        }
        let point = site.point;
        Sensors { accelerometer: self.accelerometer, mounting, point, ..Sensors::default() }
    }
}
