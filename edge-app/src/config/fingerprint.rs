//! What numbers depend on in a config, as checksums: whether those of an earlier run still hold, and if not, why.

use std::fmt::Debug;

use serde::{Deserialize, Serialize};

use super::Config;

/// What says how records were measured: under another of these they say something else.
const MEASURED: [&str; 6] = [
    "[model] file",
    "[model] gravity_m_per_s2",
    "[bus] dbc or [signals]",
    "[measurement] rate_hz",
    "[measurement] accelerometer",
    "[mounting]",
];
/// What says how they are fitted: the same records can be fitted anew.
const FITTED: [&str; 5] =
    ["[measurement] band_hz", "[bounds]", "[calibration] or [parameters]", "[static]", "[search]"];

/// Checksums of the parts of a config that a fit depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fingerprint {
    measured: [u32; MEASURED.len()],
    fitted: [u32; FITTED.len()],
}

/// How much of what was found under one config holds under another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Validity {
    /// All.
    Whole,
    /// The records, but not the fit: these sections and keys have changed.
    Records(Vec<&'static str>),
    /// Nothing: these have changed.
    Nothing(Vec<&'static str>),
}

impl Fingerprint {
    /// Of a config.
    pub fn of(config: &Config) -> Self {
        Self {
            measured: [
                checksum(&config.model),
                checksum(&config.gravity),
                checksum(&config.signals.described()),
                checksum(&config.rate_hz),
                checksum(&config.accelerometer),
                checksum(&config.mounting),
            ],
            fitted: [
                checksum(&config.band_hz),
                checksum(&config.bounds),
                checksum(&config.sought),
                checksum(&config.statics),
                checksum(&config.seed),
            ],
        }
    }

    /// How much of what was found under it holds under `other`.
    pub fn validity(&self, other: &Self) -> Validity {
        let measured = changed(&MEASURED, &self.measured, &other.measured);
        let fitted = changed(&FITTED, &self.fitted, &other.fitted);
        if !measured.is_empty() {
            Validity::Nothing(measured)
        } else if !fitted.is_empty() {
            Validity::Records(fitted)
        } else {
            Validity::Whole
        }
    }
}

fn changed(places: &[&'static str], before: &[u32], now: &[u32]) -> Vec<&'static str> {
    let pairs = places.iter().zip(before.iter().zip(now));
    pairs.filter(|(_, (before, now))| before != now).map(|(place, _)| *place).collect()
}

/// Of the value as `Debug` writes it, which tells any two numbers apart.
fn checksum(value: &impl Debug) -> u32 {
    crc32fast::hash(format!("{value:?}").as_bytes())
}
