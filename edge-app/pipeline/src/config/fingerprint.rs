//! Checksums of the parts of a config that records and fit depend on. They show which results of an earlier run still hold, and
//! which parts have changed.

use std::fmt::Debug;

use serde::{Deserialize, Serialize};

use super::Config;
use crate::model::{ModelJoint, Tcp};

/// Parts of a config that describe how the records were measured. A change of one of them makes the records invalid.
const MEASURED: [&str; 6] = [
    "[model] file",
    "[model] gravity_m_per_s2",
    "[bus] dbc or [signals]",
    "[measurement] rate_hz",
    "[measurement] accelerometer",
    "[mounting]",
];
/// Parts of a config that describe how the records are fitted. After a change of one of them the records are fitted anew.
const FITTED: [&str; 5] = [
    "[measurement] band_hz",
    "[bounds]",
    "[calibration], [parameters] or [accuracy]",
    "[static] or [receptance]",
    "[search]",
];

/// Checksums of the parts of a config that records and fit depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fingerprint {
    measured: [u32; MEASURED.len()],
    fitted: [u32; FITTED.len()],
}

/// What records depend on of a model: all but how far it may be off, which is one of the fit's accuracies.
#[derive(Debug)]
struct Model<'a> {
    // Read by `Debug`, whose text is summed.
    #[expect(dead_code)]
    name: &'a str,
    #[expect(dead_code)]
    joints: &'a [ModelJoint],
    #[expect(dead_code)]
    tcp: &'a Tcp,
}

impl<'a> Model<'a> {
    fn of(config: &'a Config) -> Self {
        let model = &config.model;
        Self { name: &model.name, joints: &model.joints, tcp: &model.tcp }
    }
}

/// The results of one config that hold under another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Validity {
    /// Records and fit hold.
    Whole,
    /// The records hold, but not the fit. These sections and keys have changed.
    Records(Vec<&'static str>),
    /// Nothing holds. These sections and keys have changed.
    Nothing(Vec<&'static str>),
}

impl Fingerprint {
    /// Computes the checksums of a config.
    pub fn of(config: &Config) -> Self {
        Self {
            measured: [
                checksum(&Model::of(config)),
                checksum(&config.gravity),
                checksum(&config.signals.described()),
                checksum(&config.rate_hz),
                checksum(&config.accelerometer),
                checksum(&config.mounting),
            ],
            fitted: [
                checksum(&config.band_hz),
                checksum(&config.bounds),
                checksum(&(&config.sought, &config.accuracies)),
                match config.receptances.as_slice() {
                    [] => checksum(&config.statics.tests),
                    receptances => checksum(&(&config.statics.tests, receptances)),
                },
                checksum(&config.seed),
            ],
        }
    }

    /// Returns a checksum of the parts that describe how the records were measured. Under another they do not hold.
    pub fn of_measurement(&self) -> u32 {
        checksum(&self.measured)
    }

    /// Returns which results found under `self` hold under `other`.
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

/// Computes the CRC-32 of the value's `Debug` text. Any two different numbers have different texts.
fn checksum(value: &impl Debug) -> u32 {
    crc32fast::hash(format!("{value:?}").as_bytes())
}
