//! TDMS files of LabVIEW and of NI's drivers (NI, "TDMS File Format Internal Structure"; DAQmx data as npTDMS documents them).
//!
//! A file is a row of segments, each with the objects that changed and the values that came. The values of a channel stand in one piece, one after
//! the other with those of other channels, or, as DAQmx writes them, raw in the buffers of devices. The crate `tdms` is not used: of DAQmx data it
//! returns nothing, without an error.

use std::collections::HashMap;
use std::io::{self, Read};

use super::channels::{Channel, Group, LARGEST, bounded};
use super::layout::Layout;

/// Contents of a segment.
const METADATA: u32 = 1 << 1;
const NEW_LIST: u32 = 1 << 2;
const RAW_DATA: u32 = 1 << 3;
const INTERLEAVED: u32 = 1 << 5;
const BIG_ENDIAN: u32 = 1 << 6;
const DAQMX: u32 = 1 << 7;
/// Indexes of an object: without data, as before, and of DAQmx: scaled, and of digital lines.
const NO_DATA: u32 = u32::MAX;
const AS_BEFORE: u32 = 0;
const OF_DAQMX: u32 = 0x1269;
const OF_LINES: u32 = 0x126A;
/// Types of values.
const TEXT: u32 = 0x20;
const STAMP: u32 = 0x44;
const DAQMX_TYPE: u32 = u32::MAX;
/// Properties that say at which instants values are.
const INSTANTS: [&str; 3] = ["wf_start_time", "wf_start_offset", "wf_increment"];
/// Most scales of a channel. Chosen: a sensor has one or two.
const MOST_SCALES: usize = 100;
/// Longest description of a segment, bytes.
const LONGEST: u64 = 256 << 20;

const CUT_OFF: &str = "is cut off or damaged: copy or record it again";

/// Reads the channels that the layout wants; of others the names. Of a last segment that its writer did not finish, what is there is read.
///
/// # Errors
/// The file is damaged or cut off, or has values of a kind that is not known.
pub(super) fn read(bytes: impl Read, layout: &Layout) -> Result<Vec<Group>, String> {
    bounded(bytes, |bytes| segments(bytes, layout))
}

fn segments(mut bytes: &mut dyn Read, layout: &Layout) -> Result<Vec<Group>, String> {
    let mut objects = Objects::default();
    loop {
        let head = upto(&mut bytes, 28)?;
        let Some(lead) = head.first_chunk::<28>() else {
            return if head.is_empty() { objects.groups() } else { Err(CUT_OFF.into()) };
        };
        if !lead.starts_with(b"TDSm") {
            return Err(CUT_OFF.into());
        }
        let contents = u32::from_le_bytes(field(lead, 4)?);
        // The number of the segment's version, and these lengths, are of the same order as the rest.
        let mut rest = Reader { bytes: &lead[8..], is_big_endian: contents & BIG_ENDIAN != 0 };
        let (_version, length, described) = (rest.whole()?, rest.long()?, rest.long()?);
        if described > LONGEST || described > length {
            return Err(CUT_OFF.into());
        }
        let description = upto(&mut bytes, described)?;
        if (description.len() as u64) < described {
            return Err(CUT_OFF.into());
        }
        if contents & METADATA != 0 {
            let mut reader = Reader { bytes: &description, ..rest };
            objects.describe(&mut reader, contents & NEW_LIST != 0, layout)?;
        }
        // Of a segment that was not finished the length is not known.
        let values = if length == u64::MAX { LARGEST } else { length - described };
        let data = upto(&mut bytes, if contents & RAW_DATA != 0 { values } else { 0 })?;
        if contents & RAW_DATA != 0 && length != u64::MAX && (data.len() as u64) < values {
            return Err(CUT_OFF.into());
        }
        objects.take(&data, contents)?;
        if contents & RAW_DATA == 0 {
            io::copy(&mut (&mut bytes).take(values), &mut io::sink()).map_err(unreadable)?;
        }
    }
}

fn unreadable(error: io::Error) -> String {
    format!("cannot be read: {error}")
}

