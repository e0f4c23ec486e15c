//! A client of the daemon. It connects, sends Hello, and receives messages.

use std::io::{self, ErrorKind, Read, Write};
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use flexid_pipeline::config::{Listen, ListenError};
use flexid_wire::framing::{Decoder, FRAME_BUFFER, FrameError, encode};
use flexid_wire::messages::{FromEdge, Hello, ToEdge};
use socket2::{Domain, SockAddr, Socket, Type};

/// Time within which a running daemon accepts a client and answers its Hello.
const PATIENCE: Duration = Duration::from_secs(5);
/// Interval between two attempts to connect to a daemon that does not listen yet.
const RETRY: Duration = Duration::from_millis(100);

/// Error of a connection to a daemon.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// No daemon listens at the address.
    #[error(
        "{address}: nobody listens there ({error}): is flexid-edge running, with this address in its [server] listen?"
    )]
    Nobody {
        /// Address of the daemon.
        address: Listen,
        /// Error of the kernel.
        error: io::Error,
    },
    /// The socket's file belongs to another group.
    #[error(
        "{address}: this user may not connect ({error}): join the group that `ls -l` shows for the socket, or have the daemon's [server] socket_group and socket_mode changed"
    )]
    NotAllowed {
        /// Address of the daemon.
        address: Listen,
        /// Error of the kernel.
        error: io::Error,
    },
    /// The daemon refuses this client.
    #[error("{address}: the daemon refuses: {reason}")]
    Refused {
        /// Address of the daemon.
        address: Listen,
        /// Reason, in the daemon's words.
        reason: String,
    },
    /// The bytes received are no message of a daemon.
    #[error("{address}: {error}")]
    Protocol {
        /// Address of the daemon.
        address: Listen,
        /// Fault of the bytes.
        error: FrameError,
    },
    /// Another program answers at the address.
    #[error("{0}: somebody listens there but does not answer as flexid-edge: check the address")]
    Stranger(Listen),
    /// No answer comes from the address.
    #[error(
        "{0}: somebody listens there but says nothing: check the address, or restart flexid-edge"
    )]
    Silent(Listen),
    /// The daemon closed the connection.
    #[error("{0}: the daemon hung up: it was stopped, or has failed; see its log")]
    HungUp(Listen),
}

/// Reads the address of a daemon on this machine or on another. The daemon decides whether other machines may
/// connect.
///
/// # Errors
/// The text has none of the valid forms. The error lists them.
pub fn address(text: &str) -> Result<Listen, ListenError> {
    let elsewhere = || text.strip_prefix("tcp:")?.parse().ok().map(Listen::Tcp);
    match Listen::parse(text, Path::new("")) {
        Err(ListenError::NotLoopback(text)) => elsewhere().ok_or(ListenError::Form(text)),
        parsed => parsed,
    }
}

/// A connection after the exchange of Hello.
#[derive(Debug)]
pub struct Client {
    address: Listen,
    socket: Socket,
    decoder: Box<Decoder>,
}

impl Client {
    /// Connects to the daemon at `address`. With a `deadline`, it waits for a daemon that does not listen yet, and
    /// ends at the deadline.
    ///
    /// # Errors
    /// No daemon listens there, or it is not a daemon of this version.
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
    /// The daemon closed the connection, or sent an invalid message.
    pub fn next(&mut self, timeout: Duration) -> Result<Option<FromEdge>, ClientError> {
        let hung_up = || ClientError::HungUp(self.address.clone());
        // A timeout of zero would wait for ever.
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
    // A socket refuses a timeout of zero.
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
