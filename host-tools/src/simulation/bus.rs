//! The wire end of the simulated robot: a CAN interface, or one end of a socket pair.

use std::io;
use std::os::fd::{AsFd as _, OwnedFd};
use std::thread;
use std::time::{Duration, Instant};

use flexid_edge::source::{self, Frame, OpenError};
use socketcan::{CanFrame, CanSocket, EmbeddedFrame as _, Socket as _, SocketOptions as _};

use super::sensor::{TimedFrame, Transmission};

/// How long a full transmit queue may take to drain, and how often it is tried.
const PATIENCE: Duration = Duration::from_secs(2);
const RETRY: Duration = Duration::from_micros(200);

/// Sends frames.
#[derive(Debug)]
pub struct BusSender {
    socket: CanSocket,
    /// The next experiment does not begin before.
    free: Instant,
}

impl BusSender {
    /// On the interface of this name.
    ///
    /// # Errors
    /// One line that says what to do.
    pub fn open(interface: &str) -> Result<Self, OpenError> {
        let io = |error| OpenError::Io { interface: interface.to_owned(), error };
        // The daemon's socket knows what can be wrong with an interface.
        let opened = source::CanSocket::open(interface)?;
        let socket = CanSocket::from(opened.as_fd().try_clone_to_owned().map_err(io)?);
        // It only sends; what others send must not fill its buffer.
        socket.set_filter_drop_all().map_err(io)?;
        socket.set_error_filter_drop_all().map_err(io)?;
        Ok(Self { socket, free: Instant::now() })
    }

    /// Into one end of a SOCK_SEQPACKET pair, each packet a `struct can_frame`.
    pub fn from_pair(end: OwnedFd) -> Self {
        Self { socket: end.into(), free: Instant::now() }
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

    /// Sends what one experiment puts on the bus in real time, after the experiment before and the pause
    /// between them: each frame when it is due and late ones at once, so that delays do not add up. `told`
    /// hears after each how long it has lasted.
    ///
    /// # Errors
    /// As [`send`](Self::send).
    pub fn play(
        &mut self,
        experiment: &Transmission,
        mut told: impl FnMut(Duration),
    ) -> io::Result<()> {
        // Simulating may have taken longer than the pause.
        let start = self.free.max(Instant::now());
        for TimedFrame { time_s, frame } in &experiment.frames {
            let due = start + Duration::from_secs_f64(*time_s);
            thread::sleep(due.saturating_duration_since(Instant::now()));
            self.send(frame)?;
            told(start.elapsed());
        }
        self.free = start + Duration::from_secs_f64(experiment.lasts_s());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use embedded_can::{ExtendedId, StandardId};
    use flexid_edge::source::{CanSocket as Receiver, Flow, FrameKind, FrameSource};
    use nix::sys::socket::{AddressFamily, SockFlag, SockType, socketpair};

    use super::*;
    use crate::simulation::sensor::PAUSE_S;

    #[test]
    fn the_daemon_reads_from_a_pair_what_was_sent_at_its_time() {
        let (robot, daemon) =
            socketpair(AddressFamily::Unix, SockType::SeqPacket, None, SockFlag::SOCK_CLOEXEC)
                .unwrap();
        let (mut robot, mut daemon) =
            (BusSender::from_pair(robot), Receiver::from_pair(daemon).unwrap());
        let timed = |time_s, id, data: &[u8]| TimedFrame {
            time_s,
            frame: Frame::new(id, FrameKind::Data, data),
        };
        let frames = vec![
            timed(0.0, StandardId::new(0x101).unwrap().into(), &[1, 2, 3, 4, 5, 6, 7, 8]),
            timed(0.2, ExtendedId::new(0x1234567).unwrap().into(), &[]),
        ];
        let experiment =
            Transmission { frames, first_counter: 0, lost_force: 0, lost_acceleration: 0 };
        let begun = Instant::now();
        robot.play(&experiment, |_| {}).unwrap();
        assert!((200..PAUSE_S as u128 * 1000).contains(&begun.elapsed().as_millis()));
        // The second waits for the pause.
        robot.play(&experiment, |_| {}).unwrap();
        assert!(begun.elapsed() >= Duration::from_secs_f64(0.4 + PAUSE_S));
        drop(robot);
        let mut batch = Vec::new();
        while daemon.read(&mut batch, Duration::from_secs(5)).unwrap() == Flow::Open {}
        let read: Vec<_> = batch.iter().map(|arrival| arrival.frame).collect();
        let sent = experiment.frames.iter().map(|timed| timed.frame).collect::<Vec<_>>().repeat(2);
        assert_eq!(read, sent);
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
