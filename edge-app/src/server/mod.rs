//! Serves the latest messages to clients on this machine. Each client has a thread of its own, and no client blocks another.

mod client;
mod listener;
mod slots;

use std::io::{self, ErrorKind};
use std::os::fd::AsFd;
use std::sync::{Mutex, PoisonError};
use std::thread::{self, Scope};
use std::time::{Duration, Instant};

use flexid_pipeline::stop::Stop;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use tracing::{debug, warn};

use crate::latest::Latest;
use crate::tally::{Line, Tally};
use crate::threads::no_thread;

pub use listener::{BindError, Listener};
pub use slots::MAX_CLIENTS;
use slots::Slots;

/// Interval at which threads check the stop switch.
const LOOK: Duration = Duration::from_millis(200);

/// Trouble with a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Event {
    /// It cannot be accepted, or has no thread.
    NotAccepted,
    /// It is refused, since there is no slot.
    Refused,
    /// It does not keep to the protocol.
    Dropped,
    /// No client can come, since the socket's file is gone and cannot be made again.
    NoSocket,
}

/// Log of the troubles.
#[derive(Debug, Default)]
struct Events(Mutex<Tally<Event>>);

impl Events {
    /// Logs a trouble that `text` describes, or counts it.
    fn note(&self, event: Event, text: String) {
        let line = self.with(|tally| tally.line(event, Line::Warning(text), Instant::now()));
        line.iter().for_each(Line::log);
    }

    /// Logs the counts that are a minute old.
    fn log_counts(&self) {
        self.with(|tally| tally.counts(Instant::now())).iter().for_each(Line::log);
    }

    fn with<T>(&self, work: impl FnOnce(&mut Tally<Event>) -> T) -> T {
        // The tally is whole between any two statements, so that a panic leaves it valid.
        work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Serves every client that connects to `listeners` until `stop` is set. Returns once no message will follow and every
/// client has read the latest ones or is gone.
///
/// # Errors
/// The system cannot start a thread. `stop` is requested then.
pub fn serve(listeners: &[Listener], latest: &Latest, stop: &Stop) -> io::Result<()> {
    let (slots, events) = (Slots::default(), Events::default());
    thread::scope(|scope| {
        for listener in listeners {
            let (slots, events) = (&slots, &events);
            let thread = thread::Builder::new().name("flexid-accept".into());
            thread
                .spawn_scoped(scope, move || accept(scope, listener, latest, stop, slots, events))
                .inspect_err(|_| stop.request())
                .map_err(no_thread("flexid-accept"))?;
        }
        Ok(())
    })
}

fn accept<'scope>(
    scope: &'scope Scope<'scope, '_>,
    listener: &'scope Listener,
    latest: &'scope Latest,
    stop: &'scope Stop,
    slots: &'scope Slots,
    events: &'scope Events,
) {
    // A socket's file is removed or replaced by hand, or by a program that cleans up.
    let mut again = None;
    while !stop.requested() {
        events.log_counts();
        let listener = again.as_ref().unwrap_or(listener);
        if listener.is_gone() {
            match listener.bind_again() {
                Ok(new) => {
                    warn!(
                        "{}: the socket's file was removed or replaced: made again",
                        new.address()
                    );
                    again = Some(new);
                }
                Err(error) => {
                    events.note(Event::NoSocket, error.to_string());
                    thread::sleep(LOOK);
                }
            }
            continue;
        }
        let address = listener.address().clone();
        let mut waiting = [PollFd::new(listener.as_fd(), PollFlags::POLLIN)];
        let timeout = PollTimeout::try_from(LOOK).unwrap_or(PollTimeout::MAX);
        if !matches!(poll(&mut waiting, timeout), Ok(1..)) {
            continue;
        }
        let (socket, peer) = match listener.accept() {
            Ok(accepted) => accepted,
            // The client went away again.
            Err(error) if error.kind() == ErrorKind::WouldBlock => continue,
            Err(error) => {
                let text = format!("{address}: a client cannot be accepted: {error}");
                events.note(Event::NotAccepted, text);
                thread::sleep(LOOK);
                continue;
            }
        };
        let Some(slot) = slots.take(peer) else {
            let reason = client::turn_away(socket);
            events.note(Event::Refused, format!("{address}: a client was refused: {reason}"));
            continue;
        };
        let spawned =
            thread::Builder::new().name("flexid-client".into()).spawn_scoped(scope, move || {
                match client::serve(socket, latest, stop, &slot) {
                    Ok(()) => debug!("{address}: a client has gone"),
                    Err(end) => {
                        events.note(
                            Event::Dropped,
                            format!("{address}: a client was dropped: {end}"),
                        );
                    }
                }
            });
        if let Err(error) = spawned {
            let address = listener.address();
            events.note(Event::NotAccepted, format!("{address}: no thread for a client: {error}"));
        }
    }
}
