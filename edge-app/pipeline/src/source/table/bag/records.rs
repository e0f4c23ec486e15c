//! Records of an MCAP file (mcap.dev/spec): those at its top and those in its chunks, in the order of the file. A chunk is held in memory, and
//! nothing else.
//!
//! A file that is cut off is read as far as it goes, its last chunk too. The crate `mcap` is not used: of a chunk that contradicts itself it
//! subtracts lengths with overflow, and it gives nothing of a chunk that is cut off.

use std::fmt::Display;
use std::io::{self, BufReader, Read};

use lz4_flex::frame::FrameDecoder;
use ruzstd::decoding::StreamingDecoder;

use super::super::bytes::{CutOff, Order, Reader};

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
                return Err(damaged("a record is longer than its chunk"));
            }
            let head = self.read(9)?;
            let (kind, length) = (head[0], Order::Little.bits(&head[1..]));
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
        let too_long = || io::Error::other("has a chunk of more than 256 MiB");
        if length > LONGEST {
            return Err(too_long());
        }
        let mut bytes = Vec::new();
        (&mut self.bytes).take(length).read_to_end(&mut bytes)?;
        let is_cut_off = (bytes.len() as u64) < length;
        let mut reader = Reader::new(&bytes, Order::Little);
        let (length, crc, compression) = chunk_header(&mut reader).map_err(|_| cut_off())?;
        if length > LONGEST {
            return Err(too_long());
        }
        let rest = reader.rest();
        (self.chunk, self.place) = (Vec::new(), 0);
        // What is more shows by one byte.
        let most = length + 1;
        let unpacked = match &*compression {
            "" => rest.take(most).read_to_end(&mut self.chunk),
            "zstd" => StreamingDecoder::new(rest)
                .map_err(io::Error::other)
                .and_then(|own| own.take(most).read_to_end(&mut self.chunk)),
            "lz4" => FrameDecoder::new(rest).take(most).read_to_end(&mut self.chunk),
            other => {
                let message = format!(
                    "has chunks that are compressed as {other:?}: record with zstd, lz4 or none"
                );
                return Err(io::Error::new(io::ErrorKind::Unsupported, message));
            }
        };
        self.broken = match unpacked {
            _ if is_cut_off => Some(cut_off()),
            Err(error) => Some(damaged(format_args!("a chunk cannot be unpacked ({error})"))),
            Ok(own) if own as u64 > length => {
                self.chunk.clear();
                Some(damaged(format_args!("a chunk states {length} bytes, and has more")))
            }
            Ok(_) if crc != 0 && crc32fast::hash(&self.chunk) != crc => {
                self.chunk.clear();
                Some(damaged("a chunk has another checksum"))
            }
            Ok(own) if own as u64 != length => {
                Some(damaged(format_args!("a chunk states {length} bytes, and has {own}")))
            }
            Ok(_) => None,
        };
        Ok(())
    }

    /// Reads so many bytes.
    fn read(&mut self, length: u64) -> io::Result<Vec<u8>> {
        if length > LONGEST {
            return Err(damaged("a record has more than 256 MiB"));
        }
        let mut bytes = Vec::new();
        (&mut self.bytes).take(length).read_to_end(&mut bytes)?;
        if (bytes.len() as u64) < length { Err(cut_off()) } else { Ok(bytes) }
    }
}

fn cut_off() -> io::Error {
    io::Error::other("is cut off, and what comes before is used")
}

fn damaged(what: impl Display) -> io::Error {
    io::Error::other(format!("is damaged: {what}"))
}

/// Returns the next record in a chunk, its kind and its body, or `None` if no whole one follows.
fn within<'a>(chunk: &'a [u8], place: &mut usize) -> Option<(u8, &'a [u8])> {
    let (kind, rest) = chunk.get(*place..)?.split_first()?;
    let mut reader = Reader::new(rest, Order::Little);
    let length = usize::try_from(reader.u64().ok()?).ok()?;
    let body = reader.take(length).ok()?;
    *place += 9 + length;
    Some((*kind, body))
}

/// Reads the head of a chunk: the length of its content, bytes, its checksum and its compression.
fn chunk_header(reader: &mut Reader) -> Result<(u64, u32, String), CutOff> {
    let (_first_ns, _last_ns) = (reader.u64()?, reader.u64()?);
    let (length, crc, compression) = (reader.u64()?, reader.u32()?, text(reader)?);
    let _packed = reader.u64()?;
    Ok((length, crc, compression))
}

/// Returns a record, or `None` if it is of another kind.
fn parse(kind: u8, body: &[u8]) -> io::Result<Option<Record>> {
    let mut reader = Reader::new(body, Order::Little);
    let own = match kind {
        SCHEMA => schema(&mut reader),
        CHANNEL => channel(&mut reader),
        MESSAGE => message(&mut reader),
        _ => return Ok(None),
    };
    own.map(Some).map_err(|CutOff| damaged("a record is shorter than it must be"))
}

fn schema(reader: &mut Reader) -> Result<Record, CutOff> {
    Ok(Record::Schema { id: reader.u16()?, name: text(reader)? })
}

fn channel(reader: &mut Reader) -> Result<Record, CutOff> {
    let (id, schema) = (reader.u16()?, reader.u16()?);
    Ok(Record::Channel { id, schema, topic: text(reader)?, encoding: text(reader)? })
}

fn message(reader: &mut Reader) -> Result<Record, CutOff> {
    let (channel, _sequence) = (reader.u16()?, reader.u32()?);
    let (log_ns, _published_ns) = (reader.u64()?, reader.u64()?);
    Ok(Record::Message { channel, log_ns, data: reader.rest().to_vec() })
}

fn text(reader: &mut Reader) -> Result<String, CutOff> {
    reader.text().map(|own| String::from_utf8_lossy(own).into_owned())
}
