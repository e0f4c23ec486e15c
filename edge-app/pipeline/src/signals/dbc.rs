//! Makes the table from signal names and a DBC file.

use std::collections::{BTreeMap, HashSet};
use std::path::Path;

use can_dbc::{Dbc, MessageId, MultiplexIndicator, SignalExtendedValueType};
use embedded_can::{ExtendedId, Id, StandardId};
use flexid_wire::bits::{ByteOrder, Number, Signal};
use flexid_wire::misfits::FrameId;

use super::map::{MOST_CHANNELS, Map};
use super::message::{Content, Message, Part};
use super::{Clocks, FINEST, OtherAngle, Sensor, SignalTable};
use crate::config::{Axes, ChannelsSection, ClocksKey, SignalsSection};
use crate::input::{self, BadInput};
use crate::model::{Kind, Model};
use crate::source::LONGEST_DATA;
use crate::units::{ACCELERATION, ANGLE, FORCE, Quantity, STROKE};

/// Widths of counters that are accepted, bits. A narrower counter wraps too often to separate a loss from a pause. Wider ones
/// do not exist.
const COUNTER_BITS: std::ops::RangeInclusive<u8> = 8..=32;
/// Steps of a signal that are accepted, SI units. The results that follow from other steps leave the range of floating point.
const STEPS: std::ops::RangeInclusive<f64> = FINEST as f64..=1e12;
/// Lengths of CAN FD frames above those of classical ones, bytes.
const FD_LENGTHS: [usize; 7] = [12, 16, 20, 24, 32, 48, LONGEST_DATA];
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

/// A signal that the config names.
struct Named<'a> {
    /// The name in the config.
    name: &'a str,
    found: Found<'a>,
    layout: Signal,
}

/// What the config says of a sensor.
struct Keys<'a> {
    /// 0: force, 1: acceleration.
    sensor: usize,
    key: &'static str,
    axes: &'a Axes,
    counter: Option<&'a String>,
    unit: Option<&'a String>,
    quantity: Quantity,
}

/// A sensor that was looked up.
struct Looked<'a> {
    sensor: Sensor,
    /// Names of the axes.
    axes: [String; 3],
    /// Step of the coarsest axis, SI units.
    resolution: f32,
    /// Width of the counter, bits.
    counter_bits: Option<u32>,
    named: Vec<Named<'a>>,
}

