//! Disturbances of a sensor: coloured noise, hum, lines of spindle and bearings, spikes.

use std::f64::consts::{LN_2, TAU};

use rand_core::Rng;
use rand_distr::{Distribution, Exp, StandardNormal};
use serde::Deserialize;

use super::range::{all_between, between};

/// Largest number of spindle lines.
const MOST_ORDERS: usize = 32;

/// Disturbances of every axis of a sensor, in its unit: N or m/s².
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Disturbance {
    /// Frequency below which the noise is pink, Hz: its amplitude density grows as `√(1 + corner/f)`. Typical: 1 to 10, the corner of amplifiers
    /// and piezoelectric sensors in data sheets.
    pub pink_below_hz: f64,
    /// Frequency of the mains, Hz. Typical: 50 or 60.
    pub hum_hz: f64,
    /// Amplitude of the hum; its third harmonic has a third of it. Typical: 1 N, 0.02 m/s², a cable beside that of a drive.
    pub hum: f64,
    /// Frequencies of lines per turn of the spindle. Typical: 1 (imbalance); 3.57 and 5.43 (outer and inner race of a bearing of nine balls;
    /// Randall and Antoni, Mechanical Systems and Signal Processing 25, 2011).
    pub spindle_orders: Vec<f64>,
    /// Amplitude of each of these lines. Typical: 0.3 m/s² on the accelerometer (0.71 mm/s rms at 50 Hz, zone A of class I in ISO 10816-1).
    pub spindle: f64,
    /// Mean number of spikes a second on each axis. Typical: 0.1, loose contacts and sparks.
    pub spikes_per_s: f64,
    /// Standard deviation of a spike. Typical: 50 N, 20 m/s².
    pub spike: f64,
}

impl Disturbance {
    pub(super) fn check(&self, place: &str) -> Result<(), String> {
        for (key, value, most) in [
            ("pink_below_hz", self.pink_below_hz, 1e4),
            ("hum_hz", self.hum_hz, 1e4),
            ("hum", self.hum, 1e6),
            ("spindle", self.spindle, 1e6),
            ("spikes_per_s", self.spikes_per_s, 1e4),
            ("spike", self.spike, 1e9),
        ] {
            between(&format!("[{place}] {key}"), value, [0.0, most])?;
        }
        if self.hum > 0.0 && self.hum_hz == 0.0 {
            return Err(format!("[{place}] hum_hz is 0: give the frequency of the hum, 50 or 60"));
        }
        if self.spindle_orders.len() > MOST_ORDERS {
            let given = self.spindle_orders.len();
            return Err(format!("[{place}] spindle_orders has {given}: at most {MOST_ORDERS}"));
        }
        all_between(&format!("[{place}] spindle_orders"), &self.spindle_orders, [0.0, 1e3])
    }

    /// Noise of one axis: white of the standard deviation `white`, and all disturbances. `turned` is the angle of the spindle at
    /// each sample, rad.
    pub fn draw(&self, white: f64, rate_hz: f64, turned: &[f64], rng: &mut impl Rng) -> Vec<f64> {
        let mut series = self.coloured(white, rate_hz, turned.len(), rng);
        let [hum, third] = [0, 1].map(|_| TAU * uniform(rng));
        let lines: Vec<f64> = self.spindle_orders.iter().map(|_| TAU * uniform(rng)).collect();
        for (n, (value, turned)) in series.iter_mut().zip(turned).enumerate() {
            let mains = TAU * self.hum_hz * n as f64 / rate_hz;
            *value += self.hum * ((mains + hum).sin() + (3.0 * mains + third).sin() / 3.0);
            for (order, phase) in self.spindle_orders.iter().zip(&lines) {
                *value += self.spindle * (order * turned + phase).sin();
            }
        }
        // The times between spikes of a constant mean rate are exponential.
        if let Ok(pause) = Exp::new(self.spikes_per_s / rate_hz)
            && self.spikes_per_s > 0.0
        {
            let mut sample: f64 = pause.sample(rng);
            while sample < series.len() as f64 {
                let height: f64 = StandardNormal.sample(rng);
                series[sample as usize] += self.spike * height;
                sample += pause.sample(rng);
            }
        }
        series
    }

    /// White noise, and pink noise of the same density at the corner: a sum of first-order processes, one an octave (van der Ziel,
    /// Physica 16, 1950).
    fn coloured(&self, white: f64, rate_hz: f64, samples: usize, rng: &mut impl Rng) -> Vec<f64> {
        let mut normal = || -> f64 { StandardNormal.sample(rng) };
        let mut octaves = Vec::new();
        let mut corner = if self.pink_below_hz > 0.0 { rate_hz / 8.0 } else { 0.0 };
        // Processes slower than 0.01 Hz do not change during a cut.
        while corner > 0.01 {
            let keep = (-TAU * corner / rate_hz).exp();
            // One process of corner c and variance v has the one-sided density 2v c / (π (c² + f²)). One an octave they add up to
            // v / (f ln 2); white noise has 2 white² / rate.
            let variance = 2.0 * white * white * LN_2 * self.pink_below_hz / rate_hz;
            octaves.push((keep, variance.sqrt(), variance.sqrt() * normal()));
            corner /= 2.0;
        }
        (0..samples)
            .map(|_| {
                let pink: f64 = octaves
                    .iter_mut()
                    .map(|(keep, deviation, state)| {
                        let now = *state;
                        *state = *keep * now + *deviation * (1.0 - *keep * *keep).sqrt() * normal();
                        now
                    })
                    .sum();
                white * normal() + pink
            })
            .collect()
    }
}

fn uniform(rng: &mut impl Rng) -> f64 {
    f64::from(rng.next_u32()) / 2_f64.powi(32)
}
