//! The epochs of a daemon: when one ends, and its finding until that is written.

use std::collections::VecDeque;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;

use flexid_pipeline::config::{Config, Epoch};
use flexid_pipeline::date::stamp;
use flexid_pipeline::stop::Stop;
use flexid_pipeline::text::count;
use flexid_pipeline::{Counts, Record, Solver};
use tracing::{info, warn};

use super::storing::Access;
use crate::history;
use crate::store::Store;

/// Most findings that wait to be written. Chosen: a month of days in which nobody reads the log.
const MOST_WAITING: usize = 31;

/// The findings of epochs, and when an epoch ends.
pub(super) struct Epochs<'a> {
    /// When an epoch ends, and the folder of the findings. `None` if all of life is one epoch.
    history: Option<(Epoch, PathBuf)>,
    files: Access<'a>,
    /// Findings that are not written yet, each with the time at which its oldest record began, s since 1970.
    waiting: VecDeque<(f64, Arc<str>)>,
    /// Error of the last attempt, which is in the log. `None` if it succeeded.
    failed: Option<String>,
}

impl<'a> Epochs<'a> {
    /// Makes those of a config.
    pub(super) fn new(config: &Config, store: Option<&Store>, stop: &'a Stop) -> io::Result<Self> {
        let (files, waiting) = (Access::new(stop), VecDeque::new());
        let mut own = Self { history: None, files, waiting, failed: None };
        own.follow(config, store)?;
        Ok(own)
    }

    /// Follows a config from here on. Findings that wait go to its folder.
    pub(super) fn follow(&mut self, config: &Config, store: Option<&Store>) -> io::Result<()> {
        let folder = history::folder(config, store).map_err(io::Error::other)?;
        self.history = config.history.as_ref().map(|history| history.epoch).zip(folder);
        Ok(())
    }

    /// Returns whether a record belongs to another epoch than those that a solver holds.
    pub(super) fn ends(&self, solver: &Solver, record: &Record) -> bool {
        let ends = |epoch: Epoch| {
            let [_, newest_s] = solver.span_s()?;
            Some(epoch.ends(solver.came(), newest_s, record.start_s))
        };
        self.history.as_ref().and_then(|(epoch, _)| ends(*epoch)).unwrap_or(false)
    }

    /// Takes the finding of the epoch of a solver that has settled, and writes it if that is possible.
    pub(super) fn take(&mut self, solver: &Solver, counts: &Counts) -> io::Result<()> {
        let Some([begun_s, _]) = solver.span_s() else { return Ok(()) };
        let finding = solver.finding(counts, &[]);
        let text = finding.map(|finding| solver.document(&finding)).transpose()?.flatten();
        match text {
            Some(text) => self.waiting.push_back((begun_s, text.into())),
            None => warn!("the epoch of {} leaves no finding: nothing fits", stamp(begun_s)),
        }
        if self.waiting.len() > MOST_WAITING
            && let Some((begun_s, _)) = self.waiting.pop_front()
        {
            warn!("the finding of the epoch of {} is given up: it waits too long", stamp(begun_s));
        }
        self.write();
        Ok(())
    }

    /// Writes the findings that wait, as far as that is possible.
    pub(super) fn write(&mut self) {
        let Some((_, folder)) = &self.history else { return };
        while let Some((begun_s, text)) = self.waiting.front() {
            let (place, begun_s, text) = (folder.clone(), *begun_s, Arc::clone(text));
            let named = format!("writing to {}", folder.display());
            let written = self.files.access(named, move || history::write(&place, begun_s, &text));
            match written.and_then(|written| written) {
                Ok(()) => {
                    self.waiting.pop_front();
                    if self.failed.take().is_some() {
                        info!("{}: can be written again", folder.display());
                    }
                }
                Err(error) => {
                    let error = error.to_string();
                    if self.failed.as_ref() != Some(&error) {
                        warn!(
                            "{}: cannot be written: {error}: its findings wait",
                            folder.display()
                        );
                    }
                    self.failed = Some(error);
                    return;
                }
            }
        }
    }

    /// Writes what waits for the last time, and says what is lost.
    pub(super) fn end(&mut self) {
        self.write();
        if !self.waiting.is_empty() {
            let findings = count(self.waiting.len() as u64, "finding");
            warn!("{findings} of epochs could not be written: given up");
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use super::*;

    fn epochs<'a>(folder: &Path, stop: &'a Stop) -> Epochs<'a> {
        Epochs {
            history: Some((Epoch::Records(1), folder.to_path_buf())),
            files: Access::new(stop),
            waiting: VecDeque::new(),
            failed: None,
        }
    }

    /// The disk is mounted late.
    #[test]
    fn findings_wait_until_they_can_be_written() {
        let folder = tempfile::tempdir().unwrap();
        let disk = folder.path().join("disk");
        let stop = Stop::new();
        let mut epochs = epochs(&disk.join("history"), &stop);
        epochs.waiting.extend([(1.0e9, "first".into()), (1.1e9, "second".into())]);
        epochs.write();
        assert_eq!(epochs.waiting.len(), 2);
        assert!(epochs.failed.is_some());
        fs::create_dir(&disk).unwrap();
        epochs.write();
        assert!(epochs.waiting.is_empty() && epochs.failed.is_none());
        let file = disk.join("history/2004-11-09T11-33-20.000Z.json");
        assert_eq!(fs::read_to_string(file).unwrap(), "second");
        assert_eq!(fs::read_dir(disk.join("history")).unwrap().count(), 2);
    }
}
