//! Records of an MCAP file (mcap.dev/spec): those at its top and those in its chunks, in the order of the file. A chunk is held in memory, and
//! nothing else.
//!
//! What can be read of a file that is cut off is read, also of its last chunk. The crate `mcap` is not used: of a chunk that contradicts itself it
//! subtracts lengths with overflow, and it gives nothing of a chunk that is cut off.

use std::io::{self, BufReader, Read};

use lz4_flex::frame::FrameDecoder;
use ruzstd::decoding::StreamingDecoder;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// Kinds of records.
const FOOTER: u8 = 2;
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const DATA_END: u8 = 15;
/// Longest record and longest content of a chunk, bytes. Writers make chunks of 1 to 4 MB.
const LONGEST: u64 = 256 << 20;

/// A record that a recording needs.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Record {
    /// Type of messages.
    Schema { id: u16, name: String },
    /// A topic.
    Channel { id: u16, schema: u16, topic: String, encoding: String },
    /// A message, with the time at which it was recorded, ns since the Unix epoch.
    Message { channel: u16, log_ns: u64, data: Vec<u8> },
}

/// Reads the records of a file.
pub(super) struct Records<R> {
    bytes: BufReader<R>,
    /// Content of the present chunk, and the place of the next record in it.
    chunk: Vec<u8>,
    place: usize,
    /// The error behind this content.
    broken: Option<io::Error>,
    is_begun: bool,
}

impl<R: Read> Records<R> {
    pub(super) fn new(bytes: R) -> Self {
        let bytes = BufReader::new(bytes);
        Self { bytes, chunk: Vec::new(), place: 0, broken: None, is_begun: false }
    }

    /// Returns the next record. Returns `None` at the end of the data.
    ///
    /// # Errors
    /// The file is damaged or cut off. All records before are good.
    pub(super) fn next(&mut self) -> io::Result<Option<Record>> {
        if !self.is_begun {
            self.is_begun = true;
            if self.read(MAGIC.len() as u64)? != MAGIC {
                return Err(io::Error::other("does not begin as an MCAP file"));
            }
        }
        loop {
            while let Some((kind, body)) = within(&self.chunk, &mut self.place) {
                if let Some(record) = parse(kind, body)? {
                    return Ok(Some(record));
                }
            }
            if let Some(error) = self.broken.take() {
                return Err(error);
            }
            if self.place < self.chunk.len() {
                self.place = self.chunk.len();
                return Err(io::Error::other("is damaged: a record is longer than its chunk"));
            }
            let kind = self.read(1)?[0];
            let length = number(&mut &self.read(8)?[..]).map_or(0, u64::from_le_bytes);
            match kind {
                FOOTER | DATA_END => return Ok(None),
                SCHEMA | CHANNEL | MESSAGE => {
                    let body = self.read(length)?;
                    if let Some(record) = parse(kind, &body)? {
                        return Ok(Some(record));
                    }
                }
                CHUNK => self.unpack(length)?,
                _ => {
                    if io::copy(&mut (&mut self.bytes).take(length), &mut io::sink())? < length {
                        return Err(cut_off());
                    }
                }
            }
        }
    }

    /// Takes the chunk of this length.
    fn unpack(&mut self, length: u64) -> io::Result<()> {
        let mut bytes = Vec::new();
        (&mut self.bytes).take(length.min(LONGEST)).read_to_end(&mut bytes)?;
        if length > LONGEST {
            return Err(io::Error::other("has a chunk of more than 256 MiB"));
        }
        let is_cut_off = (bytes.len() as u64) < length;
        let mut rest = &bytes[..];
        let (Some((length, crc, compression)), Some(_)) =
            (chunk_header(&mut rest), number::<8>(&mut rest))
        else {
            return Err(cut_off());
        };
        (self.chunk, self.place) = (Vec::new(), 0);
        let unpacked = match &*compression {
            "" => rest.take(LONGEST).read_to_end(&mut self.chunk),
            "zstd" => StreamingDecoder::new(rest)
                .map_err(io::Error::other)
                .and_then(|own| own.take(LONGEST).read_to_end(&mut self.chunk)),
            "lz4" => FrameDecoder::new(rest).take(LONGEST).read_to_end(&mut self.chunk),
            other => {
                let message = format!(
                    "has chunks that are compressed as {other:?}: record with zstd, lz4 or none"
                );
                return Err(io::Error::other(message));
            }
        };
        self.broken = match unpacked {
            _ if is_cut_off => Some(cut_off()),
            Err(error) => {
                Some(io::Error::other(format!("is damaged: a chunk cannot be unpacked ({error})")))
            }
            Ok(_) if crc != 0 && crc32fast::hash(&self.chunk) != crc => {
                self.chunk.clear();
                Some(io::Error::other("is damaged: a chunk has another checksum"))
            }
            Ok(own) if own as u64 != length => Some(io::Error::other(format!(
                "is damaged: a chunk states {length} bytes, and has {own}"
            ))),
            Ok(_) => None,
        };
        Ok(())
    }

