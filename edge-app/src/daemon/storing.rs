//! Files, whose file system may hang: the end of the daemon does not wait for it.

use std::cell::Cell;
use std::io::{self, ErrorKind};
use std::time::{Duration, Instant};

use flexid_pipeline::State;
use flexid_pipeline::config::Fingerprint;
use flexid_pipeline::stop::Stop;
use tracing::warn;

use crate::store::{ClaimError, Store, encode};
use crate::threads::Detached;

/// Interval at which the stop switch is checked.
const LOOK: Duration = Duration::from_millis(200);
/// Longest time for an access after the end was requested. Chosen: three times that for the largest state, 3 MB, on the slowest memory card
/// (SD speed class 2: 2 MB/s).
const LAST: Duration = Duration::from_secs(5);

/// Access to files.
pub(super) struct Access<'a> {
    stop: &'a Stop,
    /// True once the end did not wait for an access. There is no other then, so that nothing is written over what was not read.
    is_stuck: Cell<bool>,
}

/// Access to a store.
pub(super) struct Storing<'a> {
    store: &'a Store,
    files: Access<'a>,
}

impl<'a> Storing<'a> {
    pub(super) fn new(store: &'a Store, stop: &'a Stop) -> Self {
        Self { store, files: Access::new(stop) }
    }

    pub(super) fn store(&self) -> &'a Store {
        self.store
    }

    /// Locks the file, see [`Store::claim`].
    pub(super) fn claim(&self) -> Result<(), ClaimError> {
        self.access("locking", Store::claim)?
    }

    /// Reads the state, see [`Store::load`]. There is none if the end comes before the file can be read.
    pub(super) fn load(&self) -> io::Result<Option<State>> {
        let loaded = self.access("reading", Store::load);
        if let Err(error) = &loaded
            && self.files.is_stuck.get()
        {
            warn!("{}: cannot be read: {error}", self.store.file().display());
            return Ok(None);
        }
        loaded?
    }

    /// Writes the state, see [`Store::write`].
    pub(super) fn save(&self, state: &State) -> Result<usize, ClaimError> {
        let bytes = encode(state)?;
        self.access("writing", move |store| store.write(&bytes))?
    }

    /// Puts the file aside, see [`Store::put_aside_state`].
    pub(super) fn put_aside(&self, fingerprint: Fingerprint, why: String) {
        let done = self.access("renaming", move |store| store.put_aside_state(&fingerprint, &why));
        self.warn(done);
    }

    /// Takes back a state, see [`Store::take_back`].
    pub(super) fn take_back(&self, fingerprint: Fingerprint) -> Option<State> {
        self.warn(self.access("reading", move |store| store.take_back(&fingerprint)))?
    }

    fn warn<T>(&self, done: io::Result<T>) -> Option<T> {
        let file = self.store.file().display();
        done.inspect_err(|error| warn!("{file}: cannot be accessed: {error}")).ok()
    }

    fn access<T: Send + 'static>(
        &self,
        named: &str,
        access: impl FnOnce(&Store) -> T + Send + 'static,
    ) -> io::Result<T> {
        let store = self.store.clone();
        self.files.access(format!("{named} {}", store.file().display()), move || access(&store))
    }
}

impl<'a> Access<'a> {
    pub(super) fn new(stop: &'a Stop) -> Self {
        Self { stop, is_stuck: Cell::new(false) }
    }

    /// Returns the result of `access`, which is `named` in the log if it is late.
    pub(super) fn access<T: Send + 'static>(
        &self,
        named: String,
        access: impl FnOnce() -> T + Send + 'static,
    ) -> io::Result<T> {
        let does_not_answer =
            || io::Error::new(ErrorKind::TimedOut, "the file system does not answer");
        if self.is_stuck.get() {
            return Err(does_not_answer());
        }
        let mut work = Detached::begin("flexid-store", named, access)?;
        let mut end = None;
        loop {
            if let Some(done) = work.wait(LOOK)? {
                return Ok(done);
            }
            let now = Instant::now();
            if self.stop.requested() && now >= *end.get_or_insert(now + LAST) {
                self.is_stuck.set(true);
                return Err(does_not_answer());
            }
        }
    }
}
