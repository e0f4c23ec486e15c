//! The demo's bus: a real virtual CAN bus where the kernel has one, else a socket pair with the same frames.

use std::fs;
use std::os::fd::OwnedFd;
use std::process::{Command, Stdio};

use anyhow::{Context as _, Result, ensure};
use flexid_pipeline::source::CanSocket;
use nix::sched::{CloneFlags, unshare};
use nix::sys::socket::{AddressFamily, SockFlag, SockType, socketpair};
use nix::unistd::{getegid, geteuid};

use flexid_simulation::bus::BusSender;

/// Both ends of a bus, its name, and its description.
pub(super) struct DemoBus {
    pub(super) robot: BusSender,
    pub(super) daemon: CanSocket,
    pub(super) name: String,
    pub(super) what: String,
}

impl DemoBus {
    /// Makes a bus of this process alone. Call it before any thread is started: the kernel gives a new user namespace
    /// to a process of one thread only.
    pub(super) fn new(interface: &str) -> Result<Self> {
        match vcan(interface) {
            Ok((robot, daemon)) => {
                let what =
                    format!("{interface}, a virtual CAN bus in a network namespace of its own");
                Ok(Self { robot, daemon, name: interface.to_owned(), what })
            }
            Err(reason) => {
                let (robot, daemon) = pair()?;
                let what = format!("a socket pair that carries the same CAN frames ({reason})");
                Ok(Self { robot, daemon, name: "socket pair".to_owned(), what })
            }
        }
    }
}

/// Makes a virtual bus in a new network namespace, in which the process has root rights without being root.
fn vcan(interface: &str) -> Result<(BusSender, CanSocket)> {
    let (user, group) = (geteuid(), getegid());
    // Where user namespaces are restricted, root still gets a network of its own.
    match unshare(CloneFlags::CLONE_NEWUSER | CloneFlags::CLONE_NEWNET) {
        Ok(()) => {
            fs::write("/proc/self/setgroups", "deny").context("/proc/self/setgroups")?;
            fs::write("/proc/self/uid_map", format!("0 {user} 1")).context("/proc/self/uid_map")?;
            fs::write("/proc/self/gid_map", format!("0 {group} 1"))
                .context("/proc/self/gid_map")?;
        }
        Err(_) => {
            unshare(CloneFlags::CLONE_NEWNET).context("no network namespace may be made here")?
        }
    }
    ensure!(ip(&["link", "add", interface, "type", "vcan"])?, "this kernel has no vcan");
    ensure!(ip(&["link", "set", interface, "up"])?, "a vcan does not come up here");
    Ok((BusSender::open(interface)?, CanSocket::open(interface)?))
}

/// Returns whether `ip` succeeded. The function hides its messages, since those of a kernel without vcan do not help the
/// user.
fn ip(arguments: &[&str]) -> Result<bool> {
    let mut command = Command::new("ip");
    let status = command.args(arguments).stderr(Stdio::null()).status();
    Ok(status.context("for a vcan install `ip`: apt-get install iproute2")?.success())
}

fn pair() -> Result<(BusSender, CanSocket)> {
    let (robot, daemon): (OwnedFd, OwnedFd) =
        socketpair(AddressFamily::Unix, SockType::SeqPacket, None, SockFlag::SOCK_CLOEXEC)?;
    Ok((BusSender::from_pair(robot), CanSocket::from_pair(daemon)?))
}
