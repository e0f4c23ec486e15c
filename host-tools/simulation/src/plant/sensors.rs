//! Errors of a sensor, from the true signal to the reading.
//!
//! The signal is given on a grid finer than the samples. In order: the axes are mixed (gain, crosstalk), filters act, the clock
//! samples, noise adds, the range clips, the converter rounds, and a stuck axis repeats its last value. The clamping angles and the place are
//! errors of the geometry ([`Sensor::angle_rad`], [`Sensor::offset_m`]), and act where the motion is computed.

use nalgebra::{Matrix3, Vector3};
use rand_core::Rng;
use serde::Deserialize;

use super::clock::Clock;
use super::filter::{Filter, filtered};
use super::interpolation::interpolated;
use super::noise::Disturbance;
use super::range::{all_between, between};

/// Errors of a sensor. Forces are in N, accelerations in m/s².
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sensor {
    /// Rotation vector from the configured axes to the true ones, along the configured axes, rad. Typical: 2.4e-3 (0.14°), 0.1 mm over a
    /// flange of 40 mm; 9e-3 (0.5°) where the sensor is aligned by eye.
    pub angle_rad: [f64; 3],
    /// True place less the configured place, TCP axes, m (the accelerometer only). Typical: 2e-3, a ruler.
    pub offset_m: [f64; 3],
    /// Reading per true value of each axis. Typical: 1 ± 0.01 (calibration uncertainty of industrial force sensors and accelerometers in
    /// data sheets: 0.5 to 2 %).
    pub gain: [f64; 3],
    /// Part of each other axis that an axis shows. Typical: 0.01 to 0.02 (Kistler 9257B: ≤ 2 %; transverse sensitivity of
    /// accelerometers: ≤ 5 %).
    pub crosstalk: f64,
    /// Corner of a Butterworth low-pass, Hz; 0 without. Typical: 500 to 1000, a quarter of the output rate.
    pub low_pass_hz: f64,
    /// Order of the low-pass. Typical: 2.
    pub low_pass_order: u32,
    /// Corner of a first-order high-pass, Hz; 0 without. Typical: 0.16, a discharge time of 1 s (IEPE accelerometers and charge amplifiers).
    pub high_pass_hz: f64,
    /// Resonance of the sensor with what it carries, Hz; 0 without. Typical: 1000 to 2300 (Kistler 9257B unloaded: 2300).
    pub resonance_hz: f64,
    /// Damping ratio of that resonance. Typical: 0.02, a bolted joint.
    pub resonance_damping: f64,
    /// Errors of the clock.
    pub clock: Clock,
    /// Disturbances beside the white noise of the scenario.
    pub noise: Disturbance,
    /// Largest magnitude of a reading; 0 for no limit. Typical: 5000 N; 20 m/s² (a MEMS accelerometer of 2 g).
    pub limit: f64,
    /// Step of the converter; 0 for none beyond the frame's. Typical: 0.5 N; 0.005 m/s² (16 bits).
    pub quantum: f64,
    /// An axis that sticks.
    pub stuck: Option<Stuck>,
}

/// An axis that repeats its reading for a while.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stuck {
    /// The axis: 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// Start, s from the first sample of each cut.
    pub from_s: f64,
    /// Duration, s. Typical: 0.05, a converter that restarts; a whole cut, a broken wire.
    pub for_s: f64,
}

impl Default for Sensor {
    fn default() -> Self {
        Self {
            angle_rad: [0.0; 3],
            offset_m: [0.0; 3],
            gain: [1.0; 3],
            crosstalk: 0.0,
            low_pass_hz: 0.0,
            low_pass_order: 2,
            high_pass_hz: 0.0,
            resonance_hz: 0.0,
            resonance_damping: 0.02,
            clock: Clock::default(),
            noise: Disturbance::default(),
            limit: 0.0,
            quantum: 0.0,
            stuck: None,
        }
    }
}

