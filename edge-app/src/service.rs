//! Signals to the daemon, and messages to the service manager.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use flexid_edge::reload::Reload;
use flexid_pipeline::config::Config;
use flexid_pipeline::stop::Stop;
use sd_notify::NotifyState;
use signal_hook::consts::SIGHUP;
use signal_hook::flag;
use tracing::{info, warn};

/// Interval at which signals are checked.
const LOOK: Duration = Duration::from_millis(50);

/// Signals that have come.
pub(crate) struct Signals {
    /// SIGTERM or SIGINT has come.
    end: Stop,
    /// SIGHUP has come.
    again: Arc<AtomicBool>,
}

impl Signals {
    /// Catches the signals from here on. Call it before anything else, so that no signal ends a daemon that is just beginning.
    pub(crate) fn catch() -> io::Result<Self> {
        let (end, again) = (Stop::on_signals()?, Arc::new(AtomicBool::new(false)));
        flag::register(SIGHUP, Arc::clone(&again))?;
        Ok(Self { end, again })
    }
}

/// Connects the signals, the service manager and the daemon.
pub(crate) struct Service<'a> {
    /// Config with which the daemon has begun.
    pub(crate) config: &'a Config,
    pub(crate) signals: Signals,
    pub(crate) stop: &'a Stop,
    pub(crate) reload: &'a Reload,
}

impl Service<'_> {
    /// Carries out what the signals request, until the daemon stops.
    pub(crate) fn attend(&self) {
        notify(&[NotifyState::Ready]);
        let mut reloading = false;
        while !self.stop.requested() {
            if self.signals.end.requested() {
                break;
            }
            if self.signals.again.swap(false, Ordering::Relaxed) {
                reloading = true;
                notify_reloading();
                self.read_config_again();
            }
            if reloading && !self.reload.is_pending() {
                reloading = false;
                notify(&[NotifyState::Ready]);
            }
            thread::sleep(LOOK);
        }
        notify(&[NotifyState::Stopping]);
        self.stop.request();
    }

    /// Reads the config file again and offers the config to the daemon. A bad file is named in the log, and the daemon keeps
    /// the old config.
    fn read_config_again(&self) {
        let begun = self.config;
        let mut config = match Config::load(&begun.file) {
            Ok(config) => config,
            Err(error) => return warn!("goes on with the old config: {error}"),
        };
        let unchanged = |place: &str, same: bool| {
            if !same {
                warn!("{place} has changed: takes effect when flexid-edge is started again");
            }
        };
        unchanged("[bus] interface", config.interface == begun.interface);
        unchanged("[server] listen", config.listen == begun.listen);
        let access = config.socket_access == begun.socket_access;
        unchanged("[server] socket_mode or socket_group", access);
        unchanged("[state] file", config.state == begun.state);
        config.interface.clone_from(&begun.interface);
        info!("{}: read again", begun.file.display());
        self.reload.offer(config);
    }
}

fn notify_reloading() {
    // Newer versions of systemd require the time with it.
    let time = NotifyState::monotonic_usec_now();
    let states: Vec<_> = std::iter::once(NotifyState::Reloading).chain(time).collect();
    notify(&states);
}

/// Notifies the service manager. Does nothing without systemd.
fn notify(states: &[NotifyState]) {
    if let Err(error) = sd_notify::notify(states) {
        warn!("the service manager does not listen: {error}");
    }
}
