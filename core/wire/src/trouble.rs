//! Troubles of a bus or of a recording.

use core::fmt;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::text::{Name, Text};

/// Present fault of a bus.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct BusFault {
    /// Name of the interface.
    pub interface: Name,
    /// Kind of the fault.
    pub kind: BusFaultKind,
}

/// Kind of a bus' fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum BusFaultKind {
    /// An error counter of the controller is above 96.
    ManyErrors,
    /// An error counter of the controller is above 127.
    ErrorPassive,
    /// The link is down.
    Down,
    /// The controller has left the bus after too many errors.
    BusOff,
    /// The interface does not exist any more.
    Gone,
}

/// Trouble of a source of frames.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum Trouble {
    /// The bus has a fault.
    Bus(BusFault),
    /// The bus cannot be read any more, with the message of the operating system.
    BusBroken(Text),
    /// The first recording that could not be read to its end, with the message of the operating system.
    RecordingBroken(Text),
    /// A further recording that could not be read to its end, with the message of the operating system.
    Unreadable(Text),
    /// A recording has lines that are no frames. They are left out.
    Garbage {
        /// Path of the recording.
        file: Text,
        /// Number of the first such line, from 1.
        line: u64,
        /// Fault of the first such line.
        fault: LineFault,
        /// Number of such lines.
        lines: u64,
    },
    /// A recording has frames of other buses. They are left out.
    OtherBuses {
        /// Path of the recording.
        file: Text,
        /// Interface whose frames are taken.
        bus: Name,
        /// Number of frames of other buses.
        frames: u64,
    },
}

/// Fault of a line of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum LineFault {
    /// The line ends too early.
    EndsEarly,
    /// The line does not begin with a time.
    Timestamp,
    /// The name of the interface is missing or too long.
    DeviceName,
    /// The frame cannot be read.
    Frame,
    /// The mark of the direction is neither R nor T.
    Direction,
    /// The line is not text.
    NotText,
}

impl fmt::Display for BusFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { interface, kind } = self;
        match kind {
            BusFaultKind::ManyErrors => write!(
                f,
                "the controller of {interface} sees many errors: check bit rate, wires and termination"
            ),
            BusFaultKind::ErrorPassive => write!(
                f,
                "the controller of {interface} is error-passive: check bit rate, wires and termination"
            ),
            BusFaultKind::Down => {
                write!(f, "the link of {interface} is down: `ip link set {interface} up`")
            }
            BusFaultKind::BusOff => write!(
                f,
                "{interface} is bus-off: check wires and bit rate, then `ip link set {interface} type can restart`, \
                 or let `restart-ms 100` do it"
            ),
            BusFaultKind::Gone => write!(f, "interface {interface} was removed"),
        }
    }
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus(fault) => fault.fmt(f),
            Self::BusBroken(error) => write!(f, "the bus cannot be read any more: {error}"),
            Self::RecordingBroken(error) => {
                write!(f, "the recording breaks off: {error}: copy or record it again")
            }
            Self::Unreadable(error) => write!(f, "{error}: copy or record it again"),
            Self::Garbage { file, line, fault, lines } => write!(
                f,
                "{file}:{line}: no line of candump -L ({fault}), {lines} such in all, left out"
            ),
            Self::OtherBuses { file, bus, frames } => {
                write!(f, "{file}: took the frames of {bus}, left out {frames} others")
            }
        }
    }
}

impl fmt::Display for LineFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::EndsEarly => "Unexpected end of line",
            Self::Timestamp => "Invalid timestamp",
            Self::DeviceName => "Invalid device name",
            Self::Frame => "Invalid CAN frame",
            Self::Direction => "Invalid frame direction",
            Self::NotText => "not UTF-8",
        })
    }
}
