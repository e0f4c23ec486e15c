//! Troubles of a bus or of a recording.

use core::fmt;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::text::{Name, Text};
use crate::words::Count;

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
        /// Number of all lines of the recording.
        of: u64,
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
    /// The stamps of a recording are no times, or not all of them.
    Stamps {
        /// Path of the recording.
        file: Text,
        /// Fault of the stamps.
        fault: StampFault,
        /// Number of the frames concerned.
        frames: u64,
    },
    /// The kernel dropped frames while a recording was made.
    Dropped {
        /// Path of the recording.
        file: Text,
        /// Number of frames.
        frames: u64,
    },
}

/// Fault of the stamps of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum StampFault {
    /// All stamps are equal.
    Equal,
    /// All stamps are whole seconds.
    WholeSeconds,
    /// The stamps go back again and again, as differences do.
    GoBack,
    /// Single stamps are not between those before and after them. They have been replaced.
    Jump,
}

/// A fault of the stamps of so many frames, in words.
#[derive(Clone, Copy, Debug)]
pub struct OfStamps {
    fault: StampFault,
    frames: u64,
}

impl StampFault {
    /// Returns the fault of so many frames, in words.
    pub fn of(self, frames: u64) -> OfStamps {
        OfStamps { fault: self, frames }
    }

    /// Returns whether the stamps tell no time at all.
    pub fn is_of_all(self) -> bool {
        self != Self::Jump
    }

    /// Returns what is to be done.
    pub fn mend(self) -> &'static str {
        match self {
            Self::Equal => "record without -H: the adapter has no clock",
            Self::WholeSeconds => "record with `candump -L`, whose stamps have microseconds",
            Self::GoBack => "record without -t d: differences are no times",
            Self::Jump => "record without -H, whose stamps are those of the adapter",
        }
    }
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
            Self::RecordingBroken(error) => write!(f, "the recording breaks off: {error}"),
            Self::Unreadable(error) => f.write_str(error),
            Self::Garbage { file, line, fault, lines, of } => write!(
                f,
                "{file}:{line}: no line of candump -L ({fault}), {lines} such of {of}, left out"
            ),
            Self::OtherBuses { file, bus, frames } => {
                write!(f, "{file}: took the frames of {bus}, left out {frames} others")
            }
            Self::Stamps { file, fault, frames } => {
                write!(f, "{file}: {}: {}", fault.of(*frames), fault.mend())
            }
            Self::Dropped { file, frames } => write!(
                f,
                "{file}: the kernel dropped {} while this was recorded: record with `candump -r 8388608 -L`",
                Count(*frames, "frame")
            ),
        }
    }
}

impl fmt::Display for OfStamps {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.fault {
            StampFault::Equal => f.write_str("all stamps are equal"),
            StampFault::WholeSeconds => f.write_str("all stamps are whole seconds"),
            StampFault::GoBack => {
                write!(f, "the stamps go back {} times", self.frames)
            }
            StampFault::Jump => write!(
                f,
                "the stamps of {} jump away and back, and were replaced",
                Count(self.frames, "frame")
            ),
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
