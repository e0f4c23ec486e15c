//! Makes the table from signal names and a DBC file.

use std::collections::{BTreeMap, HashSet};
use std::path::Path;

use can_dbc::{Dbc, MessageId, MultiplexIndicator, SignalExtendedValueType};
use embedded_can::{ExtendedId, Id, StandardId};
use flexid_wire::bits::{ByteOrder, Signal};
use flexid_wire::misfits::FrameId;

use super::message::{Content, Message};
use super::{Clocks, FINEST, OtherAngle, SignalTable};
use crate::config::{ClocksKey, SignalsSection};
use crate::input::{self, BadInput};
use crate::model::{Kind, Model};
use crate::units::{ACCELERATION, ANGLE, FORCE, Quantity, STROKE};

/// Widths of counters that are accepted, bits. A narrower counter wraps too often to separate a loss from a pause. Wider ones
/// do not exist.
const COUNTER_BITS: std::ops::RangeInclusive<u8> = 8..=32;
/// Steps of a signal that are accepted, SI units. The results that follow from other steps leave the range of floating point.
const STEPS: std::ops::RangeInclusive<f64> = FINEST as f64..=1e12;
/// Name of the message in which Vector's editor keeps signals without a message.
const NO_MESSAGE: &str = "VECTOR__INDEPENDENT_SIG_MSG";

impl SignalTable {
    /// Looks up in `dbc_file` the signals that the config names. `model` determines which joints are prismatic.
    ///
    /// # Errors
    /// The error is one line that names the config or the DBC file, the signal and the correction.
    pub(crate) fn load(
        config: &Path,
        dbc_file: &Path,
        names: &SignalsSection,
        model: &Model,
    ) -> Result<Self, BadInput> {
        Self::parse(config, dbc_file, input::read_regular_bytes(dbc_file)?, names, model)
    }

    /// Looks up the signals in `bytes`, the content of `dbc_file`.
    ///
    /// # Errors
    /// The errors are those of a config that names this DBC file.
    pub fn parse(
        config: &Path,
        dbc_file: &Path,
        bytes: Vec<u8>,
        names: &SignalsSection,
        model: &Model,
    ) -> Result<Self, BadInput> {
        if let Some(own) = input::in_bytes(&bytes) {
            return Err(BadInput::new(dbc_file, format!("is not a DBC file: it is {own}")));
        }
        // Older DBC files are in Windows-1252, newer ones in UTF-8.
        let text = match input::decode(bytes) {
            Ok(text) => text,
            Err(bytes) => can_dbc::decode_cp1252(&bytes)
                .ok_or_else(|| BadInput::new(dbc_file, "is neither UTF-8 nor Windows-1252"))?
                .into_owned(),
        };
        if text.trim().is_empty() {
            return Err(BadInput::new(dbc_file, "is empty: name the DBC file of this bus"));
        }
        let dbc = parsed(&text).map_err(|mend| BadInput::new(dbc_file, mend))?;
        check_distinct(config, names)?;
        Lookup { config, dbc_file, dbc: &dbc }.table(names, model)
    }
}

/// Parses the `text` of a DBC file. A backslash before a quote escapes it for some writers, and is a letter as any other for others, so
/// that the quote ends its text. A file that cannot be read in the first way is read in the second: where `;` and the end of the line follow,
/// else everywhere. The texts themselves are not used.
fn parsed(text: &str) -> Result<Dbc, String> {
    let ends_a_statement = |rest: &str| {
        let line = rest.lines().next().unwrap_or_default();
        line.trim() == ";"
    };
    Dbc::try_from(text).or_else(|error| {
        let at_ends = || Dbc::try_from(&*quotes_end_texts(text, ends_a_statement)).ok();
        let everywhere = || Dbc::try_from(&*quotes_end_texts(text, |_| true)).ok();
        at_ends().or_else(everywhere).ok_or_else(|| not_dbc(text, &error.to_string()))
    })
}

/// Replaces the backslash before each quote for which `is_end` holds, given what follows the quote.
fn quotes_end_texts(text: &str, is_end: impl Fn(&str) -> bool) -> String {
    let mut read = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("\\\"") {
        read += before;
        read += if is_end(after) { "/\"" } else { "\\\"" };
        rest = after;
    }
    read + rest
}

