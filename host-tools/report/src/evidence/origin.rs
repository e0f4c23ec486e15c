//! The origin of a result: program, files with their hashes, command, date.

use std::fs::{self, File};
use std::io::{self, Read};
use std::path::Path;

use flexid_pipeline::date::date;
use flexid_pipeline::document::{Origin, OriginFile};
use sha2::{Digest as _, Sha256};
use time::{Date, Month};

/// The Julian day of 1 January 1970.
const EPOCH: i32 = 2_440_588;

/// The origin of a command with these options, whose first file is the configuration; the first record began at this time on the log's clock, s.
pub fn origin(
    command: &str,
    options: &[&str],
    configuration: &[&Path],
    logs: &[&Path],
    start_s: Option<f64>,
) -> Origin {
    let files =
        |files: &[&Path]| -> Vec<OriginFile> { files.iter().map(|own| file(own)).collect() };
    let [configuration, logs] = [configuration, logs].map(files);
    let mut words = vec!["flexid".to_owned(), command.to_owned()];
    if let Some(first) = configuration.first() {
        words.extend(["--config".to_owned(), quoted(&first.name)]);
    }
    words.extend(options.iter().map(|option| (*option).to_owned()));
    words.extend(logs.iter().map(|log| quoted(&log.name)));
    Origin {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        command: words.join(" "),
        date: start_s.and_then(date),
        configuration,
        logs,
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

/// A file as it is now.
pub fn file(file: &Path) -> OriginFile {
    let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
    let is_standard_input = file.as_os_str() == "-";
    let sha256 = if is_standard_input { None } else { of_file(file).ok().flatten() };
    OriginFile { name: name.into_owned(), sha256 }
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
    fn dates_are_days_since_1970() {
        assert_eq!(days("2025-11-25T11:00:00Z"), Some(20_417.0 + 11.0 / 24.0));
        for none in
            ["", "2025-11-25", "2025-13-25T11:00:00Z", "2025-11-25T24:00:00Z", "a-b-cT1:2:3Z"]
        {
            assert_eq!(days(none), None, "{none}");
        }
    }

    #[test]
    fn a_command_can_be_copied() {
        let files = ["a/edge.toml", "a/mill3-model.toml"].map(Path::new);
        let logs = ["b/my cut.log", "it's.log"].map(Path::new);
        let origin = super::origin("identify", &["--explain"], &files, &logs, None);
        let expected = r"flexid identify --config edge.toml --explain 'my cut.log' 'it'\''s.log'";
        assert_eq!(origin.command, expected);
        assert_eq!(origin.configuration[1].name, "mill3-model.toml");
    }

    /// The vectors of FIPS 180-4, appendix B.
    #[test]
    fn a_hash_is_that_of_the_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("abc");
        fs::write(&path, "abc").unwrap();
        let own = file(&path);
        fs::remove_file(&path).unwrap();
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(own.sha256.as_deref(), Some(expected));
        assert_eq!(file(&path).sha256, None);
        assert_eq!(file(Path::new("/dev/null")).sha256, None);
    }
}