/// Reads so many bytes, or those that are left.
fn upto(bytes: &mut impl Read, length: u64) -> Result<Vec<u8>, String> {
    let mut own = Vec::new();
    bytes.take(length).read_to_end(&mut own).map_err(unreadable)?;
    Ok(own)
}

fn field<const N: usize>(bytes: &[u8], place: usize) -> Result<[u8; N], String> {
    bytes
        .get(place..)
        .and_then(|rest| rest.first_chunk())
        .copied()
        .ok_or_else(|| CUT_OFF.to_owned())
}

/// Reads a description from its beginning.
#[derive(Clone, Copy)]
struct Reader<'a> {
    bytes: &'a [u8],
    is_big_endian: bool,
}

impl Reader<'_> {
    fn number<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let (own, rest) = self.bytes.split_first_chunk::<N>().ok_or(CUT_OFF)?;
        self.bytes = rest;
        let mut own = *own;
        if self.is_big_endian {
            own.reverse();
        }
        Ok(own)
    }

    fn whole(&mut self) -> Result<u32, String> {
        self.number().map(u32::from_le_bytes)
    }

    fn long(&mut self) -> Result<u64, String> {
        self.number().map(u64::from_le_bytes)
    }

    fn text(&mut self) -> Result<String, String> {
        let length = self.whole()? as usize;
        let (own, rest) = self.bytes.split_at_checked(length).ok_or(CUT_OFF)?;
        self.bytes = rest;
        Ok(String::from_utf8_lossy(own).into_owned())
    }

    /// Returns the value of a property.
    fn property(&mut self) -> Result<Property, String> {
        let kind = self.whole()?;
        if kind == TEXT {
            return self.text().map(Property::Text);
        }
        let size =
            size(kind).ok_or_else(|| format!("is damaged: a property is of type {kind:#x}"))?;
        let (own, rest) = self.bytes.split_at_checked(size).ok_or(CUT_OFF)?;
        self.bytes = rest;
        Ok(Property::Number(value(kind, own, self.is_big_endian)))
    }
}

enum Property {
    Number(f64),
    Text(String),
}

/// Returns the size of a number of a type, bytes.
fn size(kind: u32) -> Option<usize> {
    Some(match kind {
        1 | 5 | 0x21 => 1,
        2 | 6 => 2,
        3 | 7 | 9 | 0x19 => 4,
        4 | 8 | 10 | 0x1A => 8,
        STAMP => 16,
        _ => return None,
    })
}

/// Returns the number in bytes, NaN of a type that is none.
fn value(kind: u32, bytes: &[u8], is_big_endian: bool) -> f64 {
    let mut own = [0; 16];
    let count = bytes.len().min(16);
    own[..count].copy_from_slice(&bytes[..count]);
    if is_big_endian {
        own[..count].reverse();
    }
    let long = u128::from_le_bytes(own);
    let whole = long as u64;
    match kind {
        // Seconds since 1904 in 2^-64.
        STAMP => (long >> 64) as i64 as f64 + whole as f64 * 2_f64.powi(-64),
        1 => f64::from(whole as i8),
        2 => f64::from(whole as i16),
        3 => f64::from(whole as i32),
        4 => whole as i64 as f64,
        5 | 6 | 7 | 8 | 0x21 => whole as f64,
        9 | 0x19 => f64::from(f32::from_bits(whole as u32)),
        10 | 0x1A => f64::from_bits(whole),
        _ => f64::NAN,
    }
}

/// Where the values of an object stand in a segment.
#[derive(Clone, Debug)]
enum Index {
    /// Numbers of a type, so many in each chunk. Of texts the bytes are given.
    Plain { kind: u32, count: u64, bytes: u64 },
    /// Parts of the rows of raw buffers, by the numbers of their scales, and the widths of the rows.
    Daqmx { count: u64, scalers: Vec<Scaler>, widths: Vec<u32> },
}

/// A part of the rows of a raw buffer.
#[derive(Clone, Debug)]
struct Scaler {
    kind: u32,
    buffer: usize,
    place: usize,
    scale: f64,
}

