//! Recordings of a bus: the text that `candump -L` writes.

use std::collections::{BTreeSet, HashMap, VecDeque};
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};
use std::time::Duration;

use embedded_can::{ExtendedId, Frame as _, Id};
use flexid_wire::text::clipped;
use flexid_wire::trouble::{LineFault, Trouble};
use socketcan::CanAnyFrame;
use socketcan::dump::{CanDumpRecord, ParseError};

use super::line::{self, Line};
use super::stamps::{self, Stamps};
use super::{Arrival, Elsewhere, Flow, Frame, FrameKind, FrameSource, SourceHealth};
use crate::input::BadInput;

/// Number of frames that one read takes.
const BATCH: usize = 256;
/// Number of frames that are searched for the buses of a log: two seconds of two full buses.
pub const LOOK_AHEAD: usize = 32_768;

/// Longest name of an interface, bytes: IFNAMSIZ less its closing zero.
const LONGEST_NAME: usize = 15;
/// Number of buses that are named if the right one is not among them.
const NAMED: usize = 3;
/// Most identifiers of other buses, and most buses with dropped frames, that are told apart.
const MOST_ELSEWHERE: usize = 256;

/// Reads a log line by line. Lines that are no frames are counted and left out.
pub struct CandumpLog<R> {
    file: PathBuf,
    text: BufReader<R>,
    line: Vec<u8>,
    lines: u64,
    garbage: u64,
    first_garbage: Option<(u64, LineFault)>,
    /// Bus whose frames are taken. `None` takes the frames of all buses.
    bus: Option<String>,
    /// Number of frames of other buses that were left out.
    strays: u64,
    /// The identifiers of these frames.
    elsewhere: HashMap<(Id, String), u64>,
    /// Frames that were read ahead, with the stamps of the log.
    ahead: VecDeque<(String, Arrival)>,
    /// Event behind the frames read ahead: an error, once, or the end.
    end: Option<Option<io::Error>>,
    stamps: Stamps,
    /// Times of the newest frames, s.
    before_s: VecDeque<f64>,
    /// Number of frames of each bus that the kernel dropped.
    dropped: HashMap<String, u64>,
}

impl<R: Read> CandumpLog<R> {
    /// Makes a source of any log, with the frames of all its buses. Messages name it `file`.
    pub fn new(file: &Path, log: R) -> Self {
        Self {
            file: file.to_path_buf(),
            text: BufReader::new(log),
            line: Vec::new(),
            lines: 0,
            garbage: 0,
            first_garbage: None,
            bus: None,
            strays: 0,
            elsewhere: HashMap::new(),
            ahead: VecDeque::new(),
            end: None,
            stamps: Stamps::default(),
            before_s: VecDeque::new(),
            dropped: HashMap::new(),
        }
    }

    /// Takes the frames of one bus only: of `interface`, or of the only bus of the log, whatever its name.
    ///
    /// It reads the first 32,768 frames to find the buses. Frames of a bus that comes later are left out, and the troubles
    /// count them.
    ///
    /// # Errors
    /// The log holds no frame, or several buses, of which none is `interface`.
    pub fn on_bus(mut self, interface: &str) -> Result<Self, BadInput> {
        self.look_ahead(LOOK_AHEAD);
        let is_broken = matches!(self.end, Some(Some(_)));
        // Lines that are no frames say more than the error that follows them.
        if self.ahead.is_empty() && (!is_broken || self.first_garbage.is_some()) {
            return Err(BadInput::new(&self.file, self.no_frame()));
        }
        let buses: BTreeSet<&str> = self.ahead.iter().map(|(bus, _)| bus.as_str()).collect();
        let bus = match buses.first() {
            Some(bus) if buses.len() == 1 => bus,
            Some(_) if !buses.contains(interface) => {
                let message = format!(
                    "holds frames of {}, but none of [bus] interface, {interface:?}: name one of them there",
                    enumerate(&buses)
                );
                return Err(BadInput::new(&self.file, message));
            }
            _ => interface,
        };
        self.bus = Some(bus.to_string());
        Ok(self)
    }

    /// Returns what is wrong with a log without any frame.
    fn no_frame(&self) -> String {
        let what = match self.first_garbage {
            None => "is empty".to_owned(),
            Some((line, fault)) => {
                format!("is not a candump log: line {line} is no line of `candump -L` ({fault})")
            }
        };
        format!("{what}: record it with `candump -L can0 > cut.log`, or name another log")
    }

