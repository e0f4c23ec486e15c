//! Serves the board to clients on this machine: one thread for each, none of which can hold up another.

mod client;
mod listener;

use std::io::{self, ErrorKind};
use std::os::fd::AsFd;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::{self, Scope};
use std::time::Duration;

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use tracing::{debug, warn};

use crate::board::Board;
use crate::stop::Stop;

pub use listener::{BindError, Listener};

/// Most clients at a time; one more is refused.
pub const MAX_CLIENTS: usize = 16;
/// Threads look at the stop switch this often.
const LOOK: Duration = Duration::from_millis(200);

/// Serves everybody who connects to `listeners` until `stop`; returns once the board is closed and everybody
/// has read it or is gone.
///
/// # Errors
/// The system gave no thread; then `stop` is requested.
pub fn serve(listeners: &[Listener], board: &Board, stop: &Stop) -> io::Result<()> {
    let clients = AtomicUsize::new(0);
    thread::scope(|scope| {
        for listener in listeners {
            let clients = &clients;
            let thread = thread::Builder::new().name("flexid-accept".into());
            thread
                .spawn_scoped(scope, move || accept(scope, listener, board, stop, clients))
                .inspect_err(|_| stop.request())?;
        }
        Ok(())
    })
}

fn accept<'scope>(
    scope: &'scope Scope<'scope, '_>,
    listener: &'scope Listener,
    board: &'scope Board,
    stop: &'scope Stop,
    clients: &'scope AtomicUsize,
) {
    while !stop.requested() {
        let mut waiting = [PollFd::new(listener.as_fd(), PollFlags::POLLIN)];
        let timeout = PollTimeout::try_from(LOOK).unwrap_or(PollTimeout::MAX);
        if !matches!(poll(&mut waiting, timeout), Ok(1..)) {
            continue;
        }
        let socket = match listener.accept() {
            Ok(socket) => socket,
            // It went away again.
            Err(error) if error.kind() == ErrorKind::WouldBlock => continue,
            Err(error) => {
                warn!("{}: a client cannot be accepted: {error}", listener.address());
                thread::sleep(LOOK);
                continue;
            }
        };
        if clients.fetch_add(1, Ordering::Relaxed) >= MAX_CLIENTS {
            clients.fetch_sub(1, Ordering::Relaxed);
            client::turn_away(socket);
            continue;
        }
        let spawned =
            thread::Builder::new().name("flexid-client".into()).spawn_scoped(scope, || {
                match client::serve(socket, board, stop) {
                    Ok(()) => debug!("{}: a client has gone", listener.address()),
                    // It has been told itself; a crowd of clients shall not flood the log.
                    Err(end) => debug!("{}: a client was dropped: {end}", listener.address()),
                }
                clients.fetch_sub(1, Ordering::Relaxed);
            });
        if let Err(error) = spawned {
            clients.fetch_sub(1, Ordering::Relaxed);
            warn!("{}: no thread for a client: {error}", listener.address());
        }
    }
}
