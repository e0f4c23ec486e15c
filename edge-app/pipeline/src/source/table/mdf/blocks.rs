//! Blocks of an MF4 file: links to others, and data.

use std::cell::{Cell, RefCell};
use std::collections::HashSet;
use std::io::Read;

use flate2::read::ZlibDecoder;

use super::super::bytes::{CutOff, Order, Reader, field};
use super::super::channels::LARGEST;

/// Place of the first block behind the identification.
const HEADER: u64 = 64;

/// Bytes of a file.
pub(super) struct File<'a> {
    bytes: &'a [u8],
    /// Places of the blocks of lists and of records so far: each belongs to one list.
    seen: RefCell<HashSet<u64>>,
    /// Bytes of texts that may still be copied. Channels share blocks of names and units, and yet all of them, written out, are shorter than the
    /// file: the block of a channel has 160 bytes.
    texts: Cell<usize>,
}

/// A block: its links, and the data behind.
pub(super) struct Block<'a> {
    pub(super) id: [u8; 4],
    pub(super) links: &'a [[u8; 8]],
    pub(super) data: &'a [u8],
}

impl<'a> File<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, seen: RefCell::default(), texts: Cell::new(bytes.len()) }
    }

    /// Returns the block from which links lead to all others.
    pub(super) fn header(&self) -> Result<Block<'a>, String> {
        self.block(HEADER, b"##HD")
    }

    /// Returns the block at a place, which must be of one kind.
    pub(super) fn block(&self, place: u64, kind: &[u8; 4]) -> Result<Block<'a>, String> {
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

    fn any(&self, place: u64) -> Result<Block<'a>, CutOff> {
        let own = usize::try_from(place).ok().and_then(|place| self.bytes.get(place..));
        let mut reader = Reader::new(own.ok_or(CutOff)?, Order::Little);
        let id = field(reader.take(8)?, 0)?;
        let (length, links) = (reader.u64()?, reader.u64()?);
        let bytes = |own: u64| usize::try_from(own).map_err(|_| CutOff);
        let body = reader.take(bytes(length.checked_sub(24).ok_or(CutOff)?)?)?;
        let links = bytes(links.checked_mul(8).ok_or(CutOff)?)?;
        let (links, data) = body.split_at_checked(links).ok_or(CutOff)?;
        Ok(Block { id, links: links.as_chunks().0, data })
    }

    /// Returns the blocks of one kind of which each points to the next.
    pub(super) fn list(&self, first: u64, kind: &[u8; 4]) -> Result<Vec<Block<'a>>, String> {
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
    pub(super) fn text(&self, place: u64) -> Result<String, String> {
        if place == 0 {
            return Ok(String::new());
        }
        let block = self.any(place)?;
        let end = block.data.iter().position(|byte| *byte == 0).unwrap_or(block.data.len());
        let text = String::from_utf8_lossy(&block.data[..end]);
        let within = text.split_once("<TX>").and_then(|(_, rest)| rest.split_once("</TX>"));
        let own = match within {
            Some((own, _)) if &block.id == b"##MD" => own,
            _ => &text,
        };
        let left = self.texts.get().checked_sub(own.len()).ok_or(
            "is damaged: the names and units of its channels are longer than the file: record it again",
        )?;
        self.texts.set(left);
        Ok(own.to_owned())
    }

    /// Returns the records of a data group, all together; of packed ones at most so many bytes.
    pub(super) fn records(&self, place: u64, most: u64) -> Result<Vec<u8>, String> {
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
                let packed = block.data.get(24..).ok_or(CutOff)?;
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
    pub(super) fn link(&self, place: usize) -> u64 {
        self.links.get(place).copied().map_or(0, u64::from_le_bytes)
    }

    pub(super) fn data<const N: usize>(&self, place: usize) -> Result<[u8; N], CutOff> {
        field(self.data, place)
    }
}

/// Appends data that stand byte by byte of all rows of so many columns. What fills no row stands behind.
fn transpose(data: &[u8], columns: usize, all: &mut Vec<u8>) {
    let rows = data.len().checked_div(columns).unwrap_or_default();
    let (own, rest) = data.split_at(rows * columns);
    all.extend((0..rows).flat_map(|row| own.iter().skip(row).step_by(rows)));
    all.extend(rest);
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
        File::new(bytes).records(8, most)
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
    fn names_and_units_are_no_longer_than_the_file() {
        let text = file(&[block(b"##TX", &[], b"m/s\0")]);
        let md = file(&[block(b"##MD", &[], b"<CNunit><TX>kN</TX></CNunit>\0")]);
        assert_eq!(File::new(&text).text(8), Ok("m/s".to_owned()));
        assert_eq!(File::new(&md).text(8), Ok("kN".to_owned()));
        let file = File::new(&text);
        let shared = (0..text.len()).map(|_| file.text(8)).collect::<Result<Vec<_>, _>>();
        assert!(shared.unwrap_err().contains("are longer than the file"));
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
}
