//! Frames whose identifier has no signal, listed beside the identifiers that were expected.

use std::collections::HashMap;

use embedded_can::Id;

use crate::source::Frame;

/// Most identifiers that are counted. Further identifiers are left out.
const MOST: usize = 256;
/// Most identifiers that are named, so that the line fits a message of the wire.
const NAMED: usize = 3;

/// Numbers of frames of each unknown identifier.
#[derive(Clone, Debug, Default)]
pub(super) struct UnknownFrames {
    frames: HashMap<Id, u64>,
}

impl UnknownFrames {
    pub(super) fn note(&mut self, frame: &Frame) {
        if let Some(frames) = self.frames.get_mut(&frame.id) {
            *frames += 1;
        } else if self.frames.len() < MOST {
            self.frames.insert(frame.id, 1);
        }
    }

    /// Returns a line, for example `expected 0x101, 0x102; came 0x201 (8192 frames), 0x202 (12)`. Returns `None` if no unknown
    /// identifier came.
    pub(super) fn beside(&self, expected: &[Id]) -> Option<String> {
        if self.frames.is_empty() {
            return None;
        }
        let mut came: Vec<_> = self.frames.iter().collect();
        // The most frequent identifier comes first. Equally frequent ones come in the order of their names, so that the text is
        // always the same.
        came.sort_by_key(|(id, frames)| (u64::MAX - **frames, name(**id)));
        let came = came.iter().enumerate().map(|(rank, (id, frames))| {
            let unit = if rank == 0 { " frames" } else { "" };
            format!("{} ({frames}{unit})", name(**id))
        });
        let expected = list(expected.iter().map(|id| name(*id)));
        Some(format!("expected {expected}; came {}", list(came)))
    }
}

/// Lists the first names and the number of the others.
fn list(names: impl ExactSizeIterator<Item = String>) -> String {
    let more = names.len().saturating_sub(NAMED);
    let mut list = names.take(NAMED).collect::<Vec<_>>().join(", ");
    if more > 0 {
        list += &format!(" and {more} more");
    }
    list
}

/// Formats an identifier with the digits of candump: three for a standard identifier, eight for an extended one.
fn name(id: Id) -> String {
    match id {
        Id::Standard(id) => format!("0x{:03X}", id.as_raw()),
        Id::Extended(id) => format!("0x{:08X}", id.as_raw()),
    }
}

#[cfg(test)]
mod tests {
    use embedded_can::{ExtendedId, StandardId};

    use super::*;
    use crate::source::FrameKind;

    fn standard(id: u16) -> Id {
        StandardId::new(id).unwrap().into()
    }

    #[test]
    fn the_most_frequent_are_named_and_the_line_fits_a_message() {
        let mut unknown = UnknownFrames::default();
        let expected: Vec<_> = (0x101..0x10A).map(standard).collect();
        assert_eq!(unknown.beside(&expected), None);
        for id in 0..2 * MOST as u32 {
            let id = ExtendedId::new(0x0CF0_0400 + id).unwrap().into();
            unknown.note(&Frame::new(id, FrameKind::Data, &[]));
        }
        for _ in 0..8192 {
            let first = *unknown.frames.keys().next().unwrap();
            unknown.note(&Frame::new(first, FrameKind::Data, &[]));
        }
        let line = unknown.beside(&expected).unwrap();
        let begin = "expected 0x101, 0x102, 0x103 and 6 more; came 0x0CF";
        assert!(line.starts_with(begin) && line.ends_with(" and 253 more"), "{line}");
        assert!(line.contains(" (8193 frames), 0x0CF"), "{line}");
        let message = format!("no frame of [bus] dbc: {line}");
        assert!(message.len() <= 160, "{} bytes: {message}", message.len());
    }
}
