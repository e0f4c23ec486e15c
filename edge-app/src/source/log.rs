//! A recording of a bus: the text that `candump -L` writes.

use std::fs::File;
use std::io::{self, BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::time::Duration;

use embedded_can::{ExtendedId, Frame as _, Id};
use socketcan::CanAnyFrame;
use socketcan::dump::{CanDumpRecord, ParseError, Reader};

use super::{Arrival, Flow, Frame, FrameKind, FrameSource, SourceHealth};
use crate::input::BadInput;

/// Frames handed over at once.
const BATCH: usize = 256;

/// Reads a log line by line; lines that are no frames are counted and left out.
pub struct CandumpLog<R> {
    file: PathBuf,
    reader: Reader<BufReader<R>>,
    line: u64,
    garbage: u64,
    first_garbage: Option<(u64, String)>,
}

impl CandumpLog<File> {
    /// Opens a log.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn open(file: &Path) -> Result<Self, BadInput> {
        let log = File::open(file)
            .map_err(|error| BadInput::new(file, format!("cannot be read: {error}")))?;
        Ok(Self::new(file, log))
    }
}

impl<R: Read> CandumpLog<R> {
    /// Reads a log from anywhere; messages call it `file`.
    pub fn new(file: &Path, log: R) -> Self {
        Self {
            file: file.to_path_buf(),
            reader: Reader::from_reader(log),
            line: 0,
            garbage: 0,
            first_garbage: None,
        }
    }

    /// Lines that were no frames.
    pub fn garbage(&self) -> u64 {
        self.garbage
    }
}

impl<R: Read + Send> FrameSource for CandumpLog<R> {
    fn read(&mut self, batch: &mut Vec<Arrival>, _timeout: Duration) -> io::Result<Flow> {
        for _ in 0..BATCH {
            self.line += 1;
            match self.reader.next_record() {
                Ok(Some(record)) => batch.push(arrival(&record)),
                Ok(None) => return Ok(Flow::Ended),
                // Bytes that are not even text come as an error of reading.
                Err(ParseError::Io(error)) if error.kind() != ErrorKind::InvalidData => {
                    return Err(error);
                }
                Err(error) => {
                    self.garbage += 1;
                    self.first_garbage.get_or_insert_with(|| (self.line, error.to_string()));
                }
            }
        }
        Ok(Flow::Open)
    }

    fn health(&self) -> SourceHealth {
        let trouble = match &self.first_garbage {
            None => String::new(),
            Some((line, error)) => format!(
                "{}:{line}: no line of candump -L ({error}), {} such in all, left out",
                self.file.display(),
                self.garbage
            ),
        };
        SourceHealth { trouble, ..SourceHealth::default() }
    }
}

fn arrival(record: &CanDumpRecord) -> Arrival {
    let frame = match &record.frame {
        CanAnyFrame::Normal(frame) => Frame::new(frame.id(), FrameKind::Data, frame.data()),
        CanAnyFrame::Remote(frame) => Frame::new(frame.id(), FrameKind::Remote, &[]),
        CanAnyFrame::Fd(frame) => Frame::new(frame.id(), FrameKind::Fd, &[]),
        CanAnyFrame::Error(frame) => {
            let class = ExtendedId::new(frame.error_bits()).unwrap_or(ExtendedId::ZERO);
            Frame::new(Id::Extended(class), FrameKind::Error, frame.data())
        }
    };
    Arrival { time_s: record.t_us as f64 / 1e6, frame }
}

#[cfg(test)]
mod tests {
    use embedded_can::StandardId;

    use super::*;

    fn read(log: &[u8]) -> (Vec<Arrival>, SourceHealth) {
        let mut source = CandumpLog::new(Path::new("a.log"), log);
        let mut batch = Vec::new();
        while source.read(&mut batch, Duration::ZERO).unwrap() == Flow::Open {}
        (batch, source.health())
    }

    #[test]
    fn every_kind_of_frame_is_told() {
        let log = b"(1767000000.000060) can0 101#03000000FEFFFE0E\n\
            (1767000000.000070) can0 12345678#01\n\
            (1767000000.000080) can0 101#R\n\
            (1767000000.000090) can0 101##1AABB\n\
            (1767000000.000100) can0 20000004#000C000000000000\n\
            (1767000000.000110) can0 101#";
        let (frames, health) = read(log);
        let standard = |id| Id::from(StandardId::new(id).unwrap());
        assert_eq!(frames[0].time_s, 1_767_000_000.000_06);
        let force =
            Frame::new(standard(0x101), FrameKind::Data, &[3, 0, 0, 0, 0xFE, 0xFF, 0xFE, 14]);
        assert_eq!(frames[0].frame, force);
        let kinds: Vec<_> = frames.iter().map(|arrival| arrival.frame.kind).collect();
        use FrameKind::{Data, Error, Fd, Remote};
        assert_eq!(kinds, [Data, Data, Remote, Fd, Error, Data]);
        assert_eq!(frames[1].frame.id, ExtendedId::new(0x1234_5678).unwrap().into());
        assert_eq!(frames[5].frame.data(), b"");
        assert_eq!(health, SourceHealth::default());
    }

    #[test]
    fn garbage_is_counted_and_what_is_around_it_stays() {
        let mut log = b"(1767000000.000060) can0 101#00\nhello\n".to_vec();
        log.extend(b"\xFF\xFE\x00\n(1767000000) can0 101#00\n(1767000000.000060) can0 101#0\n");
        log.extend(b"(1767000000.000061) can0 102#00\n(1767000000.0000");
        let (frames, health) = read(&log);
        assert_eq!(frames.len(), 2);
        assert_eq!(
            health.trouble,
            "a.log:2: no line of candump -L (Invalid timestamp), 5 such in all, left out"
        );
    }

    #[test]
    fn a_failing_disk_keeps_what_was_read() {
        struct Failing(&'static [u8]);
        impl Read for Failing {
            fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
                match self.0.read(into)? {
                    0 => Err(io::Error::other("worn out")),
                    bytes => Ok(bytes),
                }
            }
        }
        let log = Failing(b"(1767000000.000060) can0 101#00\n(1767000000.000070) can0 101#");
        let mut source = CandumpLog::new(Path::new("a.log"), log);
        let mut batch = Vec::new();
        let error = source.read(&mut batch, Duration::ZERO).unwrap_err();
        assert_eq!((batch.len(), error.to_string().as_str()), (1, "worn out"));
    }
}