/// An object of the file: the file, a group or a channel.
#[derive(Default)]
struct Object {
    /// Group and channel. `None` of another object.
    name: Option<(String, String)>,
    is_wanted: bool,
    properties: HashMap<String, Property>,
    index: Option<Index>,
    values: Vec<f64>,
}

/// The objects so far, and those of the present segment in the order of their values.
#[derive(Default)]
struct Objects {
    all: Vec<Object>,
    places: HashMap<String, usize>,
    present: Vec<usize>,
}

impl Objects {
    /// Takes the description of a segment.
    fn describe(
        &mut self,
        reader: &mut Reader,
        is_new: bool,
        layout: &Layout,
    ) -> Result<(), String> {
        if is_new {
            self.present.clear();
        }
        for _ in 0..reader.whole()? {
            let path = reader.text()?;
            let place = *self.places.entry(path.clone()).or_insert(self.all.len());
            if place == self.all.len() {
                let name = names(&path);
                let is_wanted = name.as_ref().is_some_and(|(group, own)| layout.wants(group, own));
                self.all.push(Object { name, is_wanted, ..Object::default() });
            }
            let object = &mut self.all[place];
            let has_data = match reader.whole()? {
                NO_DATA => false,
                AS_BEFORE => object.index.is_some(),
                own => {
                    object.index = Some(index(own, reader)?);
                    true
                }
            };
            self.present.retain(|own| *own != place || has_data);
            if has_data && !self.present.contains(&place) {
                self.present.push(place);
            }
            for _ in 0..reader.whole()? {
                let name = reader.text()?;
                let value = reader.property()?;
                object.keeps_instants(&name, &value)?;
                object.properties.insert(name, value);
            }
        }
        Ok(())
    }

    /// Takes the values of a segment: chunks of all present objects, the last of which may be short.
    fn take(&mut self, data: &[u8], contents: u32) -> Result<(), String> {
        let is_big_endian = contents & BIG_ENDIAN != 0;
        let mut rest = data;
        while !rest.is_empty() {
            let before = rest.len();
            if contents & DAQMX != 0 {
                self.take_buffers(&mut rest, is_big_endian)?;
            } else if contents & INTERLEAVED != 0 {
                self.take_rows(&mut rest, is_big_endian)?;
            } else {
                self.take_pieces(&mut rest, is_big_endian)?;
            }
            if rest.len() == before {
                break;
            }
        }
        Ok(())
    }

