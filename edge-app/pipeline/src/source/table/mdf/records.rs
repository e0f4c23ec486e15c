//! Records of channel groups.

use std::collections::HashMap;

use super::super::bytes::{CutOff, Order, field};
use super::super::channels::{Channel, Group, LARGEST};
use super::super::layout::Layout;
use super::blocks::{Block, File};
use super::decoder::{COUNTED, Decoder};

/// Kinds of channels that are numbers: of fixed length, time, and time that is counted.
const NUMBERS: [u8; 3] = [0, MASTER, COUNTED];
const MASTER: u8 = 2;
/// Kind of synchronisation of a time.
const TIME: u8 = 1;
/// A channel group of texts of any length, and one whose time stands elsewhere.
const OF_TEXTS: u16 = 1;
const ELSEWHERE: u16 = 8;

/// A channel group, while its records are read.
pub(super) struct Part {
    pub(super) group: Group,
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
    pub(super) fn new(
        file: &File,
        block: &Block,
        number: usize,
        layout: &Layout,
    ) -> Result<Self, String> {
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
            let is_wanted = NUMBERS.contains(&kind) && layout.wants(&part.group.name, &name);
            let (mut unit, mut decoder) = (String::new(), None);
            if is_wanted {
                decoder = Some(Decoder::new(&channel, conversion.as_ref(), &name, part.length)?);
                unit = file.text(channel.link(6))?;
                if let (true, Some(conversion)) = (unit.is_empty(), &conversion) {
                    unit = file.text(conversion.link(1))?;
                }
            }
            part.decoders.push(decoder);
            part.group.channels.push(Channel { name, unit, ..Channel::default() });
        }
        if part.is_wanted() && part.flags & ELSEWHERE != 0 {
            return Err("stores its columns apart: save it with asammdf as version 4.10".into());
        }
        Ok(part)
    }

    /// Returns how many bytes its records have. `None` of texts, which have any length.
    pub(super) fn bytes(&self, id_bytes: usize) -> Option<u64> {
        let own = (self.length as u64).saturating_add((self.validity + id_bytes) as u64);
        (self.flags & OF_TEXTS == 0).then(|| self.count.saturating_mul(own).min(LARGEST))
    }

    /// Returns whether more than the time is wanted.
    pub(super) fn is_wanted(&self) -> bool {
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
pub(super) fn fill(parts: &mut [Part], records: &[u8], id_bytes: usize) -> Result<(), String> {
    if ![0, 1, 2, 4, 8].contains(&id_bytes) || (id_bytes == 0 && parts.len() > 1) {
        return Err("is damaged: its records have no number of their group: record it again".into());
    }
    let places: HashMap<u64, usize> =
        parts.iter().enumerate().map(|(place, own)| (own.id, place)).collect();
    let mut rest = records;
    while !rest.is_empty() {
        let (id, after) = rest.split_at_checked(id_bytes).ok_or(CutOff)?;
        let place = if id_bytes == 0 { Some(&0) } else { places.get(&Order::Little.bits(id)) };
        let part = place.and_then(|place| parts.get_mut(*place)).ok_or(CutOff)?;
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
