//! A listening socket: a Unix socket whose file comes and goes with it, or a TCP port of the loopback.

use std::fs::{self, Permissions};
use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt, chown};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

use nix::sys::socket::getsockopt;
use nix::sys::socket::sockopt::PeerCredentials;
use nix::unistd::Group;
use socket2::{Domain, SockAddr, Socket, Type};

use super::places::Peer;
use crate::config::{Listen, SocketAccess};

/// Why an address cannot be listened on.
#[derive(Debug, thiserror::Error)]
pub enum BindError {
    /// Another daemon answers there.
    #[error("{0}: somebody listens there already: stop it, or name another address")]
    InUse(Listen),
    /// There is a file of another kind.
    #[error("{}: is there already and is no socket: name another path", .0.display())]
    NoSocket(PathBuf),
    /// The group that may connect is not there.
    #[error(
        "socket_group is {0:?}: this machine has no such group; make it with `groupadd --system {0}`"
    )]
    NoGroup(String),
    /// The daemon may not give the socket to the group.
    #[error(
        "socket_group is {group:?}: the daemon may not give its socket to it ({error}); run the daemon as a member of it"
    )]
    NotInGroup {
        /// Its name.
        group: String,
        /// What the kernel says.
        error: io::Error,
    },
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
    /// Device and inode of a Unix socket's file. While the socket is open no other file has them.
    file: Option<[u64; 2]>,
}

/// Connections that may wait to be accepted.
const BACKLOG: i32 = 128;

impl Listener {
    /// Listens on `address`, a Unix socket as [`SocketAccess::default`] says.
    ///
    /// # Errors
    /// As [`Listener::bind_for`].
    pub fn bind(address: &Listen) -> Result<Self, BindError> {
        Self::bind_for(address, &SocketAccess::default())
    }

    /// Listens on `address`; `access` says who may connect to a Unix socket. The file of a Unix socket that nobody
    /// answers on is replaced.
    ///
    /// # Errors
    /// The address, and what is in the way.
    pub fn bind_for(address: &Listen, access: &SocketAccess) -> Result<Self, BindError> {
        let io = |error| BindError::Io { address: address.clone(), error };
        let (domain, bound) = match address {
            Listen::Unix(path) => {
                remove_stale(address, path)?;
                (Domain::UNIX, SockAddr::unix(path).map_err(io)?)
            }
            Listen::Tcp(address) => (Domain::for_address(*address), SockAddr::from(*address)),
        };
        let socket = Socket::new(domain, Type::STREAM, None).map_err(io)?;
        // As the standard library does it: a port is free again as soon as its daemon is gone.
        socket.set_reuse_address(domain != Domain::UNIX).map_err(io)?;
        socket.bind(&bound).map_err(|error| match error.kind() {
            io::ErrorKind::AddrInUse => BindError::InUse(address.clone()),
            _ => io(error),
        })?;
        let (address, file) = match address {
            Listen::Unix(path) => (address.clone(), identity(path)),
            // Port 0 has become a real one.
            Listen::Tcp(asked) => {
                let bound = socket.local_addr().map_err(io)?;
                (Listen::Tcp(bound.as_socket().unwrap_or(*asked)), None)
            }
        };
        let listener = Self { address, socket, file };
        if let Listen::Unix(path) = &listener.address {
            // Nobody can connect before it listens.
            admit(path, access, io)?;
        }
        listener.socket.listen(BACKLOG).map_err(io)?;
        listener.socket.set_nonblocking(true).map_err(io)?;
        Ok(listener)
    }

    /// Where it listens.
    pub fn address(&self) -> &Listen {
        &self.address
    }

    /// The next client and where it comes from; `WouldBlock` when there is none.
    pub(super) fn accept(&self) -> io::Result<(Socket, Peer)> {
        let (socket, _) = self.socket.accept()?;
        socket.set_nonblocking(false)?;
        let peer = match self.address {
            Listen::Unix(_) => {
                let peer = getsockopt(&socket, PeerCredentials)?;
                Peer::Process { user: peer.uid(), process: peer.pid() }
            }
            Listen::Tcp(_) => Peer::Network,
        };
        Ok((socket, peer))
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        if let Listen::Unix(path) = &self.address {
            // A successor's file stays.
            if self.file.is_some() && self.file == identity(path) {
                // Nothing can be done about a file that does not go.
                let _ = fs::remove_file(path);
            }
        }
    }
}

impl AsFd for Listener {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

/// Device and inode of a file; `None` where there is none.
fn identity(path: &Path) -> Option<[u64; 2]> {
    let metadata = fs::symlink_metadata(path).ok()?;
    Some([metadata.dev(), metadata.ino()])
}

/// Gives a Unix socket's file the group and the mode that say who may connect.
fn admit(
    path: &Path,
    access: &SocketAccess,
    io: impl Fn(io::Error) -> BindError,
) -> Result<(), BindError> {
    if let Some(name) = &access.group {
        let group = Group::from_name(name).map_err(|error| io(error.into()))?;
        let group = group.ok_or_else(|| BindError::NoGroup(name.clone()))?;
        chown(path, None, Some(group.gid.as_raw()))
            .map_err(|error| BindError::NotInGroup { group: name.clone(), error })?;
    }
    fs::set_permissions(path, Permissions::from_mode(access.mode)).map_err(io)
}

fn remove_stale(address: &Listen, path: &Path) -> Result<(), BindError> {
    let Ok(metadata) = fs::symlink_metadata(path) else {
        return Ok(());
    };
    if !metadata.file_type().is_socket() {
        return Err(BindError::NoSocket(path.to_path_buf()));
    }
    match UnixStream::connect(path) {
        Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => {
            fs::remove_file(path).map_err(|error| BindError::Io { address: address.clone(), error })
        }
        Err(error) if error.kind() == io::ErrorKind::PermissionDenied => {
            Err(BindError::Io { address: address.clone(), error })
        }
        _ => Err(BindError::InUse(address.clone())),
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::net::UnixListener;

    use super::*;

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().permissions().mode() & 0o777
    }

    /// Whatever the umask, and 0660 unless another mode is asked for.
    #[test]
    fn group_and_mode_are_as_configured() {
        let folder = tempfile::tempdir().unwrap();
        let address = Listen::Unix(folder.path().join("a.sock"));
        let path = folder.path().join("a.sock");
        drop(Listener::bind(&address).unwrap());
        let listener = Listener::bind(&address).unwrap();
        assert_eq!(mode(&path), 0o660);
        drop(listener);

        // The group that the file has anyway may be asked for by anybody.
        let own = fs::metadata(folder.path()).unwrap().gid();
        let own = Group::from_gid(own.into()).unwrap().map(|group| group.name);
        let listener =
            Listener::bind_for(&address, &SocketAccess { mode: 0o600, group: own }).unwrap();
        assert_eq!(mode(&path), 0o600);
        drop(listener);

        let nobody = SocketAccess { mode: 0o660, group: Some("no-such-group".into()) };
        let error = Listener::bind_for(&address, &nobody).unwrap_err().to_string();
        assert!(error.contains("this machine has no such group"), "{error}");
        assert!(!path.exists(), "a socket of a daemon that did not start");
    }

    /// Its file was removed, and a successor listens under the same name.
    #[test]
    fn a_successors_socket_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.sock");
        let address = Listen::Unix(path.clone());
        let first = Listener::bind(&address).unwrap();
        fs::remove_file(&path).unwrap();
        let second = Listener::bind(&address).unwrap();
        drop(first);
        UnixStream::connect(&path).expect("the successor's socket is gone");
        drop(second);
        assert!(!path.exists());
    }

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
