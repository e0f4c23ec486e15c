//! The origin of a result: program, files with their hashes, command, date.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use time::{Date, Month, UtcDateTime};

/// Earliest time that is taken for a date and not for seconds since a start: the year 2000, s since 1970.
const DATES_BEGIN: f64 = 946_684_800.0;

/// The Julian day of 1 January 1970.
const EPOCH: i32 = 2_440_588;

/// The origin of a result. It depends on the files and the command alone: the same run gives the same again.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Version of flexid.
    pub version: String,
    /// Command that gives the same numbers, with the names of the files without their folders.
    pub command: String,
    /// Date of the first record by the log's clock, ISO 8601, UTC. `None` if that clock shows no date.
    pub date: Option<String>,
    /// Configuration, and the files that it names.
    pub configuration: Vec<OriginFile>,
    /// Logs, in the order in which they were read.
    pub logs: Vec<OriginFile>,
}

/// A file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OriginFile {
    /// Its name, without folder.
    pub name: String,
    /// SHA-256 of its bytes, as they are stored: of a packed log, packed. `None` of what can be read only once, as standard input, or not
    /// again.
    pub sha256: Option<String>,
}

impl Origin {
    /// The origin of a command with these options, whose first file is the configuration; the first record began at this time on the log's clock, s.
    pub fn new(
        command: &str,
        options: &[&str],
        configuration: &[&Path],
        logs: &[&Path],
        start_s: Option<f64>,
    ) -> Self {
        let files = |files: &[&Path]| -> Vec<OriginFile> {
            files.iter().map(|file| OriginFile::of(file)).collect()
        };
        let [configuration, logs] = [configuration, logs].map(files);
        let mut words = vec!["flexid".to_owned(), command.to_owned()];
        if let Some(first) = configuration.first() {
            words.extend(["--config".to_owned(), quoted(&first.name)]);
        }
        words.extend(options.iter().map(|option| (*option).to_owned()));
        words.extend(logs.iter().map(|log| quoted(&log.name)));
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            command: words.join(" "),
            date: start_s.and_then(date),
            configuration,
            logs,
        }
    }
}

/// Writes a word as a shell takes it.
pub fn quoted(word: &str) -> String {
    let is_plain = |own: char| own.is_alphanumeric() || "-_.,:=+@%/".contains(own);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

impl OriginFile {
    /// The file as it is now.
    pub fn of(file: &Path) -> Self {
        let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
        let is_standard_input = file.as_os_str() == "-";
        let sha256 = if is_standard_input { None } else { of_file(file).ok().flatten() };
        Self { name: name.into_owned(), sha256 }
    }
}

/// SHA-256 of some bytes, in hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

/// SHA-256 of a regular file. `None` of others, which could be read only once.
fn of_file(file: &Path) -> io::Result<Option<String>> {
    if !fs::metadata(file)?.is_file() {
        return Ok(None);
    }
    let mut file = File::open(file)?;
    let mut hash = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        let read = file.read(&mut buffer)?;
        if read == 0 {
            return Ok(Some(hexadecimal(&hash.finalize())));
        }
        hash.update(&buffer[..read]);
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A time, s since 1970, as a date.
fn date(seconds: f64) -> Option<String> {
    let seconds = Some(seconds).filter(|seconds| *seconds >= DATES_BEGIN)?;
    // The conversion saturates, and what is beyond all dates is none.
    let at = UtcDateTime::from_unix_timestamp(seconds as i64).ok()?;
    let (year, month, day) = at.to_calendar_date();
    let month = u8::from(month);
    let (hour, minute, second) = at.as_hms();
    Some(format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z"))
}

/// Days from 1970 to a date, ISO 8601, UTC, as an origin has it. `None` of what is none.
pub fn days(date: &str) -> Option<f64> {
    let (day, time) = date.strip_suffix('Z')?.split_once('T')?;
    let [year, month, day] = three(day, '-')?;
    let [hour, minute, second] = three(time, ':')?;
    let month = Month::try_from(u8::try_from(month).ok()?).ok()?;
    let date =
        Date::from_calendar_date(year.try_into().ok()?, month, u8::try_from(day).ok()?).ok()?;
    let is_time = hour < 24 && minute < 60 && second < 60;
    let seconds = 3600 * hour + 60 * minute + second;
    is_time.then(|| f64::from(date.to_julian_day() - EPOCH) + f64::from(seconds) / 86_400.0)
}

/// Three numbers with a mark between them.
fn three(text: &str, mark: char) -> Option<[u32; 3]> {
    let numbers: Option<Vec<u32>> = text.split(mark).map(|own| own.parse().ok()).collect();
    numbers?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_since_1970_are_dates() {
        assert_eq!(date(1_764_068_400.9).as_deref(), Some("2025-11-25T11:00:00Z"));
        assert_eq!(date(951_782_400.0).as_deref(), Some("2000-02-29T00:00:00Z"));
        assert_eq!(days("2025-11-25T11:00:00Z"), Some(20_417.0 + 11.0 / 24.0));
        for none in
            ["", "2025-11-25", "2025-13-25T11:00:00Z", "2025-11-25T24:00:00Z", "a-b-cT1:2:3Z"]
        {
            assert_eq!(days(none), None, "{none}");
        }
        for none in [0.0, 12.5, f64::NAN, f64::INFINITY, 1e300] {
            assert_eq!(date(none), None, "{none}");
        }
    }

    #[test]
    fn a_command_can_be_copied() {
        let files = ["a/edge.toml", "a/mill3-model.toml"].map(Path::new);
        let logs = ["b/my cut.log", "it's.log"].map(Path::new);
        let origin = Origin::new("identify", &["--explain"], &files, &logs, None);
        let expected = r"flexid identify --config edge.toml --explain 'my cut.log' 'it'\''s.log'";
        assert_eq!(origin.command, expected);
        assert_eq!(origin.configuration[1].name, "mill3-model.toml");
    }

    /// The vectors of FIPS 180-4, appendix B.
    #[test]
    fn a_hash_is_that_of_the_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("abc");
        fs::write(&file, "abc").unwrap();
        let own = OriginFile::of(&file);
        fs::remove_file(&file).unwrap();
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(own.sha256.as_deref(), Some(expected));
        assert_eq!(OriginFile::of(&file).sha256, None);
        assert_eq!(OriginFile::of(Path::new("/dev/null")).sha256, None);
    }
}
