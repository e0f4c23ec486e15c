//! The sampling rate, where the frames contradict the configured one.

use core::fmt;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::text::FileName;

/// A sampling rate that differs from the configured one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct WrongRate {
    /// Name of the configuration file.
    pub file: FileName,
    /// Configured rate, Hz.
    pub rate_hz: f64,
    /// Measured rate, Hz.
    pub measured_hz: f32,
}

/// Rate that the records have.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum RateUsed {
    /// The measured rate.
    Measured,
    /// The configured rate: the sender was held up.
    Configured,
    /// None: the records came too fast.
    TooFast,
    /// None: the measured rate is too uncertain.
    Uncertain {
        /// Standard deviation of the measured rate, Hz.
        std_hz: f32,
    },
}

impl fmt::Display for WrongRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, rate_hz, measured_hz } = self;
        let measured_hz = f64::from(*measured_hz);
        // There are as many decimals as the difference needs.
        let places = if (measured_hz / rate_hz - 1.0).abs() > 0.01 { 0 } else { 2 };
        write!(
            f,
            "{file}: [measurement] rate_hz is {rate_hz}, but frames come at {measured_hz:.places$}/s"
        )
    }
}

impl fmt::Display for RateUsed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Measured => f.write_str("that is used"),
            Self::Configured => f.write_str("held up, so rate_hz is used"),
            Self::TooFast => f.write_str("too fast to be used"),
            Self::Uncertain { std_hz } => {
                write!(f, "± {std_hz:.2}: too uncertain to be used, so nothing is identified")
            }
        }
    }
}