impl<'a> Lookup<'a> {
    fn table(&self, names: &'a SignalsSection, model: &Model) -> Result<SignalTable, BadInput> {
        let mut table = SignalTable::none();
        let force = Keys {
            sensor: 0,
            key: "force",
            axes: &names.force,
            counter: names.force_counter.as_ref(),
            unit: names.force_unit.as_ref(),
            quantity: FORCE,
        };
        let acceleration = Keys {
            sensor: 1,
            key: "acceleration",
            axes: &names.acceleration,
            counter: names.acceleration_counter.as_ref(),
            unit: names.acceleration_unit.as_ref(),
            quantity: ACCELERATION,
        };
        let force = self.sensor(&force, &mut table)?;
        let acceleration = self.sensor(&acceleration, &mut table)?;
        (table.clocks, table.counter_bits) =
            self.clocks(names, [force.counter_bits, acceleration.counter_bits])?;
        let mut named: Vec<Named> = force.named.into_iter().chain(acceleration.named).collect();
        for (index, (name, joint)) in names.joints().iter().zip(model.driven()).enumerate() {
            let found = self.find("joints", name)?;
            let quantity = if joint.kind == Kind::Revolute { ANGLE } else { STROKE };
            let value = self.scaled(found, &quantity, None)?;
            let content = Content::Joint { index: index as u8, value };
            self.add(found.message, content, &[&found.signal.name], &mut table)?;
            table.joints.push(found.signal.name.clone());
            named.push(Named { name, found, layout: value });
        }
        self.check_apart(&named)?;
        let mut axes = force.axes.into_iter().chain(acceleration.axes);
        table.axes = std::array::from_fn(|_| axes.next().unwrap_or_default());
        table.sensors = [force.sensor, acceleration.sensor];
        table.force_resolution = force.resolution;
        table.acceleration_resolution = acceleration.resolution;
        table.other_angles = self.other_angles(&named);
        Ok(table)
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
    fn other_angles(&self, named: &[Named]) -> Vec<OtherAngle> {
        let is_angle = |found: &Found| {
            ANGLE.size(&found.signal.unit).is_some()
                && !named.iter().any(|own| std::ptr::eq(own.found.signal, found.signal))
        };
        let other = |Found { message, signal }: Found| {
            let id = match message.id {
                MessageId::Standard(id) => FrameId::Standard(id),
                MessageId::Extended(id) => FrameId::Extended(id),
            };
            OtherAngle { name: signal.name.clone(), id }
        };
        self.all().filter(is_angle).map(other).collect()
    }

    /// All signals, without those that no message has.
    fn all(&self) -> impl Iterator<Item = Found<'a>> + use<'a> {
        let messages = self.dbc.messages.iter().filter(|message| message.name != NO_MESSAGE);
        messages
            .flat_map(|message| message.signals.iter().map(move |signal| Found { message, signal }))
    }

    /// Checks that no bit has two meanings. No signal has two names, no two signals overlap, and no two messages share an
    /// identifier.
    fn check_apart(&self, named: &[Named]) -> Result<(), BadInput> {
        let mut seen: Vec<(&Named, [u8; LONGEST_DATA])> = Vec::new();
        for own in named {
            let Found { message, signal } = own.found;
            let is_twin = |other: &&can_dbc::Message| {
                other.id == message.id && !std::ptr::eq(*other, message)
            };
            if let Some(twin) = self.dbc.messages.iter().find(is_twin) {
                return Err(self.share(message, twin));
            }
            let bits = bits(&own.layout);
            let here = seen.iter().filter(|(other, _)| other.found.message.id == message.id);
            for (other, other_bits) in here {
                // One counter may be that of both sensors.
                if std::ptr::eq(other.found.signal, signal) && other.name == own.name {
                    continue;
                }
                if other.found.signal.name == signal.name {
                    return Err(self.bad_config(format!(
                        "[signals] names {}.{} as {:?} and as {:?}: each signal has one meaning",
                        message.name, signal.name, other.name, own.name
                    )));
                }
                if bits.iter().zip(other_bits).any(|(one, other)| one & other != 0) {
                    return Err(self.bad_dbc(format!(
                        "signals {} and {} of message {} overlap: mend start bit or length",
                        other.found.signal.name, signal.name, message.name
                    )));
                }
            }
            seen.push((own, bits));
        }
        Ok(())
    }

    /// Looks up a sensor, and adds the frames of its samples to the table.
    fn sensor(&self, keys: &Keys<'a>, table: &mut SignalTable) -> Result<Looked<'a>, BadInput> {
        let &Keys { sensor, key, axes, unit, ref quantity, .. } = keys;
        let channels: Vec<Named> = match &axes.channels {
            Some(map) => {
                let channel = |name: &'a String| {
                    let found = self.find(key, name)?;
                    Ok(Named { name, found, layout: self.layout(found)? })
                };
                map.channels.iter().map(channel).collect::<Result<_, BadInput>>()?
            }
            None => {
                let axis = |name: &'a String| {
                    let found = self.find(key, name)?;
                    let layout = self.scaled(found, quantity, Some((key, unit)))?;
                    Ok(Named { name, found, layout })
                };
                axes.names.iter().map(axis).collect::<Result<_, BadInput>>()?
            }
        };
        let map = axes.channels.as_ref().map(|map| self.map(keys, map)).transpose()?;
        let steps: Vec<f64> = channels.iter().map(|channel| channel.layout.step()).collect();
        let steps = map.as_ref().map_or_else(|| steps.clone(), |map| map.steps(&steps).to_vec());
        let resolution = steps.into_iter().fold(FINEST.into(), f64::max) as f32;
        let names = match &axes.channels {
            Some(_) => ["x", "y", "z"].map(|axis| format!("{key} {axis}")),
            None => {
                let mut names = channels.iter().map(|axis| axis.found.signal.name.clone());
                std::array::from_fn(|_| names.next().unwrap_or_default())
            }
        };
        let counters = self.counters(keys, &channels)?;
        let counter_bits = counters.first().map(|counter| counter.layout.length.into());

        // The frames of a sample, in the order of their identifiers.
        let mut parts: BTreeMap<Id, &can_dbc::Message> = BTreeMap::new();
        for own in channels.iter().chain(&counters) {
            parts.insert(self.id(own.found.message)?, own.found.message);
        }
        let is_in = |message: &can_dbc::Message| {
            let id = message.id;
            move |own: &&Named| own.found.message.id == id
        };
        for (number, &message) in parts.values().enumerate() {
            let counter = counters.iter().find(is_in(message));
            let own = channels.iter().enumerate().filter(|(_, own)| is_in(message)(own));
            let mut shown: Vec<&String> =
                own.clone().map(|(_, own)| &own.found.signal.name).collect();
            if shown.is_empty() {
                shown.extend(counter.map(|counter| &counter.found.signal.name));
            }
            let part = Part {
                sensor,
                number,
                counter: counter.map(|counter| counter.layout),
                channels: own.map(|(channel, own)| (channel, own.layout)).collect(),
            };
            self.add(message, Content::Part(part), &shown, table)?;
        }
        let sensor = Sensor { parts: parts.len(), is_counted: counters.len() == parts.len(), map };
        let named = channels.into_iter().chain(counters).collect();
        Ok(Looked { sensor, axes: names, resolution, counter_bits, named })
    }