    /// Reads until so many frames are read ahead, or to the end.
    fn look_ahead(&mut self, frames: usize) {
        while self.ahead.len() < frames && self.end.is_none() {
            match self.parse() {
                Ok(Some(frame)) => {
                    self.stamps.note(frame.1.time_s);
                    self.ahead.push_back(frame);
                }
                Ok(None) => self.end = Some(None),
                Err(error) => self.end = Some(Some(error)),
            }
        }
    }

    /// Returns the next frame and its bus, or `None` at the end.
    fn next(&mut self) -> io::Result<Option<(String, Arrival)>> {
        self.look_ahead(1 + stamps::REACH);
        let Some((bus, arrival)) = self.ahead.pop_front() else {
            return self.end.as_mut().and_then(Option::take).map_or(Ok(None), Err);
        };
        let after = self.ahead.iter().map(|(_, arrival)| arrival.time_s);
        let time_s = self.stamps.mended(&self.before_s, arrival.time_s, after);
        if self.before_s.len() == stamps::REACH {
            self.before_s.pop_front();
        }
        self.before_s.push_back(time_s);
        Ok(Some((bus, Arrival { time_s, ..arrival })))
    }

    /// Returns the next frame of the file and its bus, or `None` at the end.
    fn parse(&mut self) -> io::Result<Option<(String, Arrival)>> {
        loop {
            self.lines += 1;
            let read = line::read(&mut self.text, &mut self.line).map_err(|error| {
                let (file, line) = (self.file.display(), self.lines);
                let message =
                    format!("{file}:{line}: cannot be read: {error}: copy or record it again");
                io::Error::new(error.kind(), message)
            })?;
            let garbage = match read {
                None => {
                    self.lines -= 1;
                    return Ok(None);
                }
                Some(Line::Frame(record)) if record.device.len() > LONGEST_NAME => {
                    ParseError::InvalidDeviceName
                }
                Some(Line::Frame(record)) => {
                    return Ok(Some((record.device.clone(), arrival(&record))));
                }
                Some(Line::Dropped { bus, .. }) if bus.len() > LONGEST_NAME => {
                    ParseError::InvalidDeviceName
                }
                Some(Line::Dropped { frames, bus }) => {
                    if self.dropped.len() < MOST_ELSEWHERE || self.dropped.contains_key(&bus) {
                        let dropped = self.dropped.entry(bus).or_default();
                        *dropped = dropped.saturating_add(frames);
                    }
                    continue;
                }
                Some(Line::Garbage(error)) => error,
            };
            self.garbage += 1;
            self.first_garbage.get_or_insert_with(|| (self.lines, line_fault(&garbage)));
        }
    }

    /// Counts a frame of another bus.
    fn stray(&mut self, bus: String, frame: &Frame) {
        self.strays += 1;
        let place = (frame.id, bus);
        if self.elsewhere.len() < MOST_ELSEWHERE || self.elsewhere.contains_key(&place) {
            *self.elsewhere.entry(place).or_default() += 1;
        }
    }
}

impl<R: Read + Send> FrameSource for CandumpLog<R> {
    fn read(&mut self, batch: &mut Vec<Arrival>, _timeout: Duration) -> io::Result<Flow> {
        for _ in 0..BATCH {
            match self.next()? {
                None => return Ok(Flow::Ended),
                Some((bus, arrival)) if self.bus.as_ref().is_some_and(|only| *only != bus) => {
                    if let Some(frame) = arrival.frame() {
                        self.stray(bus, &frame);
                    }
                }
                Some((_, arrival)) => batch.push(arrival),
            }
        }
        Ok(Flow::Open)
    }

