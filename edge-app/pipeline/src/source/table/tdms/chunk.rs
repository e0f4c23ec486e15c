//! Places of values in a segment. Its chunks are alike; each consists of blocks, one behind the other, and a block of rows of one width.
//!
//! Where each channel stands in one piece, it is a block whose rows are its values. Where the values of an instant stand together, all channels are one
//! block. Of DAQmx each buffer of a device is one.

use super::super::bytes::{CutOff, Order, Reader};
use super::daqmx::Raw;
use super::kind::Kind;

/// Codes of the description of DAQmx values: scaled ones, and digital lines.
const OF_DAQMX: u32 = 0x1269;
const OF_LINES: u32 = 0x126A;

/// Where the values of an object stand in a chunk.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Index {
    /// So many values of a type. Of texts the bytes of all are given.
    Plain {
        kind: Kind,
        count: usize,
        bytes: usize,
    },
    Raw(Raw),
}

/// Rows of one width.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Block {
    /// Bytes of a row.
    width: usize,
    rows: usize,
    columns: Vec<Column>,
}

/// The values of an object in the rows of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Column {
    object: usize,
    kind: Kind,
    /// First byte in the row, and the one behind the last.
    begin: usize,
    end: usize,
}

impl Index {
    /// Reads the description behind its code.
    ///
    /// # Errors
    /// It is cut off, or of a type that is not known.
    pub(super) fn read(code: u32, reader: &mut Reader) -> Result<Self, String> {
        if [OF_DAQMX, OF_LINES].contains(&code) {
            return Raw::read(reader, code == OF_LINES).map(Self::Raw);
        }
        let (code, _dimension, count) = (reader.u32()?, reader.u32()?, reader.u64()?);
        let kind = Kind::of(code).ok_or_else(|| {
            format!("has values of type {code:#x}, which is not known: save it with numbers alone")
        })?;
        let count = usize::try_from(count).unwrap_or(usize::MAX);
        let bytes = match kind.size() {
            Some(size) => count.saturating_mul(size),
            None => usize::try_from(reader.u64()?).unwrap_or(usize::MAX),
        };
        Ok(Self::Plain { kind, count, bytes })
    }
}

impl Column {
    fn new(object: usize, kind: Kind, begin: usize) -> Self {
        let end = begin.saturating_add(kind.size().unwrap_or_default());
        Self { object, kind, begin, end }
    }
}

impl Block {
    /// Returns the blocks of objects in one piece each.
    ///
    /// # Errors
    /// One is described as of DAQmx.
    pub(super) fn pieces(objects: &[(usize, &Index)]) -> Result<Vec<Self>, CutOff> {
        let block = |&(object, index): &(usize, &Index)| match *index {
            Index::Plain { kind: Kind::Text, bytes, .. } => {
                Ok(Self { width: bytes, rows: 1, columns: Vec::new() })
            }
            Index::Plain { kind, count, .. } => {
                let column = Column::new(object, kind, 0);
                Ok(Self { width: column.end, rows: count, columns: vec![column] })
            }
            Index::Raw(_) => Err(CutOff),
        };
        objects.iter().map(block).collect()
    }

    /// Returns the block of objects whose values of an instant stand together.
    ///
    /// # Errors
    /// One has no numbers.
    pub(super) fn together(objects: &[(usize, &Index)]) -> Result<Vec<Self>, CutOff> {
        let mut block = Self { width: 0, rows: usize::MAX, columns: Vec::new() };
        for &(object, index) in objects {
            let Index::Plain { kind, count, .. } = *index else { return Err(CutOff) };
            kind.size().ok_or(CutOff)?;
            let column = Column::new(object, kind, block.width);
            (block.width, block.rows) = (column.end, block.rows.min(count));
            block.columns.push(column);
        }
        Ok(vec![block])
    }

    /// Returns the blocks of the buffers of DAQmx.
    ///
    /// # Errors
    /// No object has values of DAQmx, or one lies outside of its buffer.
    pub(super) fn buffers(objects: &[(usize, &Index)]) -> Result<Vec<Self>, String> {
        let raw = |&(object, index): &(usize, &Index)| match index {
            Index::Raw(raw) => Some((object, raw.clone())),
            Index::Plain { .. } => None,
        };
        let objects: Vec<(usize, Raw)> = objects.iter().filter_map(raw).collect();
        let (_, first) = objects.first().ok_or(CutOff)?;
        let empty = |width: &usize| Self { width: *width, rows: 0, columns: Vec::new() };
        let mut blocks: Vec<Self> = first.widths.iter().map(empty).collect();
        for (object, raw) in &objects {
            let column = Column::new(*object, raw.kind, raw.place);
            let block = blocks.get_mut(raw.buffer).filter(|block| column.end <= block.width);
            let block = block.ok_or(
                "is damaged: a channel of DAQmx lies outside of its buffer: copy it again",
            )?;
            block.rows = block.rows.max(raw.rows);
            block.columns.push(column);
        }
        Ok(blocks)
    }

    /// Leaves out the values of other objects than these.
    pub(super) fn retain(&mut self, is_wanted: impl Fn(usize) -> bool) {
        self.columns.retain(|column| is_wanted(column.object));
    }

    fn length(&self) -> usize {
        self.width.saturating_mul(self.rows)
    }
}

/// Passes the values in chunks of these blocks to `to`, each with the number of its object. Returns false if bytes are left over.
///
/// Of a last chunk that is short, whole rows are passed if it has one block. Of several blocks none is: those behind would lack instants that those
/// before have.
pub(super) fn values(
    data: &[u8],
    blocks: &[Block],
    order: Order,
    mut to: impl FnMut(usize, f64),
) -> bool {
    let blocks: Vec<&Block> = blocks.iter().filter(|block| block.length() > 0).collect();
    let length = blocks.iter().map(|block| block.length()).fold(0, usize::saturating_add);
    let mut rest = data;
    while length > 0 && !rest.is_empty() {
        let is_whole = rest.len() >= length;
        if !is_whole && blocks.len() > 1 {
            return false;
        }
        let left_over = if is_whole { 0 } else { rest.len() % blocks[0].width };
        for block in &blocks {
            let (rows, behind) = rest.split_at(block.length().min(rest.len()));
            rest = behind;
            for Column { object, kind, begin, end } in &block.columns {
                let own = rows.chunks_exact(block.width).filter_map(|row| row.get(*begin..*end));
                own.for_each(|own| to(*object, kind.value(own, order)));
            }
        }
        if left_over > 0 {
            return false;
        }
    }
    true
}
