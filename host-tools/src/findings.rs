//! Results in files and folders.

use std::cmp::Ordering;
use std::fs;
use std::path::{Path, PathBuf};

use flexid_pipeline::input::BadInput;
use flexid_prediction::document::Found;
use flexid_report::evidence::days;
use flexid_wire::report::Acceptance;

/// Results that can be laid side by side.
#[derive(Default)]
pub(crate) struct Read {
    /// Each with its file: their fits are consistent, and no two are of one log.
    pub(crate) used: Vec<(PathBuf, Found)>,
    /// Number of all results that were read.
    pub(crate) all: usize,
    /// What was left out and why, a line each.
    pub(crate) notes: Vec<String>,
}

impl Read {
    /// Reads a result, or of a folder all files that end in `.json`. What is in a folder and is no result is left out.
    ///
    /// # Errors
    /// The file is no result, or the folder cannot be read.
    pub(crate) fn add(&mut self, path: &Path) -> Result<(), BadInput> {
        if !path.is_dir() {
            self.take(path.to_owned(), Found::load(path)?);
            return Ok(());
        }
        entries(path)?
            .into_iter()
            .filter(|file| is_result(file))
            .for_each(|file| self.add_if_result(file));
        Ok(())
    }

    /// Reads a file of a folder, and leaves it out if it is no result.
    pub(crate) fn add_if_result(&mut self, file: PathBuf) {
        match Found::load(&file) {
            Ok(found) => self.take(file, found),
            Err(error) => self.notes.push(format!("left out: {error}")),
        }
    }

    fn take(&mut self, file: PathBuf, found: Found) {
        self.all += 1;
        let doubt = match found.fit.acceptance {
            Acceptance::Consistent => None,
            Acceptance::ModelSuspect => Some("MODEL SUSPECT".to_owned()),
            Acceptance::Unsettled => Some("not settled".to_owned()),
        };
        let again = || {
            let mut others = self.used.iter();
            let other = others.find(|(_, own)| own.logs.iter().any(|log| found.logs.contains(log)));
            other.map(|(other, _)| format!("is of a log of {}", other.display()))
        };
        match doubt.or_else(again) {
            Some(why) => self.notes.push(format!("left out: {}: {why}", file.display())),
            None => self.used.push((file, found)),
        }
    }
}

/// Returns whether the file of a folder may be a result, by its name.
pub(crate) fn is_result(file: &Path) -> bool {
    file.extension().is_some_and(|end| end == "json") && file.is_file()
}

/// What is in a folder, by the names.
pub(crate) fn entries(folder: &Path) -> Result<Vec<PathBuf>, BadInput> {
    let unreadable = |error| BadInput::new(folder, format!("cannot be read: {error}"));
    let entries = fs::read_dir(folder).map_err(unreadable)?;
    let paths = entries.map(|entry| entry.map(|own| own.path()));
    let mut paths: Vec<PathBuf> = paths.collect::<Result<_, _>>().map_err(unreadable)?;
    paths.sort();
    Ok(paths)
}

/// Days from 1970 to the date of a result. `None` if it has none.
pub(crate) fn date((_, found): &(PathBuf, Found)) -> Option<f64> {
    found.date.as_deref().and_then(days)
}

/// Puts results in the order of their dates, and returns the first date. `None`, and the order stays, if not all have one of their own: logs of
/// one instant have clocks that were set anew.
pub(crate) fn by_date(results: &mut [(PathBuf, Found)]) -> Option<f64> {
    let [first, last] = [f64::min, f64::max].map(|end| results.iter().filter_map(date).reduce(end));
    if first >= last || !results.iter().all(|own| date(own).is_some()) {
        return None;
    }
    results.sort_by(|one, other| date(one).partial_cmp(&date(other)).unwrap_or(Ordering::Equal));
    first
}
