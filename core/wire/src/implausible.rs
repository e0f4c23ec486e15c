//! Readings that the robot and its sensors cannot have.

use core::fmt;

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::text::{FileName, Name};
use crate::words::{Count, Enumeration};

/// Number of axes of the sensors: force x, y, z, acceleration x, y, z.
pub const AXES: usize = 6;

/// Signals of the sensors, each with the number of the frames concerned.
pub type Signals = Vec<SignalFrames, AXES>;

/// A kind of readings that the robot and its sensors cannot have, with its likely cause.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum Implausible {
    /// A joint is beyond its limits.
    BeyondLimits(BeyondLimits),
    /// The accelerometer reads gravity at rest, but the configuration denies it.
    GravityDenied {
        /// Size of the acceleration at rest, m/s².
        reading: f64,
        /// Line of the configuration that denies gravity.
        by: GravityDenial,
        /// Name of the configuration file.
        file: FileName,
    },
    /// The accelerometer reads gravity at rest in another unit than m/s².
    GravityInUnit {
        /// Size of the acceleration at rest, taken for m/s².
        reading: f64,
        /// Likely unit.
        unit: AccelerationUnit,
    },
    /// Signals that never change while others do.
    Stuck(Signals),
    /// Signals that reach a largest value again and again, and never exceed it.
    Flat(Signals),
    /// Signals with single samples far beyond their neighbours.
    Spikes(Signals),
    /// Signals that were clipped in records, at the end of the sensor's range.
    Clipped(WrongSamples),
    /// Signals that repeated their last value in records, although they should have moved.
    Held(WrongSamples),
}

/// Wrong samples of records.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct WrongSamples {
    /// Signals, each with the number of its wrong samples. Those of records that were not refused are bridged.
    pub signals: Signals,
    /// Number of records that were refused, since they have too many.
    pub refused: u64,
}

/// A joint beyond its limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct BeyondLimits {
    /// Name of the joint's signal.
    pub signal: Name,
    /// Name of the joint.
    pub joint: Name,
    /// True if the joint slides. Else it turns.
    pub slides: bool,
    /// Reading, rad (m).
    pub value: f64,
    /// Lower and upper limit, rad (m). A sliding joint may lack one.
    pub limits: [Option<f64>; 2],
    /// True if the reading lies within the limits if it is in degrees (mm).
    pub in_other_unit: bool,
    /// Number of other joints beyond their limits. This joint is the farthest.
    pub others: u8,
}

/// Line of the configuration that denies gravity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum GravityDenial {
    /// `gravity_m_per_s2` is zero.
    NoGravity,
    /// `accelerometer` is "inertial".
    Inertial,
}

/// Unit of an acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum AccelerationUnit {
    /// Standard gravity.
    G,
    /// mg or cm/s², which are almost equal.
    MilliG,
    /// mm/s².
    MillimetrePerS2,
}

/// A signal, and the number of its frames that are concerned.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct SignalFrames {
    /// Name of the signal.
    pub signal: Name,
    /// Number of frames.
    pub frames: u64,
}

impl fmt::Display for Implausible {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BeyondLimits(joint) => joint.fmt(f),
            Self::GravityDenied { reading, by, file } => write!(
                f,
                "the accelerometer reads {reading:.2} m/s² at rest: it feels gravity, but {by} in {file}: \
                 delete that line"
            ),
            Self::GravityInUnit { reading, unit } => write!(
                f,
                "the accelerometer reads {reading:.2} m/s² at rest, gravity is 9.81: is it in {unit}? \
                 give its unit in [bus] dbc"
            ),
            Self::Stuck(signals) => write!(
                f,
                "stuck while others move: {}: check the sensor and its wiring",
                enumerate(signals)
            ),
            Self::Flat(signals) => write!(
                f,
                "flat at its largest value: {}: the sensor is overdriven: widen its range",
                enumerate(signals)
            ),
            Self::Spikes(signals) => write!(
                f,
                "spikes of single samples: {}: check wiring, shield and supply",
                enumerate(signals)
            ),
            Self::Clipped(samples) => write!(
                f,
                "clipped: {samples}: take a sensor or a range that is larger, or cut less"
            ),
            Self::Held(samples) => write!(
                f,
                "repeated while others move: {samples}: check cable and sensor, and set its rate to that of the bus"
            ),
        }
    }
}

impl fmt::Display for BeyondLimits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { signal, joint, value, limits, .. } = self;
        let (unit, other) = if self.slides { ("m", "mm") } else { ("rad", "degrees") };
        write!(f, "{signal} reads {value:.4}, ")?;
        match limits {
            [Some(lower), Some(upper)] => {
                write!(f, "beyond {joint}'s limits, {lower:.4} to {upper:.4} {unit}")
            }
            [Some(lower), None] => write!(f, "below {joint}'s limit, {lower:.4} {unit}"),
            [None, Some(upper)] => write!(f, "above {joint}'s limit, {upper:.4} {unit}"),
            [None, None] => write!(f, "beyond {joint}'s limits"),
        }?;
        if self.others > 0 {
            write!(f, " (and {} beyond theirs)", Count(self.others.into(), "other joint"))?;
        }
        if self.in_other_unit {
            write!(f, ": in {other}? give its unit in [bus] dbc")
        } else {
            write!(f, ": check its unit ({other}?) and offset, or mend the limits in [model] file")
        }
    }
}

impl fmt::Display for GravityDenial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoGravity => "gravity_m_per_s2 is zero",
            Self::Inertial => "accelerometer is \"inertial\"",
        })
    }
}

impl fmt::Display for AccelerationUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::G => "g",
            Self::MilliG => "mg or cm/s^2",
            Self::MillimetrePerS2 => "mm/s^2",
        })
    }
}

impl fmt::Display for WrongSamples {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        enumerate(&self.signals).fmt(f)?;
        match self.refused {
            0 => f.write_str(" (bridged)"),
            refused => write!(f, " ({} refused)", Count(refused, "record")),
        }
    }
}

impl fmt::Display for SignalFrames {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} in {}", self.signal, Count(self.frames, "frame"))
    }
}

/// Returns the enumeration of all `signals`.
pub(crate) fn enumerate(signals: &Signals) -> impl fmt::Display {
    Enumeration { named: signals, more: 0 }
}