    /// Reads so many bytes.
    fn read(&mut self, length: u64) -> io::Result<Vec<u8>> {
        if length > LONGEST {
            return Err(io::Error::other("is damaged: a record has more than 256 MiB"));
        }
        let mut bytes = Vec::new();
        (&mut self.bytes).take(length).read_to_end(&mut bytes)?;
        if (bytes.len() as u64) < length { Err(cut_off()) } else { Ok(bytes) }
    }
}

fn cut_off() -> io::Error {
    io::Error::other("is cut off: what comes before is used")
}

/// Returns the next record in a chunk, its kind and its body, or `None` if no whole one follows.
fn within<'a>(chunk: &'a [u8], place: &mut usize) -> Option<(u8, &'a [u8])> {
    let (kind, mut rest) = chunk.get(*place..)?.split_first()?;
    let length = usize::try_from(u64::from_le_bytes(number(&mut rest)?)).ok()?;
    let body = rest.get(..length)?;
    *place += 9 + length;
    Some((*kind, body))
}

/// Returns the length of the content of a chunk, its checksum and its compression.
fn chunk_header(rest: &mut &[u8]) -> Option<(u64, u32, String)> {
    // The times of the first and the last message.
    number::<16>(rest)?;
    let length = number(rest).map(u64::from_le_bytes)?;
    let crc = number(rest).map(u32::from_le_bytes)?;
    Some((length, crc, text(rest)?))
}

/// Returns a record, or `None` if it is of another kind.
fn parse(kind: u8, body: &[u8]) -> io::Result<Option<Record>> {
    let mut rest = body;
    let own = match kind {
        SCHEMA => schema(&mut rest),
        CHANNEL => channel(&mut rest),
        MESSAGE => message(&mut rest),
        _ => return Ok(None),
    };
    own.map(Some).ok_or_else(|| io::Error::other("is damaged: a record is shorter than it must be"))
}

fn schema(rest: &mut &[u8]) -> Option<Record> {
    Some(Record::Schema { id: u16::from_le_bytes(number(rest)?), name: text(rest)? })
}

fn channel(rest: &mut &[u8]) -> Option<Record> {
    let (id, schema) = (number(rest)?, number(rest)?);
    let (id, schema) = (u16::from_le_bytes(id), u16::from_le_bytes(schema));
    Some(Record::Channel { id, schema, topic: text(rest)?, encoding: text(rest)? })
}

fn message(rest: &mut &[u8]) -> Option<Record> {
    let channel = u16::from_le_bytes(number(rest)?);
    let _sequence = number::<4>(rest)?;
    let log_ns = u64::from_le_bytes(number(rest)?);
    let _published = number::<8>(rest)?;
    Some(Record::Message { channel, log_ns, data: rest.to_vec() })
}

fn number<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (own, after) = rest.split_first_chunk::<N>()?;
    *rest = after;
    Some(*own)
}

fn text(rest: &mut &[u8]) -> Option<String> {
    let length = u32::from_le_bytes(number(rest)?) as usize;
    let (own, after) = rest.split_at_checked(length)?;
    *rest = after;
    Some(String::from_utf8_lossy(own).into_owned())
}