/// Returns the fault of a `text` that the parser refuses. Its error says where: `--> LINE:COLUMN`.
fn not_dbc(text: &str, error: &str) -> String {
    let line = error.split_once("--> ").and_then(|(_, at)| at.split_once(':'));
    match (input::kind(text), line) {
        (Some(other), _) if other != "a DBC file" => {
            format!("is not a DBC file: it is {other}: name the right one")
        }
        (_, Some((line, _))) => format!(
            "is not a DBC file: line {line} cannot be read: mend it, or copy the file again"
        ),
        _ => format!("is not a DBC file: {error}"),
    }
}

fn check_distinct(config: &Path, names: &SignalsSection) -> Result<(), BadInput> {
    let mut seen = HashSet::new();
    for (_, name) in names.all() {
        if !seen.insert(name) {
            let message = format!("[signals] names {name:?} twice: each signal has one meaning");
            return Err(BadInput::new(config, message));
        }
    }
    Ok(())
}

/// Names of the config and the DBC file for errors, and the content of the DBC file.
struct Lookup<'a> {
    config: &'a Path,
    dbc_file: &'a Path,
    dbc: &'a Dbc,
}

/// A signal of the DBC file with the message that carries it.
#[derive(Clone, Copy)]
struct Found<'a> {
    message: &'a can_dbc::Message,
    signal: &'a can_dbc::Signal,
}

impl<'a> Lookup<'a> {
    fn table(&self, names: &SignalsSection, model: &Model) -> Result<SignalTable, BadInput> {
        let mut messages = BTreeMap::new();
        let (force, force_bits) = self.vector(
            (0, "force"),
            &names.force,
            ("force_counter", names.force_counter.as_ref()),
            &FORCE,
            &mut messages,
        )?;
        let (acceleration, acceleration_bits) = self.vector(
            (1, "acceleration"),
            &names.acceleration,
            ("acceleration_counter", names.acceleration_counter.as_ref()),
            &ACCELERATION,
            &mut messages,
        )?;
        let (clocks, counter_bits) = self.clocks(names, [force_bits, acceleration_bits])?;
        for (index, (name, joint)) in names.joints().iter().zip(model.driven()).enumerate() {
            let found = self.find("joints", name)?;
            let quantity = if joint.kind == Kind::Revolute { ANGLE } else { STROKE };
            let value = self.scaled(found, &quantity)?;
            let content = Content::Joint { index: index as u8, value };
            self.add(found, content, &mut messages)?;
        }
        self.check_apart(names)?;
        let axis = |name: &String| Ok::<_, BadInput>(self.find("", name)?.signal.name.clone());
        let [fx, fy, fz] = &names.force;
        let [ax, ay, az] = &names.acceleration;
        Ok(SignalTable {
            messages,
            clocks,
            counter_bits,
            force_resolution: coarsest(&force),
            acceleration_resolution: coarsest(&acceleration),
            axes: [axis(fx)?, axis(fy)?, axis(fz)?, axis(ax)?, axis(ay)?, axis(az)?],
            joints: names.joints().iter().map(axis).collect::<Result<_, _>>()?,
            other_angles: self.other_angles(names)?,
        })
    }

    /// Returns the clocks of force and acceleration, whose counters have so many `bits`, and the width of the counters that join them.
    fn clocks(
        &self,
        names: &SignalsSection,
        bits: [Option<u32>; 2],
    ) -> Result<(Clocks, u32), BadInput> {
        let [force, acceleration] = bits;
        match (names.clocks, force, acceleration) {
            (Some(ClocksKey::Common), None, _) | (Some(ClocksKey::Common), _, None) => {
                let key = if force.is_none() { "force" } else { "acceleration" };
                Err(self.bad_config(format!(
                    "[signals] clocks is \"common\", and {key}_counter is missing: name the signal that counts the samples of both, or write \"own\""
                )))
            }
            (None | Some(ClocksKey::Common), Some(force), Some(acceleration)) => {
                if force != acceleration {
                    let name = |name: &Option<String>| name.clone().unwrap_or_default();
                    return Err(self.bad_dbc(format!(
                        "{} has {force} bits and {} has {acceleration}: force and acceleration are joined by their counters, which \
                         must be equally wide; if they do not count the same instants, write clocks = \"own\" in [signals]",
                        name(&names.force_counter),
                        name(&names.acceleration_counter),
                    )));
                }
                Ok((Clocks::Common, force))
            }
            (None | Some(ClocksKey::Own), ..) => Ok((Clocks::Own(bits), 32)),
        }
    }

