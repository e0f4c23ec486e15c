//! A frame as it was on the bus, whatever brought it here.

use embedded_can::Id;

/// What a frame is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameKind {
    /// Carries data.
    Data,
    /// Asks for data.
    Remote,
    /// Reports an error of the bus; the identifier is its class.
    Error,
    /// CAN FD, which flexid does not read; its data are left out.
    Fd,
}

/// A classical CAN frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Standard (11 bits) or extended (29 bits).
    pub id: Id,
    /// What it is for.
    pub kind: FrameKind,
    length: u8,
    bytes: [u8; 8],
}

/// A frame with the time at which the kernel had it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// On the clock of the source, s: CLOCK_MONOTONIC of a bus, what a recording says (mostly since the Unix epoch).
    pub time_s: f64,
    /// What came.
    pub frame: Frame,
}

impl Frame {
    /// A frame of this kind; of `data` at most 8 bytes are kept.
    pub fn new(id: Id, kind: FrameKind, data: &[u8]) -> Self {
        let length = data.len().min(8);
        let mut bytes = [0; 8];
        bytes[..length].copy_from_slice(&data[..length]);
        Self { id, kind, length: length as u8, bytes }
    }

    /// Its data, 0 to 8 bytes.
    pub fn data(&self) -> &[u8] {
        &self.bytes[..usize::from(self.length)]
    }
}
