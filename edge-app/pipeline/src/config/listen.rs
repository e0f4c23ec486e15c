//! Addresses on which the daemon listens: `unix:PATH` or `tcp:127.0.0.1:PORT`.

use std::fmt;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

/// An address to listen on, or to connect to.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Listen {
    /// A Unix socket at this path.
    Unix(PathBuf),
    /// A TCP port of the loopback interface.
    Tcp(SocketAddr),
}

/// Access to a Unix socket: mode and group of its file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SocketAccess {
    /// Permissions of the file. A client needs write permission to connect.
    pub mode: u32,
    /// Name of the file's group. `None` keeps the daemon's own group.
    pub group: Option<String>,
}

impl Default for SocketAccess {
    fn default() -> Self {
        Self { mode: 0o660, group: None }
    }
}

impl SocketAccess {
    /// Checks the keys `socket_mode` and `socket_group` of the section `[server]`.
    pub(super) fn new(mode: Option<u32>, group: Option<String>) -> Result<Self, String> {
        let access = Self { mode: mode.unwrap_or(Self::default().mode), group };
        // 660 without its prefix is 0o1224. The owner must be able to connect: the owner's next daemon tests whether this one
        // still answers.
        if access.mode > 0o777 || access.mode & 0o200 == 0 {
            return Err(format!(
                "[server] socket_mode is 0o{:o}: write three octal digits that let the owner write, like 0o660",
                access.mode
            ));
        }
        if access.group.as_deref().is_some_and(|name| name.is_empty() || name.contains(['\0', ':']))
        {
            return Err(
                "[server] socket_group is no name of a group: leave it out for the daemon's own"
                    .into(),
            );
        }
        Ok(access)
    }
}

/// Why an address is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ListenError {
    /// The address begins with neither `unix:` nor `tcp:`, or what must follow is missing or wrong.
    #[error("{0:?} is no address: write \"unix:PATH\" or \"tcp:127.0.0.1:PORT\"")]
    Form(String),
    /// The address is reachable from other machines.
    #[error(
        "{0:?} is open to the network, and the protocol has no password: write \"tcp:127.0.0.1:PORT\""
    )]
    NotLoopback(String),
    /// The path is longer than the kernel accepts.
    #[error("{0:?} is too long for a Unix socket: at most 107 bytes")]
    TooLong(PathBuf),
}

/// Longest path that `sun_path` holds, bytes, without the closing zero.
const UNIX_PATH_BYTES: usize = 107;

impl Listen {
    /// Parses an address. A relative path of a Unix socket starts at `base`.
    ///
    /// # Errors
    /// The error names the address and the correction.
    pub fn parse(text: &str, base: &Path) -> Result<Self, ListenError> {
        let form = || ListenError::Form(text.to_string());
        match text.split_once(':') {
            Some(("unix", path)) if !path.is_empty() => {
                let path = base.join(path);
                if path.as_os_str().len() > UNIX_PATH_BYTES {
                    return Err(ListenError::TooLong(path));
                }
                Ok(Self::Unix(path))
            }
            Some(("tcp", address)) => {
                let address: SocketAddr = address.parse().map_err(|_| form())?;
                if !address.ip().is_loopback() {
                    return Err(ListenError::NotLoopback(text.to_string()));
                }
                Ok(Self::Tcp(address))
            }
            _ => Err(form()),
        }
    }
}

impl fmt::Display for Listen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unix(path) => write!(f, "unix:{}", path.display()),
            Self::Tcp(address) => write!(f, "tcp:{address}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_this_machine_is_listened_to() {
        let parse = |text: &str| Listen::parse(text, Path::new("/etc/flexid"));
        assert_eq!(parse("unix:a.sock"), Ok(Listen::Unix("/etc/flexid/a.sock".into())));
        assert_eq!(parse("unix:/run/a.sock"), Ok(Listen::Unix("/run/a.sock".into())));
        assert_eq!(parse("tcp:127.0.0.1:7000").unwrap().to_string(), "tcp:127.0.0.1:7000");
        assert!(matches!(parse("tcp:[::1]:7000"), Ok(Listen::Tcp(_))));
        assert!(matches!(parse("tcp:0.0.0.0:7000"), Err(ListenError::NotLoopback(_))));
        assert!(matches!(parse("tcp:10.0.0.1:7000"), Err(ListenError::NotLoopback(_))));
        for text in ["", "unix:", "tcp:", "tcp:localhost", "udp:127.0.0.1:1", "flexid.sock"] {
            assert!(matches!(parse(text), Err(ListenError::Form(_))), "{text:?}");
        }
        let long = format!("unix:/{}", "a".repeat(107));
        assert!(matches!(parse(&long), Err(ListenError::TooLong(_))));
    }
}
