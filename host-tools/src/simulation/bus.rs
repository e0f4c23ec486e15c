//! The wire end of the simulated robot: a CAN interface, or one end of a socket pair.

use std::io;
use std::os::fd::OwnedFd;
use std::thread;
use std::time::{Duration, Instant};

use flexid_edge::source::{Frame, OpenError};
use socketcan::{CanFrame, CanSocket, EmbeddedFrame as _, Socket as _, SocketOptions as _};

use super::sensor::TimedFrame;

/// How long a full transmit queue may take to drain, and how often it is tried.
const PATIENCE: Duration = Duration::from_secs(2);
const RETRY: Duration = Duration::from_micros(200);

/// Sends frames.
#[derive(Debug)]
pub struct BusSender {
    socket: CanSocket,
}

impl BusSender {
    /// On the interface of this name.
    ///
    /// # Errors
    /// One line that says what to do.
    pub fn open(interface: &str) -> Result<Self, OpenError> {
        let name = || interface.to_owned();
        nix::net::if_::if_nametoindex(interface).map_err(|_| OpenError::NoInterface(name()))?;
        let socket = CanSocket::open(interface).map_err(|error| match error.raw_os_error() {
            Some(nix::libc::EAFNOSUPPORT) => OpenError::NoCan,
            Some(nix::libc::ENODEV) => OpenError::NotCan(name()),
            _ => OpenError::Io { interface: name(), error },
        })?;
        // It only sends; what others send must not fill its buffer.
        socket.set_filter_drop_all().map_err(|error| OpenError::Io { interface: name(), error })?;
        Ok(Self { socket })
    }

    /// Into one end of a SOCK_SEQPACKET pair, each packet a `struct can_frame`.
    pub fn from_pair(end: OwnedFd) -> Self {
        Self { socket: end.into() }
    }

    /// Sends one frame; waits while the queue is full.
    ///
    /// # Errors
    /// The interface is down or gone, or nobody reads the pair's other end.
    pub fn send(&self, frame: &Frame) -> io::Result<()> {
        let frame = CanFrame::new(frame.id, frame.data())
            .ok_or_else(|| io::Error::other("a frame of more than 8 bytes"))?;
        let begun = Instant::now();
        loop {
            match self.socket.write_frame(&frame) {
                Err(error)
                    if error.raw_os_error() == Some(nix::libc::ENOBUFS)
                        && begun.elapsed() < PATIENCE =>
                {
                    thread::sleep(RETRY);
                }
                sent => return sent,
            }
        }
    }

    /// Sends `frames` at their times after `start`, each when it is due and late ones at once, so that
    /// delays do not add up. `sent` is told of each.
    ///
    /// # Errors
    /// As [`send`](Self::send).
    pub fn play(
        &self,
        frames: &[TimedFrame],
        start: Instant,
        mut sent: impl FnMut(),
    ) -> io::Result<()> {
        for TimedFrame { time_s, frame } in frames {
            let due = start + Duration::from_secs_f64(*time_s);
            thread::sleep(due.saturating_duration_since(Instant::now()));
            self.send(frame)?;
            sent();
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use embedded_can::{ExtendedId, StandardId};
    use flexid_edge::source::{CanSocket as Receiver, Flow, FrameKind, FrameSource};
    use nix::sys::socket::{AddressFamily, SockFlag, SockType, socketpair};

    use super::*;

    #[test]
    fn the_daemon_reads_from_a_pair_what_was_sent_at_its_time() {
        let (robot, daemon) =
            socketpair(AddressFamily::Unix, SockType::SeqPacket, None, SockFlag::SOCK_CLOEXEC)
                .unwrap();
        let (robot, mut daemon) =
            (BusSender::from_pair(robot), Receiver::from_pair(daemon).unwrap());
        let timed = |time_s, id, data: &[u8]| TimedFrame {
            time_s,
            frame: Frame::new(id, FrameKind::Data, data),
        };
        let frames = [
            timed(0.0, StandardId::new(0x101).unwrap().into(), &[1, 2, 3, 4, 5, 6, 7, 8]),
            timed(0.2, ExtendedId::new(0x1234567).unwrap().into(), &[]),
        ];
        let begun = Instant::now();
        robot.play(&frames, begun, || {}).unwrap();
        assert!(begun.elapsed() >= Duration::from_millis(200));
        drop(robot);
        let mut batch = Vec::new();
        while daemon.read(&mut batch, Duration::from_secs(5)).unwrap() == Flow::Open {}
        let read: Vec<_> = batch.iter().map(|arrival| arrival.frame).collect();
        assert_eq!(read, frames.map(|timed| timed.frame));
    }

    #[test]
    fn nobody_at_the_other_end_is_an_error() {
        let (robot, daemon) =
            socketpair(AddressFamily::Unix, SockType::SeqPacket, None, SockFlag::SOCK_CLOEXEC)
                .unwrap();
        drop(daemon);
        let frame = Frame::new(StandardId::ZERO.into(), FrameKind::Data, &[0]);
        assert!(BusSender::from_pair(robot).send(&frame).is_err());
    }
}
