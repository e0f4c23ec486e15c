//! Results in files and folders, in the order of their dates.

use std::fs;
use std::path::{Path, PathBuf};

use flexid_pipeline::input::BadInput;
use flexid_pipeline::text::count;
use flexid_prediction::document::Found;
use flexid_report::evidence::days;
use flexid_wire::report::Acceptance;

use crate::compare::differing;

/// Results that a history rests on.
pub(crate) struct Findings {
    /// Each with its file, the oldest first.
    pub(crate) used: Vec<(PathBuf, Found)>,
    /// Days since the first, or numbers from 0 where one has no date.
    pub(crate) times: Vec<f64>,
    pub(crate) are_dated: bool,
    /// What was left out and why, and what differs, a line each.
    pub(crate) notes: Vec<String>,
}

impl Findings {
    /// Reads results: files, and of folders all files that end in `.json`. What is in a folder and is no result is left out.
    ///
    /// # Errors
    /// A file that is named is no result, or there are not two results to be compared.
    pub(crate) fn load(paths: &[PathBuf]) -> Result<Self, BadInput> {
        let (mut notes, mut all) = (Vec::new(), Vec::new());
        for path in paths {
            if !path.is_dir() {
                all.push((path.clone(), Found::load(path)?));
                continue;
            }
            for file in results_of(path)? {
                match Found::load(&file) {
                    Ok(found) => all.push((file, found)),
                    Err(error) => notes.push(format!("left out: {error}")),
                }
            }
        }
        let read = all.len();
        let mut used: Vec<(PathBuf, Found)> = Vec::new();
        for (file, found) in all {
            let doubt = match found.fit.acceptance {
                Acceptance::Consistent => None,
                Acceptance::ModelSuspect => Some("MODEL SUSPECT".to_owned()),
                Acceptance::Unsettled => Some("not settled".to_owned()),
            };
            let again = || {
                let mut others = used.iter();
                let other =
                    others.find(|(_, own)| own.logs.iter().any(|log| found.logs.contains(log)));
                other.map(|(other, _)| format!("is of a log of {}", other.display()))
            };
            match doubt.or_else(again) {
                Some(why) => notes.push(format!("left out: {}: {why}", file.display())),
                None => used.push((file, found)),
            }
        }
        if used.len() < 2 {
            let which = paths.first().map_or(Path::new(""), PathBuf::as_path);
            let of = count(read as u64, "result");
            let why = format!(
                "{} of {of} can be compared, and a history needs two: name results of `flexid identify --json` of separate cuts, whose fits are consistent",
                used.len()
            );
            return Err(BadInput::new(which, why));
        }
        let date = |(_, found): &(PathBuf, Found)| found.date.as_deref().and_then(days);
        // Logs of one instant have clocks that were set anew.
        let [first, last] =
            [f64::min, f64::max].map(|end| used.iter().filter_map(date).reduce(end));
        let are_dated = first < last && used.iter().all(|own| date(own).is_some());
        if are_dated {
            used.sort_by(|one, other| {
                date(one).partial_cmp(&date(other)).unwrap_or(std::cmp::Ordering::Equal)
            });
        } else {
            notes.push(
                "not all results have a date of their own: they are taken in the order in which they are named"
                    .into(),
            );
        }
        let first = first.unwrap_or(0.0);
        let times = used.iter().enumerate().map(|(number, own)| match date(own) {
            Some(days) if are_dated => days - first,
            _ => number as f64,
        });
        let times = times.collect();
        notes.extend(used.windows(2).filter_map(|pair| {
            let [(_, before), (file, after)] = pair else { return None };
            let differing = differing(before.robot.model(), after.robot.model());
            (!differing.is_empty()).then(|| {
                let (file, keys) = (file.display(), differing.join(", "));
                format!("{file}: from here on the model has another {keys}: what differs in a model shows in the parameters")
            })
        }));
        let lacking = used.iter().filter(|(_, own)| own.shared.is_none()).count();
        if lacking > 0 {
            let of = count(lacking as u64, "result");
            notes.push(format!(
                "{of} of an older flexid: errors that findings share do not cancel in their changes, and intervals are wider"
            ));
        }
        Ok(Self { used, times, are_dated, notes })
    }
}

/// The files of a folder that may be results, by their names.
fn results_of(folder: &Path) -> Result<Vec<PathBuf>, BadInput> {
    let unreadable = |error| BadInput::new(folder, format!("cannot be read: {error}"));
    let entries = fs::read_dir(folder).map_err(unreadable)?;
    let files = entries.map(|entry| entry.map(|own| own.path()));
    let mut files: Vec<PathBuf> = files.collect::<Result<_, _>>().map_err(unreadable)?;
    files.retain(|file| file.extension().is_some_and(|end| end == "json") && file.is_file());
    files.sort();
    Ok(files)
}
