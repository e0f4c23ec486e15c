//! The real bus: a SocketCAN socket, or one end of a socket pair that carries the same frames.

use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};
use std::time::{Duration, Instant};

use embedded_can::{ExtendedId, Id, StandardId};
use flexid_wire::text::clipped;
use flexid_wire::trouble::BusFault;
use nix::cmsg_space;
use nix::errno::Errno;
use nix::ifaddrs::getifaddrs;
use nix::libc::{CAN_RAW_FD_FRAMES, SOL_CAN_RAW};
use nix::net::if_::{InterfaceFlags, if_nametoindex};
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::socket::{
    ControlMessageOwned, MsgFlags, MultiHeaders, RecvMsg, getsockopt, recvmmsg, setsockopt, sockopt,
};
use nix::sys::time::TimeSpec;
use socketcan::{Socket as _, SocketOptions as _};

use super::link::{self, Interface, Link};
use super::monotonic::Offset;
use super::{Arrival, Flow, Frame, FrameKind, FrameSource, SourceHealth};

/// Most frames that one system call fetches.
const BATCH: usize = 64;
/// Receive buffer that is requested, bytes: about 5 s of a bus at 4,000 frames/s. Without CAP_NET_ADMIN the kernel grants less,
/// up to the sysctl net.core.rmem_max.
const RECEIVE_BUFFER: usize = 8 << 20;
/// Interval between two checks of a silent interface.
const LOOK: Duration = Duration::from_secs(1);

/// Size of the kernel's `struct can_frame`, bytes.
const CAN_FRAME: usize = 16;
/// Size of the kernel's `struct canfd_frame`, bytes.
const CAN_FD_FRAME: usize = 72;
/// Size of what precedes the data in both, bytes.
const HEADER: usize = 8;
// Flags beside the identifier in the first 4 bytes of a frame.
const EXTENDED: u32 = 0x8000_0000;
const REMOTE: u32 = 0x4000_0000;
const ERROR: u32 = 0x2000_0000;

/// Advice where the kernel has no virtual bus.
const WITHOUT_VCAN: &str = "where `modprobe vcan` fails, install the kernel's extra modules (Ubuntu: \
    linux-modules-extra-$(uname -r)), or run the command by tests/with-vcan of flexid's repository, whose bus is vcan0";

/// Why a bus cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// No interface has this name.
    #[error(
        "interface {0:?} does not exist: plug the adapter in, or make a virtual bus with \
         `ip link add dev {0} type vcan && ip link set {0} up`; {WITHOUT_VCAN}"
    )]
    NoInterface(String),
    /// The interface is of another kind.
    #[error("interface {0:?} is not a CAN interface: `ip -br link` lists what there is")]
    NotCan(String),
    /// The kernel has no CAN sockets.
    #[error("the kernel has no CAN sockets: `modprobe can-raw`")]
    NoCan,
    /// Another error occurred.
    #[error("interface {interface:?} cannot be opened: {error}")]
    Io {
        /// Name of the interface.
        interface: String,
        /// Error of the kernel.
        error: io::Error,
    },
}

/// A socket that delivers `struct can_frame`, read in batches with the kernel's timestamps.
pub struct CanSocket {
    socket: socketcan::CanSocket,
    /// Name and index of the interface. `None` for one end of a socket pair.
    interface: Option<(String, u32)>,
    buffers: Box<[[u8; CAN_FD_FRAME]]>,
    /// Number of frames dropped at this socket.
    dropped: u64,
    /// Number of frames dropped at the sockets before it.
    dropped_before: u64,
    receive_buffer_bytes: u64,
    link: Link,
    offset: Offset,
    looked: Instant,
}

impl CanSocket {
    /// Opens the bus of this interface. A link that is down is no error.
    ///
    /// # Errors
    /// The error is one line with the correction.
    pub fn open(interface: &str) -> Result<Self, OpenError> {
        let (socket, index) = open(interface)?;
        let socket = Self::new(socket, Some((interface.to_string(), index)));
        socket.map_err(|error| OpenError::Io { interface: interface.to_string(), error })
    }

    /// Makes a source of one end of a SOCK_SEQPACKET socket pair. Each packet at the other end is a `struct can_frame`.
    ///
    /// # Errors
    /// `socket` is not a socket.
    pub fn from_pair(socket: OwnedFd) -> io::Result<Self> {
        Self::new(socket.into(), None)
    }

