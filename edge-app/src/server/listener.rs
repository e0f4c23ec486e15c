//! A listening socket: a Unix socket, which makes and removes its file, or a TCP port of the loopback interface.

use std::fs::{self, Permissions};
use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt, chown};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

use flexid_pipeline::config::{Listen, SocketAccess};
use nix::sys::socket::getsockopt;
use nix::sys::socket::sockopt::PeerCredentials;
use nix::unistd::Group;
use socket2::{Domain, SockAddr, Socket, Type};

use super::slots::Peer;

/// Why the daemon cannot listen on an address.
#[derive(Debug, thiserror::Error)]
pub enum BindError {
    /// Another daemon answers on the address.
    #[error("{0}: somebody listens there already: stop it, or name another address")]
    InUse(Listen),
    /// The path belongs to a file of another kind.
    #[error("{}: is there already and is no socket: name another path", .0.display())]
    NoSocket(PathBuf),
    /// The group that may connect does not exist.
    #[error(
        "socket_group is {0:?}: this machine has no such group; make it with `groupadd --system {0}`"
    )]
    NoGroup(String),
    /// The daemon may not give the socket to the group.
    #[error(
        "socket_group is {group:?}: the daemon may not give its socket to it ({error}); run the daemon as a member of it"
    )]
    NotInGroup {
        /// Name of the group.
        group: String,
        /// Error of the kernel.
        error: io::Error,
    },
    /// The folder does not exist, is not writable, or the system has no room.
    #[error("{address}: cannot be listened on: {error}")]
    Io {
        /// Address to listen on.
        address: Listen,
        /// Error of the kernel.
        error: io::Error,
    },
}

impl BindError {
    /// Returns whether only another address, or another name, mends it. If not, a later attempt may succeed: a folder may come, as that of a
    /// disk that is mounted late, and an interface may get its address.
    pub fn is_bad_input(&self) -> bool {
        use io::ErrorKind::{InvalidInput, NotADirectory, PermissionDenied};
        match self {
            Self::NoSocket(_) | Self::NoGroup(_) | Self::NotInGroup { .. } => true,
            Self::InUse(_) => false,
            Self::Io { error, .. } => {
                matches!(error.kind(), InvalidInput | NotADirectory | PermissionDenied)
            }
        }
    }
}

/// A socket that clients connect to.
#[derive(Debug)]
pub struct Listener {
    address: Listen,
    socket: Socket,
    /// Device and inode of a Unix socket's file. No other file has them while the socket is open.
    file: Option<[u64; 2]>,
    access: SocketAccess,
}

/// Number of connections that may wait to be accepted.
const BACKLOG: i32 = 128;

impl Listener {
    /// Listens on `address`. A Unix socket has the access of [`SocketAccess::default`].
    ///
    /// # Errors
    /// The errors are those of [`Listener::bind_for`].
    pub fn bind(address: &Listen) -> Result<Self, BindError> {
        Self::bind_for(address, &SocketAccess::default())
    }

    /// Listens on `address`. A Unix socket has the access `access`. The file of a Unix socket on which no process answers is
    /// replaced.
    ///
    /// # Errors
    /// The error names the address or the group, and the obstacle.
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
        // A port is free again as soon as its daemon is gone, which the standard library does, too.
        socket.set_reuse_address(domain != Domain::UNIX).map_err(io)?;
        socket.bind(&bound).map_err(|error| match error.kind() {
            io::ErrorKind::AddrInUse => BindError::InUse(address.clone()),
            _ => io(error),
        })?;
        let (address, file) = match address {
            Listen::Unix(path) => (address.clone(), identity(path)),
            // The kernel has replaced port 0 by a real one.
            Listen::Tcp(asked) => {
                let bound = socket.local_addr().map_err(io)?;
                (Listen::Tcp(bound.as_socket().unwrap_or(*asked)), None)
            }
        };
        let listener = Self { address, socket, file, access: access.clone() };
        if let Listen::Unix(path) = &listener.address {
            // No client can connect before the socket listens.
            admit(path, access, io)?;
        }
        listener.socket.listen(BACKLOG).map_err(io)?;
        listener.socket.set_nonblocking(true).map_err(io)?;
        Ok(listener)
    }

    /// Returns whether no client can come any more, since the file of the Unix socket was removed or replaced.
    pub(super) fn is_gone(&self) -> bool {
        match &self.address {
            Listen::Unix(path) => identity(path) != self.file,
            Listen::Tcp(_) => false,
        }
    }

    /// Listens anew on its address. This listener remains for the clients that have connected to it.
    pub(super) fn bind_again(&self) -> Result<Self, BindError> {
        Self::bind_for(&self.address, &self.access)
    }

    /// Returns the address on which it listens.
    pub fn address(&self) -> &Listen {
        &self.address
    }

    /// Accepts the next client. Returns its socket and its origin. The error is `WouldBlock` if there is no client.
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
            // The file of a successor stays.
            if self.file.is_some() && self.file == identity(path) {
                // There is no remedy for a file that cannot be removed.
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

/// Returns device and inode of a file, or `None` if there is no file.
fn identity(path: &Path) -> Option<[u64; 2]> {
    let metadata = fs::symlink_metadata(path).ok()?;
    Some([metadata.dev(), metadata.ino()])
}

/// Sets group and mode of a Unix socket's file, which determine who may connect.
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

    /// The mode does not depend on the umask. It is 0660 unless another mode is given.
    #[test]
    fn group_and_mode_are_as_configured() {
        let folder = tempfile::tempdir().unwrap();
        let address = Listen::Unix(folder.path().join("a.sock"));
        let path = folder.path().join("a.sock");
        drop(Listener::bind(&address).unwrap());
        let listener = Listener::bind(&address).unwrap();
        assert_eq!(mode(&path), 0o660);
        drop(listener);

        // Any user may set the group that the file has already.
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

    /// The file of the first socket was removed, and a successor listens under the same name.
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
        // The standard library leaves the file behind, as a daemon that was killed does.
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
    fn a_place_that_may_come_is_no_bad_input() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("file"), "").unwrap();
        let at = |path: &str| Listen::Unix(folder.path().join(path));
        // TEST-NET-1 is no address of any machine.
        let foreign = Listen::Tcp("192.0.2.1:80".parse().unwrap());
        let longest = "a".repeat(200);
        for (address, is_bad_input) in [
            (at("late/a.sock"), false),
            (foreign, false),
            (at("file/a.sock"), true),
            (at(&longest), true),
        ] {
            let error = Listener::bind(&address).unwrap_err();
            assert_eq!(error.is_bad_input(), is_bad_input, "{error}");
        }
    }

    #[test]
    fn a_port_in_use_is_named() {
        let any = Listen::Tcp("127.0.0.1:0".parse().unwrap());
        let first = Listener::bind(&any).unwrap();
        assert_ne!(*first.address(), any);
        assert!(matches!(Listener::bind(first.address()), Err(BindError::InUse(_))));
    }
}
