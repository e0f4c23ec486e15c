//! Signals to the daemon, of which the service manager hears.

use std::fmt::Display;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use flexid_edge::history;
use flexid_edge::manager::notify;
use flexid_edge::reload::Reload;
use flexid_edge::store::Store;
use flexid_edge::threads::Detached;
use flexid_pipeline::config::Config;
use flexid_pipeline::input::BadInput;
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

    /// Reads a config. Returns `None` if a signal requests the end before.
    pub(crate) fn read_config(&self, file: &Path) -> anyhow::Result<Option<Config>> {
        Ok(self.wait_for(reading(file)?)?.transpose()?)
    }

    /// Waits for the result of work. Returns `None` if a signal requests the end before.
    ///
    /// # Errors
    /// The thread of the work has died.
    pub(crate) fn wait_for<T: Send + 'static>(
        &self,
        mut work: Detached<T>,
    ) -> io::Result<Option<T>> {
        while !self.end.requested() {
            if let Some(result) = work.wait(LOOK)? {
                return Ok(Some(result));
            }
        }
        Ok(None)
    }
}

/// Begins to read a config.
fn reading(file: &Path) -> io::Result<Detached<Result<Config, BadInput>>> {
    let (named, file) = (format!("reading {}", file.display()), file.to_path_buf());
    Detached::begin("flexid-config", named, move || Config::load_live(&file))
}

/// Connects the signals, the service manager and the daemon.
pub(crate) struct Service<'a> {
    /// Config with which the daemon has begun.
    pub(crate) config: &'a Config,
    pub(crate) signals: Signals,
    pub(crate) stop: &'a Stop,
    pub(crate) reload: &'a Reload,
    pub(crate) store: Option<&'a Store>,
}

impl Service<'_> {
    /// Carries out what the signals request, until the daemon stops.
    pub(crate) fn attend(&self) {
        notify(&[NotifyState::Ready]);
        let mut read: Option<Detached<_>> = None;
        let mut reloading = false;
        while !self.stop.requested() && !self.signals.end.requested() {
            if read.is_none() && self.signals.again.swap(false, Ordering::Relaxed) {
                reloading = true;
                notify_reloading();
                read = or_old(reading(&self.config.file));
            }
            match read.as_mut().map(|read| read.wait(LOOK)) {
                None => thread::sleep(LOOK),
                Some(Ok(None)) => {}
                Some(done) => {
                    read = None;
                    if let Some(config) = or_old(done).flatten().and_then(or_old) {
                        self.offer(config);
                    }
                }
            }
            if reloading && read.is_none() && !self.reload.is_pending() {
                reloading = false;
                notify(&[NotifyState::Ready]);
            }
        }
        notify(&[NotifyState::Stopping]);
        self.stop.request();
    }

    /// Offers a config that was read again to the daemon.
    fn offer(&self, mut config: Config) {
        if or_old(history::folder(&config, self.store)).is_none() {
            return;
        }
        let begun = self.config;
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

/// Names an error in the log, with which the daemon keeps the old config.
fn or_old<T>(read: Result<T, impl Display>) -> Option<T> {
    read.inspect_err(|error| warn!("goes on with the old config: {error}")).ok()
}

fn notify_reloading() {
    // Newer versions of systemd require the time with it.
    let time = NotifyState::monotonic_usec_now();
    let states: Vec<_> = std::iter::once(NotifyState::Reloading).chain(time).collect();
    notify(&states);
}
