//! The bits of the frames that are force, acceleration and joint angles. The config's signal names are looked up in the DBC
//! file and put into a table that decodes frames, and encodes them for the simulator.

mod dbc;
mod decoder;
mod described;
mod joining;
mod lookup;
mod map;
mod message;
mod sensor;

use std::collections::BTreeMap;

use embedded_can::Id;
use flexid_core::stream::Reading;
use flexid_wire::bits::{Signal, SignalError};
use flexid_wire::misfits::FrameId;

use crate::source::{Frame, FrameKind};
pub use decoder::Decoder;
use map::{Channels, MOST_CHANNELS, Map};
use message::{Content, Message, Part};

/// Smallest step of a signal that is accepted, SI units. The results that follow from smaller ones leave the range of floating point.
pub(crate) const FINEST: f32 = 1e-12;

/// Table that converts frames to readings and back. All signals are scaled to SI units: N, m/s², rad or m.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalTable {
    messages: BTreeMap<Id, Message>,
    /// Force and acceleration.
    sensors: [Sensor; 2],
    /// Names of the values in the frames of each identifier.
    names: BTreeMap<Id, Vec<String>>,
    /// Clocks of force and acceleration.
    pub clocks: Clocks,
    /// Width of the counters that join force and acceleration, bits; 32 where none do.
    pub counter_bits: u32,
    /// Smallest step of the force on its coarsest axis, N.
    pub force_resolution: f32,
    /// Smallest step of the acceleration on its coarsest axis, m/s².
    pub acceleration_resolution: f32,
    /// Names of the signals of force and acceleration, in the order of [`Limits`], or of the axes that channels give. An axis that is not measured has an empty name, and a channel
    /// whose direction differs from cut to cut the name of all three.
    pub axes: [String; 6],
    /// Names of the signals of the joints, base first.
    pub joints: Vec<String>,
    /// The DBC file's other signals in a unit of angles, in the order of the file.
    pub other_angles: Vec<OtherAngle>,
}

/// A signal in a unit of angles that the config does not name.
#[derive(Clone, Debug, PartialEq)]
pub struct OtherAngle {
    /// Name of the signal.
    pub name: String,
    /// Identifier of its frames.
    pub id: FrameId,
}

/// True for each value of a frame that lies at the limit of its signal: force x, y, z, acceleration x, y, z.
pub type Limits = [bool; 6];

/// How a sensor's samples come.
#[derive(Clone, Debug, Default, PartialEq)]
struct Sensor {
    /// Number of frames of a sample.
    parts: usize,
    /// True if each of them has the counter.
    is_counted: bool,
    /// From channels to axes. `None` where the channels are the axes.
    map: Option<Map>,
}

/// Clocks of force and acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clocks {
    /// One counter counts the instants of both.
    Common,
    /// Each sensor samples by its own clock. Width of its counter, bits; `None`: without, its samples are numbered as they come.
    Own([Option<u32>; 2]),
}

/// Why a frame gives no readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoReading {
    /// No signal of the table has this identifier.
    UnknownId,
    /// The identifier is known, but the payload has another length than in the DBC file.
    WrongLength {
        /// Length in the DBC file, bytes.
        expected: u8,
    },
    /// The bus reports an error.
    ErrorFrame,
    /// The identifier is known, but the frame has no data: it requests some.
    NotData,
}

impl SignalTable {
    /// Returns the table of no signal.
    pub(crate) fn none() -> Self {
        Self {
            messages: BTreeMap::new(),
            sensors: Default::default(),
            names: BTreeMap::new(),
            clocks: Clocks::Common,
            counter_bits: 32,
            force_resolution: FINEST,
            acceleration_resolution: FINEST,
            axes: Default::default(),
            joints: Vec::new(),
            other_angles: Vec::new(),
        }
    }

    /// Returns the table of the columns of a file: `axes` in the order of [`Limits`], and joints, base first. No frame has them. The number of
    /// the row is the counter, and the steps are known once the file is read.
    pub(crate) fn of_columns(axes: [String; 6], joints: Vec<String>) -> Self {
        Self { axes, joints, ..Self::none() }
    }

    /// Returns whether the signals are columns of tables, and no frame has them.
    pub fn is_of_columns(&self) -> bool {
        self.messages.is_empty() && !self.is_none()
    }

    /// Returns whether there is no signal at all.
    pub fn is_none(&self) -> bool {
        self.axes.iter().all(String::is_empty)
    }

    /// Returns whether the force or the acceleration (sensor 0, 1) is of one channel, whose direction differs from cut to cut.
    pub fn is_single(&self, sensor: usize) -> bool {
        let [x, y, z] = [0, 1, 2].map(|axis| &self.axes[3 * sensor + axis]);
        !x.is_empty() && x == y && y == z
    }

    /// Returns whether an axis, in the order of [`Limits`], is measured in every cut.
    pub fn is_measured(&self, axis: usize) -> bool {
        !self.axes[axis].is_empty() && !self.is_single(axis / 3)
    }

    /// Returns whether the force is measured along some axes alone: it is that of a hammer or a shaker.
    pub fn has_part_of_force(&self) -> bool {
        !self.is_none() && !(0..3).all(|axis| self.is_measured(axis))
    }

    /// Returns the identifiers of the frames that are read: force, acceleration, then the joints, base first.
    pub fn identifiers(&self) -> Vec<Id> {
        let first = |(_, message): &(&Id, &Message)| {
            message.contents.iter().map(Content::rank).min().unwrap_or(u8::MAX)
        };
        let mut messages: Vec<_> = self.messages.iter().collect();
        messages.sort_by_key(first);
        messages.into_iter().map(|(&id, _)| id).collect()
    }

