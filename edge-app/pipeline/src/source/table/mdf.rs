//! MF4 files (ASAM MDF 4.0 to 4.2), as data acquisition units, CANape and asammdf write them, compressed or not.
//!
//! A file is a graph of blocks that point to each other: data groups, their channel groups, their channels, and their records. The crate `mf4-rs` is not
//! used: it reads no compressed blocks.

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::io::Read;

use flate2::read::ZlibDecoder;

use super::channels::{Channel, Group, LARGEST, bounded};
use super::layout::Layout;

/// Place of the first block behind the identification.
const HEADER: u64 = 64;
/// Kinds of channels: of fixed length, time, time that is counted.
const FIXED: u8 = 0;
const MASTER: u8 = 2;
const COUNTED: u8 = 3;
/// Kind of synchronisation of a time.
const TIME: u8 = 1;
/// A channel group of texts of any length, and one whose time stands elsewhere.
const OF_TEXTS: u16 = 1;
const ELSEWHERE: u16 = 8;

const CUT_OFF: &str =
    "is cut off or damaged: a block lies behind its end: record it again, or save it with asammdf";

/// Reads the channels that the layout wants; of others the names.
///
/// # Errors
/// The file is damaged, cut off, not finished, of an older version, or of a bus.
pub(super) fn read(bytes: impl Read, layout: &Layout) -> Result<Vec<Group>, String> {
    let file = bounded(bytes, |bytes| {
        let mut file = Vec::new();
        let read = bytes.read_to_end(&mut file);
        read.map_err(|error| format!("cannot be read: {error}")).map(|_| file)
    })?;
    if file.starts_with(b"UnFinMF") {
        let mend = "`pip install asammdf; python3 -c \"from asammdf import MDF; MDF('IN.mf4').save('OUT.mf4')\"`";
        return Err(format!("was not finished by its writer: finish it with {mend}"));
    }
    let version = u16::from_le_bytes(field(&file, 28)?);
    if !(400..500).contains(&version) {
        let mend = "`pip install asammdf; python3 -c \"from asammdf import MDF; MDF('IN.mdf').convert('4.10').save('OUT.mf4')\"`";
        return Err(format!(
            "is MDF of version {}.{:02}, and 4 is read: convert it with {mend}",
            version / 100,
            version % 100
        ));
    }
    let file = File { bytes: &file, seen: RefCell::default() };
    let mut groups = Vec::new();
    for data_group in file.list(file.block(HEADER, b"##HD")?.link(0), b"##DG")? {
        let groups_of: Vec<Block> = file.list(data_group.link(1), b"##CG")?;
        let id_bytes = usize::from(data_group.data::<1>(0)?[0]);
        let mut parts = Vec::new();
        for group in &groups_of {
            parts.push(Part::new(&file, group, groups.len() + parts.len(), layout)?);
        }
        if parts.iter().any(Part::is_wanted) {
            let bytes: Option<u64> = parts.iter().map(|own| own.bytes(id_bytes)).sum();
            let records = file.records(data_group.link(2), bytes.unwrap_or(LARGEST))?;
            fill(&mut parts, &records, id_bytes)?;
        }
        groups.extend(parts.into_iter().map(|part| part.group));
    }
    let of_bus = |own: &Channel| own.name.starts_with("CAN_DataFrame");
    if groups.iter().any(|own| own.channels.iter().any(of_bus)) {
        let mend = "`pip install 'python-can[mf4]'; can_logconvert IN.mf4 OUT.log`";
        return Err(format!("holds the frames of a CAN bus: convert it with {mend}"));
    }
    Ok(groups)
}

/// Bytes of a file.
struct File<'a> {
    bytes: &'a [u8],
    /// Places of the blocks of lists and of records so far: each belongs to one list.
    seen: RefCell<HashSet<u64>>,
}

/// A block: its links, and the data behind.
struct Block<'a> {
    id: [u8; 4],
    links: &'a [[u8; 8]],
    data: &'a [u8],
}

