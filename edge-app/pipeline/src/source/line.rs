//! Lines of `candump -L`, in all its forms: names of equal length, stamps of any number of decimals, raw DLC.

use std::borrow::Cow;
use std::io::{self, BufRead, Read as _};

use socketcan::dump::{CanDumpRecord, ParseError, Reader};

/// Longest line that is read, bytes. A line of a CAN FD frame has 200.
const LONGEST: u64 = 4096;
/// Decimals of a stamp that the parser of frames takes.
const DECIMALS: usize = 6;
/// Beginning of the line with which `candump -d` says that the kernel has dropped frames.
const DROPPED: &str = "DROPCOUNT: dropped ";

/// Content of a line.
#[derive(Debug)]
pub(super) enum Line {
    /// A frame.
    Frame(CanDumpRecord),
    /// The kernel dropped frames of a bus.
    Dropped { frames: u64, bus: String },
    /// Something else.
    Garbage(ParseError),
}

/// Reads the next line from `log` into `line`, and what it holds; `None` at the end. What is too long for a line is garbage.
///
/// # Errors
/// The log cannot be read.
pub(super) fn read(log: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<Option<Line>> {
    line.clear();
    if log.take(LONGEST).read_until(b'\n', line)? == 0 {
        return Ok(None);
    }
    if line.len() as u64 == LONGEST && !line.ends_with(b"\n") {
        log.skip_until(b'\n')?;
        return Ok(Some(Line::Garbage(ParseError::UnexpectedEndOfLine)));
    }
    Ok(Some(match str::from_utf8(line) {
        Ok(text) => parse(text),
        Err(error) => {
            Line::Garbage(ParseError::Io(io::Error::new(io::ErrorKind::InvalidData, error)))
        }
    }))
}

/// Returns whether a line is one of `candump -L`, with a frame.
pub fn is_frame(line: &str) -> bool {
    matches!(parse(line), Line::Frame(_))
}

/// Returns what a line holds.
pub(super) fn parse(line: &str) -> Line {
    if let Some(rest) = line.trim_start().strip_prefix(DROPPED) {
        let frames = rest.split(' ').next().and_then(|number| number.parse().ok());
        let dropped = frames.zip(rest.split('\'').nth(1));
        return match dropped {
            Some((frames, bus)) => Line::Dropped { frames, bus: bus.to_owned() },
            None => Line::Garbage(ParseError::InvalidCanFrame),
        };
    }
    match Reader::from_reader(canonical(line).as_bytes()).next_record() {
        Ok(Some(record)) => Line::Frame(record),
        // A line of nothing but its end.
        Ok(None) => Line::Garbage(ParseError::UnexpectedEndOfLine),
        Err(error) => Line::Garbage(error),
    }
}

/// Returns the form of a line that its parser takes: words one space apart, stamps of six decimals, no raw DLC. What is no line of
/// `candump -L` stays none.
fn canonical(line: &str) -> Cow<'_, str> {
    if is_canonical(line) {
        return Cow::Borrowed(line);
    }
    let mut canonical = String::with_capacity(line.len() + DECIMALS);
    for (place, word) in line.split_whitespace().enumerate() {
        let word = match place {
            0 => &stamp(word),
            2 => without_raw_dlc(word),
            _ => word,
        };
        if place > 0 {
            canonical.push(' ');
        }
        canonical.push_str(word);
    }
    // An empty line is no end of the text.
    canonical.push('\n');
    Cow::Owned(canonical)
}

/// Returns whether a line has this form, as `candump -L` writes it.
fn is_canonical(line: &str) -> bool {
    let line = line.trim_end();
    if line.contains(|own: char| own.is_whitespace() && own != ' ') {
        return false;
    }
    let mut words = line.split(' ');
    let (Some(stamp), Some(bus), Some(frame), None) =
        (words.next(), words.next(), words.next(), words.next())
    else {
        return false;
    };
    let number = stamp.strip_prefix('(').and_then(|rest| rest.strip_suffix(')'));
    let has_decimals = number
        .and_then(|number| number.split_once('.'))
        .is_some_and(|(_, part)| part.len() == DECIMALS);
    has_decimals && !bus.is_empty() && !frame.is_empty() && !frame.contains('_')
}

/// Returns a stamp with six decimals. Smaller ones are left out.
fn stamp(word: &str) -> String {
    let number = word.strip_prefix('(').and_then(|rest| rest.strip_suffix(')'));
    let parts = number.map(|number| number.split_once('.').unwrap_or((number, "")));
    let is_number = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    match parts {
        Some((whole, part)) if is_number(part) && !whole.is_empty() => {
            let part = &part[..part.len().min(DECIMALS)];
            format!("({whole}.{part:0<DECIMALS$})")
        }
        _ => word.to_owned(),
    }
}

