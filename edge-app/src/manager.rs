//! Messages to the service manager, and its watchdog.

use std::time::{Duration, Instant};

use sd_notify::NotifyState;
use tracing::warn;

/// Notifies the service manager. Does nothing without systemd.
pub fn notify(states: &[NotifyState<'_>]) {
    if let Err(error) = sd_notify::notify(states) {
        warn!("the service manager does not listen: {error}");
    }
}

/// The watchdog of the service manager, which ends a daemon that it does not hear from for a period.
#[derive(Clone, Copy, Debug)]
pub struct Watchdog {
    /// Shortest interval between two messages.
    interval: Duration,
    told: Option<Instant>,
}

impl Watchdog {
    /// Returns the watchdog that the service manager has set for this process.
    pub fn of_this_process() -> Option<Self> {
        // Every half of the period, sd_watchdog_enabled(3).
        sd_notify::watchdog_enabled().map(|period| Self { interval: period / 2, told: None })
    }

    /// Tells it that the work goes on, unless it has just been told.
    pub(crate) fn tell(&mut self) {
        if self.told.is_none_or(|told| told.elapsed() >= self.interval) {
            self.told = Some(Instant::now());
            notify(&[NotifyState::Watchdog]);
        }
    }
}
