//! Layout of a frame: where its numbers lie.

use flexid_core::stream::Reading;
use flexid_wire::bits::{Number, Signal, SignalError};

use super::map::Channels;

/// Layout of a frame.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Message {
    /// Length of the payload, bytes.
    pub(super) length: usize,
    pub(super) contents: Vec<Content>,
}

/// What a frame carries.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Content {
    /// A sample of a sensor, or a part of one.
    Part(Part),
    /// Angle of a joint, counted from the base.
    Joint { index: u8, value: Signal },
}

/// What one frame carries of a sample of the force or the acceleration (sensor 0, 1).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Part {
    pub(super) sensor: usize,
    /// Number of the part, in the order of the identifiers.
    pub(super) number: usize,
    pub(super) counter: Option<Signal>,
    /// Signals of channels, each with the channel's number.
    pub(super) channels: Vec<(usize, Signal)>,
}

impl Content {
    /// Returns the place in the order force, acceleration, joints base first.
    pub(super) fn rank(&self) -> u8 {
        match self {
            Self::Part(part) => part.sensor as u8,
            Self::Joint { index, .. } => 2 + index,
        }
    }

    pub(super) fn part(&self) -> Option<&Part> {
        match self {
            Self::Part(part) => Some(part),
            Self::Joint { .. } => None,
        }
    }
}

impl Part {
    /// Returns the counter in a payload, whose length was checked.
    pub(super) fn count(&self, data: &[u8]) -> Option<u32> {
        self.counter.as_ref().and_then(|counter| count(counter, data))
    }

    /// Writes the values in a payload, whose length was checked, to their places among the channels.
    pub(super) fn read(&self, data: &[u8], channels: &mut Channels) {
        for (channel, signal) in &self.channels {
            if let (Some(channel), Ok(value)) = (channels.get_mut(*channel), signal.decode(data)) {
                *channel = value;
            }
        }
    }

    /// Returns the channels whose value is the smallest or the largest that their signal can carry. A floating-point number has no such.
    pub(super) fn at_limit(&self, data: &[u8]) -> impl Iterator<Item = usize> {
        let is_at_limit = |signal: &Signal| {
            let (low, high) = signal.raw_range().into_inner();
            signal.number != Number::Float
                && signal.decode_raw(data).is_ok_and(|raw| raw == low || raw == high)
        };
        let channels = self.channels.iter();
        channels.filter(move |(_, signal)| is_at_limit(signal)).map(|(channel, _)| *channel)
    }

    /// Writes the values of its channels, and the counter.
    pub(super) fn write(
        &self,
        number: u32,
        channels: &Channels,
        data: &mut [u8],
    ) -> Result<(), SignalError> {
        for (channel, signal) in &self.channels {
            signal.encode(channels.get(*channel).copied().unwrap_or_default(), data)?;
        }
        self.counter.as_ref().map_or(Ok(()), |counter| encode_count(counter, number, data))
    }
}

/// Returns the reading of a sensor (0: force, 1: acceleration).
pub(super) fn reading(sensor: usize, counter: u32, axes: [f64; 3]) -> Reading {
    let value = axes.map(|axis| axis as f32);
    match sensor {
        0 => Reading::Force { counter, value },
        _ => Reading::Acceleration { counter, value },
    }
}

/// Returns a counter. The low bits in two's complement count on, for a signed counter as for an unsigned one.
fn count(counter: &Signal, data: &[u8]) -> Option<u32> {
    let mask = u32::MAX >> (32 - counter.length.clamp(1, 32));
    Some(counter.decode_raw(data).ok()? as u32 & mask)
}

/// Writes a counter. It wraps where another signal saturates.
fn encode_count(counter: &Signal, number: u32, data: &mut [u8]) -> Result<(), SignalError> {
    let unused = 64 - counter.length.clamp(1, 64);
    let bits = u64::from(number) << unused;
    let raw = match counter.number {
        Number::Signed => i128::from(bits as i64 >> unused),
        Number::Unsigned | Number::Float => i128::from(bits >> unused),
    };
    counter.encode_raw(raw, data)
}
