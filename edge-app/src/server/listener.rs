//! A listening socket: a Unix socket whose file comes and goes with it, or a TCP port of the loopback.

use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::fs::FileTypeExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

use socket2::Socket;

use crate::config::Listen;

/// Why an address cannot be listened on.
#[derive(Debug, thiserror::Error)]
pub enum BindError {
    /// Another daemon answers there.
    #[error("{0}: somebody listens there already: stop it, or name another address")]
    InUse(Listen),
    /// There is a file of another kind.
    #[error("{}: is there already and is no socket: name another path", .0.display())]
    NoSocket(PathBuf),
    /// The folder is not there, or may not be written.
    #[error("{address}: cannot be listened on: {error}")]
    Io {
        /// The address.
        address: Listen,
        /// What the kernel says.
        error: io::Error,
    },
}

/// A socket that clients connect to.
#[derive(Debug)]
pub struct Listener {
    address: Listen,
    socket: Socket,
}

impl Listener {
    /// Listens on `address`. The file of a Unix socket that nobody answers on is replaced.
    ///
    /// # Errors
    /// The address, and what is in the way.
    pub fn bind(address: &Listen) -> Result<Self, BindError> {
        let io = |error| BindError::Io { address: address.clone(), error };
        let bound = match address {
            Listen::Unix(path) => {
                remove_stale(address, path)?;
                UnixListener::bind(path).map(Socket::from)
            }
            Listen::Tcp(address) => std::net::TcpListener::bind(address).map(Socket::from),
        };
        let socket = bound.map_err(|error| match error.kind() {
            io::ErrorKind::AddrInUse => BindError::InUse(address.clone()),
            _ => io(error),
        })?;
        socket.set_nonblocking(true).map_err(io)?;
        let address = match address {
            Listen::Unix(_) => address.clone(),
            // Port 0 has become a real one.
            Listen::Tcp(asked) => {
                let bound = socket.local_addr().map_err(io)?;
                Listen::Tcp(bound.as_socket().unwrap_or(*asked))
            }
        };
        Ok(Self { address, socket })
    }

    /// Where it listens.
    pub fn address(&self) -> &Listen {
        &self.address
    }

    /// The next client; `WouldBlock` when there is none.
    pub(super) fn accept(&self) -> io::Result<Socket> {
        let (socket, _) = self.socket.accept()?;
        socket.set_nonblocking(false)?;
        Ok(socket)
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        if let Listen::Unix(path) = &self.address {
            // Nothing can be done about a file that does not go.
            let _ = std::fs::remove_file(path);
        }
    }
}

impl AsFd for Listener {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

fn remove_stale(address: &Listen, path: &Path) -> Result<(), BindError> {
    let Ok(metadata) = std::fs::symlink_metadata(path) else {
        return Ok(());
    };
    if !metadata.file_type().is_socket() {
        return Err(BindError::NoSocket(path.to_path_buf()));
    }
    match UnixStream::connect(path) {
        Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => {
            std::fs::remove_file(path)
                .map_err(|error| BindError::Io { address: address.clone(), error })
        }
        _ => Err(BindError::InUse(address.clone())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_socket_that_nobody_answers_on_is_replaced_and_no_other_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.sock");
        let address = Listen::Unix(path.clone());
        // Closing leaves the file behind, as a daemon that was killed does.
        drop(UnixListener::bind(&path).unwrap());
        assert!(path.exists());
        let first = Listener::bind(&address).unwrap();
        let error = Listener::bind(&address).unwrap_err().to_string();
        assert!(
            error.ends_with("somebody listens there already: stop it, or name another address")
        );
        drop(first);
        assert!(!path.exists());

        std::fs::write(&path, "precious").unwrap();
        let error = Listener::bind(&address).unwrap_err().to_string();
        assert!(error.ends_with("is there already and is no socket: name another path"), "{error}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "precious");
    }

    #[test]
    fn a_port_in_use_is_named() {
        let any = Listen::Tcp("127.0.0.1:0".parse().unwrap());
        let first = Listener::bind(&any).unwrap();
        assert_ne!(*first.address(), any);
        assert!(matches!(Listener::bind(first.address()), Err(BindError::InUse(_))));
    }
}
