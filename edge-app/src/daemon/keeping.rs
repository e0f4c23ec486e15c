//! When the state is written: as often as the storage endures, and again after a failure.

use std::time::{Duration, Instant};

use flexid_pipeline::stop::Stop;
use flexid_pipeline::{Counts, State};
use tracing::{info, warn};

use super::storing::Storing;
use crate::store::Store;

/// Most bytes that are written a second, on average: 1.6 TB a year. The smallest industrial flash of today, 8 GB of 3000 cycles,
/// endures that for 15 years. The state with the most records, of 3 MB, is then written once a minute, one of a single record
/// every 4 s.
const WRITE_RATE: f64 = 50_000.0;
/// Time after which a write that failed is tried again. Chosen: short beside the minute.
const RETRY: Duration = Duration::from_secs(10);

/// Writes the state when that is due.
pub(super) struct Keeping<'a> {
    storing: Option<Storing<'a>>,
    /// Instant from which the state may be written again.
    due: Instant,
    /// Counts of what had come in at the last change since the last write. `None` without a change.
    unsaved: Option<Counts>,
    /// Error of the last attempt, which is in the log. `None` if it succeeded.
    failed: Option<String>,
}

impl<'a> Keeping<'a> {
    /// Makes one whose first write is due at once. A warning says if it cannot be written now.
    pub(super) fn new(store: Option<&'a Store>, stop: &'a Stop) -> Self {
        let storing = store.map(|store| Storing::new(store, stop));
        let claimed = storing.as_ref().map(Storing::claim);
        let mut own = Self { storing, due: Instant::now(), unsaved: None, failed: None };
        if let Some(Err(error)) = claimed {
            own.fail(&error);
        }
        own
    }

    /// Returns the access to the store.
    pub(super) fn storing(&self) -> Option<&Storing<'a>> {
        self.storing.as_ref()
    }

    /// Notes that the state has changed.
    pub(super) fn note_change(&mut self, counts: &Counts) {
        self.unsaved = self.storing.as_ref().map(|_| *counts);
    }

    /// Returns the counts at the last change, if a write is due.
    pub(super) fn due(&self) -> Option<Counts> {
        self.unsaved.filter(|_| Instant::now() >= self.due)
    }

    /// Returns the time until a write is due, and at most `longest`.
    pub(super) fn until_due(&self, longest: Duration) -> Duration {
        match self.unsaved {
            Some(_) => longest.min(self.due.saturating_duration_since(Instant::now())),
            None => longest,
        }
    }

    /// Writes the state, with the counts of what had come in. If that fails, it remains to be written. Returns whether the file holds all
    /// records of the state.
    pub(super) fn save(&mut self, state: &State, counts: &Counts) -> bool {
        self.unsaved = None;
        let Some(storing) = self.storing.as_ref().filter(|_| !state.is_empty()) else {
            return state.is_empty();
        };
        match storing.save(state) {
            Ok(bytes) => {
                self.due = Instant::now() + Duration::from_secs_f64(bytes as f64 / WRITE_RATE);
                if self.failed.take().is_some() {
                    info!("{}: can be written again", storing.store().file().display());
                }
                true
            }
            Err(error) => {
                self.unsaved = Some(*counts);
                self.due = Instant::now() + RETRY;
                self.fail(&error);
                false
            }
        }
    }

    /// Logs an error once.
    fn fail(&mut self, error: &impl ToString) {
        let error = error.to_string();
        if let Some(storing) =
            self.storing.as_ref().filter(|_| self.failed.as_ref() != Some(&error))
        {
            let file = storing.store().file().display();
            warn!("{file}: cannot be written: {error}: a restart forgets until it can");
        }
        self.failed = Some(error);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::decode;

    /// Who waits for this time must not turn in circles.
    #[test]
    fn nothing_is_due_where_nothing_is_kept_or_the_last_write_has_failed() {
        let longest = Duration::from_secs(60);
        let stop = Stop::new();
        let mut nowhere = Keeping::new(None, &stop);
        nowhere.note_change(&Counts::default());
        assert_eq!((nowhere.due(), nowhere.until_due(longest)), (None, longest));

        let store =
            Store::find(Some(std::path::Path::new("/no/such/folder/flexid.state"))).unwrap();
        let mut keeping = Keeping::new(Some(&store), &stop);
        assert_eq!((keeping.due(), keeping.until_due(longest)), (None, longest));
        keeping.note_change(&Counts::default());
        assert_eq!(keeping.due(), Some(Counts::default()));
        keeping.due = Instant::now() + RETRY;
        assert_eq!(keeping.due(), None);
        assert!(keeping.until_due(longest) > RETRY / 2 && keeping.until_due(longest) <= RETRY);
    }

    /// A reload writes what no record has changed.
    #[test]
    fn a_write_that_failed_is_due_again() {
        let test = || {
            let state = decode(include_bytes!("../../tests/pipeline/format9.state")).unwrap();
            let file = std::path::Path::new("/no/such/folder/flexid.state");
            let (store, stop) = (Store::find(Some(file)).unwrap(), Stop::new());
            let mut keeping = Keeping::new(Some(&store), &stop);
            assert!(!keeping.save(&state, &Counts::default()));
            assert_eq!(keeping.unsaved, Some(Counts::default()));
            assert!(keeping.until_due(Duration::from_secs(60)) <= RETRY);
        };
        let large = std::thread::Builder::new().stack_size(flexid_pipeline::STACK);
        large.spawn(test).unwrap().join().unwrap();
    }
}