    /// Looks up the counter of a sensor with these `channels`. It is one signal, or a signal of this name in each frame of a sample.
    fn counters(&self, keys: &Keys<'a>, channels: &[Named]) -> Result<Vec<Named<'a>>, BadInput> {
        let Some(name) = keys.counter else { return Ok(Vec::new()) };
        let counter = |found| Ok(Named { name, found, layout: self.counter(found)? });
        let has_channel = |found: &Found| {
            channels.iter().any(|channel| std::ptr::eq(channel.found.message, found.message))
        };
        let of_name: Vec<Found> = self.all().filter(|found| found.signal.name == *name).collect();
        let is_in_each = channels.iter().all(|channel| {
            let is_beside = |found: &&Found| std::ptr::eq(found.message, channel.found.message);
            of_name.iter().filter(is_beside).count() == 1
        });
        if of_name.len() == 1 || !is_in_each {
            return Ok(vec![counter(self.find(&format!("{}_counter", keys.key), name)?)?]);
        }
        let counters = of_name.into_iter().filter(has_channel).map(counter);
        let counters: Vec<Named> = counters.collect::<Result<_, BadInput>>()?;
        if counters.iter().any(|counter| counter.layout.length != counters[0].layout.length) {
            return Err(self.bad_dbc(format!(
                "counter {name} has several widths: one counts the frames of a sample"
            )));
        }
        Ok(counters)
    }

    /// Returns the map from the channels of a sensor to its axes, SI units.
    fn map(&self, keys: &Keys, map: &ChannelsSection) -> Result<Map, BadInput> {
        let Keys { key, quantity, unit, .. } = keys;
        let bad = |message: String| self.bad_config(format!("[signals] {key}: {message}"));
        let size = match unit {
            Some(unit) => self.size(key, unit, quantity)?,
            None => 1.0,
        };
        let channels = map.channels.len();
        if !(3..=MOST_CHANNELS).contains(&channels) {
            return Err(bad(format!(
                "channels names {channels}: three axes follow from 3 to {MOST_CHANNELS}"
            )));
        }
        let rows = map.matrix.len();
        let (3 | 6, Some([x, y, z])) = (rows, map.matrix.first_chunk()) else {
            return Err(bad(format!(
                "matrix has {rows} rows: must have three, that give x, y and z, or three further ones, that give moments and are left out"
            )));
        };
        if let Some(row) = map.matrix.iter().find(|row| row.len() != channels) {
            return Err(bad(format!(
                "matrix has a row of {} numbers, and there are {channels} channels: write a number for each",
                row.len()
            )));
        }
        let offset = map.offset.unwrap_or_default();
        if !map.matrix.iter().flatten().chain(&offset).all(|number| number.is_finite()) {
            return Err(bad("matrix or offset has a number that is not finite".into()));
        }
        let columns = (0..channels).map(|channel| [x, y, z].map(|row| size * row[channel]));
        Map::new(columns.collect(), offset.map(|axis| size * axis)).ok_or_else(|| {
            bad("matrix does not tell x, y and z apart: its first three rows depend on each other".into())
        })
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
    fn scaled(
        &self,
        found: Found,
        quantity: &Quantity,
        stated: Option<(&str, Option<&String>)>,
    ) -> Result<Signal, BadInput> {
        let signal = self.layout(found)?;
        let (name, unit, what) = (&found.signal.name, found.signal.unit.trim(), quantity.name);
        let size = match (quantity.size(unit), stated) {
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
    fn size(&self, key: &str, unit: &str, quantity: &Quantity) -> Result<f64, BadInput> {
        quantity.size(unit).ok_or_else(|| {
            let known = quantity.known();
            self.bad_config(format!("[signals] {key}_unit is {unit:?}: must be one of {known}"))
        })
    }

    /// Returns the layout of a signal, as the DBC file scales it.
    fn layout(&self, Found { message, signal }: Found) -> Result<Signal, BadInput> {
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
    fn payload(&self, message: &can_dbc::Message) -> Result<usize, BadInput> {
        let size = usize::try_from(message.size).unwrap_or(usize::MAX);
        let fits = (0..=8).chain(FD_LENGTHS).find(|length| *length >= size);
        fits.ok_or_else(|| {
            self.bad_dbc(format!(
                "message {} has {} bytes: a CAN FD frame has at most {LONGEST_DATA}",
                message.name, message.size
            ))
        })
    }

    fn id(&self, message: &can_dbc::Message) -> Result<Id, BadInput> {
        let id = match message.id {
            MessageId::Standard(id) => StandardId::new(id).map(Id::from),
            MessageId::Extended(id) => ExtendedId::new(id).map(Id::from),
        };
        id.ok_or_else(|| {
            self.bad_dbc(format!(
                "message {} has identifier {}: above 2047 it is extended, written with 2147483648 added",
                message.name,
                message.id.raw()
            ))
        })
    }

    /// Adds what a message carries to the table, and the names of its values.
    fn add(
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

    fn bad_config(&self, message: String) -> BadInput {
        BadInput::new(self.config, message)
    }

    fn bad_dbc(&self, message: String) -> BadInput {
        BadInput::new(self.dbc_file, message)
    }
}

/// Returns the bits of a payload that a signal takes. The signal must have been checked to fit.
fn bits(signal: &Signal) -> [u8; LONGEST_DATA] {
    let mut payload = [0; LONGEST_DATA];
    let (low, high) = signal.raw_range().into_inner();
    let ones = if low < 0 { -1 } else { high };
    let _ = signal.encode_raw(ones, &mut payload);
    payload
}
