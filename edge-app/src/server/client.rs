//! Serves one client: the exchange of Hellos, then the latest messages as fast as the client reads.

use std::io::{self, ErrorKind, Read, Write};
use std::net::Shutdown;
use std::os::fd::AsFd;
use std::time::{Duration, Instant};

use flexid_pipeline::stop::Stop;
use flexid_wire::framing::{self, Decoder, FRAME_BUFFER, FrameError};
use flexid_wire::messages::{FromEdge, Hello, Refusal, ToEdge};
use flexid_wire::text::clipped;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use socket2::Socket;

use super::LOOK;
use super::slots::{MAX_CLIENTS, Slot};
use crate::latest::Latest;

/// Name and version of the daemon.
const SOFTWARE: &str = concat!("flexid-edge ", env!("CARGO_PKG_VERSION"));
/// Longest time until a client's Hello.
const HELLO: Duration = Duration::from_secs(5);
/// Longest time that a client may need to take a message.
const TAKE: Duration = Duration::from_secs(2);

/// Why a client is no longer served.
#[derive(Debug, thiserror::Error)]
pub(super) enum Dropped {
    #[error("it said no Hello within {} s", HELLO.as_secs())]
    NoHello,
    #[error("{0}")]
    Mismatch(String),
    #[error("{0}")]
    Rubbish(FrameError),
    #[error("it talks after its Hello, which this protocol has no use for")]
    Talks,
    #[error("it took no message for {} s", TAKE.as_secs())]
    TakesNothing,
    #[error(
        "all {MAX_CLIENTS} slots are taken, and its peer holds most of them: another peer gets this one"
    )]
    Evicted,
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// Serves one client until it goes, or until it has read all messages and none will follow. A client that does not keep to the
/// protocol gets the reason and is dropped.
pub(super) fn serve(
    mut socket: Socket,
    latest: &Latest,
    stop: &Stop,
    slot: &Slot,
) -> Result<(), Dropped> {
    let served = talk(&mut socket, latest, stop, slot);
    match &served {
        Err(Dropped::Io(error)) if hung_up(error) => return Ok(()),
        Ok(()) | Err(Dropped::TakesNothing | Dropped::Io(_)) => {}
        Err(reason) => refuse(&mut socket, Refusal { reason: clipped(reason) }),
    }
    served
}

fn talk(socket: &mut Socket, latest: &Latest, stop: &Stop, slot: &Slot) -> Result<(), Dropped> {
    socket.set_write_timeout(Some(TAKE))?;
    if !greet(socket, stop, slot)? {
        return Ok(());
    }
    let mut seen = 0;
    while let Some(news) = latest.news(&mut seen, LOOK) {
        for message in news {
            send(socket, &message)?;
        }
        if has_gone(socket)? {
            break;
        }
        if slot.is_evicted() {
            return Err(Dropped::Evicted);
        }
    }
    Ok(())
}

/// Refuses a client, since there are too many of them. Returns the reason.
pub(super) fn turn_away(mut socket: Socket) -> impl std::fmt::Display {
    let reason = clipped(format_args!("{MAX_CLIENTS} clients are served already: close one"));
    // A new connection has room for one message. The daemon does not check that it arrives.
    if socket.set_nonblocking(true).is_ok() {
        let _ = send(&mut socket, &FromEdge::Refused(Refusal { reason: reason.clone() }));
    }
    reason
}

/// Exchanges Hellos. Returns false if there is no client to serve.
fn greet(socket: &mut Socket, stop: &Stop, slot: &Slot) -> Result<bool, Dropped> {
    let deadline = Instant::now() + HELLO;
    let mut decoder = Decoder::new();
    loop {
        match decoder.next::<ToEdge>().map_err(Dropped::Rubbish)? {
            Some(ToEdge::Hello(hello)) => {
                if let Some(refusal) = hello.refusal() {
                    return Err(Dropped::Mismatch(refusal.reason.to_string()));
                }
                send(socket, &FromEdge::Hello(Hello::new(SOFTWARE)))?;
                return Ok(true);
            }
            None if stop.requested() => return Ok(false),
            None if slot.is_evicted() => return Err(Dropped::Evicted),
            None if Instant::now() >= deadline => return Err(Dropped::NoHello),
            None => {}
        }
        socket.set_read_timeout(Some(LOOK))?;
        match socket.read(decoder.space()) {
            Ok(0) => return Ok(false),
            Ok(bytes) => decoder.advance(bytes),
            Err(error) if passing(&error) => {}
            Err(error) => return Err(error.into()),
        }
    }
}

fn send(socket: &mut Socket, message: &FromEdge) -> Result<(), Dropped> {
    let mut buffer = [0; FRAME_BUFFER];
    let frame = framing::encode(message, &mut buffer).map_err(Dropped::Rubbish)?;
    socket.write_all(frame).map_err(|error| match error.kind() {
        ErrorKind::WouldBlock | ErrorKind::TimedOut => Dropped::TakesNothing,
        _ => error.into(),
    })
}

/// Returns whether the client has closed. A client must not send anything after its Hello.
fn has_gone(socket: &mut Socket) -> Result<bool, Dropped> {
    let mut waiting = [PollFd::new(socket.as_fd(), PollFlags::POLLIN)];
    if !matches!(poll(&mut waiting, PollTimeout::ZERO), Ok(1..)) {
        return Ok(false);
    }
    match socket.read(&mut [0; 64]) {
        Ok(0) => Ok(true),
        Ok(_) => Err(Dropped::Talks),
        Err(error) if passing(&error) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

/// Sends the reason, and leaves the client a moment to read it. A socket that is closed with unread bytes may lose the answer.
fn refuse(socket: &mut Socket, refusal: Refusal) {
    if send(socket, &FromEdge::Refused(refusal)).is_err()
        || socket.shutdown(Shutdown::Write).is_err()
    {
        return;
    }
    let deadline = Instant::now() + LOOK;
    while Instant::now() < deadline && !matches!(socket.read(&mut [0; 1024]), Ok(0) | Err(_)) {}
}

/// Returns whether the client went in the middle of a message, which is allowed.
fn hung_up(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::BrokenPipe | ErrorKind::ConnectionReset)
}

fn passing(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}
