//! Places where a fit leaves more than elsewhere, and which family of causes that points to.

use core::fmt;

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::verdict::MAX_JOINTS;

/// Largest number of places of a report.
pub const MAX_LEFT_OVER: usize = 7;
/// Names of the axes of a sensor.
const AXES: [&str; 3] = ["x", "y", "z"];

/// A place where more is left than elsewhere. `times` is the mean square of the residuals there, in units of the noise, over that of all others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum LeftOver {
    /// In a band.
    Frequency {
        /// Lower end, Hz.
        from_hz: f64,
        /// Upper end, Hz.
        to_hz: f64,
        /// How many times what is left elsewhere.
        times: f64,
    },
    /// Along an axis of the accelerometer.
    Direction {
        /// Number of the axis, 0 to 2.
        axis: u8,
        /// How many times what is left along the others.
        times: f64,
    },
    /// In a record.
    Record {
        /// Its number, from 1.
        record: u8,
        /// Its joint angles, rad (m).
        pose: Vec<f64, MAX_JOINTS>,
        /// How many times what is left of the others.
        times: f64,
    },
    /// In a part of every record.
    Time {
        /// Start, as a part of the record, 0 to 1.
        from: f64,
        /// End, likewise.
        to: f64,
        /// How many times what is left in the rest.
        times: f64,
    },
    /// The residuals at one pose go with another power of the force than 1, with which an error of a linear model goes.
    Force {
        /// This power.
        exponent: f64,
        /// Its standard deviation.
        std: f64,
    },
    /// All stiffnesses at the same pose go with the force.
    Stiffness {
        /// By which part they grow where the force doubles.
        growth: f64,
        /// Its standard deviation.
        std: f64,
    },
    /// The residuals are no response to the force, so that no linear model explains it.
    Distortion {
        /// The part of it that no smooth response to the force explains.
        part: f64,
    },
}

/// For example `direction z: 2.2 times the others: gain, axis or cable of that axis`.
impl fmt::Display for LeftOver {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frequency { from_hz, to_hz, times } => write!(
                f,
                "{} to {} Hz: {times:.1} times the rest: a filter or resonance of a sensor, a resonance that the model lacks, or noise that grows there",
                Hz(*from_hz),
                Hz(*to_hz)
            ),
            Self::Direction { axis, times } => {
                let axis = AXES.get(usize::from(*axis)).unwrap_or(&"?");
                write!(
                    f,
                    "direction {axis}: {times:.1} times the others: gain, axis or cable of that axis"
                )
            }
            Self::Record { record, pose, times } => {
                write!(f, "record {record} (pose")?;
                for angle in pose {
                    write!(f, " {angle:.2}")?;
                }
                write!(
                    f,
                    "): {times:.1} times the others: its joint angles, clock or trigger, or what differed in that cut"
                )
            }
            Self::Time { from, to, times } => write!(
                f,
                "{:.0} to {:.0} % of the records: {times:.1} times the rest: drift, warming or feed, or what the cut does then",
                100.0 * from,
                100.0 * to
            ),
            Self::Force { exponent, std } => {
                let family = if *exponent > 1.0 {
                    "springs that stiffen or soften with load"
                } else {
                    "friction or backlash"
                };
                write!(
                    f,
                    "at the same pose as force^{exponent:.1} ± {std:.1}, not force^1: nonlinear: {family}"
                )
            }
            Self::Stiffness { growth, std } => write!(
                f,
                "at the same pose all stiffnesses {} by {:.1} ± {:.1} % where the force doubles: the joints are nonlinear: cut with \
                 the force of the process",
                if *growth < 0.0 { "fall" } else { "grow" },
                100.0 * growth.abs(),
                100.0 * std
            ),
            Self::Distortion { part } => write!(
                f,
                "{:.0} % is no response to the force: nonlinear: friction, backlash or clipping; or a clock that wanders, or shocks",
                100.0 * part
            ),
        }
    }
}

/// A frequency with two digits or more.
struct Hz(f64);

impl fmt::Display for Hz {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = if self.0 < 9.95 { 1 } else { 0 };
        write!(f, "{:.digits$}", self.0)
    }
}