    fn health(&self) -> SourceHealth {
        let file = || clipped(self.file.display());
        let mut troubles = Vec::new();
        if let Some((line, fault)) = self.first_garbage {
            let (lines, of) = (self.garbage, self.lines);
            troubles.push(Trouble::Garbage { file: file(), line, fault, lines, of });
        }
        if let Some((fault, frames)) = self.stamps.fault() {
            troubles.push(Trouble::Stamps { file: file(), fault, frames });
        }
        // `candump any` has one socket for all buses.
        let is_own = |bus: &str| self.bus.as_ref().is_none_or(|own| own == bus || bus == "any");
        let dropped = self.dropped.iter().filter(|(bus, _)| is_own(bus));
        let frames = dropped.fold(0_u64, |sum, (_, frames)| sum.saturating_add(*frames));
        if frames > 0 {
            troubles.push(Trouble::Dropped { file: file(), frames });
        }
        if let (Some(bus), frames @ 1..) = (&self.bus, self.strays) {
            troubles.push(Trouble::OtherBuses { file: file(), bus: clipped(bus), frames });
        }
        let elsewhere = self.elsewhere.iter();
        let elsewhere = elsewhere.map(|((id, bus), frames)| Elsewhere {
            id: *id,
            bus: bus.clone(),
            frames: *frames,
        });
        SourceHealth { troubles, elsewhere: elsewhere.collect(), ..SourceHealth::default() }
    }
}

/// Lists the first names and the number of the others.
fn enumerate(buses: &BTreeSet<&str>) -> String {
    let named = buses.iter().take(NAMED).copied().collect::<Vec<_>>().join(", ");
    match buses.len().saturating_sub(NAMED) {
        0 => named,
        more => format!("{named} and {more} more"),
    }
}

/// Converts the fault of a line for the wire. The only reading error is that of bytes which are not text.
fn line_fault(error: &ParseError) -> LineFault {
    match error {
        ParseError::Io(_) => LineFault::NotText,
        ParseError::UnexpectedEndOfLine => LineFault::EndsEarly,
        ParseError::InvalidTimestamp => LineFault::Timestamp,
        ParseError::InvalidDeviceName => LineFault::DeviceName,
        ParseError::InvalidCanFrame | ParseError::ConstructionError(_) => LineFault::Frame,
        ParseError::InvalidFrameDirection => LineFault::Direction,
    }
}

fn arrival(record: &CanDumpRecord) -> Arrival {
    let frame = match &record.frame {
        CanAnyFrame::Normal(frame) => Frame::new(frame.id(), FrameKind::Data, frame.data()),
        CanAnyFrame::Remote(frame) => Frame::new(frame.id(), FrameKind::Remote, &[]),
        CanAnyFrame::Fd(frame) => Frame::new(frame.id(), FrameKind::Data, frame.data()),
        CanAnyFrame::Error(frame) => {
            let class = ExtendedId::new(frame.error_bits()).unwrap_or(ExtendedId::ZERO);
            Frame::new(Id::Extended(class), FrameKind::Error, frame.data())
        }
    };
    Arrival::of_frame(record.t_us as f64 / 1e6, frame)
}

#[cfg(test)]
mod tests {
    use embedded_can::StandardId;

    use super::*;
    use crate::source::Logs;

    fn read(log: &[u8]) -> (Vec<Arrival>, SourceHealth) {
        let mut source = CandumpLog::new(Path::new("a.log"), log);
        let mut batch = Vec::new();
        while source.read(&mut batch, Duration::ZERO).unwrap() == Flow::Open {}
        (batch, source.health())
    }

