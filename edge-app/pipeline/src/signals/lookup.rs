//! Signals of a DBC file by their names in the config.

use std::collections::HashMap;
use std::path::Path;

use can_dbc::{Dbc, MessageId, MultiplexIndicator, SignalExtendedValueType};
use embedded_can::{ExtendedId, Id, StandardId};
use flexid_wire::bits::{ByteOrder, Number, Signal};

use super::message::{Content, Message};
use super::{FINEST, SignalTable};
use crate::input::BadInput;
use crate::source::LONGEST_DATA;
use crate::units::{Quantity, is_unit};

/// Widths of counters that are accepted, bits. A narrower counter wraps too often to separate a loss from a pause. Wider ones
/// do not exist.
const COUNTER_BITS: std::ops::RangeInclusive<u8> = 8..=32;
/// Steps of a signal that are accepted, SI units. The results that follow from other steps leave the range of floating point.
pub(super) const STEPS: std::ops::RangeInclusive<f64> = FINEST as f64..=1e12;
/// Lengths of CAN FD frames above those of classical ones, bytes.
const FD_LENGTHS: [usize; 7] = [12, 16, 20, 24, 32, 48, LONGEST_DATA];
/// Name of the message in which Vector's editor keeps signals without a message.
const NO_MESSAGE: &str = "VECTOR__INDEPENDENT_SIG_MSG";

/// Names of the config and the DBC file for errors, and the content of the DBC file.
pub(super) struct Lookup<'a> {
    pub(super) config: &'a Path,
    pub(super) dbc_file: &'a Path,
    pub(super) dbc: &'a Dbc,
    /// Identifiers too large for 11 bits that are not marked as extended, by the names of their messages. The parser cuts them.
    pub(super) unmarked: &'a HashMap<String, u64>,
}

/// A signal of the DBC file with the message that carries it.
#[derive(Clone, Copy)]
pub(super) struct Found<'a> {
    pub(super) message: &'a can_dbc::Message,
    pub(super) signal: &'a can_dbc::Signal,
}

/// A signal that the config names.
pub(super) struct Named<'a> {
    /// The name in the config.
    pub(super) name: &'a str,
    pub(super) found: Found<'a>,
    pub(super) layout: Signal,
}

impl<'a> Lookup<'a> {
    /// All signals, without those that no message has.
    pub(super) fn all(&self) -> impl Iterator<Item = Found<'a>> + use<'a> {
        let messages = self.dbc.messages.iter().filter(|message| message.name != NO_MESSAGE);
        messages
            .flat_map(|message| message.signals.iter().map(move |signal| Found { message, signal }))
    }

