//! Whether the last line of a log is whole. A copy that broke off, or a full disk, ends in the middle of a line.

use std::fs::File;
use std::io::{self, Read as _, Seek as _, SeekFrom};
use std::path::Path;
use std::time::Duration;

use flexid_pipeline::signals::{NoReading, SignalTable};
use flexid_pipeline::source::{CandumpLog, FrameSource as _};

use super::packed;

/// Longest line that is looked at, bytes. A line of `candump -L` has 80 at most, and one of a CAN FD frame 200.
const LONGEST: u64 = 4096;

/// Number of bytes before a last line that is cut off: it has no end, and is no frame or one of another length than in the DBC file.
/// `None` of a log whose last line is whole.
///
/// Packed logs, pipes and standard input are not looked at: a packed log that is cut off has an error of its own. A log that cannot be read
/// has been reported before.
pub(super) fn whole_bytes(name: &Path, table: &SignalTable) -> Option<u64> {
    let last = last_line(name).ok().flatten()?;
    (!is_whole(&last.text, table)).then_some(last.start)
}

/// A last line without an end.
struct LastLine {
    /// Bytes of the log before it.
    start: u64,
    /// Its text, or the beginning of it.
    text: Vec<u8>,
}

/// The last line if it has no end. Returns `None` for a log that ends with a line's end, is packed, or is no regular file.
fn last_line(name: &Path) -> io::Result<Option<LastLine>> {
    let mut file = File::open(name)?;
    if !file.metadata()?.is_file() {
        return Ok(None);
    }
    let mut head = Vec::new();
    file.by_ref().take(packed::HEAD).read_to_end(&mut head)?;
    if packed::is_packed(&head) {
        return Ok(None);
    }
    let start = start_of_last_line(&mut file)?;
    file.seek(SeekFrom::Start(start))?;
    let mut text = Vec::new();
    file.take(LONGEST).read_to_end(&mut text)?;
    Ok((!text.is_empty()).then_some(LastLine { start, text }))
}

/// Number of bytes before the last line. It looks for the end of the line before it from the end of the file on, since logs are long.
fn start_of_last_line(file: &mut File) -> io::Result<u64> {
    let mut end = file.metadata()?.len();
    let mut block = Vec::new();
    while end > 0 {
        let start = end.saturating_sub(LONGEST);
        file.seek(SeekFrom::Start(start))?;
        block.clear();
        file.take(end - start).read_to_end(&mut block)?;
        if let Some(place) = block.iter().rposition(|byte| *byte == b'\n') {
            return Ok(start + place as u64 + 1);
        }
        end = start;
    }
    Ok(0)
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
    use std::fs;

    use flexid_pipeline::config::Config;

    use super::*;

    const WHOLE: &str = "(1767000000.000060) can0 101#0102030405060708";

    #[test]
    fn a_line_in_the_middle_of_which_the_log_ends_is_no_whole_one() {
        let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenario/mill3-edge.toml");
        let table = Config::load(&config).unwrap().signals;
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("a.log");
        let whole = |text: &str| {
            fs::write(&log, text).unwrap();
            whole_bytes(&log, &table)
        };
        // A frame that is not known may have any length.
        let other = "(1767000000.000060) can0 7FF#01";
        for text in ["", WHOLE, other, &format!("{WHOLE}\n"), &format!("{WHOLE}\n{WHOLE}")] {
            assert_eq!(whole(text), None, "{text}");
        }
        for length in 1..WHOLE.len() {
            let bytes = whole(&format!("{WHOLE}\n{WHOLE}\n{}", &WHOLE[..length]));
            assert_eq!(bytes, Some(2 * (WHOLE.len() as u64 + 1)), "{length}");
        }
        assert_eq!(whole(&"x".repeat(100_000)), Some(0));
        // The line's beginning is far from its end.
        let long = format!("{WHOLE}\n{}", "x".repeat(100_000));
        assert_eq!(whole(&long), Some(WHOLE.len() as u64 + 1));
    }
}
