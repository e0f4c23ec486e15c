//! State of the daemon: what it waits for, or what keeps it from records.

use core::fmt;

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::implausible::Implausible;
use crate::misfits::{Misfit, UnknownFrames};
use crate::rate::WrongRate;
use crate::text::Name;
use crate::trouble::BusFault;
use crate::unused::Unused;
use crate::verdict::MAX_JOINTS;
use crate::words::Count;

/// State of the daemon, or of a run over a recording at its end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// No frame has come.
    NoFrames,
    /// The bus has reported errors only.
    OnlyErrors {
        /// Number of errors.
        errors: u64,
        /// Name of the CAN interface.
        interface: Name,
    },
    /// The bus has a fault, so that no frames can come.
    BusFault(BusFault),
    /// Frames come, but cannot become records.
    Obstacle(Obstacle),
    /// No frame has an identifier of the DBC file.
    UnknownFrames(UnknownFrames),
    /// No force has come.
    NoForce,
    /// No acceleration has come.
    NoAcceleration,
    /// No angle of these joints has come.
    NoAngles(Vec<Name, MAX_JOINTS>),
    /// All signals come. The first record is awaited.
    AwaitingRecord {
        /// Length of a record, s.
        seconds: f64,
        /// Largest force so far, N, if a cut has a larger one.
        faint_force_n: Option<f32>,
        /// Gravest kind of implausible readings.
        implausible: Option<Implausible>,
    },
    /// The angle of a joint does not come any more.
    AngleStopped {
        /// Name of the joint.
        joint: Name,
        /// Gravest kind of implausible readings.
        implausible: Option<Implausible>,
    },
    /// Records come.
    Measuring {
        /// Gravest kind of implausible readings.
        implausible: Option<Implausible>,
    },
    /// There are records, but the numbers do not rest on them.
    Unused(Unused),
    /// The frames of this sensor do not come any more.
    SensorSilent(Sensor),
    /// The angle of a joint comes, but the newest is no measurement: an end of its signal, beyond the limits of the joint.
    AngleNotAvailable {
        /// Name of the joint.
        joint: Name,
        /// Reading, rad (m).
        value: f64,
    },
}

/// Reason why frames cannot become records.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum Obstacle {
    /// Frames differ from the DBC file.
    Misfit(Misfit),
    /// Frames come at another rate than the configured one.
    WrongRate(WrongRate),
    /// The counter of a sensor does not count.
    CounterStandsStill {
        /// The sensor.
        sensor: Sensor,
        /// Number of frames whose counter equals that of the frame before.
        frames: u64,
    },
    /// The counters of force and acceleration do not belong together.
    CountersApart {
        /// Number of jumps of the counters.
        jumps: u64,
    },
    /// Readings are not finite.
    NotFinite {
        /// Number of readings.
        readings: u64,
    },
    /// Readings are at the limits of their signals.
    Clipped {
        /// Number of frames with such a reading.
        frames: u64,
    },
    /// The counters jump so often that no stretch between is as long as a record.
    CountersJump {
        /// Number of jumps after which the stream began anew.
        jumps: u64,
        /// Number of frames that are missing by the other jumps.
        lost: u64,
    },
}

/// A sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum Sensor {
    /// The force sensor.
    Force,
    /// The accelerometer.
    Acceleration,
}

impl State {
    /// Returns whether the state needs nobody to act.
    pub fn is_in_order(&self) -> bool {
        match self {
            Self::NoFrames => true,
            Self::AwaitingRecord { implausible, faint_force_n, .. } => {
                implausible.is_none() && faint_force_n.is_none()
            }
            Self::Measuring { implausible } => implausible.is_none(),
            _ => false,
        }
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoFrames => f.write_str("waiting for frames"),
            Self::OnlyErrors { errors, interface } => write!(
                f,
                "waiting for frames: {} of the bus and no frame: is the bit rate of {interface} that of the bus?",
                Count(*errors, "error")
            ),
            Self::BusFault(fault) => fault.fmt(f),
            Self::Obstacle(obstacle) => obstacle.fmt(f),
            Self::UnknownFrames(frames) => write!(f, "no frame of [bus] dbc: {frames}"),
            Self::NoForce => f.write_str("waiting for force frames: none seen"),
            Self::NoAcceleration => f.write_str("waiting for acceleration frames: none seen"),
            Self::NoAngles(joints) => {
                f.write_str("waiting for joint angles: ")?;
                for (index, joint) in joints.iter().enumerate() {
                    write!(f, "{}{joint}", if index == 0 { "" } else { ", " })?;
                }
                f.write_str(" not seen")
            }
            Self::AwaitingRecord { seconds, faint_force_n, implausible } => {
                write!(
                    f,
                    "waiting for the first record: {seconds:.1} s of milling, standing or at an even feed"
                )?;
                if let Some(largest) = faint_force_n {
                    write!(f, "; no force above {largest:.2} N so far: in kN?")?;
                }
                and(f, implausible)
            }
            Self::AngleStopped { joint, implausible } => {
                write!(f, "waiting for joint angles: {joint} does not come any more")?;
                and(f, implausible)
            }
            Self::Measuring { implausible } => {
                f.write_str("measuring")?;
                and(f, implausible)
            }
            Self::Unused(records) => records.fmt(f),
            Self::SensorSilent(sensor) => {
                write!(f, "waiting for {sensor} frames: they do not come any more")
            }
            Self::AngleNotAvailable { joint, value } => write!(
                f,
                "waiting for joint angles: {joint} comes, but reads {value:.4}, an end of its signal (not available)"
            ),
        }
    }
}

/// Writes the implausible readings after a state.
fn and(f: &mut fmt::Formatter<'_>, implausible: &Option<Implausible>) -> fmt::Result {
    implausible.iter().try_for_each(|implausible| write!(f, "; {implausible}"))
}

impl fmt::Display for Obstacle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Misfit(misfit) => misfit.fmt(f),
            Self::WrongRate(rate) => rate.fmt(f),
            Self::CounterStandsStill { sensor, frames } => write!(
                f,
                "[signals] {sensor}_counter stands still ({frames} frames): it must count the instants"
            ),
            Self::CountersApart { jumps } => write!(
                f,
                "the counters of force and acceleration do not go together ({jumps} jumps): \
                 both must be equal at the same instant"
            ),
            Self::NotFinite { readings } => write!(
                f,
                "{readings} readings are no finite numbers: check the factors in [bus] dbc"
            ),
            Self::Clipped { frames } => write!(
                f,
                "{frames} frames of force and acceleration are at the limit of a signal: \
                 the sensor is overloaded, or its range in [bus] dbc is too small"
            ),
            Self::CountersJump { jumps, lost } => write!(
                f,
                "the counters of force or acceleration jump ({}, {} missing), so that no stretch is \
                 as long as a record: check the sensors' supply and the load of the bus",
                Count(*jumps, "restart"),
                Count(*lost, "frame")
            ),
        }
    }
}

impl fmt::Display for Sensor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Force => "force",
            Self::Acceleration => "acceleration",
        })
    }
}
