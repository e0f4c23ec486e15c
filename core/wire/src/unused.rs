//! Records that the numbers do not rest on.

use core::fmt;

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::text::Name;
use crate::verdict::MAX_JOINTS;
use crate::words::Count;

/// Records that the numbers do not rest on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum Unused {
    /// The records were refused.
    Refused {
        /// Number of records.
        records: u64,
        /// Fault of the first of them.
        first: RecordFault,
    },
    /// The run ended before the newest records were worked through.
    Unfinished {
        /// Number of records.
        records: u64,
    },
}

/// Fault of a record that makes it useless.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum RecordFault {
    /// A robot as stiff as the bounds allow has no equilibrium under gravity at the record's pose.
    NoEquilibrium {
        /// Name of the joint that gives way.
        joint: Name,
        /// Joint angles, rad (m).
        pose: Vec<f64, MAX_JOINTS>,
    },
    /// The pose has this many angles, not one for each joint.
    Pose(u64),
    /// The record has too few samples.
    Samples(u64),
    /// The band holds too few or too many bins.
    Bins(u64),
    /// A value is not finite.
    NotFinite,
    /// The force in the band is hardly larger than its noise.
    NoForce,
    /// The robot starts, stops or turns in all parts of the record.
    Uneven,
}

impl fmt::Display for Unused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused { records, first } => {
                write!(f, "{} refused, the first because {first}", Count(*records, "record"))
            }
            Self::Unfinished { records: 1 } => f.write_str(
                "ended before the newest record was worked through: it is not in the numbers",
            ),
            Self::Unfinished { records } => write!(
                f,
                "ended before the newest {records} records were worked through: they are not in the numbers"
            ),
        }
    }
}

impl fmt::Display for RecordFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoEquilibrium { joint, pose } => {
                write!(f, "{joint} gives way under gravity at (")?;
                for (index, angle) in pose.iter().enumerate() {
                    write!(f, "{}{angle:.2}", if index == 0 { "" } else { ", " })?;
                }
                f.write_str("): raise [bounds] or check masses")
            }
            Self::Pose(angles) => write!(f, "its pose has {angles} angles"),
            Self::Samples(samples) => {
                write!(f, "its {samples} samples are too few: record for longer")
            }
            Self::Bins(bins) => {
                write!(f, "its band holds {bins} bins: widen [measurement] band_hz")
            }
            Self::NotFinite => f.write_str("it has values that are not finite"),
            Self::NoForce => {
                f.write_str("its force in the band is hardly above its noise: cut harder")
            }
            Self::Uneven => {
                f.write_str("the robot starts, stops or turns in most of it: feed evenly")
            }
        }
    }
}
