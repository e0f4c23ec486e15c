//! Signals to the daemon, and messages to the service manager.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, TryRecvError, bounded};
use flexid_edge::reload::Reload;
use flexid_edge::threads::no_thread;
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
        let reading = Reading::begin(file)?;
        while !self.end.requested() {
            match reading.0.recv_timeout(LOOK) {
                Err(RecvTimeoutError::Timeout) => {}
                read => return Ok(Some(read??)),
            }
        }
        Ok(None)
    }
}

/// A config that is being read, by a thread of its own: a file system that hangs may hold it up for ever. The end of the program
/// does not wait for it.
struct Reading(Receiver<Result<Config, BadInput>>);

impl Reading {
    fn begin(file: &Path) -> io::Result<Self> {
        let (sender, receiver) = bounded(1);
        let file = file.to_path_buf();
        let thread = thread::Builder::new().name("flexid-config".into());
        let spawned = thread.spawn(move || {
            // Nobody waits for it any more after the end.
            let _ = sender.send(Config::load(&file));
        });
        spawned.map(|_| Self(receiver)).map_err(no_thread("flexid-config"))
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
        let mut reading: Option<Reading> = None;
        let mut reloading = false;
        while !self.stop.requested() && !self.signals.end.requested() {
            if reading.is_none() && self.signals.again.swap(false, Ordering::Relaxed) {
                reloading = true;
                notify_reloading();
                reading = Reading::begin(&self.config.file)
                    .inspect_err(|error| warn!("goes on with the old config: {error}"))
                    .ok();
            }
            match reading.as_ref().map(|reading| reading.0.try_recv()) {
                Some(Ok(read)) => {
                    self.offer(read);
                    reading = None;
                }
                Some(Err(TryRecvError::Disconnected)) => reading = None,
                Some(Err(TryRecvError::Empty)) | None => {}
            }
            if reloading && reading.is_none() && !self.reload.is_pending() {
                reloading = false;
                notify(&[NotifyState::Ready]);
            }
            thread::sleep(LOOK);
        }
        notify(&[NotifyState::Stopping]);
        self.stop.request();
    }

    /// Offers a config that was read again to the daemon. A bad file is named in the log, and the daemon keeps the old config.
    fn offer(&self, read: Result<Config, BadInput>) {
        let begun = self.config;
        let mut config = match read {
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