    /// Returns the signals in a unit of angles that the config does not name.
    fn other_angles(&self, names: &SignalsSection) -> Result<Vec<OtherAngle>, BadInput> {
        let named = names.all().map(|(key, name)| self.find(key, name));
        let named = named.collect::<Result<Vec<_>, _>>()?;
        let is_angle = |found: &Found| {
            ANGLE.size(&found.signal.unit).is_some()
                && !named.iter().any(|other| std::ptr::eq(other.signal, found.signal))
        };
        let other = |Found { message, signal }: Found| {
            let id = match message.id {
                MessageId::Standard(id) => FrameId::Standard(id),
                MessageId::Extended(id) => FrameId::Extended(id),
            };
            OtherAngle { name: signal.name.clone(), id }
        };
        Ok(self.all().filter(is_angle).map(other).collect())
    }

    /// All signals, without those that no message has.
    fn all(&self) -> impl Iterator<Item = Found<'a>> + use<'a> {
        let messages = self.dbc.messages.iter().filter(|message| message.name != NO_MESSAGE);
        messages
            .flat_map(|message| message.signals.iter().map(move |signal| Found { message, signal }))
    }

    /// Checks that no bit has two meanings. No signal has two names, no two signals overlap, and no two messages share an
    /// identifier.
    fn check_apart(&self, names: &SignalsSection) -> Result<(), BadInput> {
        let mut seen: Vec<(&String, Found, u64)> = Vec::new();
        for (key, name) in names.all() {
            let found = self.find(key, name)?;
            let Found { message, signal } = found;
            let is_twin = |other: &&can_dbc::Message| {
                other.id == message.id && !std::ptr::eq(*other, message)
            };
            if let Some(twin) = self.dbc.messages.iter().find(is_twin) {
                return Err(self.share(message, twin));
            }
            let bits = bits(&self.layout(found)?);
            let here = seen.iter().filter(|(_, other, _)| other.message.id == message.id);
            for (other_name, other, other_bits) in here {
                if other.signal.name == signal.name {
                    return Err(self.bad_config(format!(
                        "[signals] names {}.{} as {other_name:?} and as {name:?}: each signal has one meaning",
                        message.name, signal.name
                    )));
                }
                if bits & other_bits != 0 {
                    return Err(self.bad_dbc(format!(
                        "signals {} and {} of message {} overlap: mend start bit or length",
                        other.signal.name, signal.name, message.name
                    )));
                }
            }
            seen.push((name, found, bits));
        }
        Ok(())
    }

    /// Looks up the three axes of a sensor, and its counter if it has one, which must share a message. Returns the axes, and the width of
    /// the counter, bits.
    fn vector(
        &self,
        (sensor, key): (usize, &str),
        names: &[String; 3],
        (counter_key, counter): (&str, Option<&String>),
        quantity: &Quantity,
        messages: &mut BTreeMap<Id, Message>,
    ) -> Result<([Signal; 3], Option<u32>), BadInput> {
        let (at_key, at_name) = counter.map_or((key, &names[0]), |counter| (counter_key, counter));
        let at = self.find(at_key, at_name)?;
        let counter = counter.map(|_| self.counter(at)).transpose()?;
        let axis = |name: &String| {
            let found = self.find(key, name)?;
            if found.message.id != at.message.id {
                return Err(self.bad_config(format!(
                    "[signals] {key}: {name:?} is in message {} and {at_name:?} in {}: the three \
                     axes and their counter must share a message",
                    found.message.name, at.message.name
                )));
            }
            self.scaled(found, quantity)
        };
        let axes = [axis(&names[0])?, axis(&names[1])?, axis(&names[2])?];
        self.add(at, Content::Sample { sensor, counter, axes }, messages)?;
        Ok((axes, counter.map(|counter| counter.length.into())))
    }

    /// Finds a signal by its name. If several messages have a signal of that name, `MESSAGE.signal` says which one, with the name of the
    /// message or, if that is also the name of another, with its identifier in the DBC file.
    fn find(&self, key: &str, name: &str) -> Result<Found<'a>, BadInput> {
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
    fn label(&self, message: &can_dbc::Message) -> String {
        let namesakes = self.dbc.messages.iter().filter(|other| other.name == message.name);
        if namesakes.count() > 1 { message.id.raw().to_string() } else { message.name.clone() }
    }

    /// The error about two messages of one identifier.
    fn share(&self, one: &can_dbc::Message, other: &can_dbc::Message) -> BadInput {
        self.bad_dbc(format!(
            "messages {} and {} share the identifier {}: each frame has one layout",
            one.name,
            other.name,
            one.id.raw()
        ))
    }

