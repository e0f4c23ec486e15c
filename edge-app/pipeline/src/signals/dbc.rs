//! Makes the table from signal names and a DBC file.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use can_dbc::{Dbc, MessageId};
use flexid_wire::bits::Signal;
use flexid_wire::misfits::FrameId;

use super::lookup::{Found, Lookup, Named};
use super::message::Content;
use super::sensor::{Keys, Looked};
use super::{Clocks, OtherAngle, SignalTable};
use crate::config::{ClocksKey, SignalsSection};
use crate::input::{self, BadInput};
use crate::model::{Kind, Model};
use crate::source::LONGEST_DATA;
use crate::units::{ACCELERATION, ANGLE, FORCE, STROKE};

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
        Lookup { config, dbc_file, dbc: &dbc, unmarked: &unmarked(&text) }.table(names, model)
    }
}

/// Returns the identifiers that are too large for 11 bits and not marked as extended by 2147483648, by the names of their messages.
fn unmarked(text: &str) -> HashMap<String, u64> {
    let message = |line: &str| {
        let mut words = line.trim_start().strip_prefix("BO_ ")?.split_whitespace();
        let id: u64 = words.next()?.parse().ok()?;
        let name = words.next()?.trim_end_matches(':').to_owned();
        (0x800..0x8000_0000).contains(&id).then_some((name, id))
    };
    text.lines().filter_map(message).collect()
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
        if names.clocks.is_none() {
            self.check_own_counter("acceleration", &acceleration, &force)?;
            self.check_own_counter("force", &force, &acceleration)?;
        }
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

    /// Checks that the counter of a sensor does not come in a frame of the other one that has none of its channels: another device counts there.
    fn check_own_counter(&self, key: &str, own: &Looked, other: &Looked) -> Result<(), BadInput> {
        let ids = |of: &Looked| -> Vec<MessageId> {
            let channels = of.named.len().saturating_sub(of.counters);
            of.named.iter().take(channels).map(|own| own.found.message.id).collect()
        };
        let (own_ids, other_ids) = (ids(own), ids(other));
        let channels = own.named.len().saturating_sub(own.counters);
        let is_foreign = |counter: &&Named| {
            let id = counter.found.message.id;
            other_ids.contains(&id) && !own_ids.contains(&id)
        };
        match own.named.iter().skip(channels).find(is_foreign) {
            Some(counter) => Err(self.bad_config(format!(
                "[signals] {key}_counter: {} is in a frame of the other sensor: write clocks = \"common\" if one device samples both, else leave it out",
                counter.found.signal.name
            ))),
            None => Ok(()),
        }
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
}

/// Returns the bits of a payload that a signal takes. The signal must have been checked to fit.
fn bits(signal: &Signal) -> [u8; LONGEST_DATA] {
    let mut payload = [0; LONGEST_DATA];
    let (low, high) = signal.raw_range().into_inner();
    let ones = if low < 0 { -1 } else { high };
    let _ = signal.encode_raw(ones, &mut payload);
    payload
}
