//! Serves the latest messages to clients on this machine. Each client has a thread of its own, and no client blocks another.

mod client;
mod listener;
mod slots;
mod tally;

use std::io::{self, ErrorKind};
use std::os::fd::AsFd;
use std::thread::{self, Scope};
use std::time::Duration;

use flexid_pipeline::stop::Stop;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use tracing::{debug, warn};

use crate::latest::Latest;
use crate::threads::no_thread;

pub use listener::{BindError, Listener};
use slots::Slots;
use tally::{Event, Tally};

/// Most clients at a time. A further client is refused, unless another peer holds more than its share.
pub const MAX_CLIENTS: usize = 16;
/// Interval at which threads check the stop switch.
const LOOK: Duration = Duration::from_millis(200);

/// Serves every client that connects to `listeners` until `stop` is set. Returns once no message will follow and every
/// client has read the latest ones or is gone.
///
/// # Errors
/// The system cannot start a thread. `stop` is requested then.
pub fn serve(listeners: &[Listener], latest: &Latest, stop: &Stop) -> io::Result<()> {
    let (slots, tally) = (Slots::default(), Tally::default());
    thread::scope(|scope| {
        for listener in listeners {
            let (slots, tally) = (&slots, &tally);
            let thread = thread::Builder::new().name("flexid-accept".into());
            thread
                .spawn_scoped(scope, move || accept(scope, listener, latest, stop, slots, tally))
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
    tally: &'scope Tally,
) {
    // A socket's file is removed by hand, or by a program that cleans up.
    let mut again = None;
    while !stop.requested() {
        tally.log_counts();
        let listener = again.as_ref().unwrap_or(listener);
        if listener.is_gone() {
            match listener.bind_again() {
                Ok(new) => {
                    warn!("{}: the socket's file was removed: made again", new.address());
                    again = Some(new);
                }
                Err(error) => {
                    tally.note(Event::NoSocket, error.to_string());
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
                tally.note(Event::NotAccepted, text);
                thread::sleep(LOOK);
                continue;
            }
        };
        let Some(slot) = slots.take(peer) else {
            let reason = client::turn_away(socket);
            tally.note(Event::Refused, format!("{address}: a client was refused: {reason}"));
            continue;
        };
        let spawned =
            thread::Builder::new().name("flexid-client".into()).spawn_scoped(scope, move || {
                match client::serve(socket, latest, stop, &slot) {
                    Ok(()) => debug!("{address}: a client has gone"),
                    Err(end) => {
                        tally.note(
                            Event::Dropped,
                            format!("{address}: a client was dropped: {end}"),
                        );
                    }
                }
            });
        if let Err(error) = spawned {
            let address = listener.address();
            tally.note(Event::NotAccepted, format!("{address}: no thread for a client: {error}"));
        }
    }
}