    /// Returns the layout of a counter, which must be an integer without factor and offset.
    fn counter(&self, found: Found) -> Result<Signal, BadInput> {
        let signal = self.layout(found)?;
        let name = &found.signal.name;
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

    /// Returns the layout of a signal, scaled to SI units.
    fn scaled(&self, found: Found, quantity: &Quantity) -> Result<Signal, BadInput> {
        let signal = self.layout(found)?;
        let (unit, what) = (found.signal.unit.trim(), quantity.name);
        let Some(size) = quantity.size(unit) else {
            return Err(self.bad_dbc(format!(
                "signal {} has unit {unit:?}: {what} must be in one of {}",
                found.signal.name,
                quantity.known()
            )));
        };
        let in_si = Signal { scale: signal.scale * size, offset: signal.offset * size, ..signal };
        if !STEPS.contains(&in_si.scale.abs()) || !in_si.offset.is_finite() {
            return Err(self.bad_dbc(format!(
                "signal {} has factor {:e} and offset {:e} ({unit}): no {what} is measured so",
                found.signal.name, signal.scale, signal.offset
            )));
        }
        Ok(in_si)
    }

    /// Returns the layout of a signal, as the DBC file scales it.
    fn layout(&self, Found { message, signal }: Found) -> Result<Signal, BadInput> {
        let name = &signal.name;
        if signal.multiplexer_indicator != MultiplexIndicator::Plain {
            return Err(self.bad_dbc(format!(
                "signal {name} is multiplexed: flexid reads plain signals only"
            )));
        }
        if !matches!(
            self.dbc.extended_value_type_for_signal(message.id, name),
            None | Some(SignalExtendedValueType::SignedOrUnsignedInteger)
        ) {
            return Err(self.bad_dbc(format!(
                "signal {name} is a floating-point number: flexid reads scaled integers only"
            )));
        }
        // The check refuses numbers that do not fit the types.
        let layout = Signal {
            start_bit: u16::try_from(signal.start_bit).unwrap_or(u16::MAX),
            length: u8::try_from(signal.size).unwrap_or(u8::MAX),
            byte_order: match signal.byte_order {
                can_dbc::ByteOrder::LittleEndian => ByteOrder::Intel,
                can_dbc::ByteOrder::BigEndian => ByteOrder::Motorola,
            },
            signed: signal.value_type == can_dbc::ValueType::Signed,
            scale: signal.factor,
            offset: signal.offset,
        };
        layout
            .check(self.payload(message)?)
            .map_err(|error| self.bad_dbc(format!("signal {name}: {error}")))?;
        Ok(layout)
    }

    fn payload(&self, message: &can_dbc::Message) -> Result<usize, BadInput> {
        match usize::try_from(message.size) {
            Ok(bytes) if bytes <= 8 => Ok(bytes),
            _ => Err(self.bad_dbc(format!(
                "message {} has {} bytes: flexid reads classical CAN frames, of at most 8",
                message.name, message.size
            ))),
        }
    }

    fn add(
        &self,
        Found { message, .. }: Found,
        content: Content,
        messages: &mut BTreeMap<Id, Message>,
    ) -> Result<(), BadInput> {
        let id = match message.id {
            MessageId::Standard(id) => StandardId::new(id).map(Id::from),
            MessageId::Extended(id) => ExtendedId::new(id).map(Id::from),
        };
        let id = id.ok_or_else(|| {
            self.bad_dbc(format!(
                "message {} has identifier {}: above 2047 it is extended, written with 2147483648 added",
                message.name,
                message.id.raw()
            ))
        })?;
        let length = self.payload(message)?;
        let entry = messages.entry(id).or_insert(Message { length, contents: Vec::new() });
        entry.contents.push(content);
        Ok(())
    }

    fn bad_config(&self, message: String) -> BadInput {
        BadInput::new(self.config, message)
    }

    fn bad_dbc(&self, message: String) -> BadInput {
        BadInput::new(self.dbc_file, message)
    }
}

/// Returns the bits of a payload of 8 bytes that a signal takes. The signal must have been checked to fit.
fn bits(signal: &Signal) -> u64 {
    let mut payload = [0; 8];
    let ones = if signal.signed { -1 } else { *signal.raw_range().end() };
    let _ = signal.encode_raw(ones, &mut payload);
    u64::from_le_bytes(payload)
}

fn coarsest(axes: &[Signal; 3]) -> f32 {
    axes.iter().map(|axis| axis.scale.abs() as f32).fold(0.0, f32::max)
}