    fn new(socket: socketcan::CanSocket, interface: Option<(String, u32)>) -> io::Result<Self> {
        let receive_buffer_bytes = prepare(&socket)?;
        Ok(Self {
            socket,
            interface,
            buffers: vec![[0; CAN_FD_FRAME]; BATCH].into_boxed_slice(),
            dropped: 0,
            dropped_before: 0,
            receive_buffer_bytes,
            link: Link::default(),
            offset: Offset::default(),
            looked: Instant::now(),
        })
    }

    /// Fetches the frames that are there, at most [`BATCH`].
    fn fetch(&mut self, batch: &mut Vec<Arrival>) -> nix::Result<Flow> {
        // The headers are made anew each time: the kernel shortens the room for control messages to what it used, and the
        // headers do not restore it. The drop counter would then never fit behind a timestamp.
        let mut headers = MultiHeaders::<()>::preallocate(BATCH, Some(cmsg_space!(TimeSpec, u32)));
        let mut slices: Vec<_> =
            self.buffers.iter_mut().map(|buffer| [io::IoSliceMut::new(buffer)]).collect();
        let fd = self.socket.as_raw_fd();
        let messages = recvmmsg(fd, &mut headers, &mut slices, MsgFlags::MSG_DONTWAIT, None)?;
        self.offset.measure()?;
        for message in messages {
            if message.bytes == 0 {
                return Ok(Flow::Ended);
            }
            let (time, dropped) = control(&message)?;
            self.dropped = dropped.map_or(self.dropped, u64::from);
            let Some(frame) = message.iovs().next().and_then(frame) else { continue };
            match frame.kind {
                FrameKind::Error => self.link.err(link::class(&frame), frame.data()),
                _ => self.link.hear(),
            }
            let offset = &mut self.offset;
            let time_s = time.map_or(offset.looked_s(), |time| offset.monotonic_s(time));
            batch.push(Arrival::of_frame(time_s, frame));
        }
        Ok(Flow::Open)
    }

    /// Checks whether the interface is still the one that was opened, and notes its state. The socket of a deleted interface
    /// stays silent, even after an interface of the same name is made. A link that comes up gives no sign either.
    fn look(&mut self) {
        let Some((name, index)) = &mut self.interface else {
            return;
        };
        match if_nametoindex(name.as_str()) {
            Err(Errno::ENODEV | Errno::ENXIO) => self.link.look(Interface::Missing),
            // The system has no descriptor or no memory to look with: nothing is known.
            Err(_) => {}
            Ok(now) if now != *index => {
                let reopened = open(name).ok().and_then(|(socket, index)| {
                    prepare(&socket).ok().map(|bytes| (socket, index, bytes))
                });
                // If the interface is gone again, the next check notes it.
                if let Some((socket, now, bytes)) = reopened {
                    *index = now;
                    self.socket = socket;
                    self.dropped_before += std::mem::take(&mut self.dropped);
                    self.receive_buffer_bytes = bytes;
                    // The old interface was gone between two checks.
                    self.link.look(Interface::Missing);
                    self.link.look(state_of(name).unwrap_or(Interface::Running));
                }
            }
            Ok(_) => {
                if let Some(state) = state_of(name) {
                    self.link.look(state);
                }
            }
        }
    }
}

impl FrameSource for CanSocket {
    fn read(&mut self, batch: &mut Vec<Arrival>, timeout: Duration) -> io::Result<Flow> {
        let before = batch.len();
        let timeout = PollTimeout::try_from(timeout).unwrap_or(PollTimeout::MAX);
        let mut waiting = [PollFd::new(self.socket.as_fd(), PollFlags::POLLIN)];
        let fetched = match poll(&mut waiting, timeout) {
            Ok(0) => Ok(Flow::Open),
            Ok(_) => self.fetch(batch),
            Err(error) => Err(error),
        };
        let flow = match fetched {
            Ok(flow) => flow,
            Err(Errno::EINTR | Errno::EAGAIN) => Flow::Open,
            Err(Errno::ENETDOWN) => {
                self.link.go_down();
                Flow::Open
            }
            // The next check of the interface shows more.
            Err(Errno::ENODEV) => Flow::Open,
            Err(error) => return Err(error.into()),
        };
        // Error frames alone do not show the state of a link.
        if batch[before..]
            .iter()
            .filter_map(Arrival::frame)
            .any(|frame| frame.kind != FrameKind::Error)
        {
            self.looked = Instant::now();
        } else if self.looked.elapsed() >= LOOK {
            self.looked = Instant::now();
            self.look();
        }
        Ok(flow)
    }