impl<'a> File<'a> {
    /// Returns the block at a place, which must be of one kind.
    fn block(&self, place: u64, kind: &[u8; 4]) -> Result<Block<'a>, String> {
        let block = self.any(place)?;
        if block.id != *kind {
            let [own, kind] =
                [&block.id, kind].map(|own| String::from_utf8_lossy(own).into_owned());
            return Err(format!(
                "is damaged: a block is {own:?}, and must be {kind:?}: record it again"
            ));
        }
        Ok(block)
    }

    fn any(&self, place: u64) -> Result<Block<'a>, String> {
        let place = usize::try_from(place).map_err(|_| CUT_OFF)?;
        let rest = self.bytes.get(place..).ok_or(CUT_OFF)?;
        let id = field(rest, 0)?;
        let [length, count] = [8, 16].map(|place| field(rest, place).map(u64::from_le_bytes));
        let length = usize::try_from(length?).map_err(|_| CUT_OFF)?;
        let rest = rest.get(24..length).ok_or(CUT_OFF)?;
        let bytes =
            usize::try_from(count?).ok().and_then(|count| count.checked_mul(8)).ok_or(CUT_OFF)?;
        let (links, data) = rest.split_at_checked(bytes).ok_or(CUT_OFF)?;
        Ok(Block { id, links: links.as_chunks().0, data })
    }

    /// Returns the blocks of one kind of which each points to the next.
    fn list(&self, first: u64, kind: &[u8; 4]) -> Result<Vec<Block<'a>>, String> {
        let (mut place, mut blocks) = (first, Vec::new());
        while place != 0 {
            self.visit(place)?;
            let block = self.block(place, kind)?;
            place = block.link(0);
            blocks.push(block);
        }
        Ok(blocks)
    }

    /// Remembers that the block at a place was read.
    ///
    /// # Errors
    /// It was read before.
    fn visit(&self, place: u64) -> Result<(), String> {
        if self.seen.borrow_mut().insert(place) {
            return Ok(());
        }
        Err("is damaged: two of its blocks point to the same one, or in a circle: record it again"
            .into())
    }

    /// Returns the text of a block, of its element TX where it is XML. An empty one where no block is.
    fn text(&self, place: u64) -> Result<String, String> {
        if place == 0 {
            return Ok(String::new());
        }
        let block = self.any(place)?;
        let end = block.data.iter().position(|byte| *byte == 0).unwrap_or(block.data.len());
        let text = String::from_utf8_lossy(&block.data[..end]).into_owned();
        let within = text.split_once("<TX>").and_then(|(_, rest)| rest.split_once("</TX>"));
        Ok(match within {
            Some((own, _)) if &block.id == b"##MD" => own.to_owned(),
            _ => text,
        })
    }

    /// Returns the records of a data group, all together; of packed ones at most so many bytes.
    fn records(&self, place: u64, most: u64) -> Result<Vec<u8>, String> {
        let mut all = Vec::new();
        if place == 0 {
            return Ok(all);
        }
        let (mut place, mut block) = (place, self.any(place)?);
        if &block.id == b"##HL" {
            place = block.link(0);
            block = self.block(place, b"##DL")?;
        }
        if &block.id != b"##DL" {
            self.visit(place)?;
            self.unpack(&block, most, &mut all)?;
            return Ok(all);
        }
        for list in self.list(place, b"##DL")? {
            for place in list.links.iter().skip(1).map(|own| u64::from_le_bytes(*own)) {
                if place != 0 {
                    self.visit(place)?;
                    self.unpack(&self.any(place)?, most, &mut all)?;
                }
            }
        }
        Ok(all)
    }

    /// Appends the data of a block, unpacked if need be.
    fn unpack(&self, block: &Block, most: u64, all: &mut Vec<u8>) -> Result<(), String> {
        match &block.id {
            b"##DT" => all.extend(block.data),
            b"##DZ" => {
                let [transposed] = block.data::<1>(2)?;
                let columns = u32::from_le_bytes(block.data(4)?) as usize;
                let length = u64::from_le_bytes(block.data(8)?);
                let end = length.saturating_add(all.len() as u64);
                if end > LARGEST {
                    return Err("has more than 4 GiB of records: cut it with asammdf".into());
                }
                if end > most {
                    return Err(format!(
                        "is damaged: its groups state {most} bytes of records, and it has {end}: save it with asammdf"
                    ));
                }
                let packed = block.data.get(24..).ok_or(CUT_OFF)?;
                let mut data = Vec::new();
                let read = ZlibDecoder::new(packed).take(length + 1).read_to_end(&mut data);
                read.map_err(|error| format!("is damaged: a block cannot be unpacked ({error})"))?;
                if data.len() as u64 != length {
                    return Err(format!(
                        "is damaged: a block has another length than {length} bytes when it is unpacked: record it again"
                    ));
                }
                match transposed {
                    0 => all.extend(data),
                    1 => transpose(&data, columns, all),
                    other => {
                        return Err(format!(
                            "is compressed in a way that is not known, {other}: save it with asammdf"
                        ));
                    }
                }
            }
            other => {
                return Err(format!(
                    "has records in blocks {:?}: save it with asammdf as version 4.10",
                    String::from_utf8_lossy(other)
                ));
            }
        }
        Ok(())
    }
}

