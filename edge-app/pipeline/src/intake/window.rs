//! The newest frames, by which obstacles are judged.
//!
//! A window begins at the newest record, and holds at most the frames of four records: what was mended long ago is no obstacle, and a
//! fault shows soon after hours without a cut.

use flexid_core::stream::StreamHealth;
use flexid_wire::misfits::Misfit;

use super::counts::Counts;

/// Counts and misfits at one instant.
#[derive(Clone, Debug, Default)]
pub(super) struct Mark {
    pub(super) counts: Counts,
    pub(super) misfits: Vec<Misfit>,
}

/// Beginning of the window.
#[derive(Clone, Debug)]
pub(super) struct Window {
    /// Beginning of this window and of the next.
    begins: [Mark; 2],
    /// Number of frames of force and acceleration after which the next window takes the place of this one: those of two records, as many
    /// as every obstacle needs to be recognised.
    frames: u64,
    /// Number of these frames since the next window began.
    came: u64,
}

impl Window {
    /// Makes the window of a stream that begins, whose records have `of_record` frames of force and acceleration.
    pub(super) fn new(of_record: u64) -> Self {
        Self { begins: Default::default(), frames: 2 * of_record, came: 0 }
    }

    /// Notes a frame of force or acceleration. Returns whether the next window is to [begin](Self::advance).
    pub(super) fn note(&mut self) -> bool {
        self.came += 1;
        self.came >= self.frames
    }

    /// Goes over to the next window, and begins another. A wrong rate shows in records alone, and holds until the next record.
    pub(super) fn advance(&mut self, mut mark: Mark) {
        let [_, next] = std::mem::take(&mut self.begins);
        let StreamHealth { wrong_rate, doubtful_rate, .. } = next.counts.stream;
        let stream = &mut mark.counts.stream;
        (stream.wrong_rate, stream.doubtful_rate) = (wrong_rate, doubtful_rate);
        (self.begins, self.came) = ([next, mark], 0);
    }

    /// Begins anew with a record.
    pub(super) fn begin_anew(&mut self, mark: Mark) {
        (self.begins, self.came) = ([mark.clone(), mark], 0);
    }

    /// Returns where the window begins.
    pub(super) fn begin(&self) -> &Mark {
        &self.begins[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the length of the window, in frames, after each of `frames` frames. Records come after those of `records`.
    fn lengths(frames: u64, records: &[u64]) -> Vec<u64> {
        let mut window = Window::new(10);
        let mark =
            |frame| Mark { counts: Counts { all: frame, ..Counts::default() }, ..Mark::default() };
        (1..=frames)
            .map(|frame| {
                if window.note() {
                    window.advance(mark(frame));
                }
                if records.contains(&frame) {
                    window.begin_anew(mark(frame));
                }
                frame - window.begin().counts.all
            })
            .collect()
    }

    #[test]
    fn it_has_the_frames_of_two_to_four_records() {
        let lengths = lengths(1000, &[]);
        assert_eq!(lengths[38], 39);
        assert!(lengths[19..].iter().all(|frames| (20..40).contains(frames)), "{lengths:?}");
    }

    #[test]
    fn it_begins_with_a_record() {
        let lengths = lengths(100, &[50]);
        assert_eq!((lengths[49], lengths[88], lengths[89]), (0, 39, 20));
    }
}