/// Returns a classical frame without the raw DLC above 8 that it may have: `_9` to `_F`. It has 8 bytes all the same.
fn without_raw_dlc(word: &str) -> &str {
    let Some((frame, [b'9' | b'A'..=b'F' | b'a'..=b'f'])) =
        word.rsplit_once('_').map(|(frame, dlc)| (frame, dlc.as_bytes()))
    else {
        return word;
    };
    if frame.contains("##") { word } else { frame }
}

#[cfg(test)]
mod tests {
    use socketcan::CanAnyFrame;
    use socketcan::EmbeddedFrame as _;

    use super::*;

    /// Stamp, µs, and data of a line that holds a frame.
    fn frame(line: &str) -> Option<(u64, Vec<u8>)> {
        match parse(line) {
            Line::Frame(CanDumpRecord { t_us, frame: CanAnyFrame::Normal(frame), .. }) => {
                Some((t_us, frame.data().to_vec()))
            }
            _ => None,
        }
    }

    #[test]
    fn what_candump_writes_is_taken_as_it_is() {
        for (line, expected) in [
            ("(1767000000.000060) can0 101#0102\n", true),
            ("(1767000000.00006) can0 101#0102\n", false),
            ("(1767000000.000060)  can0 101#0102\n", false),
            ("(1767000000.000060) can0 101#0102030405060708_9\n", false),
            ("(1767000000.000060) can0 101#0102 R\n", false),
            (" (1767000000.000060) can0 101#0102\n", false),
            ("(1767000000.000060) can0\t101#0102\n", false),
            ("(1767000000.000060) can0\t101#0102 R\n", false),
            ("(1767000000.000060) can0 101#0102\tR\n", false),
            ("\n", false),
        ] {
            assert_eq!(matches!(canonical(line), Cow::Borrowed(_)), expected, "{line:?}");
            assert_eq!(is_frame(line), line.contains("101#"), "{line:?}");
        }
    }

    #[test]
    fn decimals_are_decimals() {
        for (stamp, t_us) in [
            ("1767000000.000060", 1_767_000_000_000_060),
            ("1767000000.5", 1_767_000_000_500_000),
            ("1767000000.00006", 1_767_000_000_000_060),
            ("1767000000.", 1_767_000_000_000_000),
            ("1767000000", 1_767_000_000_000_000),
            ("1767000000.000060123", 1_767_000_000_000_060),
            ("1767000000.0000601234567890", 1_767_000_000_000_060),
            ("0000000000.000000", 0),
        ] {
            let line = format!("({stamp}) can0 101#0102");
            assert_eq!(frame(&line), Some((t_us, vec![1, 2])), "{line}");
        }
        for stamp in ["", ".", ".5", "1,5", "1.5.2", "-1.5", "1e9", "x.5", "1.x"] {
            assert_eq!(frame(&format!("({stamp}) can0 101#0102")), None, "{stamp}");
        }
    }

    #[test]
    fn a_raw_dlc_leaves_eight_bytes() {
        for dlc in ["_9", "_F", "_a", ""] {
            let line = format!("(1.0)  can0 101#0102030405060708{dlc} R");
            assert_eq!(frame(&line).unwrap().1, [1, 2, 3, 4, 5, 6, 7, 8]);
        }
        for data in ["0102_8", "0102_", "0102_FF", "_", "#1AABB_F"] {
            assert_eq!(frame(&format!("(1.0) can0 101#{data}")), None, "{data}");
        }
    }

    #[test]
    fn what_the_kernel_dropped_is_read() {
        let line = "DROPCOUNT: dropped 3 CAN frames on 'vcan0' socket (total drops 15)";
        assert!(matches!(parse(line), Line::Dropped { frames: 3, bus } if bus == "vcan0"));
        assert!(matches!(parse("DROPCOUNT: dropped many"), Line::Garbage(_)));
    }

    #[test]
    fn a_line_without_end_is_garbage_and_the_next_is_read() {
        let text = [&b"x".repeat(100_000)[..], b"\n\n\xFF\n(1.5) can0 101#00"].concat();
        let (mut log, mut line) = (&text[..], Vec::new());
        let mut next = || read(&mut log, &mut line).unwrap();
        for _ in 0..3 {
            assert!(matches!(next(), Some(Line::Garbage(_))));
        }
        assert!(matches!(next(), Some(Line::Frame(_))));
        assert!(next().is_none());
    }
}
