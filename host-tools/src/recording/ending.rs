//! Whether the last line of a log is whole. A copy that broke off, or a full disk, ends in the middle of a line.

use std::collections::VecDeque;
use std::io::{self, Read};
use std::path::Path;
use std::time::Duration;

use flexid_pipeline::signals::{NoReading, SignalTable};
use flexid_pipeline::source::{CandumpLog, Frame, FrameKind, FrameSource as _, LOOK_AHEAD};

/// The error in place of a last line that is cut off.
const CUT_OFF: &str = "the last line is cut off";
/// Longest line that is judged, bytes. A line of `candump -L` has 80 at most, and one of a CAN FD frame 200.
const LONGEST: usize = 4096;
/// Bytes that are read at once.
const BLOCK: usize = 1 << 16;

/// The lines of a log, unpacked. In place of a last line that is cut off there comes an error: a line that has no end, follows a frame, and is
/// the beginning of one, or a frame that is shorter than in the DBC file.
pub(super) struct Whole<R> {
    bytes: R,
    /// Bus whose frames are taken if the log has any.
    interface: String,
    table: SignalTable,
    /// What has been read and not yet returned.
    ready: VecDeque<u8>,
    /// The beginning of a line whose end has not been read.
    begun: Vec<u8>,
    /// Number of frames that have been looked at: those up to the first of the interface, at most as many as [`CandumpLog::on_bus`] searches.
    frames: usize,
    /// Whether one of them is of the interface.
    has_interface: bool,
    /// Whether the line that has begun is too long to be judged, and its beginning is returned already.
    is_long: bool,
    /// What comes after all that is ready: an error, once, or the end.
    end: Option<Option<io::Error>>,
}

impl<R> Whole<R> {
    pub(super) fn new(bytes: R, interface: String, table: SignalTable) -> Self {
        Self {
            bytes,
            interface,
            table,
            ready: VecDeque::new(),
            begun: Vec::new(),
            frames: 0,
            has_interface: false,
            is_long: false,
            end: None,
        }
    }

    /// Takes bytes of the log. What is no whole line waits for the rest.
    fn take(&mut self, block: &[u8]) {
        let mut rest = block;
        if let Some(last) = block.iter().rposition(|byte| *byte == b'\n') {
            self.begun.extend(&block[..=last]);
            self.look();
            self.ready.extend(self.begun.drain(..));
            rest = &block[last + 1..];
            self.is_long = false;
        }
        self.begun.extend(rest);
        if self.begun.len() > LONGEST {
            self.ready.extend(self.begun.drain(..));
            self.is_long = true;
        }
    }

    /// Searches the lines that have ended for a frame of the interface.
    fn look(&mut self) {
        for line in self.begun.split(|byte| *byte == b'\n').skip(self.is_long.into()) {
            if self.has_interface || self.frames == LOOK_AHEAD {
                return;
            }
            let Some((bus, _)) = parsed(line) else { continue };
            self.frames += 1;
            self.has_interface = bus == self.interface;
        }
    }

    /// Whether the line that has begun is cut off, if nothing follows. A line of candump begins with a parenthesis: what does not is no
    /// frame, whole or not.
    fn is_cut_off(&self) -> bool {
        if self.frames == 0 || self.is_long {
            return false;
        }
        let Some((bus, frame)) = parsed(&self.begun) else {
            return self.begun.trim_ascii_start().starts_with(b"(");
        };
        // The frames of another bus are taken only if the log has none of the interface.
        let is_taken = bus == self.interface || !self.has_interface;
        let is_short = match self.table.check(&frame) {
            Err(NoReading::WrongLength { expected }) => frame.data().len() < usize::from(expected),
            Err(NoReading::NotData) => frame.kind == FrameKind::Data,
            _ => false,
        };
        is_taken && is_short
    }

    /// Judges the line that has begun, since nothing comes any more.
    fn finish(&mut self) {
        if self.is_cut_off() {
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

/// The bus and the frame of this line, if it is one of `candump -L`.
fn parsed(line: &[u8]) -> Option<(&str, Frame)> {
    let mut frames = Vec::new();
    CandumpLog::new(Path::new(""), line).read(&mut frames, Duration::ZERO).ok()?;
    let bus = str::from_utf8(line).ok()?.split_whitespace().nth(1)?;
    Some((bus, frames.pop()?.frame()?))
}

#[cfg(test)]
mod tests {
    use flexid_pipeline::config::Config;

    use super::*;

    const WHOLE: &str = "(1767000000.000060) can0 101#0102030405060708";
    const INTERFACE: &str = "can0";

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
                let mut whole =
                    Whole::new(Slow(text.as_bytes(), count), INTERFACE.to_owned(), table.clone());
                let mut bytes = Vec::new();
                let error = whole.read_to_end(&mut bytes).err().map(|error| error.to_string());
                (String::from_utf8(bytes).unwrap(), error)
            });
            assert_eq!(once, again);
            once
        };
        let other = WHOLE.replace("can0", "can1");
        // The frame of 8 bytes, cut to 7.
        let short = |line: &str| line[..line.len() - 2].to_owned();
        for text in [
            // Without a frame before it, the last line tells of no log that is cut off.
            "".to_owned(),
            "Dear".to_owned(),
            "Dear\nSir".to_owned(),
            "(Dear\n(Sir".to_owned(),
            WHOLE.to_owned(),
            format!("{WHOLE}\n"),
            format!("{WHOLE}\n{WHOLE}"),
            format!("{WHOLE}\n{WHOLE} "),
            // What is no line of candump.
            format!("{WHOLE}\n "),
            format!("{WHOLE}\n\r"),
            format!("{WHOLE}\n# by the pe"),
            format!("{WHOLE}\n{}", "x".repeat(100_000)),
            format!("{WHOLE}\n({}", "x".repeat(100_000)),
            // A frame that is not known may have any length, and so may one of a bus that is left out. A longer one is not cut off.
            format!("{WHOLE}\n(1767000000.000060) can0 7FF#01"),
            format!("{WHOLE}\n{}", short(&other)),
            format!("{other}\n{WHOLE}\n{}", short(&other)),
            format!("{WHOLE}\n{}", WHOLE.replace(" 101#", " 111#")),
        ] {
            assert_eq!(read(&text), (text, None));
        }
        for (before, last) in [(WHOLE, WHOLE), (&other, WHOLE), (&other, &other)] {
            let text = format!("{before}\n{}", short(last));
            assert_eq!(read(&text), (format!("{before}\n"), Some(CUT_OFF.to_owned())), "{text}");
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
        let mut whole = Whole::new(
            WHOLE.as_bytes().chain(&b"\n(17"[..]).chain(fails),
            INTERFACE.to_owned(),
            table,
        );
        let mut bytes = Vec::new();
        assert_eq!(whole.read_to_end(&mut bytes).unwrap_err().to_string(), "broken");
        assert_eq!(String::from_utf8(bytes).unwrap(), format!("{WHOLE}\n"));
    }
}
