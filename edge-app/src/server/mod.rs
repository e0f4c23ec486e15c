//! Serves the latest messages to clients on this machine. Each client has a thread of its own, and no client blocks another.

mod client;
mod listener;
mod slots;

use std::io::{self, ErrorKind};
use std::os::fd::AsFd;
use std::thread::{self, Scope};
use std::time::Duration;

use flexid_pipeline::stop::Stop;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use tracing::{debug, warn};

use crate::latest::Latest;

pub use listener::{BindError, Listener};
use slots::Slots;

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
    let slots = Slots::default();
    thread::scope(|scope| {
        for listener in listeners {
            let slots = &slots;
            let thread = thread::Builder::new().name("flexid-accept".into());
            thread
                .spawn_scoped(scope, move || accept(scope, listener, latest, stop, slots))
                .inspect_err(|_| stop.request())?;
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
) {
    while !stop.requested() {
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
                warn!("{}: a client cannot be accepted: {error}", listener.address());
                thread::sleep(LOOK);
                continue;
            }
        };
        let Some(slot) = slots.take(peer) else {
            client::turn_away(socket);
            continue;
        };
        let spawned =
            thread::Builder::new().name("flexid-client".into()).spawn_scoped(scope, move || {
                match client::serve(socket, latest, stop, &slot) {
                    Ok(()) => debug!("{}: a client has gone", listener.address()),
                    // The client has got the reason. Many clients must not flood the log.
                    Err(end) => debug!("{}: a client was dropped: {end}", listener.address()),
                }
            });
        if let Err(error) = spawned {
            warn!("{}: no thread for a client: {error}", listener.address());
        }
    }
}
