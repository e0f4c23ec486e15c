//! Contents of a source: frames of a bus, which `signals` decodes, or readings of a table.

use embedded_can::Id;
use flexid_core::stream::Reading;

/// Kind of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameKind {
    /// The frame carries data, as a classical or a CAN FD frame.
    Data,
    /// The frame requests data.
    Remote,
    /// The frame reports an error of the bus. Its identifier is the class of the error.
    Error,
}

/// Longest payload of a frame, bytes: that of CAN FD.
pub const LONGEST_DATA: usize = 64;

/// A CAN frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Identifier: standard (11 bits) or extended (29 bits).
    pub id: Id,
    /// Kind of the frame.
    pub kind: FrameKind,
    length: u8,
    bytes: [u8; LONGEST_DATA],
}

/// Content of a source at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// Time on the clock of the source, s. A bus uses CLOCK_MONOTONIC, at which the kernel received a frame. A recording contains its times,
    /// mostly since the Unix epoch.
    pub time_s: f64,
    /// Frame or reading.
    pub content: Content,
}

/// Content of an arrival.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Content {
    /// Frame of a bus.
    Frame(Frame),
    /// Reading of a table. It needs no decoding.
    Reading(Reading),
}

impl Arrival {
    /// Makes the arrival of a frame at `time_s`, s.
    pub fn of_frame(time_s: f64, frame: Frame) -> Self {
        Self { time_s, content: Content::Frame(frame) }
    }

    /// Returns the frame that came, or `None` if a reading of a table came.
    pub fn frame(&self) -> Option<Frame> {
        match self.content {
            Content::Frame(frame) => Some(frame),
            Content::Reading(_) => None,
        }
    }
}

impl Frame {
    /// Makes a frame of this kind. At most [`LONGEST_DATA`] bytes of `data` are kept.
    pub fn new(id: Id, kind: FrameKind, data: &[u8]) -> Self {
        let length = data.len().min(LONGEST_DATA);
        let mut bytes = [0; LONGEST_DATA];
        bytes[..length].copy_from_slice(&data[..length]);
        Self { id, kind, length: length as u8, bytes }
    }

    /// Returns the data, 0 to 64 bytes.
    pub fn data(&self) -> &[u8] {
        &self.bytes[..usize::from(self.length)]
    }
}
