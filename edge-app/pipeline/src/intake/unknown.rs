//! Frames whose identifier has no signal, listed beside the identifiers that were expected.

use std::collections::HashMap;

use embedded_can::Id;
use flexid_wire::misfits::{self, FrameId, IdFrames, MAX_IDS};

use super::misfit::frame_id;
use crate::source::Frame;

/// Most identifiers that are counted. Further identifiers are left out.
const MOST: usize = 256;

/// Numbers of frames of each unknown identifier.
#[derive(Clone, Debug, Default)]
pub(super) struct UnknownFrames {
    frames: HashMap<FrameId, u64>,
}

impl UnknownFrames {
    pub(super) fn note(&mut self, frame: &Frame) {
        let id = frame_id(frame.id);
        if let Some(frames) = self.frames.get_mut(&id) {
            *frames += 1;
        } else if self.frames.len() < MOST {
            self.frames.insert(id, 1);
        }
    }

    /// Returns the first unknown identifiers beside the first of the `expected` ones. Returns `None` if no unknown identifier
    /// came.
    pub(super) fn beside(&self, expected: &[Id]) -> Option<misfits::UnknownFrames> {
        if self.frames.is_empty() {
            return None;
        }
        let mut came: Vec<_> =
            self.frames.iter().map(|(id, frames)| IdFrames { id: *id, frames: *frames }).collect();
        // The most frequent identifier comes first. Equally frequent ones come in ascending order, so that the result is always
        // the same.
        came.sort_by_key(|IdFrames { id, frames }| (u64::MAX - frames, *id));
        let more = |all: usize| all.saturating_sub(MAX_IDS) as u32;
        Some(misfits::UnknownFrames {
            expected: expected.iter().take(MAX_IDS).map(|id| frame_id(*id)).collect(),
            more_expected: more(expected.len()),
            came: came.iter().take(MAX_IDS).copied().collect(),
            more_came: more(came.len()),
        })
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
    fn the_most_frequent_are_named() {
        let mut unknown = UnknownFrames::default();
        let expected: Vec<_> = (0x101..0x10A).map(standard).collect();
        assert_eq!(unknown.beside(&expected), None);
        for id in 0..2 * MOST as u32 {
            let id = ExtendedId::new(0x0CF0_0400 + id).unwrap().into();
            unknown.note(&Frame::new(id, FrameKind::Data, &[]));
        }
        for _ in 0..8192 {
            let first = ExtendedId::new(0x0CF0_0410).unwrap().into();
            unknown.note(&Frame::new(first, FrameKind::Data, &[]));
        }
        assert_eq!(
            unknown.beside(&expected).unwrap().to_string(),
            "expected 0x101, 0x102, 0x103 and 6 more; \
             came 0x0CF00410 (8193 frames), 0x0CF00400 (1), 0x0CF00401 (1) and 253 more"
        );
    }
}