    fn lines(health: &SourceHealth) -> Vec<String> {
        health.troubles.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn every_kind_of_frame_is_recognised() {
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
        assert_eq!(frames[0].frame(), Some(force));
        let kinds: Vec<_> = frames.iter().map(|arrival| arrival.frame().unwrap().kind).collect();
        use FrameKind::{Data, Error, Remote};
        assert_eq!(kinds, [Data, Data, Remote, Data, Error, Data]);
        assert_eq!(frames[1].frame().unwrap().id, ExtendedId::new(0x1234_5678).unwrap().into());
        assert_eq!(frames[3].frame().unwrap().data(), [0xAA, 0xBB]);
        assert_eq!(frames[5].frame().unwrap().data(), b"");
        assert_eq!(health, SourceHealth::default());
    }

    /// `candump -L can0 vcan10` writes names of equal length.
    #[test]
    fn names_may_be_padded() {
        let log = b"(1767000000.000060)   can0 101#00\n(1767000000.000070) vcan10 102#0001\n";
        let (frames, health) = read(log);
        let frames: Vec<_> = frames.iter().filter_map(Arrival::frame).collect();
        let data: Vec<_> = frames.iter().map(Frame::data).collect();
        assert_eq!(data, [&[0][..], &[0, 1]]);
        assert_eq!(health, SourceHealth::default());
    }

    #[test]
    fn garbage_is_counted_and_what_is_around_it_stays() {
        let mut log = b"(1767000000.000060) can0 101#00\nhello\n".to_vec();
        log.extend(b"\xFF\xFE\x00\n(17x.5) can0 101#00\n(1767000000.000060) can0 101#0\n");
        log.extend(b"(1767000000.000061) can0 102#00\n(1767000000.0000");
        let (frames, health) = read(&log);
        assert_eq!(frames.len(), 2);
        assert_eq!(
            lines(&health),
            ["a.log:2: no line of candump -L (Invalid timestamp), 5 such of 7, left out"]
        );
    }

    /// The name is kept for each of the 32,768 frames that are read ahead.
    #[test]
    fn a_name_that_no_interface_has_is_garbage() {
        let line = |bytes| format!("(1767000000.000060) {} 101#00\n", "c".repeat(bytes));
        let log = [line(15), line(16), line(60_000)].concat();
        let mut source =
            CandumpLog::new(Path::new("a.log"), log.as_bytes()).on_bus("can0").unwrap();
        let mut batch = Vec::new();
        while source.read(&mut batch, Duration::ZERO).unwrap() == Flow::Open {}
        assert_eq!(batch.len(), 1);
        assert_eq!(
            lines(&source.health()),
            ["a.log:2: no line of candump -L (Invalid device name), 2 such of 3, left out"]
        );
    }

    #[test]
    fn a_log_without_any_frame_is_refused() {
        let refused = |text: &str| {
            let log = CandumpLog::new(Path::new("a.log"), text.as_bytes()).on_bus("can0");
            log.err().map(|error| error.to_string()).unwrap_or_default()
        };
        let mend = ": record it with `candump -L can0 > cut.log`, or name another log";
        assert_eq!(refused(""), format!("a.log: is empty{mend}"));
        let fault = "is not a candump log: line 1 is no line of `candump -L` (Invalid timestamp)";
        assert_eq!(refused("Dear reader,\n\n"), format!("a.log: {fault}{mend}"));
        assert_eq!(refused("Dear reader,\n(1767000000.000060) can0 101#00\n"), "");
    }

    #[test]
    fn of_many_buses_three_are_named() {
        let line = |bus| format!("(1767000000.000060) can{bus} 101#00\n");
        let log: String = (0..500).map(line).collect();
        let refused =
            CandumpLog::new(Path::new("a.log"), log.as_bytes()).on_bus("vcan0").err().unwrap();
        let expected = "a.log: holds frames of can0, can1, can10 and 497 more, but none of ";
        assert!(refused.to_string().starts_with(expected), "{refused}");
    }

    #[test]
    fn a_failing_disk_does_not_make_a_log_of_other_lines() {
        let refused = |text| {
            let log = CandumpLog::new(Path::new("a.log"), Failing(text)).on_bus("can0");
            log.err().map(|error| error.to_string())
        };
        let error = refused(b"Dear\nSir").unwrap();
        assert!(error.starts_with("a.log: is not a candump log: line 1 is no line of "), "{error}");
        assert_eq!(refused(b""), None);
    }

    struct Failing(&'static [u8]);

    impl Read for Failing {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            match self.0.read(into)? {
                0 => Err(io::Error::other("worn out")),
                bytes => Ok(bytes),
            }
        }
    }

    #[test]
    fn a_failing_disk_keeps_what_was_read_and_the_next_log() {
        let log = |file: &str| {
            let bytes = Failing(b"(1767000000.000060) can0 101#00\n(1767000000.000070) can0 101#");
            CandumpLog::new(Path::new(file), bytes)
        };
        let mut batch = Vec::new();
        let error = log("a.log").read(&mut batch, Duration::ZERO).unwrap_err();
        assert_eq!(batch.len(), 1);
        assert_eq!(error.to_string(), "a.log:2: cannot be read: worn out: copy or record it again");

        let mut logs = Logs::new([Ok(log("a.log").on_bus("can0").unwrap()), Ok(log("b.log"))]);
        let mut batch = Vec::new();
        let error = loop {
            match logs.read(&mut batch, Duration::ZERO) {
                Ok(flow) => assert_eq!(flow, Flow::Open),
                Err(error) => break error,
            }
        };
        assert_eq!(batch.len(), 2);
        assert_eq!(error.to_string(), "a.log:2: cannot be read: worn out: copy or record it again");
        assert_eq!(
            lines(&logs.health()),
            ["b.log:2: cannot be read: worn out: copy or record it again"]
        );
        assert_eq!(logs.read(&mut batch, Duration::ZERO).unwrap(), Flow::Ended);
    }

    #[test]
    fn of_several_buses_only_the_named_one_is_taken() {
        let log = b"(1767000000.000060) can1 101#00\n(1767000000.000070) can0 102#00\n\
            (1767000000.000080) can1 101#00\n";
        let mut source = CandumpLog::new(Path::new("a.log"), &log[..]).on_bus("can0").unwrap();
        let mut batch = Vec::new();
        while source.read(&mut batch, Duration::ZERO).unwrap() == Flow::Open {}
        assert_eq!(batch.len(), 1);
        assert_eq!(batch[0].frame().unwrap().id, StandardId::new(0x102).unwrap().into());
        assert_eq!(lines(&source.health()), ["a.log: took the frames of can0, left out 2 others"]);

        let refused = CandumpLog::new(Path::new("a.log"), &log[..]).on_bus("vcan0").err().unwrap();
        assert_eq!(
            refused.to_string(),
            "a.log: holds frames of can0, can1, but none of [bus] interface, \"vcan0\": name one of them there"
        );

        let one = b"(1767000000.000060) can1 101#00\n(1767000000.000080) can1 101#00\n";
        let mut source = CandumpLog::new(Path::new("a.log"), &one[..]).on_bus("can0").unwrap();
        let mut batch = Vec::new();
        while source.read(&mut batch, Duration::ZERO).unwrap() == Flow::Open {}
        assert_eq!((batch.len(), source.health()), (2, SourceHealth::default()));
    }

    #[test]
    fn frames_of_other_buses_are_counted_by_identifier() {
        let log = b"(1767000000.000060) can1 101#00\n(1767000000.000070) can0 102#00\n\
            (1767000000.000080) can1 101#00\n";
        let mut source = CandumpLog::new(Path::new("a.log"), &log[..]).on_bus("can0").unwrap();
        while source.read(&mut Vec::new(), Duration::ZERO).unwrap() == Flow::Open {}
        let id = StandardId::new(0x101).unwrap().into();
        let expected = Elsewhere { id, bus: "can1".to_owned(), frames: 2 };
        assert_eq!(source.health().elsewhere, [expected]);
    }

    #[test]
    fn dropped_frames_are_those_of_the_bus() {
        let log = b"(1767000000.000060) can0 101#00\n(1767000000.000070) can1 102#00\n\
            DROPCOUNT: dropped 3 CAN frames on 'can0' socket (total drops 3)\n\
            DROPCOUNT: dropped 70 CAN frames on 'can1' socket (total drops 70)\n\
            DROPCOUNT: dropped 1 CAN frame on 'can0' socket (total drops 4)\n";
        let dropped = |source: CandumpLog<&[u8]>| {
            let mut source = source;
            while source.read(&mut Vec::new(), Duration::ZERO).unwrap() == Flow::Open {}
            let troubles = source.health().troubles;
            troubles.iter().find_map(|trouble| match trouble {
                Trouble::Dropped { frames, .. } => Some(*frames),
                _ => None,
            })
        };
        let source = || CandumpLog::new(Path::new("a.log"), &log[..]);
        assert_eq!(dropped(source().on_bus("can0").unwrap()), Some(4));
        assert_eq!(dropped(source()), Some(74));
    }

    #[test]
    fn dropped_frames_and_wrong_stamps_are_troubles() {
        let line = |n: u32| {
            let jump = if n == 77 { 700_000 } else { 0 };
            format!("(1767000000.{:06}) can0 101#00\n", 250 * n + jump)
        };
        let dropped = "DROPCOUNT: dropped 3 CAN frames on 'can0' socket (total drops 3)\n";
        let log: String = (0..200).map(line).chain([dropped.to_owned()]).collect();
        let (frames, health) = read(log.as_bytes());
        assert_eq!(frames.len(), 200);
        assert!(
            frames.windows(2).all(|pair| (0.0..1e-3).contains(&(pair[1].time_s - pair[0].time_s)))
        );
        assert_eq!(
            lines(&health),
            [
                "a.log: the stamps of 1 frame jump away and back, and were replaced: \
                 record without -H, whose stamps are those of the adapter",
                "a.log: the kernel dropped 3 frames while this was recorded: record with `candump -r 8388608 -L`",
            ]
        );
    }
}
