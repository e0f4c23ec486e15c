//! The switch that ends all threads.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// Switch that requests the end. It is off at first. Every loop that checks it returns soon after it is on. Clones are one
/// switch.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Makes a switch that is off.
    pub fn new() -> Self {
        Self::default()
    }

    /// Makes a switch that SIGTERM and SIGINT set. The second signal ends the program at once, with exit status 1.
    ///
    /// # Errors
    /// The signals cannot be caught.
    pub fn on_signals() -> io::Result<Self> {
        let stop = Self::new();
        for signal in [SIGTERM, SIGINT] {
            // The actions run in the order in which they are registered.
            flag::register_conditional_shutdown(signal, 1, Arc::clone(&stop.0))?;
            flag::register(signal, Arc::clone(&stop.0))?;
        }
        Ok(stop)
    }

    /// Requests the end.
    pub fn request(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Returns whether the end was requested.
    pub fn requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
