//! The way of a new config into a daemon that runs.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::config::Config;

/// Holds the newest config until the daemon has taken it. Interface, addresses and state file are those that the daemon
/// has begun with, whatever it says.
#[derive(Debug, Default)]
pub struct Reload(Mutex<Option<Arc<Config>>>);

impl Reload {
    /// Without a new config.
    pub fn new() -> Self {
        Self::default()
    }

    /// Offers a config, in place of one that has not been taken yet.
    pub fn offer(&self, config: Config) {
        *self.lock() = Some(Arc::new(config));
    }

    /// Whether the last one offered still waits.
    pub fn is_pending(&self) -> bool {
        self.lock().is_some()
    }

    /// The config that waits.
    pub(crate) fn pending(&self) -> Option<Arc<Config>> {
        self.lock().clone()
    }

    /// Takes `config`, unless a newer one has come.
    pub(crate) fn taken(&self, config: &Arc<Config>) {
        let mut pending = self.lock();
        if pending.as_ref().is_some_and(|other| Arc::ptr_eq(other, config)) {
            *pending = None;
        }
    }

    fn lock(&self) -> MutexGuard<'_, Option<Arc<Config>>> {
        // What is guarded is whole between any two statements.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