impl Block<'_> {
    fn link(&self, place: usize) -> u64 {
        self.links.get(place).copied().map_or(0, u64::from_le_bytes)
    }

    fn data<const N: usize>(&self, place: usize) -> Result<[u8; N], String> {
        field(self.data, place)
    }
}

/// Returns the bytes at a place.
fn field<const N: usize>(bytes: &[u8], place: usize) -> Result<[u8; N], String> {
    bytes
        .get(place..)
        .and_then(|rest| rest.first_chunk())
        .copied()
        .ok_or_else(|| CUT_OFF.to_owned())
}

/// Appends data that stand byte by byte of all rows of so many columns. What fills no row stands behind.
fn transpose(data: &[u8], columns: usize, all: &mut Vec<u8>) {
    let rows = data.len().checked_div(columns).unwrap_or_default();
    let (own, rest) = data.split_at(rows * columns);
    all.extend((0..rows).flat_map(|row| own.iter().skip(row).step_by(rows)));
    all.extend(rest);
}

/// A channel group, while its records are read.
struct Part {
    group: Group,
    /// How the channels are decoded. `None` of one that is not wanted.
    decoders: Vec<Option<Decoder>>,
    id: u64,
    flags: u16,
    /// Bytes of a record, and those of it that say which values are not valid.
    length: usize,
    validity: usize,
    /// Number of records.
    count: u64,
}

impl Part {
    fn new(file: &File, block: &Block, number: usize, layout: &Layout) -> Result<Self, String> {
        let text = file.text(block.link(2))?;
        let name = if text.is_empty() { format!("{number}") } else { text };
        let [length, validity] = [24, 28].map(|place| block.data(place).map(u32::from_le_bytes));
        let mut part = Self {
            group: Group { name, ..Group::default() },
            decoders: Vec::new(),
            id: u64::from_le_bytes(block.data(0)?),
            count: u64::from_le_bytes(block.data(8)?),
            flags: u16::from_le_bytes(block.data(16)?),
            length: length? as usize,
            validity: validity? as usize,
        };
        for channel in file.list(block.link(1), b"##CN")? {
            let [kind, sync, ..]: [u8; 4] = channel.data(0)?;
            let is_time = [MASTER, COUNTED].contains(&kind) && sync == TIME;
            let text = file.text(channel.link(2))?;
            let name = if is_time { "time".to_owned() } else { text };
            let conversion = match channel.link(4) {
                0 => None,
                place => Some(file.block(place, b"##CC")?),
            };
            let mut unit = file.text(channel.link(6))?;
            if let (true, Some(conversion)) = (unit.is_empty(), &conversion) {
                unit = file.text(conversion.link(1))?;
            }
            let is_number = [FIXED, MASTER, COUNTED].contains(&kind);
            let is_wanted = is_number && layout.wants(&part.group.name, &name);
            let decoder =
                is_wanted.then(|| Decoder::new(&channel, conversion.as_ref(), &name, part.length));
            part.decoders.push(decoder.transpose()?);
            part.group.channels.push(Channel { name, unit, ..Channel::default() });
        }
        if part.is_wanted() && part.flags & ELSEWHERE != 0 {
            return Err("stores its columns apart: save it with asammdf as version 4.10".into());
        }
        Ok(part)
    }

