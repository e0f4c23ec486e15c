//! Frames that the DBC file does not describe, or describes otherwise.

use core::fmt;

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Largest number of identifiers that are named.
pub const MAX_IDS: usize = 3;

/// Identifier of a frame.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, Schema,
)]
#[serde(rename_all = "snake_case")]
pub enum FrameId {
    /// Identifier of 11 bits.
    Standard(u16),
    /// Identifier of 29 bits.
    Extended(u32),
}

/// Frames of a known identifier that differ from the DBC file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Misfit {
    /// Identifier of the frames.
    pub id: FrameId,
    /// Difference from the DBC file.
    pub kind: MisfitKind,
    /// Number of the frames.
    pub frames: u64,
    /// True if other frames of this identifier could be read.
    pub others_fit: bool,
}

/// A fault of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[serde(rename_all = "snake_case")]
pub enum MisfitKind {
    /// The length of the payload differs from that in the DBC file.
    Length {
        /// Length on the bus, bytes.
        got: u8,
        /// Length in the DBC file, bytes.
        expected: u8,
    },
    /// The frame is a remote request.
    Remote,
    /// Other frames of its sample are missing.
    Incomplete,
}

/// Identifiers without a signal, beside the identifiers that have one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct UnknownFrames {
    /// First identifiers of the DBC file's signals.
    pub expected: Vec<FrameId, MAX_IDS>,
    /// Number of further identifiers of the DBC file's signals.
    pub more_expected: u32,
    /// Most frequent identifiers without a signal.
    pub came: Vec<IdFrames, MAX_IDS>,
    /// Number of further identifiers without a signal.
    pub more_came: u32,
}

/// An identifier, and the number of its frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct IdFrames {
    /// Identifier.
    pub id: FrameId,
    /// Number of frames.
    pub frames: u64,
}

/// An identifier has the digits of candump: three if it is standard, eight if it is extended.
impl fmt::Display for FrameId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Standard(id) => write!(f, "0x{id:03X}"),
            Self::Extended(id) => write!(f, "0x{id:08X}"),
        }
    }
}

impl fmt::Display for Misfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "frames {}", self.id)?;
        match self.kind {
            MisfitKind::Length { got, expected } => write!(
                f,
                " have {got} bytes, by [bus] dbc {expected}: mend the DBC file or the sender"
            )?,
            MisfitKind::Remote => f.write_str(" are remote requests: does the sensor answer?")?,
            MisfitKind::Incomplete => f.write_str(
                " lack others of their samples, or their stamps show no order: let the sensor send all, and record with stamps of the hardware",
            )?,
        }
        write!(f, " ({} so far)", self.frames)
    }
}

impl fmt::Display for UnknownFrames {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("expected ")?;
        for (rank, id) in self.expected.iter().enumerate() {
            write!(f, "{}{id}", if rank == 0 { "" } else { ", " })?;
        }
        more(f, self.more_expected)?;
        f.write_str("; came ")?;
        for (rank, IdFrames { id, frames }) in self.came.iter().enumerate() {
            match rank {
                0 => write!(f, "{id} ({frames} frames)")?,
                _ => write!(f, ", {id} ({frames})")?,
            }
        }
        more(f, self.more_came)
    }
}

/// Writes the number of the identifiers that are not named.
fn more(f: &mut fmt::Formatter<'_>, number: u32) -> fmt::Result {
    if number > 0 { write!(f, " and {number} more") } else { Ok(()) }
}
