//! A client of the daemon: connects, says Hello, and takes its messages.

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::os::unix::net::UnixStream;
use std::time::Duration;

use flexid_edge::config::Listen;
use flexid_wire::framing::{Decoder, FRAME_BUFFER, FrameError, encode};
use flexid_wire::messages::{FromEdge, Hello, ToEdge};

/// A daemon that is alive answers a Hello within this time.
const PATIENCE: Duration = Duration::from_secs(5);

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
    /// Something else answers there, or nothing.
    #[error("{0}: somebody listens there but does not answer as flexid-edge: check the address")]
    Stranger(Listen),
    /// The daemon is gone.
    #[error("{0}: the daemon hung up: it was stopped, or has failed; its log tells")]
    HungUp(Listen),
}

/// Where the bytes come from.
#[derive(Debug)]
enum Socket {
    Unix(UnixStream),
    Tcp(TcpStream),
}

/// A connection that both sides have agreed on.
#[derive(Debug)]
pub struct Client {
    address: Listen,
    socket: Socket,
    decoder: Box<Decoder>,
}

impl Client {
    /// Connects to the daemon at `address`.
    ///
    /// # Errors
    /// Nobody listens there, or it is not a daemon of this version.
    pub fn connect(address: &Listen) -> Result<Self, ClientError> {
        let nobody = |error| ClientError::Nobody { address: address.clone(), error };
        let socket = match address {
            Listen::Unix(path) => UnixStream::connect(path).map(Socket::Unix),
            Listen::Tcp(address) => TcpStream::connect(address).map(Socket::Tcp),
        };
        let mut client = Self {
            address: address.clone(),
            socket: socket.map_err(nobody)?,
            decoder: Box::new(Decoder::new()),
        };
        client.say_hello().map_err(|_| ClientError::HungUp(address.clone()))?;
        match client.next(PATIENCE)? {
            Some(FromEdge::Hello(hello)) => match hello.refusal() {
                None => Ok(client),
                Some(_) => Err(ClientError::Refused {
                    address: address.clone(),
                    reason: format!(
                        "{} is of another version: install matching versions",
                        hello.software
                    ),
                }),
            },
            Some(FromEdge::Refused(refusal)) => Err(ClientError::Refused {
                address: address.clone(),
                reason: refusal.reason.to_string(),
            }),
            _ => Err(ClientError::Stranger(address.clone())),
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
        match &self.socket {
            Socket::Unix(socket) => socket.set_read_timeout(Some(timeout)),
            Socket::Tcp(socket) => socket.set_read_timeout(Some(timeout)),
        }
        .map_err(|_| hung_up())?;
        loop {
            let protocol = |error| ClientError::Protocol { address: self.address.clone(), error };
            if let Some(message) = self.decoder.next().map_err(protocol)? {
                return Ok(Some(message));
            }
            let space = self.decoder.space();
            let read = match &mut self.socket {
                Socket::Unix(socket) => socket.read(space),
                Socket::Tcp(socket) => socket.read(space),
            };
            match read {
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
        match &mut self.socket {
            Socket::Unix(socket) => socket.write_all(bytes),
            Socket::Tcp(socket) => socket.write_all(bytes),
        }
    }
}
