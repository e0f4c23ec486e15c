//! The results of a robot, in the order of their dates.

use std::path::{Path, PathBuf};

use flexid_pipeline::input::BadInput;
use flexid_pipeline::text::count;
use flexid_prediction::document::Found;

use crate::compare::differing;
use crate::findings::{Read, by_date, date};

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
        let mut read = Read::default();
        for path in paths {
            read.add(path)?;
        }
        let Read { mut used, all, mut notes } = read;
        if used.len() < 2 {
            let which = paths.first().map_or(Path::new(""), PathBuf::as_path);
            let of = count(all as u64, "result");
            let why = format!(
                "{} of {of} can be compared, and a history needs two: name results of `flexid identify --json` of separate cuts, whose fits are consistent",
                used.len()
            );
            return Err(BadInput::new(which, why));
        }
        let first = by_date(&mut used);
        if first.is_none() {
            notes.push(
                "not all results have a date of their own: they are taken in the order in which they are named"
                    .into(),
            );
        }
        let times = used.iter().enumerate().map(|(number, own)| match first.zip(date(own)) {
            Some((first, days)) => days - first,
            None => number as f64,
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
        Ok(Self { used, times, are_dated: first.is_some(), notes })
    }
}
