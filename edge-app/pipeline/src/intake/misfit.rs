//! Frames of a known identifier that differ from the DBC file.

use std::collections::HashSet;

use embedded_can::Id;
use flexid_wire::misfits::{FrameId, Misfit, MisfitKind};

use crate::source::Frame;

/// Converts an identifier for the wire.
pub(crate) fn frame_id(id: Id) -> FrameId {
    match id {
        Id::Standard(id) => FrameId::Standard(id.as_raw()),
        Id::Extended(id) => FrameId::Extended(id.as_raw()),
    }
}

/// The misfits of all identifiers.
#[derive(Clone, Debug, Default)]
pub(super) struct Misfits {
    seen: Vec<Misfit>,
    fitting: HashSet<FrameId>,
}

impl Misfits {
    pub(super) fn fits(&mut self, frame: &Frame) {
        self.fitting.insert(frame_id(frame.id));
    }

    pub(super) fn add(&mut self, frame: &Frame, kind: MisfitKind) {
        let id = frame_id(frame.id);
        match self.seen.iter_mut().find(|misfit| (misfit.id, misfit.kind) == (id, kind)) {
            Some(misfit) => misfit.frames += 1,
            None => self.seen.push(Misfit { id, kind, frames: 1, others_fit: false }),
        }
    }

    /// Removes the misfits so far. The identifiers with a readable frame stay known.
    pub(super) fn begin_anew(&mut self) {
        self.seen.clear();
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