    fn health(&self) -> SourceHealth {
        let name = self.interface.as_ref().map_or("the bus", |(name, _)| name);
        let fault = |kind| BusFault { interface: clipped(name), kind };
        SourceHealth {
            link: self.link.state,
            link_losses: self.link.losses,
            errors: self.link.errors,
            kernel_dropped: self.dropped_before + self.dropped,
            receive_buffer_bytes: self.receive_buffer_bytes,
            fault: self.link.fault().map(fault),
            troubles: Vec::new(),
            elsewhere: Vec::new(),
        }
    }

    fn since_1970_s(&self, time_s: f64) -> f64 {
        self.offset.realtime_s(time_s)
    }
}

impl AsFd for CanSocket {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

/// Opens a socket that is bound to this interface. Returns it with the interface's index.
fn open(interface: &str) -> Result<(socketcan::CanSocket, u32), OpenError> {
    let name = || interface.to_string();
    let index = if_nametoindex(interface).map_err(|error| match error {
        Errno::ENODEV | Errno::ENXIO => OpenError::NoInterface(name()),
        error => OpenError::Io { interface: name(), error: error.into() },
    })?;
    let opened = socketcan::CanSocket::open(interface).and_then(|socket| {
        socket.set_error_filter_accept_all()?;
        // A kernel without CAN FD refuses, and receives no such frame.
        let _ = socket.set_socket_option_int(SOL_CAN_RAW, CAN_RAW_FD_FRAMES, 1);
        Ok(socket)
    });
    match opened {
        Ok(socket) => Ok((socket, index)),
        Err(error) => Err(match error.raw_os_error().map(Errno::from_raw) {
            Some(Errno::ENODEV) => OpenError::NotCan(name()),
            Some(Errno::EAFNOSUPPORT | Errno::EPROTONOSUPPORT) => OpenError::NoCan,
            _ => OpenError::Io { interface: name(), error },
        }),
    }
}

/// Switches on timestamps and drop counter, and requests the largest receive buffer that is granted. Returns its size, bytes.
fn prepare(socket: &socketcan::CanSocket) -> io::Result<u64> {
    setsockopt(socket, sockopt::ReceiveTimestampns, &true)?;
    setsockopt(socket, sockopt::RxqOvfl, &1)?;
    if setsockopt(socket, sockopt::RcvBufForce, &RECEIVE_BUFFER).is_err() {
        setsockopt(socket, sockopt::RcvBuf, &RECEIVE_BUFFER)?;
    }
    Ok(getsockopt(socket, sockopt::RcvBuf)? as u64)
}

/// Returns the time since the epoch at which the kernel received the frame, and the number of frames that it has dropped, where
/// the message contains them.
fn control(message: &RecvMsg<()>) -> nix::Result<(Option<Duration>, Option<u32>)> {
    let (mut time, mut dropped) = (None, None);
    for control in message.cmsgs()? {
        match control {
            ControlMessageOwned::ScmTimestampns(at) => time = Some(Duration::from(at)),
            ControlMessageOwned::RxqOvfl(frames) => dropped = Some(frames),
            _ => {}
        }
    }
    Ok((time, dropped))
}

/// Parses a frame in the kernel's layout, classical or CAN FD: identifier with flags, length, 3 bytes of flags and padding, data.
fn frame(bytes: &[u8]) -> Option<Frame> {
    let (id, rest) = bytes.split_first_chunk::<4>()?;
    let raw = u32::from_ne_bytes(*id);
    let id = if raw & (EXTENDED | ERROR) != 0 {
        Id::Extended(ExtendedId::new(raw & 0x1FFF_FFFF)?)
    } else {
        Id::Standard(StandardId::new((raw & 0x7FF) as u16)?)
    };
    let kind = match bytes.len() {
        CAN_FD_FRAME => FrameKind::Data,
        CAN_FRAME if raw & ERROR != 0 => FrameKind::Error,
        CAN_FRAME if raw & REMOTE != 0 => FrameKind::Remote,
        CAN_FRAME => FrameKind::Data,
        _ => return None,
    };
    let length = usize::from(*rest.first()?).min(bytes.len() - HEADER);
    Some(Frame::new(id, kind, rest.get(4..4 + length)?))
}

fn state_of(interface: &str) -> Option<Interface> {
    let mut addresses = getifaddrs().ok()?;
    let flags = addresses.find(|address| address.interface_name == interface)?.flags;
    Some(if !flags.contains(InterfaceFlags::IFF_UP) {
        Interface::Down
    } else if flags.contains(InterfaceFlags::IFF_RUNNING) {
        Interface::Running
    } else {
        Interface::NoCarrier
    })
}

#[cfg(test)]
mod tests {
    use embedded_can::Frame as _;
    use flexid_wire::trouble::BusFaultKind;
    use nix::sys::socket::{AddressFamily, SockFlag, SockType, send, socketpair};

