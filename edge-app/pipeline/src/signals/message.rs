//! Layout of a frame: where its readings lie.

use flexid_core::stream::Reading;
use flexid_wire::bits::{Signal, SignalError};

use super::Limits;

/// Layout of a frame.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Message {
    /// Length of the payload, bytes.
    pub(super) length: usize,
    pub(super) contents: Vec<Content>,
}

/// A reading in a frame.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Content {
    /// Sample of the force or the acceleration (sensor 0, 1).
    Sample { sensor: usize, counter: Option<Signal>, axes: [Signal; 3] },
    /// Angle of a joint, counted from the base.
    Joint { index: u8, value: Signal },
}

impl Content {
    /// Returns the place in the order force, acceleration, joints base first.
    pub(super) fn rank(&self) -> u8 {
        match self {
            Self::Sample { sensor, .. } => *sensor as u8,
            Self::Joint { index, .. } => 2 + index,
        }
    }

    /// Decodes the reading. A sample without a counter has `number`. `None` never happens: the table was checked against the length of the
    /// payload.
    pub(super) fn decode(&self, data: &[u8], number: u32) -> Option<Reading> {
        let value = |signal: &Signal| signal.decode(data).ok();
        Some(match self {
            Self::Sample { sensor, counter, axes: [x, y, z] } => {
                let counter =
                    counter.as_ref().map_or(Some(number), |counter| count(counter, data))?;
                let value = [value(x)? as f32, value(y)? as f32, value(z)? as f32];
                match sensor {
                    0 => Reading::Force { counter, value },
                    _ => Reading::Acceleration { counter, value },
                }
            }
            Self::Joint { index, value: angle } => {
                Reading::Joint { index: *index, value: value(angle)? }
            }
        })
    }

    /// Notes the axes that are at their limit. A joint angle has no limit here.
    pub(super) fn note_limits(&self, data: &[u8], limits: &mut Limits) {
        let Self::Sample { sensor, axes, .. } = self else { return };
        for (axis, limit) in axes.iter().zip(&mut limits[3 * sensor..]) {
            let (low, high) = axis.raw_range().into_inner();
            *limit = axis.decode_raw(data).is_ok_and(|raw| raw == low || raw == high);
        }
    }

    /// Writes `reading` into `data` if this is its place. Returns whether it is.
    pub(super) fn encode(&self, reading: &Reading, data: &mut [u8]) -> Result<bool, SignalError> {
        match (self, reading) {
            (
                Self::Sample { sensor: 0, counter, axes },
                Reading::Force { counter: number, value },
            )
            | (
                Self::Sample { sensor: 1, counter, axes },
                Reading::Acceleration { counter: number, value },
            ) => {
                for (axis, &value) in axes.iter().zip(value) {
                    axis.encode(value.into(), data)?;
                }
                if let Some(counter) = counter {
                    encode_count(counter, *number, data)?;
                }
            }
            (Self::Joint { index, value: angle }, Reading::Joint { index: joint, value })
                if index == joint =>
            {
                angle.encode(*value, data)?;
            }
            _ => return Ok(false),
        }
        Ok(true)
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
    let raw =
        if counter.signed { i128::from(bits as i64 >> unused) } else { i128::from(bits >> unused) };
    counter.encode_raw(raw, data)
}
