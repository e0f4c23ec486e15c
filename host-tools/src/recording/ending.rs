//! Whether the last line of a log is whole. A copy that broke off, or a full disk, ends in the middle of a line.

use std::collections::VecDeque;
use std::io::{self, Read};
use std::path::Path;
use std::time::Duration;

use flexid_pipeline::signals::{NoReading, SignalTable};
use flexid_pipeline::source::{CandumpLog, FrameSource as _};

/// The error in place of a last line that is cut off.
const CUT_OFF: &str = "the last line is cut off";
/// Longest line that is judged, bytes. A line of `candump -L` has 80 at most, and one of a CAN FD frame 200.
const LONGEST: usize = 4096;
/// Bytes that are read at once.
const BLOCK: usize = 1 << 16;

/// The lines of a log, unpacked. In place of a last line that is cut off there comes an error: a line after others that has no end, and is no
/// frame or one of another length than in the DBC file.
pub(super) struct Whole<R> {
    bytes: R,
    table: SignalTable,
    /// What has been read and not yet returned.
    ready: VecDeque<u8>,
    /// The beginning of a line whose end has not been read.
    begun: Vec<u8>,
    /// Whether a line has ended.
    has_lines: bool,
    /// Whether the line that has begun is too long to be judged, and its beginning is returned already.
    is_long: bool,
    /// What comes after all that is ready: an error, once, or the end.
    end: Option<Option<io::Error>>,
}

impl<R> Whole<R> {
    pub(super) fn new(bytes: R, table: SignalTable) -> Self {
        Self {
            bytes,
            table,
            ready: VecDeque::new(),
            begun: Vec::new(),
            has_lines: false,
            is_long: false,
            end: None,
        }
    }

    /// Takes bytes of the log. What is no whole line waits for the rest.
    fn take(&mut self, block: &[u8]) {
        let mut rest = block;
        if let Some(last) = block.iter().rposition(|byte| *byte == b'\n') {
            self.ready.extend(self.begun.drain(..));
            self.ready.extend(&block[..=last]);
            rest = &block[last + 1..];
            (self.has_lines, self.is_long) = (true, false);
        }
        self.begun.extend(rest);
        if self.begun.len() > LONGEST {
            self.ready.extend(self.begun.drain(..));
            self.is_long = true;
        }
    }

    /// Judges the line that has begun, since nothing comes any more.
    fn finish(&mut self) {
        let is_judged = self.has_lines && !self.is_long && !self.begun.is_empty();
        if is_judged && !is_whole(&self.begun, &self.table) {
            self.end = Some(Some(io::Error::other(CUT_OFF)));
        } else {
            self.ready.extend(self.begun.drain(..));
            self.end = Some(None);
        }
    }
}

impl<R: Read> Read for Whole<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        while self.ready.is_empty() {
            if let Some(end) = &mut self.end {
                return end.take().map_or(Ok(0), Err);
            }
            let mut block = [0; BLOCK];
            match self.bytes.read(&mut block) {
                Ok(0) => self.finish(),
                Ok(read) => self.take(&block[..read]),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => return Err(error),
                // What has begun is not judged: the error says that it is not whole.
                Err(error) => self.end = Some(Some(error)),
            }
        }
        self.ready.read(into)
    }
}

/// Whether this line is a frame that the table can read, or one that it does not know.
fn is_whole(line: &[u8], table: &SignalTable) -> bool {
    let mut frames = Vec::new();
    let read =
        CandumpLog::new(Path::new(""), line.chain(&b"\n"[..])).read(&mut frames, Duration::ZERO);
    let [arrival] = &frames[..] else { return false };
    read.is_ok()
        && !matches!(table.decode(&arrival.frame, |_| {}), Err(NoReading::WrongLength { .. }))
}

#[cfg(test)]
mod tests {
    use flexid_pipeline::config::Config;

    use super::*;

    const WHOLE: &str = "(1767000000.000060) can0 101#0102030405060708";

    /// A reader of so many bytes at a time.
    struct Slow<'a>(&'a [u8], usize);

    impl Read for Slow<'_> {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            let count = self.1.min(into.len());
            self.0.read(&mut into[..count])
        }
    }

    #[test]
    fn a_line_in_the_middle_of_which_the_log_ends_is_an_error() {
        let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenario/mill3-edge.toml");
        let table = Config::load(&config).unwrap().signals;
        // What comes before the end, and whether the end is an error, however many bytes come at a time.
        let read = |text: &str| {
            let [once, again] = [1 << 20, 7].map(|count| {
                let mut whole = Whole::new(Slow(text.as_bytes(), count), table.clone());
                let mut bytes = Vec::new();
                let error = whole.read_to_end(&mut bytes).err().map(|error| error.to_string());
                (String::from_utf8(bytes).unwrap(), error)
            });
            assert_eq!(once, again);
            once
        };
        // A frame that is not known may have any length. What begins in the first line is no log.
        let other = format!("{WHOLE}\n(1767000000.000060) can0 7FF#01");
        let long = format!("{WHOLE}\n{}", "x".repeat(100_000));
        for text in
            ["", "Dear", WHOLE, &other, &format!("{WHOLE}\n"), &format!("{WHOLE}\n{WHOLE}"), &long]
        {
            assert_eq!(read(text), (text.to_owned(), None));
        }
        for length in 1..WHOLE.len() {
            let before = format!("{WHOLE}\n{WHOLE}\n");
            let text = format!("{before}{}", &WHOLE[..length]);
            assert_eq!(read(&text), (before, Some(CUT_OFF.to_owned())), "{length}");
        }
    }

    #[test]
    fn an_error_follows_the_lines_before_it() {
        let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenario/mill3-edge.toml");
        let table = Config::load(&config).unwrap().signals;
        let fails = super::super::packed::Failure(Some(io::Error::other("broken")));
        let mut whole = Whole::new(WHOLE.as_bytes().chain(&b"\n(17"[..]).chain(fails), table);
        let mut bytes = Vec::new();
        assert_eq!(whole.read_to_end(&mut bytes).unwrap_err().to_string(), "broken");
        assert_eq!(String::from_utf8(bytes).unwrap(), format!("{WHOLE}\n"));
    }
}
