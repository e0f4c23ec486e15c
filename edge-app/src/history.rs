//! The folder in which a daemon leaves the finding of each epoch, for `flexid history`: `[history] folder`, or `history` beside the state.
//!
//! | name                            | what                                                                                         |
//! | ------------------------------- | -------------------------------------------------------------------------------------------- |
//! | `2026-03-03T07-12-09.250Z.json` | finding of the epoch whose oldest record began then, UTC, as `flexid identify --json` writes it |
//! | `finding.new`                   | a file that is being written                                                                 |

use std::ffi::OsString;
use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use flexid_pipeline::config::Config;
use flexid_pipeline::date::stamp;
use flexid_pipeline::input::BadInput;
use flexid_pipeline::text::count;
use tracing::{info, warn};

use crate::store::{Store, write_whole};

/// Most bytes of all findings that stay. Chosen: an eighth of the smallest industrial flash of today, 8 GB. Ten years of days of a robot with
/// three joints and typical accuracies take as much, at 0.28 MB each.
const MOST: u64 = 1 << 30;
/// Name of the folder beside the state.
const NAME: &str = "history";
/// Name of the file that is being written.
const NEW: &str = "finding.new";
/// Form of the names of findings. A zero stands for a digit.
const FORM: &[u8] = b"0000-00-00T00-00-00.000Z.json";
/// Length of the day in such a name.
const DAY: usize = 10;

/// Returns the folder in which a daemon with this config and this store leaves its findings. Returns `None` without `[history]`.
///
/// # Errors
/// No folder is named, and there is no state beside which it would lie.
pub fn folder(config: &Config, store: Option<&Store>) -> Result<Option<PathBuf>, BadInput> {
    let Some(history) = &config.history else { return Ok(None) };
    let beside = || store.map(|store| store.folder().join(NAME));
    match history.folder.clone().or_else(beside) {
        Some(folder) => Ok(Some(folder)),
        None => Err(BadInput::new(
            &config.file,
            "[history] folder is missing, and there is no state beside which it would lie: add folder = \"history\", or [state] file",
        )),
    }
}

/// Writes the `text` of the finding of an epoch whose oldest record began at `begun_s`, s since 1970. A file that is there stays: a daemon that
/// was killed before it kept its state has written it of the same epoch. Removes findings beyond the most that stay.
///
/// # Errors
/// The file cannot be written.
pub(crate) fn write(folder: &Path, begun_s: f64, text: &str) -> io::Result<()> {
    match fs::create_dir(folder) {
        Err(error) if error.kind() != ErrorKind::AlreadyExists => return Err(error),
        _ => {}
    }
    let file = folder.join(stamp(begun_s) + ".json");
    if file.try_exists()? {
        info!("{}: is there already", file.display());
        return Ok(());
    }
    write_whole(&file, &folder.join(NEW), text.as_bytes())?;
    info!("{}: the finding of an epoch", file.display());
    thin(folder);
    Ok(())
}

/// Removes findings beyond the most that stay, and says how many.
fn thin(folder: &Path) {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let findings = entries.filter(|entry| is_finding(&entry.file_name()));
    let sized = findings.map(|entry| {
        let bytes = entry.metadata().map_or(0, |metadata| metadata.len());
        (entry.file_name(), bytes)
    });
    let superfluous = superfluous(sized.collect(), MOST);
    let mut failed = None;
    for name in &superfluous {
        failed = fs::remove_file(folder.join(name)).err().or(failed);
    }
    let place = folder.display();
    match (superfluous.first().zip(superfluous.last()), failed) {
        (_, Some(error)) => warn!("{place}: old findings cannot be removed: {error}"),
        (Some((first, last)), None) => {
            let findings = count(superfluous.len() as u64, "finding");
            let [first, last] = [first, last].map(|name| name.display());
            info!("{place}: {findings} removed, {first} to {last}: {} MB stay", MOST >> 20);
        }
        (None, None) => {}
    }
}

