//! Passes a new config to a running daemon.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use flexid_pipeline::config::Config;

/// Holds the newest config until the daemon has taken it. The daemon keeps the interface, addresses and state file with which
/// it has begun, whatever the config contains.
#[derive(Debug, Default)]
pub struct Reload(Mutex<Option<Arc<Config>>>);

impl Reload {
    /// Makes a holder without a config.
    pub fn new() -> Self {
        Self::default()
    }

    /// Offers a config. It replaces one that has not been taken yet.
    pub fn offer(&self, config: Config) {
        *self.lock() = Some(Arc::new(config));
    }

    /// Returns whether the config offered last still waits.
    pub fn is_pending(&self) -> bool {
        self.lock().is_some()
    }

    /// Returns the config that waits.
    pub(crate) fn pending(&self) -> Option<Arc<Config>> {
        self.lock().clone()
    }

    /// Removes `config`, which the daemon has taken, unless a newer one has come.
    pub(crate) fn taken(&self, config: &Arc<Config>) {
        let mut pending = self.lock();
        if pending.as_ref().is_some_and(|other| Arc::ptr_eq(other, config)) {
            *pending = None;
        }
    }

    fn lock(&self) -> MutexGuard<'_, Option<Arc<Config>>> {
        // The value is whole between any two statements, so that a panic leaves it valid.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