    /// Returns the names of the values in the frames of an identifier, without counters that are not alone.
    pub fn names(&self, id: Id) -> Vec<&str> {
        self.names.get(&id).into_iter().flatten().map(String::as_str).collect()
    }

    /// Returns the signal of the angle or stroke of a joint, counted from the base. Its scale is in rad (m).
    pub(crate) fn joint(&self, joint: usize) -> Option<&Signal> {
        let mut contents = self.messages.values().flat_map(|message| &message.contents);
        contents.find_map(|content| match content {
            Content::Joint { index, value } if usize::from(*index) == joint => Some(value),
            _ => None,
        })
    }

    /// Returns the step of the signal of a joint, rad (m); 0 if it is no signal of a frame.
    pub(crate) fn angle_step(&self, joint: usize) -> f64 {
        self.joint(joint).map_or(0.0, Signal::step)
    }

    /// Returns whether the frames of an identifier carry force or acceleration.
    pub fn is_sampled(&self, id: Id) -> bool {
        self.parts(id).next().is_some()
    }

    /// Returns whether the frames of an identifier carry force, and acceleration.
    pub fn sensors_of(&self, id: Id) -> [bool; 2] {
        [0, 1].map(|sensor| self.parts(id).any(|part| part.sensor == sensor))
    }

    /// Returns whether the frames of an identifier carry the counter of a sensor.
    pub(crate) fn is_counted(&self, id: Id) -> bool {
        self.parts(id).any(|part| part.counter.is_some())
    }

    /// Returns what the frames of an identifier carry of force and acceleration.
    fn parts(&self, id: Id) -> impl Iterator<Item = &Part> {
        let message = self.messages.get(&id);
        message.into_iter().flat_map(|message| &message.contents).filter_map(Content::part)
    }

    /// Returns the largest counter of the force or the acceleration (sensor 0, 1).
    pub(crate) fn last_counter(&self, sensor: usize) -> u32 {
        let bits = match self.clocks {
            Clocks::Common => self.counter_bits,
            Clocks::Own(bits) => bits[sensor].unwrap_or(32),
        };
        u32::MAX >> (32 - bits.clamp(1, 32))
    }

    /// Returns whether a frame gives readings.
    ///
    /// # Errors
    /// The error is the reason why it gives none.
    pub fn check(&self, frame: &Frame) -> Result<(), NoReading> {
        self.message(frame).map(drop)
    }

    /// Returns the layout of a frame that has data of the right length.
    fn message(&self, frame: &Frame) -> Result<&Message, NoReading> {
        if frame.kind == FrameKind::Error {
            return Err(NoReading::ErrorFrame);
        }
        let message = self.messages.get(&frame.id).ok_or(NoReading::UnknownId)?;
        if frame.kind != FrameKind::Data || frame.data().is_empty() {
            return Err(NoReading::NotData);
        }
        if frame.data().len() != message.length {
            return Err(NoReading::WrongLength { expected: message.length as u8 });
        }
        Ok(message)
    }

    /// Returns the frames that carry `readings`, in the order of the readings, and those of one reading in the order of their identifiers: one for
    /// each message that carries any of them. Values are rounded to the nearest step and limited to the range of the signal. Counters wrap.
    /// Signals that are not given are 0.
    ///
    /// # Errors
    /// A value is NaN.
    pub fn encode(&self, readings: &[Reading]) -> Result<Vec<Frame>, SignalError> {
        let mut frames: Vec<(Id, Vec<u8>)> = Vec::new();
        for reading in readings {
            for (&id, message) in &self.messages {
                let begun = frames.iter().position(|(other, _)| *other == id);
                let mut data = match begun {
                    Some(index) => frames[index].1.clone(),
                    None => vec![0; message.length],
                };
                let mut carries = false;
                for content in &message.contents {
                    carries |= self.write(content, reading, &mut data)?;
                }
                match begun {
                    Some(index) => frames[index].1 = data,
                    None if carries => frames.push((id, data)),
                    None => {}
                }
            }
        }
        Ok(frames.iter().map(|(id, data)| Frame::new(*id, FrameKind::Data, data)).collect())
    }

    /// Writes `reading` into `data` if this is its place. Returns whether it is.
    fn write(
        &self,
        content: &Content,
        reading: &Reading,
        data: &mut [u8],
    ) -> Result<bool, SignalError> {
        let (of, counter, value) = match *reading {
            Reading::Force { counter, value } => (0, counter, value),
            Reading::Acceleration { counter, value } => (1, counter, value),
            Reading::Joint { index: joint, value } => match content {
                Content::Joint { index, value: angle } if *index == joint => {
                    return angle.encode(value, data).map(|()| true);
                }
                _ => return Ok(false),
            },
            Reading::Setup(_) => return Ok(false),
        };
        let Some(part) = content.part().filter(|part| part.sensor == of) else { return Ok(false) };
        part.write(counter, &self.sensors[of].channels(value.map(f64::from)), data)?;
        Ok(true)
    }
}

impl Sensor {
    /// Returns the axes that these channels give.
    fn axes(&self, channels: &Channels) -> [f64; 3] {
        let [x, y, z, ..] = *channels;
        self.map.as_ref().map_or([x, y, z], |map| map.axes(channels))
    }

    /// Returns channels that give these axes.
    fn channels(&self, axes: [f64; 3]) -> Channels {
        match &self.map {
            Some(map) => map.channels(axes),
            None => {
                let mut channels = [0.0; MOST_CHANNELS];
                channels[..3].copy_from_slice(&axes);
                channels
            }
        }
    }

    /// Returns whether a channel goes into each axis.
    fn takes(&self, channel: usize) -> [bool; 3] {
        let own = || [0, 1, 2].map(|axis| axis == channel);
        self.map.as_ref().map_or_else(own, |map| map.takes(channel))
    }
}

#[cfg(test)]
mod tests;
