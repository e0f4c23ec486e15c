//! Frames to readings.

use flexid_core::stream::Reading;

use super::joining::Joining;
use super::map::MOST_CHANNELS;
use super::message::{Content, Part, reading};
use super::{Limits, NoReading, SignalTable};
use crate::source::Frame;

/// Turns the frames of a bus, in their order, into readings.
#[derive(Clone, Debug)]
pub struct Decoder<'a> {
    table: &'a SignalTable,
    /// Number of samples that came of force and of acceleration. It counts a sensor without a counter, and wraps.
    samples: [u32; 2],
    /// Samples of several frames. `None` of a sensor with samples of one.
    joining: [Option<Joining>; 2],
}

impl<'a> Decoder<'a> {
    /// Makes the decoder of a bus of which no frame has come.
    pub fn new(table: &'a SignalTable) -> Self {
        let joining = table.sensors.each_ref().map(|sensor| {
            (sensor.parts > 1).then(|| Joining::new(sensor.parts, sensor.is_counted))
        });
        Self { table, samples: [0; 2], joining }
    }

    /// Passes every reading that `frame`, which came at `time_s` (s), gives or completes to `sink`. Returns which values are at their limit.
    ///
    /// # Errors
    /// The error is the reason why the frame gives no reading.
    pub fn decode(
        &mut self,
        time_s: f64,
        frame: &Frame,
        mut sink: impl FnMut(Reading),
    ) -> Result<Limits, NoReading> {
        let message = self.table.message(frame)?;
        let mut limits = Limits::default();
        for content in &message.contents {
            match content {
                Content::Part(part) => {
                    self.note_limits(part, frame.data(), &mut limits);
                    self.sample(time_s, part, frame.data()).into_iter().for_each(&mut sink);
                }
                Content::Joint { index, value } => {
                    // The table was checked against the length of the payload.
                    let value = value.decode(frame.data()).ok();
                    value
                        .into_iter()
                        .for_each(|value| sink(Reading::Joint { index: *index, value }));
                }
            }
        }
        Ok(limits)
    }

    /// Returns the number of frames of samples that were not put together, since another frame of theirs is missing.
    pub fn left_out(&self) -> u64 {
        self.joining.iter().flatten().map(|joining| joining.left_out).sum()
    }

    /// Takes a sample, or a part of one. Returns the reading that it completes.
    fn sample(&mut self, time_s: f64, part: &Part, data: &[u8]) -> Option<Reading> {
        let sensor = part.sensor;
        let (channels, counter) = match &mut self.joining[sensor] {
            Some(joining) => {
                let sample = joining.take(time_s, part, data)?;
                (sample.channels, sample.counter)
            }
            None => {
                let mut channels = [0.0; MOST_CHANNELS];
                part.read(data, &mut channels);
                (channels, part.count(data))
            }
        };
        let number = self.samples[sensor];
        self.samples[sensor] = number.wrapping_add(1);
        let axes = self.table.sensors[sensor].axes(&channels);
        Some(reading(sensor, counter.unwrap_or(number), axes))
    }

    /// Notes the axes that a value at its limit goes into.
    fn note_limits(&self, part: &Part, data: &[u8], limits: &mut Limits) {
        for channel in part.at_limit(data) {
            let takes = self.table.sensors[part.sensor].takes(channel);
            for (limit, takes) in limits[3 * part.sensor..].iter_mut().zip(takes) {
                *limit |= takes;
            }
        }
    }
}