    /// Returns how many bytes its records have. `None` of texts, which have any length.
    fn bytes(&self, id_bytes: usize) -> Option<u64> {
        let own = (self.length as u64).saturating_add((self.validity + id_bytes) as u64);
        (self.flags & OF_TEXTS == 0).then(|| self.count.saturating_mul(own).min(LARGEST))
    }

    /// Returns whether more than the time is wanted.
    fn is_wanted(&self) -> bool {
        let own = self.decoders.iter().zip(&self.group.channels);
        own.filter(|(decoder, _)| decoder.is_some()).any(|(_, channel)| channel.name != "time")
    }

    fn take(&mut self, record: &[u8]) {
        let row = self.group.channels.iter().map(|own| own.values.len()).max().unwrap_or_default();
        let validity = record.get(self.length..).unwrap_or_default();
        for (channel, decoder) in self.group.channels.iter_mut().zip(&self.decoders) {
            if let Some(decoder) = decoder {
                channel.values.push(decoder.value(record, validity, row));
            }
        }
    }
}

/// Takes the records of the channel groups of a data group. Several groups have records that begin with their number.
fn fill(parts: &mut [Part], records: &[u8], id_bytes: usize) -> Result<(), String> {
    if ![0, 1, 2, 4, 8].contains(&id_bytes) || (id_bytes == 0 && parts.len() > 1) {
        return Err("is damaged: its records have no number of their group: record it again".into());
    }
    let places: HashMap<u64, usize> =
        parts.iter().enumerate().map(|(place, own)| (own.id, place)).collect();
    let mut rest = records;
    while !rest.is_empty() {
        let (id, after) = rest.split_at_checked(id_bytes).ok_or(CUT_OFF)?;
        let mut number = [0; 8];
        number[..id_bytes].copy_from_slice(id);
        let place = if id_bytes == 0 { Some(&0) } else { places.get(&u64::from_le_bytes(number)) };
        let part = place.and_then(|place| parts.get_mut(*place)).ok_or(CUT_OFF)?;
        let is_text = part.flags & OF_TEXTS != 0;
        let length = match (is_text, part.length.checked_add(part.validity)) {
            (true, _) => 4 + u32::from_le_bytes(field(after, 0)?) as usize,
            (false, Some(length)) if length + id_bytes > 0 => length,
            // A group whose values are counted has no bytes: there is nothing to read.
            _ => return Ok(()),
        };
        // The last record of a file that is cut off may be short.
        let Some((record, next)) = after.split_at_checked(length) else { break };
        if !is_text {
            part.take(record);
        }
        rest = next;
    }
    for part in parts {
        let found =
            part.group.channels.iter().map(|own| own.values.len()).max().unwrap_or_default() as u64;
        if part.is_wanted() && found < part.count {
            return Err(format!(
                "is cut off or damaged: its group {:?} has {found} of {} rows: record it again",
                part.group.name, part.count
            ));
        }
    }
    Ok(())
}

/// How a channel lies in its record, and what its numbers mean.
struct Decoder {
    /// True if the values are the numbers of the rows.
    is_counted: bool,
    place: usize,
    shift: u32,
    bits: u32,
    is_big_endian: bool,
    number: Number,
    /// Bit that says that a value is not valid.
    invalid: Option<usize>,
    is_invalid: bool,
    law: Law,
}

enum Number {
    Unsigned,
    Signed,
    Float,
}

/// Conversion of numbers into values.
enum Law {
    Same,
    Linear([f64; 2]),
    Rational([f64; 6]),
    /// Pairs, between which lines run.
    Table(Vec<[f64; 2]>),
}

