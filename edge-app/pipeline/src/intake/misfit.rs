//! Frames of a known identifier that differ from the DBC file.

use std::collections::HashSet;
use std::fmt;

use embedded_can::Id;

use crate::source::Frame;

/// Frames of a known identifier that differ from the DBC file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Misfit {
    /// Identifier of the frames.
    pub id: Id,
    /// Difference from the DBC file.
    pub kind: MisfitKind,
    /// Number of the frames.
    pub frames: u64,
    /// Whether other frames of this identifier could be read.
    pub others_fit: bool,
}

/// What is wrong with a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
    /// The frame is a CAN FD frame.
    Fd,
}

impl fmt::Display for Misfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.id {
            Id::Standard(id) => write!(f, "frames 0x{:03X}", id.as_raw())?,
            Id::Extended(id) => write!(f, "frames 0x{:08X}", id.as_raw())?,
        }
        match self.kind {
            MisfitKind::Length { got, expected } => {
                write!(
                    f,
                    " have {got} bytes, by [bus] dbc {expected}: mend the DBC file or the sender"
                )?;
            }
            MisfitKind::Remote => write!(f, " are remote requests: does the sensor answer?")?,
            MisfitKind::Fd => write!(f, " are CAN FD: set the sender to classical CAN")?,
        }
        write!(f, " ({} so far)", self.frames)
    }
}

/// The misfits of all identifiers.
#[derive(Clone, Debug, Default)]
pub(super) struct Misfits {
    seen: Vec<Misfit>,
    fitting: HashSet<Id>,
}

impl Misfits {
    pub(super) fn fits(&mut self, frame: &Frame) {
        self.fitting.insert(frame.id);
    }

    pub(super) fn add(&mut self, frame: &Frame, kind: MisfitKind) {
        match self.seen.iter_mut().find(|misfit| (misfit.id, misfit.kind) == (frame.id, kind)) {
            Some(misfit) => misfit.frames += 1,
            None => {
                self.seen.push(Misfit { id: frame.id, kind, frames: 1, others_fit: false });
            }
        }
    }

    /// Returns the most frequent misfit. A misfit of an identifier without any readable frame comes first.
    pub(super) fn worst(&self) -> Option<Misfit> {
        let all = self
            .seen
            .iter()
            .map(|misfit| Misfit { others_fit: self.fitting.contains(&misfit.id), ..*misfit });
        all.max_by_key(|misfit| (!misfit.others_fit, misfit.frames))
    }
}