    /// Finds a signal by its name. If several messages have a signal of that name, `MESSAGE.signal` says which one, with the name of the
    /// message or, if that is also the name of another, with its identifier in the DBC file.
    pub(super) fn find(&self, key: &str, name: &str) -> Result<Found<'a>, BadInput> {
        let (message_name, signal_name) = match name.split_once('.') {
            Some((message, signal)) => (Some(message), signal),
            None => (None, name),
        };
        let is_meant = |message: &can_dbc::Message| {
            message_name
                .is_none_or(|own| message.name == own || message.id.raw().to_string() == own)
        };
        let matching: Vec<Found<'a>> = self
            .all()
            .filter(|found| found.signal.name == signal_name && is_meant(found.message))
            .collect();
        match matching[..] {
            [found] => Ok(found),
            [] => {
                let known: Vec<&str> = self.all().map(|found| found.signal.name.as_str()).collect();
                Err(self.bad_config(format!(
                    "[signals] {key}: {name:?} is not in {}, which has {}",
                    self.dbc_file.display(),
                    if known.is_empty() { "no signals".to_string() } else { known.join(", ") },
                )))
            }
            [first, second, ..] if std::ptr::eq(first.message, second.message) => Err(self
                .bad_dbc(format!(
                    "signal {signal_name} is twice in message {}: rename one",
                    first.message.name
                ))),
            [first, second, ..] if first.message.id == second.message.id => {
                Err(self.share(first.message, second.message))
            }
            [first, second, ..] => {
                let [one, other] = [first, second].map(|found| self.label(found.message));
                Err(self.bad_config(format!(
                    "[signals] {key}: {name:?} is in messages {one} and {other} of {}: write \"{one}.{signal_name}\" or \"{other}.{signal_name}\"",
                    self.dbc_file.display(),
                )))
            }
        }
    }

    /// Returns what names a message alone: its name, or its identifier if another message has that name.
    pub(super) fn label(&self, message: &can_dbc::Message) -> String {
        let namesakes = self.dbc.messages.iter().filter(|other| other.name == message.name);
        if namesakes.count() > 1 { message.id.raw().to_string() } else { message.name.clone() }
    }

    /// The error about two messages of one identifier.
    pub(super) fn share(&self, one: &can_dbc::Message, other: &can_dbc::Message) -> BadInput {
        self.bad_dbc(format!(
            "messages {} and {} share the identifier {}: each frame has one layout",
            one.name,
            other.name,
            one.id.raw()
        ))
    }

    /// Returns the layout of a counter, which must be an integer without factor and offset.
    pub(super) fn counter(&self, found: Found) -> Result<Signal, BadInput> {
        let signal = self.layout(found)?;
        let name = &found.signal.name;
        if signal.number == Number::Float {
            return Err(self.bad_dbc(format!(
                "counter {name} is a floating-point number: must be an integer"
            )));
        }
        if signal.scale != 1.0 || signal.offset != 0.0 {
            return Err(self.bad_dbc(format!(
                "counter {name} has factor {} and offset {}: must be (1,0)",
                signal.scale, signal.offset
            )));
        }
        if !COUNTER_BITS.contains(&signal.length) {
            return Err(self.bad_dbc(format!(
                "counter {name} has {} bits: must have {} to {}",
                signal.length,
                COUNTER_BITS.start(),
                COUNTER_BITS.end()
            )));
        }
        Ok(signal)
    }

    /// Returns the layout of a signal, scaled to SI units. Where the DBC file has no unit that is known, the one that the config states for
    /// this sensor counts.
    pub(super) fn scaled(
        &self,
        found: Found,
        quantity: &Quantity,
        stated: Option<(&str, Option<&String>)>,
    ) -> Result<Signal, BadInput> {
        let signal = self.layout(found)?;
        let (name, unit, what) = (&found.signal.name, found.signal.unit.trim(), quantity.name);
        let size = match (quantity.size(unit), stated) {
            (None, Some((key, Some(_)))) if is_unit(unit) => {
                return Err(self.bad_dbc(format!(
                    "signal {name} has unit {unit:?}, which is none of a {what}: name another signal for {key}"
                )));
            }
            (None, Some((key, Some(stated)))) => self.size(key, stated, quantity)?,
            (Some(size), Some((key, Some(stated)))) => {
                if self.size(key, stated, quantity)? != size {
                    return Err(self.bad_config(format!(
                        "[signals] {key}_unit is {stated:?}, and signal {name} has unit {unit:?} in {}: leave it out",
                        self.dbc_file.display()
                    )));
                }
                size
            }
            (Some(size), _) => size,
            (None, stated) => {
                let mend = stated.map(|(key, _)| format!(", or state {key}_unit in [signals]"));
                return Err(self.bad_dbc(format!(
                    "signal {name} has unit {unit:?}: {what} must be in one of {}{}",
                    quantity.known(),
                    mend.unwrap_or_default()
                )));
            }
        };
        let in_si = Signal { scale: signal.scale * size, offset: signal.offset * size, ..signal };
        if !STEPS.contains(&in_si.scale.abs()) || !in_si.offset.is_finite() {
            return Err(self.bad_dbc(format!(
                "signal {name} has factor {:e} and offset {:e} ({unit}): no {what} is measured so",
                signal.scale, signal.offset
            )));
        }
        Ok(in_si)
    }

    /// Returns the size in SI units of a unit that the config states.
    pub(super) fn size(&self, key: &str, unit: &str, quantity: &Quantity) -> Result<f64, BadInput> {
        quantity.size(unit).ok_or_else(|| {
            let known = quantity.known();
            self.bad_config(format!("[signals] {key}_unit is {unit:?}: must be one of {known}"))
        })
    }

    /// Returns the layout of a signal, as the DBC file scales it.
    pub(super) fn layout(&self, Found { message, signal }: Found) -> Result<Signal, BadInput> {
        let name = &signal.name;
        if signal.multiplexer_indicator != MultiplexIndicator::Plain {
            return Err(self.bad_dbc(format!(
                "signal {name} is multiplexed: flexid reads plain signals only; set the sensor to frames of their own, or write the log as a table"
            )));
        }
        let float_bits = match self.dbc.extended_value_type_for_signal(message.id, name) {
            Some(SignalExtendedValueType::IEEEfloat32Bit) => Some(32),
            Some(SignalExtendedValueType::IEEEdouble64bit) => Some(64),
            _ => None,
        };
        if let Some(bits) = float_bits.filter(|bits| *bits != signal.size) {
            return Err(self.bad_dbc(format!(
                "signal {name} has {} bits, and SIG_VALTYPE_ makes it a floating-point number of {bits}: correct one of them",
                signal.size
            )));
        }
        let number = match (float_bits, signal.value_type) {
            (Some(_), _) => Number::Float,
            (None, can_dbc::ValueType::Signed) => Number::Signed,
            (None, can_dbc::ValueType::Unsigned) => Number::Unsigned,
        };
        // The check refuses numbers that do not fit the types.
        let layout = Signal {
            start_bit: u16::try_from(signal.start_bit).unwrap_or(u16::MAX),
            length: u8::try_from(signal.size).unwrap_or(u8::MAX),
            byte_order: match signal.byte_order {
                can_dbc::ByteOrder::LittleEndian => ByteOrder::Intel,
                can_dbc::ByteOrder::BigEndian => ByteOrder::Motorola,
            },
            number,
            scale: signal.factor,
            offset: signal.offset,
        };
        layout
            .check(self.payload(message)?)
            .map_err(|error| self.bad_dbc(format!("signal {name}: {error}")))?;
        Ok(layout)
    }

    /// Returns the number of bytes that the frames of a message have. Above 8 a CAN FD frame is filled up to the next length that there is.
    pub(super) fn payload(&self, message: &can_dbc::Message) -> Result<usize, BadInput> {
        let size = usize::try_from(message.size).unwrap_or(usize::MAX);
        let fits = (0..=8).chain(FD_LENGTHS).find(|length| *length >= size);
        fits.ok_or_else(|| {
            self.bad_dbc(format!(
                "message {} has {} bytes: a CAN FD frame has at most {LONGEST_DATA}",
                message.name, message.size
            ))
        })
    }

    pub(super) fn id(&self, message: &can_dbc::Message) -> Result<Id, BadInput> {
        let id = match message.id {
            _ if self.unmarked.contains_key(&message.name) => None,
            MessageId::Standard(id) => StandardId::new(id).map(Id::from),
            MessageId::Extended(id) => ExtendedId::new(id).map(Id::from),
        };
        id.ok_or_else(|| {
            self.bad_dbc(format!(
                "message {} has identifier {}: above 2047 it is extended, written with 2147483648 added",
                message.name,
                self.unmarked.get(&message.name).copied().unwrap_or(message.id.raw().into())
            ))
        })
    }

    /// Adds what a message carries to the table, and the names of its values.
    pub(super) fn add(
        &self,
        message: &can_dbc::Message,
        content: Content,
        names: &[&String],
        table: &mut SignalTable,
    ) -> Result<(), BadInput> {
        let (id, length) = (self.id(message)?, self.payload(message)?);
        let of_id = table.messages.entry(id).or_insert(Message { length, contents: Vec::new() });
        of_id.contents.push(content);
        table.names.entry(id).or_default().extend(names.iter().copied().cloned());
        Ok(())
    }

    pub(super) fn bad_config(&self, message: String) -> BadInput {
        BadInput::new(self.config, message)
    }

    pub(super) fn bad_dbc(&self, message: String) -> BadInput {
        BadInput::new(self.dbc_file, message)
    }
}
