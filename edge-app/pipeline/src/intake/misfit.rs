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

    /// Adds this number of frames like `frame`.
    pub(super) fn add(&mut self, frame: &Frame, kind: MisfitKind, frames: u64) {
        let id = frame_id(frame.id);
        match self.seen.iter_mut().find(|misfit| (misfit.id, misfit.kind) == (id, kind)) {
            Some(misfit) => misfit.frames += frames,
            None => self.seen.push(Misfit { id, kind, frames, others_fit: false }),
        }
    }

    /// Returns the numbers of frames so far.
    pub(super) fn seen(&self) -> &[Misfit] {
        &self.seen
    }

    /// Returns a misfit with the number of all of its frames so far.
    pub(super) fn so_far(&self, misfit: Misfit) -> Misfit {
        let is_same = |own: &&Misfit| (own.id, own.kind) == (misfit.id, misfit.kind);
        let frames = self.seen.iter().find(is_same).map_or(misfit.frames, |own| own.frames);
        Misfit { frames, ..misfit }
    }

    /// Returns the most frequent misfit since those that had been `seen`. A misfit of an identifier without any readable frame so far
    /// comes first, one of samples that are not whole last.
    pub(super) fn worst_since(&self, seen: &[Misfit]) -> Option<Misfit> {
        // New misfits are appended.
        let before = seen.iter().map(|misfit| misfit.frames).chain(std::iter::repeat(0));
        let all = self.seen.iter().zip(before).map(|(misfit, before)| Misfit {
            frames: misfit.frames - before,
            others_fit: self.fitting.contains(&misfit.id),
            ..*misfit
        });
        all.filter(|misfit| misfit.frames > 0).max_by_key(|misfit| {
            let is_whole = misfit.kind != MisfitKind::Incomplete;
            (is_whole, !misfit.others_fit, misfit.frames)
        })
    }
}
