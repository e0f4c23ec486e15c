//! Sampling of the sensors.

use serde::Deserialize;

use super::limits::{not_negative, within};

/// Standard gravity, the unit of accelerometers' noise, m/s².
const STANDARD_GRAVITY: f64 = 9.80665;
/// Smallest length of an experiment, that of the shortest record which the daemon takes, samples.
const FEWEST_SAMPLES: usize = 256;

/// Rate of the joint angles of a robot that stands, Hz. Chosen: the cycle of slow controllers.
const STANDING_HZ: f64 = 10.0;

/// Sampling of force and acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sampling {
    /// Sampling rate, Hz.
    pub rate_hz: f64,
    /// Length of an experiment, s.
    pub duration_s: f64,
    /// Rate of the joint angles on the bus, Hz; `None` for 10 Hz, and 100 Hz of a robot that feeds.
    pub angle_rate_hz: Option<f64>,
    /// Band in which displacements are compared, Hz.
    pub band_hz: [f64; 2],
    /// Amplitude density of the accelerometer's noise, one-sided, standard gravities.
    pub acceleration_noise_g_per_sqrt_hz: f64,
    /// Amplitude density of the force sensor's noise, one-sided.
    pub force_noise_n_per_sqrt_hz: f64,
}

impl Sampling {
    /// Standard deviation of one force sample's noise, N.
    pub fn force_noise(&self) -> f64 {
        self.force_noise_n_per_sqrt_hz * (self.rate_hz / 2.0).sqrt()
    }

    /// Standard deviation of one acceleration sample's noise, m/s².
    pub fn acceleration_noise(&self) -> f64 {
        self.acceleration_noise_g_per_sqrt_hz * STANDARD_GRAVITY * (self.rate_hz / 2.0).sqrt()
    }

    /// Number of samples of one experiment.
    pub fn samples(&self) -> usize {
        (self.rate_hz * self.duration_s).round() as usize
    }

    /// Rate of the joint angles on the bus, Hz.
    pub fn angle_rate_hz(&self) -> f64 {
        self.angle_rate_hz.unwrap_or(STANDING_HZ)
    }
}

impl Sampling {
    /// Longest experiment, s. Its fine grid is held in memory.
    const LONGEST_S: f64 = 120.0;

    pub(super) fn check(&self) -> Result<(), String> {
        within("[measurement] rate_hz", self.rate_hz, 20_000.0)?;
        self.check_duration("[measurement]")?;
        if let Some(hz) = self.angle_rate_hz {
            within("[measurement] angle_rate_hz", hz, self.rate_hz)?;
        }
        let [lower, upper] = self.band_hz;
        if !(0.0 < lower && lower < upper && upper < self.rate_hz / 2.0) {
            return Err(format!(
                "[measurement] band_hz is [{lower}, {upper}]: must be 0 < lower < upper < rate_hz / 2"
            ));
        }
        if (upper - lower) * self.duration_s < 1.0 {
            return Err(format!(
                "[measurement] band_hz is [{lower}, {upper}]: must be at least 1 / duration_s wide"
            ));
        }
        let noise = [
            ("acceleration_noise_g_per_sqrt_hz", self.acceleration_noise_g_per_sqrt_hz),
            ("force_noise_n_per_sqrt_hz", self.force_noise_n_per_sqrt_hz),
        ];
        noise
            .iter()
            .try_for_each(|(key, value)| not_negative(&format!("[measurement] {key}"), *value))
    }

    /// Checks the length of an experiment, which `place` states.
    pub(super) fn check_duration(&self, place: &str) -> Result<(), String> {
        within(&format!("{place} duration_s"), self.duration_s, Self::LONGEST_S)?;
        if self.samples() < FEWEST_SAMPLES {
            return Err(format!(
                "{place} duration_s is {}: must hold at least {FEWEST_SAMPLES} samples, {} s",
                self.duration_s,
                FEWEST_SAMPLES as f64 / self.rate_hz
            ));
        }
        Ok(())
    }
}