impl Decoder {
    fn new(
        channel: &Block,
        conversion: Option<&Block>,
        name: &str,
        length: usize,
    ) -> Result<Self, String> {
        let [kind, _, number, shift]: [u8; 4] = channel.data(0)?;
        let [place, bits, flags, invalid] =
            [4, 8, 12, 16].map(|place| channel.data(place).map(u32::from_le_bytes));
        let (place, bits, flags, invalid) = (place? as usize, bits?, flags?, invalid? as usize);
        let own = Self {
            is_counted: kind == COUNTED,
            place,
            shift: shift.into(),
            bits,
            is_big_endian: number % 2 == 1,
            number: match number {
                0 | 1 => Number::Unsigned,
                2 | 3 => Number::Signed,
                4 | 5 => Number::Float,
                _ => {
                    return Err(format!(
                        "channel {name:?} holds no numbers: name another in [signals]"
                    ));
                }
            },
            invalid: (flags & 2 != 0).then_some(invalid),
            is_invalid: flags & 1 != 0,
            law: Law::new(conversion, name)?,
        };
        let is_known = match own.number {
            Number::Float => own.shift == 0 && (bits == 32 || bits == 64),
            _ => (1..=64).contains(&bits) && own.shift < 8 && own.shift + bits <= 64,
        };
        let fits = || place.checked_add(own.bytes()).is_some_and(|end| end <= length);
        if own.is_counted || (is_known && fits()) {
            Ok(own)
        } else {
            Err(format!(
                "channel {name:?} has {bits} bits at byte {place} of {length}, which cannot be: record it again"
            ))
        }
    }

    fn bytes(&self) -> usize {
        ((self.shift + self.bits).div_ceil(8)) as usize
    }

    /// Returns the value in a record, NaN if it is not valid.
    fn value(&self, record: &[u8], validity: &[u8], row: usize) -> f64 {
        let is_set =
            |bit: usize| validity.get(bit / 8).is_some_and(|own| own >> (bit % 8) & 1 == 1);
        if self.is_invalid || self.invalid.is_some_and(is_set) {
            return f64::NAN;
        }
        if self.is_counted {
            return self.law.value(row as f64);
        }
        let mut bytes = [0; 8];
        let count = self.bytes();
        let Some(own) = record.get(self.place..self.place + count) else { return f64::NAN };
        bytes[..count].copy_from_slice(own);
        if self.is_big_endian {
            bytes[..count].reverse();
        }
        let raw = u64::from_le_bytes(bytes);
        let unused = 64 - self.bits;
        let raw = raw >> self.shift << unused;
        self.law.value(match self.number {
            Number::Unsigned => (raw >> unused) as f64,
            Number::Signed => (raw as i64 >> unused) as f64,
            Number::Float if self.bits == 32 => f32::from_bits((raw >> unused) as u32).into(),
            Number::Float => f64::from_bits(raw),
        })
    }
}

impl Law {
    fn new(block: Option<&Block>, name: &str) -> Result<Self, String> {
        let Some(block) = block else { return Ok(Self::Same) };
        let [kind] = block.data::<1>(0)?;
        let count = usize::from(u16::from_le_bytes(block.data(6)?));
        let numbers: Vec<f64> = (0..count)
            .map(|own| block.data(24 + 8 * own).map(f64::from_le_bytes))
            .collect::<Result<_, _>>()?;
        let damaged = || {
            format!(
                "channel {name:?} has a conversion of kind {kind} with {count} numbers, which cannot be (those of a table must rise): record it again"
            )
        };
        Ok(match kind {
            0 => Self::Same,
            1 => Self::Linear(*numbers.first_chunk().ok_or_else(damaged)?),
            2 => Self::Rational(*numbers.first_chunk().ok_or_else(damaged)?),
            4 if count >= 4 && count % 2 == 0 => {
                let pairs: Vec<[f64; 2]> = numbers.as_chunks().0.to_vec();
                let rises = pairs.is_sorted_by(|[one, _], [next, _]| one < next);
                let is_finite = pairs.iter().all(|[own, _]| own.is_finite());
                if !is_finite || !rises {
                    return Err(damaged());
                }
                Self::Table(pairs)
            }
            4 => return Err(damaged()),
            _ => {
                return Err(format!(
                    "channel {name:?} has a conversion of kind {kind}, which is no scale of a sensor: save it with asammdf (`MDF('IN.mf4').export('csv', 'OUT.csv', single_time_base=True, add_units=True)`)"
                ));
            }
        })
    }

