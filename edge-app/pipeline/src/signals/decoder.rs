//! Frames to readings.

use flexid_core::stream::Reading;

use super::message::Content;
use super::{Limits, NoReading, SignalTable};
use crate::source::Frame;

/// Turns the frames of a bus, in their order, into readings.
#[derive(Clone, Debug)]
pub struct Decoder<'a> {
    table: &'a SignalTable,
    /// Number of samples that came of force and of acceleration. It counts a sensor without a counter, and wraps.
    samples: [u32; 2],
}

impl<'a> Decoder<'a> {
    /// Makes the decoder of a bus of which no frame has come.
    pub fn new(table: &'a SignalTable) -> Self {
        Self { table, samples: [0; 2] }
    }

    /// Passes every reading in `frame` to `sink`. Returns which values are at their limit.
    ///
    /// # Errors
    /// The error is the reason why the frame gives no reading.
    pub fn decode(
        &mut self,
        frame: &Frame,
        mut sink: impl FnMut(Reading),
    ) -> Result<Limits, NoReading> {
        let message = self.table.message(frame)?;
        let mut limits = Limits::default();
        for content in &message.contents {
            content.note_limits(frame.data(), &mut limits);
            let number = match content {
                Content::Sample { sensor, .. } => self.samples[*sensor],
                Content::Joint { .. } => 0,
            };
            let Some(reading) = content.decode(frame.data(), number) else { continue };
            if let Content::Sample { sensor, .. } = content {
                self.samples[*sensor] = number.wrapping_add(1);
            }
            sink(reading);
        }
        Ok(limits)
    }
}
