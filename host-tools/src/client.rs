//! A client of the daemon: connects, says Hello, and takes its messages.

use std::io::{self, ErrorKind, Read, Write};
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use flexid_edge::config::{Listen, ListenError};
use flexid_wire::framing::{Decoder, FRAME_BUFFER, FrameError, encode};
use flexid_wire::messages::{FromEdge, Hello, ToEdge};
use socket2::{Domain, SockAddr, Socket, Type};

/// A daemon that is alive takes a client and answers its Hello within this time.
const PATIENCE: Duration = Duration::from_secs(5);
/// A daemon that is not there yet is looked for this often.
const RETRY: Duration = Duration::from_millis(100);

/// Why a daemon cannot be listened to.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// Nobody there.
    #[error(
        "{address}: nobody listens there ({error}): is flexid-edge running, with this address in its [server] listen?"
    )]
    Nobody {
        /// Where.
        address: Listen,
        /// What the kernel says.
        error: io::Error,
    },
    /// The socket's file is another group's.
    #[error(
        "{address}: this user may not connect ({error}): join the group that `ls -l` shows for the socket, or have the daemon's [server] socket_group and socket_mode changed"
    )]
    NotAllowed {
        /// Where.
        address: Listen,
        /// What the kernel says.
        error: io::Error,
    },
    /// The daemon does not want this client.
    #[error("{address}: the daemon refuses: {reason}")]
    Refused {
        /// Where.
        address: Listen,
        /// In the daemon's words.
        reason: String,
    },
    /// What comes is not what a daemon says.
    #[error("{address}: {error}")]
    Protocol {
        /// Where.
        address: Listen,
        /// What is wrong with it.
        error: FrameError,
    },
    /// Something else answers there.
    #[error("{0}: somebody listens there but does not answer as flexid-edge: check the address")]
    Stranger(Listen),
    /// Nothing answers there.
    #[error(
        "{0}: somebody listens there but says nothing: check the address, or restart flexid-edge"
    )]
    Silent(Listen),
    /// The daemon is gone.
    #[error("{0}: the daemon hung up: it was stopped, or has failed; its log tells")]
    HungUp(Listen),
}

/// Reads the address of a daemon, on this machine or on another: whether it may be reached from there is the
/// daemon's to say.
///
/// # Errors
/// The forms there are.
pub fn address(text: &str) -> Result<Listen, ListenError> {
    let elsewhere = || text.strip_prefix("tcp:")?.parse().ok().map(Listen::Tcp);
    match Listen::parse(text, Path::new("")) {
        Err(ListenError::NotLoopback(text)) => elsewhere().ok_or(ListenError::Form(text)),
        parsed => parsed,
    }
}

/// A connection that both sides have agreed on.
#[derive(Debug)]
pub struct Client {
    address: Listen,
    socket: Socket,
    decoder: Box<Decoder>,
}

impl Client {
    /// Connects to the daemon at `address`. With a `deadline`, a daemon that is not there is waited for, and
    /// nothing takes longer.
    ///
    /// # Errors
    /// Nobody listens there, or it is not a daemon of this version.
    pub fn connect(address: &Listen, deadline: Option<Instant>) -> Result<Self, ClientError> {
        let left = || match deadline {
            Some(end) => end.saturating_duration_since(Instant::now()).min(PATIENCE),
            None => PATIENCE,
        };
        let socket = loop {
            match connect(address, left()) {
                Ok(socket) => break socket,
                Err(error) if error.kind() == ErrorKind::PermissionDenied => {
                    return Err(ClientError::NotAllowed { address: address.clone(), error });
                }
                Err(error) => {
                    let absent =
                        matches!(error.kind(), ErrorKind::NotFound | ErrorKind::ConnectionRefused);
                    if !(absent && deadline.is_some() && left() > RETRY) {
                        return Err(ClientError::Nobody { address: address.clone(), error });
                    }
                    thread::sleep(RETRY);
                }
            }
        };
        let mut client =
            Self { address: address.clone(), socket, decoder: Box::new(Decoder::new()) };
        client.say_hello().map_err(|_| ClientError::HungUp(address.clone()))?;
        let refused = |reason| ClientError::Refused { address: address.clone(), reason };
        match client.next(left())? {
            Some(FromEdge::Hello(hello)) if hello.refusal().is_none() => Ok(client),
            Some(FromEdge::Hello(hello)) => Err(refused(format!(
                "{} is of another version: install matching versions",
                hello.software
            ))),
            Some(FromEdge::Refused(refusal)) => Err(refused(refusal.reason.to_string())),
            Some(_) => Err(ClientError::Stranger(address.clone())),
            None => Err(ClientError::Silent(address.clone())),
        }
    }

    /// The next message; `None` when none comes within `timeout`.
    ///
    /// # Errors
    /// The daemon hung up, or talks rubbish.
    pub fn next(&mut self, timeout: Duration) -> Result<Option<FromEdge>, ClientError> {
        let hung_up = || ClientError::HungUp(self.address.clone());
        // Zero would wait for ever.
        let timeout = timeout.max(Duration::from_millis(1));
        self.socket.set_read_timeout(Some(timeout)).map_err(|_| hung_up())?;
        loop {
            let protocol = |error| ClientError::Protocol { address: self.address.clone(), error };
            if let Some(message) = self.decoder.next().map_err(protocol)? {
                return Ok(Some(message));
            }
            match self.socket.read(self.decoder.space()) {
                Ok(0) => return Err(hung_up()),
                Ok(bytes) => self.decoder.advance(bytes),
                Err(error) => match error.kind() {
                    ErrorKind::WouldBlock | ErrorKind::TimedOut => return Ok(None),
                    ErrorKind::Interrupted => {}
                    _ => return Err(hung_up()),
                },
            }
        }
    }

    fn say_hello(&mut self) -> io::Result<()> {
        let mut buffer = [0; FRAME_BUFFER];
        let hello = ToEdge::Hello(Hello::new(concat!("flexid ", env!("CARGO_PKG_VERSION"))));
        let bytes = encode(&hello, &mut buffer).map_err(io::Error::other)?;
        self.socket.write_all(bytes)
    }
}

fn connect(address: &Listen, timeout: Duration) -> io::Result<Socket> {
    let (domain, address) = match address {
        Listen::Unix(path) => (Domain::UNIX, SockAddr::unix(path)?),
        Listen::Tcp(address) => (Domain::for_address(*address), SockAddr::from(*address)),
    };
    let socket = Socket::new(domain, Type::STREAM, None)?;
    // Zero is no timeout that a socket takes.
    socket.connect_timeout(&address, timeout.max(Duration::from_millis(1)))?;
    Ok(socket)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_daemon_elsewhere_is_the_daemons_matter() {
        for text in ["unix:a.sock", "tcp:127.0.0.1:7000", "tcp:10.0.0.1:1", "tcp:[2001:db8::1]:1"] {
            assert_eq!(address(text).unwrap().to_string(), text);
        }
        for text in ["", "tcp:", "tcp:10.0.0.1", "udp:10.0.0.1:1"] {
            assert!(matches!(address(text), Err(ListenError::Form(_))), "{text}");
        }
    }
}