/// Returns the names of the findings that go, of those with these sizes: if there are more than `most` bytes, all but the last of each day, and
/// then the oldest.
fn superfluous(mut findings: Vec<(OsString, u64)>, most: u64) -> Vec<OsString> {
    let mut bytes: u64 = findings.iter().map(|(_, bytes)| bytes).sum();
    if bytes <= most {
        return Vec::new();
    }
    findings.sort();
    let day = |(name, _): &(OsString, u64)| name.as_encoded_bytes().get(..DAY).map(<[u8]>::to_vec);
    let has_later = |index: usize| findings.get(index + 1).map(day) == Some(day(&findings[index]));
    let (of_days, last): (Vec<usize>, Vec<usize>) =
        (0..findings.len()).partition(|&index| has_later(index));
    let mut going = of_days;
    bytes -= going.iter().map(|&index| findings[index].1).sum::<u64>();
    for index in last {
        if bytes <= most {
            break;
        }
        bytes -= findings[index].1;
        going.push(index);
    }
    going.sort_unstable();
    going.into_iter().map(|index| findings[index].0.clone()).collect()
}

fn is_finding(name: &OsString) -> bool {
    let name = name.as_encoded_bytes();
    let fits = |(own, form): (&u8, &u8)| match form {
        b'0' => own.is_ascii_digit(),
        _ => own == form,
    };
    name.len() == FORM.len() && name.iter().zip(FORM).all(fits)
}

#[cfg(test)]
mod tests {
    use std::fs::File;

    use super::*;

    fn name(stamp: &str) -> OsString {
        format!("2026-03-{stamp}-00.000Z.json").into()
    }

    /// Findings of ten bytes each.
    fn going(stamps: &[&str], most: u64) -> Vec<OsString> {
        superfluous(stamps.iter().map(|stamp| (name(stamp), 10)).collect(), most)
    }

    #[test]
    fn days_are_thinned_before_the_oldest_goes() {
        let all = ["02T09-00", "01T09-00", "01T17-00", "03T09-00"];
        for (most, expected) in [
            (40, &[][..]),
            (39, &["01T09-00"]),
            (29, &["01T09-00", "01T17-00"]),
            (10, &["01T09-00", "01T17-00", "02T09-00"]),
        ] {
            assert_eq!(going(&all, most), expected.iter().map(|own| name(own)).collect::<Vec<_>>());
        }
        let one_day = ["03T09-00", "03T10-00", "03T11-00"];
        assert_eq!(going(&one_day, 29), [name("03T09-00"), name("03T10-00")]);
    }

    /// What is not the daemon's own stays, and findings do not accumulate.
    #[test]
    fn the_folder_is_bounded() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("history");
        let place = |day: u32| path.join(stamp(1.0e9 + 86_400.0 * f64::from(day)) + ".json");
        let day_s = |day: u32| 1.0e9 + 86_400.0 * f64::from(day);
        write(&path, day_s(0), "first").unwrap();
        // Holes take no room.
        let large = |file: &Path| File::create(file).unwrap().set_len(MOST / 2 - 2).unwrap();
        [place(1), place(2), path.join("found.json")].iter().for_each(|file| large(file));
        large(&path.join("2001-09-09T01-46-40.000Z.json.old"));
        write(&path, day_s(2), "again").unwrap();
        assert!(place(0).exists(), "none is new");
        write(&path, day_s(3), "last").unwrap();
        assert!(!place(0).exists() && (1..=3).all(|day| place(day).exists()));
        assert_eq!(fs::read_dir(&path).unwrap().count(), 5);
    }

    #[test]
    fn a_finding_that_is_there_stays() {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), 1.0e9, "first").unwrap();
        write(folder.path(), 1.0e9, "second").unwrap();
        let file = folder.path().join("2001-09-09T01-46-40.000Z.json");
        assert_eq!(fs::read_to_string(file).unwrap(), "first");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