impl Sensor {
    pub(super) fn check(&self, place: &str) -> Result<(), String> {
        let key = |key: &str| format!("[{place}] {key}");
        all_between(&key("angle_rad"), &self.angle_rad, [-3.2, 3.2])?;
        all_between(&key("offset_m"), &self.offset_m, [-10.0, 10.0])?;
        all_between(&key("gain"), &self.gain, [-100.0, 100.0])?;
        between(&key("crosstalk"), self.crosstalk, [-1.0, 1.0])?;
        between(&key("low_pass_order"), f64::from(self.low_pass_order), [1.0, 8.0])?;
        between(&key("resonance_damping"), self.resonance_damping, [1e-3, 10.0])?;
        for (name, value, least) in [
            ("low_pass_hz", self.low_pass_hz, 1.0),
            ("high_pass_hz", self.high_pass_hz, 0.01),
            ("resonance_hz", self.resonance_hz, 10.0),
            ("quantum", self.quantum, 1e-9),
        ] {
            if value != 0.0 {
                between(&key(name), value, [least, 1e6])?;
            }
        }
        between(&key("limit"), self.limit, [0.0, 1e9])?;
        if let Some(Stuck { axis, from_s, for_s }) = self.stuck {
            between(&format!("[{place}.stuck] axis"), axis as f64, [0.0, 2.0])?;
            all_between(
                &format!("[{place}.stuck] from_s and for_s"),
                &[from_s, for_s],
                [0.0, 1e6],
            )?;
        }
        self.clock.check(&format!("{place}.clock"))?;
        self.noise.check(&format!("{place}.noise"))
    }

    /// Readings of one cut. `signal` has `fineness` values per sample along the axes of the sensor, `white` is the standard deviation of
    /// the white noise, and `turned` the angle of the spindle at each sample, rad.
    pub fn read(
        &self,
        signal: &[Vector3<f64>],
        fineness: usize,
        rate_hz: f64,
        white: f64,
        turned: &[f64],
        rng: &mut impl Rng,
    ) -> Vec<Vector3<f64>> {
        let fine_hz = rate_hz * fineness as f64;
        let mixing = self.mixing();
        let mixed: Vec<_> = signal.iter().map(|value| mixing * value).collect();
        let axes = [0, 1, 2].map(|axis| {
            let series: Vec<f64> = mixed.iter().map(|value| value[axis]).collect();
            filtered(&series, fine_hz, &self.filters())
        });
        let instants = self.clock.instants(turned.len(), rate_hz, rng);
        let mut readings = vec![Vector3::zeros(); turned.len()];
        for (axis, series) in axes.iter().enumerate() {
            let noise = self.noise.draw(white, rate_hz, turned, rng);
            for ((reading, &instant), noise) in readings.iter_mut().zip(&instants).zip(noise) {
                reading[axis] =
                    self.convert(interpolated(series, instant * fineness as f64) + noise);
            }
        }
        if let Some(stuck) = self.stuck {
            let [from, to] = [stuck.from_s, stuck.from_s + stuck.for_s]
                .map(|time| ((time * rate_hz) as usize).min(readings.len()));
            for n in from.max(1)..to {
                readings[n][stuck.axis] = readings[n - 1][stuck.axis];
            }
        }
        readings
    }

    /// Gains and crosstalk.
    fn mixing(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|row, column| if row == column { self.gain[row] } else { self.crosstalk })
    }

    /// The filters that are there.
    pub fn filters(&self) -> Vec<Filter> {
        let low = Filter::LowPass { corner_hz: self.low_pass_hz, order: self.low_pass_order };
        let resonance =
            Filter::Resonance { hz: self.resonance_hz, damping: self.resonance_damping };
        [
            (self.low_pass_hz, low),
            (self.high_pass_hz, Filter::HighPass { corner_hz: self.high_pass_hz }),
            (self.resonance_hz, resonance),
        ]
        .into_iter()
        .filter_map(|(hz, filter)| (hz > 0.0).then_some(filter))
        .collect()
    }

    /// Range and resolution of the converter.
    fn convert(&self, value: f64) -> f64 {
        let value = if self.limit > 0.0 { value.clamp(-self.limit, self.limit) } else { value };
        if self.quantum > 0.0 { (value / self.quantum).round() * self.quantum } else { value }
    }
}