    use super::super::LinkState;
    use super::{Frame, *};

    fn pair() -> (CanSocket, OwnedFd) {
        let (ours, theirs) =
            socketpair(AddressFamily::Unix, SockType::SeqPacket, None, SockFlag::SOCK_CLOEXEC)
                .unwrap();
        (CanSocket::from_pair(ours).unwrap(), theirs)
    }

    /// Writes a frame as the simulator does, with socketcan's own frame types.
    fn write(socket: &OwnedFd, frame: impl Into<socketcan::CanFrame>) {
        let socket = socketcan::CanSocket::from(socket.try_clone().unwrap());
        socket.write_frame(&frame.into()).unwrap();
    }

    #[test]
    fn frames_come_as_they_were_sent_with_a_time() {
        let (mut source, bus) = pair();
        let now_s = || {
            let now = nix::time::clock_gettime(nix::time::ClockId::CLOCK_MONOTONIC).unwrap();
            Duration::from(now).as_secs_f64()
        };
        let before_s = now_s();
        let ids = [Id::from(StandardId::MAX), ExtendedId::new(0x1234_5678).unwrap().into()];
        for round in 0..100u8 {
            for id in ids {
                let data = &[round; 8][..usize::from(round % 9)];
                write(&bus, socketcan::CanDataFrame::new(id, data).unwrap());
            }
        }
        drop(bus);
        let mut batch = Vec::new();
        let mut calls = 0;
        while source.read(&mut batch, Duration::from_secs(10)).unwrap() == Flow::Open {
            calls += 1;
        }
        assert_eq!(batch.len(), 200);
        assert!(calls <= 4, "200 frames took {calls} calls: they should come in batches");
        for (index, arrival) in batch.iter().enumerate() {
            let round = (index / 2) as u8;
            let data = &[round; 8][..usize::from(round % 9)];
            assert_eq!(arrival.frame().unwrap(), Frame::new(ids[index % 2], FrameKind::Data, data));
            assert!((before_s..=now_s()).contains(&arrival.time_s));
        }
        assert!(source.health().receive_buffer_bytes > 0);
    }

    #[test]
    fn every_kind_of_frame_is_distinguished() {
        let (mut source, bus) = pair();
        write(&bus, socketcan::CanRemoteFrame::new_remote(StandardId::MAX, 4).unwrap());
        write(&bus, socketcan::CanErrorFrame::new_error(0x0004, &[0; 8]).unwrap());
        let mut long = [7; CAN_FD_FRAME];
        long[..HEADER].copy_from_slice(&[0, 0, 0, 0, 48, 0, 0, 0]);
        send(bus.as_raw_fd(), &long, MsgFlags::empty()).unwrap();
        send(bus.as_raw_fd(), b"rubbish", MsgFlags::empty()).unwrap();
        let mut batch = Vec::new();
        source.read(&mut batch, Duration::from_secs(10)).unwrap();
        let kinds: Vec<_> = batch.iter().map(|arrival| arrival.frame().unwrap().kind).collect();
        assert_eq!(kinds, [FrameKind::Remote, FrameKind::Error, FrameKind::Data]);
        assert_eq!(batch[2].frame().unwrap().data(), [7; 48]);
    }