    fn value(&self, raw: f64) -> f64 {
        match self {
            Self::Same => raw,
            Self::Linear([offset, slope]) => offset + slope * raw,
            Self::Rational([a, b, c, d, e, f]) => {
                (a * raw * raw + b * raw + c) / (d * raw * raw + e * raw + f)
            }
            Self::Table(pairs) => {
                let above = pairs.partition_point(|[own, _]| *own < raw).clamp(1, pairs.len() - 1);
                let [[x, y], [next, next_y]] = [pairs[above - 1], pairs[above]];
                y + (raw.clamp(pairs[0][0], pairs[pairs.len() - 1][0]) - x) * (next_y - y)
                    / (next - x)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    /// A block of these links and data.
    fn block(id: &[u8; 4], links: &[u64], data: &[u8]) -> Vec<u8> {
        let length = (24 + 8 * links.len() + data.len()) as u64;
        let links: Vec<u8> = std::iter::once(&(links.len() as u64))
            .chain(links)
            .flat_map(|own| own.to_le_bytes())
            .collect();
        [id, &[0; 4], &length.to_le_bytes()[..], &links, data].concat()
    }

    fn records(bytes: &[u8], most: u64) -> Result<Vec<u8>, String> {
        File { bytes, seen: RefCell::default() }.records(8, most)
    }

    /// Behind bytes that are no block.
    fn file(blocks: &[Vec<u8>]) -> Vec<u8> {
        [&[0; 8][..], &blocks.concat()].concat()
    }

    #[test]
    fn blocks_are_read_once() {
        let data = || block(b"##DT", &[], &[7; 8]);
        let list = |links: &[u64]| file(&[block(b"##DL", links, &[]), data(), data()]);
        // The list has 48 bytes from byte 8 on, each of the data 32.
        assert_eq!(records(&list(&[0, 56, 88]), 0).unwrap(), [7; 16]);
        for links in [[0, 56, 56], [8, 56, 88]] {
            let error = records(&list(&links), 0).unwrap_err();
            assert!(error.contains("two of its blocks point to the same one"), "{error}");
        }
    }

    #[test]
    fn records_are_unpacked_as_far_as_they_are_stated() {
        let of = |length: u64| {
            let mut packed =
                flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
            packed.write_all(&[7; 1000]).unwrap();
            let data = [&[0; 8][..], &length.to_le_bytes(), &[0; 8], &packed.finish().unwrap()];
            file(&[block(b"##DZ", &[], &data.concat())])
        };
        assert_eq!(records(&of(1000), 1000).unwrap(), [7; 1000]);
        let error = records(&of(1000), 999).unwrap_err();
        assert!(error.contains("state 999 bytes of records, and it has 1000"), "{error}");
        for length in [999, 1001] {
            let error = records(&of(length), LARGEST).unwrap_err();
            assert!(error.contains("has another length than"), "{error}");
        }
    }

    #[test]
    fn numbers_that_cannot_be_are_refused() {
        let law = |keys: [f64; 3]| {
            let pairs = keys.into_iter().flat_map(|key| [key, 2.0 * key]);
            let numbers: Vec<u8> = pairs.flat_map(f64::to_le_bytes).collect();
            let data = [&[4, 0, 0, 0, 0, 0, 6, 0][..], &[0; 16], &numbers].concat();
            Law::new(Some(&Block { id: *b"##CC", links: &[], data: &data }), "Fx")
                .map(|own| own.value(1.5))
        };
        assert_eq!(law([0.0, 1.0, 2.0]), Ok(3.0));
        for keys in [[2.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 1.0, f64::NAN]] {
            assert!(law(keys).unwrap_err().contains("those of a table must rise"));
        }
        let data = [&[0, 0, 0, 7][..], &[0; 4], &u32::MAX.to_le_bytes(), &[0; 8]].concat();
        let channel = Block { id: *b"##CN", links: &[], data: &data };
        let error = Decoder::new(&channel, None, "Fx", 8).err().unwrap();
        assert!(error.starts_with("channel \"Fx\" has 4294967295 bits at byte 0 of 8"), "{error}");
    }
}
