//! The switch that ends all threads.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// Longest time for which the work on a record goes on after the end was requested, unless a switch states another. A service
/// manager may kill a program that takes long: systemd after 90 s (systemd-system.conf(5), `DefaultTimeoutStopSec`).
const GRACE: Duration = Duration::from_secs(2);

/// Switch that requests the end. It is off at first. Every loop that checks it returns soon after it is on, and the work on a
/// record within the grace. Clones are one switch.
#[derive(Clone, Debug)]
pub struct Stop {
    is_on: Arc<AtomicBool>,
    grace: Duration,
}

impl Default for Stop {
    fn default() -> Self {
        Self::with_grace(GRACE)
    }
}

impl Stop {
    /// Makes a switch that is off, with a grace of 2 s.
    pub fn new() -> Self {
        Self::default()
    }

    /// Makes a switch that is off, with this grace.
    pub fn with_grace(grace: Duration) -> Self {
        Self { is_on: Arc::default(), grace }
    }

    /// Makes a switch that SIGTERM and SIGINT set. The second signal ends the program at once, with exit status 1.
    ///
    /// # Errors
    /// The signals cannot be caught.
    pub fn on_signals() -> io::Result<Self> {
        let stop = Self::new();
        for signal in [SIGTERM, SIGINT] {
            // The actions run in the order in which they are registered.
            flag::register_conditional_shutdown(signal, 1, Arc::clone(&stop.is_on))?;
            flag::register(signal, Arc::clone(&stop.is_on))?;
        }
        Ok(stop)
    }

    /// Requests the end.
    pub fn request(&self) {
        self.is_on.store(true, Ordering::Relaxed);
    }

    /// Returns whether the end was requested.
    pub fn requested(&self) -> bool {
        self.is_on.load(Ordering::Relaxed)
    }

    /// Returns the longest time for which the work on a record goes on after the end was requested.
    pub fn grace(&self) -> Duration {
        self.grace
    }
}