    fn take_pieces(&mut self, rest: &mut &[u8], is_big_endian: bool) -> Result<(), String> {
        for place in &self.present {
            let object = &mut self.all[*place];
            let Some(Index::Plain { kind, count, bytes }) = object.index else {
                return Err(CUT_OFF.into());
            };
            let length = usize::try_from(bytes).unwrap_or(usize::MAX).min(rest.len());
            let (own, after) = rest.split_at(length);
            *rest = after;
            match size(kind) {
                Some(size) if object.is_wanted => {
                    let count = usize::try_from(count).unwrap_or(usize::MAX);
                    let own = own.chunks_exact(size).take(count);
                    object.values.extend(own.map(|own| value(kind, own, is_big_endian)));
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn take_rows(&mut self, rest: &mut &[u8], is_big_endian: bool) -> Result<(), String> {
        let mut parts = Vec::new();
        let (mut width, mut rows) = (0, u64::MAX);
        for place in &self.present {
            let Some(Index::Plain { kind, count, .. }) = self.all[*place].index else {
                return Err(CUT_OFF.into());
            };
            let size = size(kind).ok_or(CUT_OFF)?;
            parts.push((*place, kind, width..width + size));
            (width, rows) = (width + size, rows.min(count));
        }
        let length = usize::try_from(rows)
            .ok()
            .and_then(|rows| rows.checked_mul(width))
            .unwrap_or(usize::MAX);
        let (own, after) = rest.split_at(length.min(rest.len()));
        *rest = after;
        if width > 0 {
            for row in own.chunks_exact(width) {
                for (place, kind, part) in &parts {
                    let object = &mut self.all[*place];
                    if object.is_wanted {
                        object.values.push(value(*kind, &row[part.clone()], is_big_endian));
                    }
                }
            }
        }
        Ok(())
    }

    fn take_buffers(&mut self, rest: &mut &[u8], is_big_endian: bool) -> Result<(), String> {
        let first = self.present.first().and_then(|place| self.all[*place].index.clone());
        let Some(Index::Daqmx { widths, .. }) = first else { return Err(CUT_OFF.into()) };
        for (buffer, width) in widths.into_iter().enumerate() {
            let width = width as usize;
            // All objects of a buffer have as many rows.
            let of_buffer = |index: &Option<Index>| match index {
                Some(Index::Daqmx { count, scalers, .. }) => {
                    let own = scalers.iter().any(|own| own.buffer == buffer);
                    own.then(|| usize::try_from(*count).unwrap_or(usize::MAX))
                }
                _ => None,
            };
            let counts = self.present.iter().filter_map(|place| of_buffer(&self.all[*place].index));
            let length = counts.max().unwrap_or_default().saturating_mul(width);
            let (own, after) = rest.split_at(length.min(rest.len()));
            *rest = after;
            if width == 0 {
                continue;
            }
            for place in &self.present {
                let object = &mut self.all[*place];
                let Some(Index::Daqmx { scalers, .. }) = &object.index else { continue };
                // The first scaler of the buffer: a channel of a sensor has one.
                let Some(Scaler { kind, place, .. }) =
                    scalers.iter().find(|own| own.buffer == buffer)
                else {
                    continue;
                };
                let part = *place..place.saturating_add(size(*kind).ok_or(CUT_OFF)?);
                if object.is_wanted {
                    let own = own.chunks_exact(width).map(|row| row.get(part.clone()));
                    let own: Option<Vec<f64>> =
                        own.map(|own| Some(value(*kind, own?, is_big_endian))).collect();
                    object.values.extend(
                        own.ok_or("is damaged: a channel of DAQmx lies outside of its buffer")?,
                    );
                }
            }
        }
        Ok(())
    }

    /// Returns the channels in their groups, scaled.
    fn groups(self) -> Result<Vec<Group>, String> {
        let mut groups: Vec<Group> = Vec::new();
        for object in self.all {
            let Some((group, name)) = object.name.clone() else { continue };
            let place = match groups.iter().position(|own| own.name == group) {
                Some(place) => place,
                None => {
                    groups.push(Group { name: group, ..Group::default() });
                    groups.len() - 1
                }
            };
            let number = |key: &str| object.number(key);
            let units = ["unit_string", "NI_UnitDescription"].map(|key| object.properties.get(key));
            let unit = units.into_iter().find_map(|own| match own {
                Some(Property::Text(unit)) if !unit.is_empty() => Some(unit.clone()),
                _ => None,
            });
            let unit = unit.unwrap_or_default();
            let period_s = number("wf_increment").filter(|own| *own > 0.0 && own.is_finite());
            let begins_s = number("wf_start_time")
                .map(|own| own + number("wf_start_offset").unwrap_or_default());
            let values =
                object.scaled().map_err(|message| format!("channel {name:?} {message}"))?;
            groups[place].channels.push(Channel { name, unit, values, period_s, begins_s });
        }
        Ok(groups)
    }
}

impl Object {
    /// Checks that a property does not give new instants to values that came: those before and behind a pause are two recordings.
    fn keeps_instants(&self, key: &str, value: &Property) -> Result<(), String> {
        let (Some(before), Property::Number(own)) = (self.number(key), value) else {
            return Ok(());
        };
        if !INSTANTS.contains(&key) || self.values.is_empty() || before == *own {
            return Ok(());
        }
        let (group, name) = self.name.clone().unwrap_or_default();
        Err(format!(
            "channel {name:?} of the group {group:?} has another {key} after its first values: write each recording into a group of its own"
        ))
    }

    fn number(&self, key: &str) -> Option<f64> {
        match self.properties.get(key) {
            Some(Property::Number(own)) => Some(*own),
            _ => None,
        }
    }

    /// Returns the values, scaled as the properties say: each scale takes what another one gives, or the raw values.
    fn scaled(&self) -> Result<Vec<f64>, String> {
        let mut values = self.values.clone();
        let count = self.number("NI_Number_Of_Scales").unwrap_or_default();
        let is_scaled = matches!(self.properties.get("NI_Scaling_Status"), Some(Property::Text(own)) if own == "scaled");
        // Those that stand scaled in the file need nothing.
        if values.is_empty() || is_scaled || count < 1.0 {
            return Ok(values);
        }
        let raw = match &self.index {
            Some(Index::Daqmx { scalers, .. }) => scalers.first().map(|own| own.scale),
            _ => None,
        };
        // From the last scale back to the raw values.
        let (mut scale, mut laws) = (count - 1.0, Vec::new());
        while scale != f64::from(u32::MAX) && Some(scale) != raw {
            if laws.len() as f64 >= count || laws.len() > MOST_SCALES {
                return Err("has scales that take each other's values in a circle, or more than 100: save it scaled".into());
            }
            let key = |own: &str| format!("NI_Scale[{scale}]_{own}");
            let kind = match self.properties.get(&key("Scale_Type")) {
                Some(Property::Text(kind)) => &**kind,
                _ => break,
            };
            let number = |own: &str| {
                self.number(&key(own)).ok_or(format!("has a scale without {own}: save it scaled"))
            };
            match kind {
                "Linear" => laws.push(vec![number("Linear_Y_Intercept")?, number("Linear_Slope")?]),
                "Polynomial" => {
                    let size = number("Polynomial_Coefficients_Size")
                        .unwrap_or(4.0)
                        .clamp(0.0, 100.0) as usize;
                    let own =
                        (0..size).map(|place| number(&format!("Polynomial_Coefficients[{place}]")));
                    laws.push(own.collect::<Result<_, _>>()?);
                }
                other => {
                    return Err(format!(
                        "has a scale of type {other:?}, and linear ones and polynomials are read: save it scaled"
                    ));
                }
            }
            scale =
                self.number(&key(&format!("{kind}_Input_Source"))).unwrap_or(f64::from(u32::MAX));
        }
        for law in laws.iter().rev() {
            for value in &mut values {
                *value = law.iter().rev().fold(0.0, |sum, own| sum * *value + own);
            }
        }
        Ok(values)
    }
}

/// Reads where the values of an object stand.
fn index(own: u32, reader: &mut Reader) -> Result<Index, String> {
    let kind = reader.whole()?;
    let _dimension = reader.whole()?;
    let count = reader.long()?;
    if ![OF_DAQMX, OF_LINES].contains(&own) {
        let bytes = match size(kind) {
            Some(size) => count.saturating_mul(size as u64),
            None if kind == TEXT => reader.long()?,
            None => {
                return Err(format!(
                    "has values of type {kind:#x}, which is not known: save it with numbers alone"
                ));
            }
        };
        return Ok(Index::Plain { kind, count, bytes });
    }
    if kind != DAQMX_TYPE {
        return Err(CUT_OFF.into());
    }
    let mut scalers = Vec::new();
    for _ in 0..reader.whole()? {
        let kind = match reader.whole()? {
            // Types of DAQmx: integers of 8 to 64 bits without and with sign, then floats.
            0 => 5,
            1 => 1,
            2 => 6,
            3 => 2,
            4 => 7,
            5 => 3,
            6 => 8,
            7 => 4,
            8 => 9,
            9 => 10,
            other => {
                return Err(format!(
                    "has values of DAQmx of type {other}, which is not known: save it scaled"
                ));
            }
        };
        let (buffer, place) = (reader.whole()? as usize, reader.whole()? as usize);
        let scale = if own == OF_LINES {
            reader.number::<1>()?;
            reader.whole()?
        } else {
            reader.whole()?;
            reader.whole()?
        };
        let place = if own == OF_LINES { place / 8 } else { place };
        scalers.push(Scaler { kind, buffer, place, scale: scale.into() });
    }
    let widths = (0..reader.whole()?).map(|_| reader.whole()).collect::<Result<_, _>>()?;
    Ok(Index::Daqmx { count, scalers, widths })
}

/// Returns group and channel of a path, `/'cut'/'Fx'`. A quote in a name stands twice. `None` of another object.
fn names(path: &str) -> Option<(String, String)> {
    let inner = path.strip_prefix("/'")?.strip_suffix('\'')?;
    let (group, channel) = inner.split_once("'/'")?;
    Some((group.replace("''", "'"), channel.replace("''", "'")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(own: &str) -> Vec<u8> {
        [&(own.len() as u32).to_le_bytes()[..], own.as_bytes()].concat()
    }

    /// A segment with three values of the channel `Fz` and these properties, numbers or texts.
    fn segment(properties: &[(&str, Result<f64, &str>)]) -> Vec<u8> {
        let mut own = [&1_u32.to_le_bytes()[..], &text("/'cut'/'Fz'")].concat();
        own.extend([20_u32, 10, 1, 3, 0, properties.len() as u32].map(u32::to_le_bytes).concat());
        for (name, value) in properties {
            own.extend(text(name));
            own.extend(match value {
                Ok(own) => [&10_u32.to_le_bytes()[..], &own.to_le_bytes()].concat(),
                Err(own) => [&TEXT.to_le_bytes()[..], &text(own)].concat(),
            });
        }
        let values = [1.0, 2.0, 3.0].map(f64::to_le_bytes).concat();
        let lengths = [own.len() + values.len(), own.len()].map(|own| (own as u64).to_le_bytes());
        let contents = (METADATA | NEW_LIST | RAW_DATA).to_le_bytes();
        let lead = [b"TDSm", &contents[..], &4713_u32.to_le_bytes(), &lengths.concat()].concat();
        [lead, own, values].concat()
    }

    fn channel(segments: &[Vec<u8>]) -> Result<Channel, String> {
        let axes = ["", "", "Fz", "", "", ""].map(str::to_owned);
        let layout = Layout { axes, joints: Vec::new(), rate_hz: None, base: None, topics: None };
        read(&*segments.concat(), &layout).map(|mut own| own.remove(0).channels.remove(0))
    }

    #[test]
    fn recordings_are_not_joined() {
        let of = |start_s: f64, period_s: f64| {
            segment(&[("wf_start_time", Ok(start_s)), ("wf_increment", Ok(period_s))])
        };
        let own = channel(&[of(10.0, 1e-3), of(10.0, 1e-3), segment(&[])]).unwrap();
        assert_eq!((own.values.len(), own.begins_s, own.period_s), (9, Some(10.0), Some(1e-3)));
        for (other, key) in [(of(60.0, 1e-3), "wf_start_time"), (of(10.0, 2e-3), "wf_increment")] {
            let error = channel(&[of(10.0, 1e-3), other]).unwrap_err();
            let expected = format!(
                "channel \"Fz\" of the group \"cut\" has another {key} after its first values: write each recording into a group of its own"
            );
            assert_eq!(error, expected);
        }
    }

    #[test]
    fn scales_end_and_units_are_found() {
        let of = |source: f64| {
            channel(&[segment(&[
                ("unit_string", Err("")),
                ("NI_UnitDescription", Err("kN")),
                ("NI_Number_Of_Scales", Ok(1.0)),
                ("NI_Scale[0]_Scale_Type", Err("Linear")),
                ("NI_Scale[0]_Linear_Slope", Ok(2.0)),
                ("NI_Scale[0]_Linear_Y_Intercept", Ok(1.0)),
                ("NI_Scale[0]_Linear_Input_Source", Ok(source)),
            ])])
        };
        let own = of(u32::MAX.into()).unwrap();
        assert_eq!((&*own.unit, own.values), ("kN", vec![3.0, 5.0, 7.0]));
        assert!(of(0.0).unwrap_err().contains("in a circle"));
    }

    #[test]
    fn stamps_are_times() {
        let half = [&(1_u64 << 63).to_le_bytes()[..], &7_u64.to_le_bytes()].concat();
        assert_eq!(value(STAMP, &half, false), 7.5);
        let half: Vec<u8> = half.into_iter().rev().collect();
        assert_eq!(value(STAMP, &half, true), 7.5);
    }
}