    /// Errors do not set the link up. A fault that is over is no longer reported.
    #[test]
    fn error_frames_give_the_state_of_the_link() {
        let (mut source, bus) = pair();
        let error = |class: u32, says: u8| {
            let data = [0, says, 0, 0, 0, 0, 0, 0];
            write(&bus, socketcan::CanErrorFrame::new_error(class, &data).unwrap());
        };
        let mut health = || {
            source.read(&mut Vec::new(), Duration::from_secs(10)).unwrap();
            source.health()
        };
        let fault = |health: SourceHealth| health.fault.map(|fault| fault.kind);
        error(0x040, 0);
        let off = health();
        assert_eq!((off.link, off.errors.bus_off), (LinkState::BusOff, 1));
        assert_eq!(fault(off), Some(BusFaultKind::BusOff));
        error(0x088, 0);
        let off = health();
        assert_eq!((off.link, off.errors.protocol), (LinkState::BusOff, 1));
        error(0x100, 0);
        let up = health();
        assert_eq!((up.link, up.errors.bus_off, fault(up)), (LinkState::Up, 1, None));
        error(0x004, 0x10);
        assert_eq!(fault(health()), Some(BusFaultKind::ErrorPassive));
        error(0x004, 0x40);
        assert_eq!(fault(health()), None);
    }

    #[test]
    fn the_sysctl_file_allows_the_buffer_that_is_asked_for() {
        let file = include_str!("../../../dist/60-flexid.conf");
        let limit = file.lines().find_map(|line| line.strip_prefix("net.core.rmem_max = "));
        assert_eq!(limit.unwrap().parse(), Ok(RECEIVE_BUFFER));
        // The kernel doubles the requested size and counts 768 bytes for a frame. 278 frames are 30 ms of a full bus.
        let frames = 2 * RECEIVE_BUFFER / 768;
        assert!(file.contains(" 21,800 frames") && frames / 100 == 218);
        assert!(file.contains("2.4 s of a full bus") && (frames * 30 / 278).div_ceil(100) == 24);
    }

    #[test]
    fn a_silent_bus_lets_go_in_time() {
        let (mut source, _bus) = pair();
        let mut batch = Vec::new();
        assert_eq!(source.read(&mut batch, Duration::from_millis(1)).unwrap(), Flow::Open);
        assert!(batch.is_empty());
    }

    /// Without a free descriptor nothing is known of an interface, which is no reason to report that it was removed.
    #[test]
    fn an_interface_is_missing_only_if_the_system_says_so() {
        const ALONE: &str = "FLEXID_TEST_ALONE";
        if std::env::var_os(ALONE).is_none() {
            // The limit holds for a whole process.
            let name = "source::socket::tests::an_interface_is_missing_only_if_the_system_says_so";
            let mut child = std::process::Command::new(std::env::current_exe().unwrap());
            assert!(child.args(["--exact", name]).env(ALONE, "yes").status().unwrap().success());
            return;
        }
        let (ours, _theirs) =
            socketpair(AddressFamily::Unix, SockType::SeqPacket, None, SockFlag::SOCK_CLOEXEC)
                .unwrap();
        let interface = ("lo".to_string(), if_nametoindex("lo").unwrap());
        let mut source = CanSocket::new(ours.into(), Some(interface)).unwrap();
        let limit = nix::sys::resource::Resource::RLIMIT_NOFILE;
        let (_, most) = nix::sys::resource::getrlimit(limit).unwrap();
        nix::sys::resource::setrlimit(limit, 0, most).unwrap();
        assert!(if_nametoindex("lo").is_err(), "there is still a descriptor");
        source.look();
        assert_eq!((source.health().link, source.health().link_losses), (LinkState::Up, 0));
        assert!(matches!(CanSocket::open("lo"), Err(OpenError::Io { .. })));
        nix::sys::resource::setrlimit(limit, most, most).unwrap();
        source.interface = Some(("nocan9".to_string(), 9));
        source.look();
        assert_eq!(source.health().link, LinkState::Gone);
    }

    #[test]
    fn a_missing_interface_is_named_with_the_mend() {
        let error = CanSocket::open("nocan9").err().unwrap().to_string();
        assert!(error.starts_with("interface \"nocan9\" does not exist: "), "{error}");
        assert!(error.contains("ip link add dev nocan9 type vcan"), "{error}");
        assert!(error.contains("up`; where `modprobe vcan` fails, install "), "{error}");
    }
}
