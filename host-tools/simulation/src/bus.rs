//! The connection of the simulated robot to the bus: a CAN interface, or one end of a socket pair.

use std::io;
use std::os::fd::{AsFd as _, OwnedFd};
use std::thread;
use std::time::{Duration, Instant};

use flexid_pipeline::source::{self, Frame, OpenError};
use socketcan::{
    CanAnyFrame, CanDataFrame, CanFdFrame, CanFdSocket, EmbeddedFrame as _, Socket as _,
    SocketOptions as _,
};

use super::transmission::{TimedFrame, Transmission};

/// Longest time for which a full transmit queue may drain.
const PATIENCE: Duration = Duration::from_secs(2);
/// Interval between two attempts to send.
const RETRY: Duration = Duration::from_micros(200);

/// A sender of frames.
#[derive(Debug)]
pub struct BusSender {
    socket: CanFdSocket,
    /// Earliest start of the next experiment.
    free: Instant,
}

impl BusSender {
    /// Opens the interface of this name.
    ///
    /// # Errors
    /// The interface cannot be opened. The error is one line that states what to do.
    pub fn open(interface: &str) -> Result<Self, OpenError> {
        let io = |error| OpenError::Io { interface: interface.to_owned(), error };
        // The daemon's socket reports what is wrong with an interface.
        let opened = source::CanSocket::open(interface)?;
        let socket = CanFdSocket::from(opened.as_fd().try_clone_to_owned().map_err(io)?);
        // The socket only sends. Frames of others must not fill its buffer.
        socket.set_filter_drop_all().map_err(io)?;
        socket.set_error_filter_drop_all().map_err(io)?;
        Ok(Self { socket, free: Instant::now() })
    }

    /// Sends into one end of a SOCK_SEQPACKET pair. Each packet is a `struct can_frame`.
    pub fn from_pair(end: OwnedFd) -> Self {
        Self { socket: end.into(), free: Instant::now() }
    }

    /// Sends one frame; waits while the queue is full.
    ///
    /// # Errors
    /// The interface is down or gone, or no process reads the pair's other end.
    pub fn send(&self, frame: &Frame) -> io::Result<()> {
        let frame = any_frame(frame)?;
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

    /// Sends the frames of one experiment in real time, after the experiment before and the pause between them. It
    /// sends each frame when it is due and late ones at once, so that delays do not add up. It calls `progress` after
    /// each frame with the time since the start.
    ///
    /// # Errors
    /// The errors of [`send`](Self::send).
    pub fn play(
        &mut self,
        experiment: &Transmission,
        mut progress: impl FnMut(Duration),
    ) -> io::Result<()> {
        // Simulating may have taken longer than the pause.
        let start = self.free.max(Instant::now());
        for TimedFrame { time_s, frame } in &experiment.frames {
            let due = start + Duration::from_secs_f64(*time_s);
            thread::sleep(due.saturating_duration_since(Instant::now()));
            self.send(frame)?;
            progress(start.elapsed());
        }
        self.free = start + Duration::from_secs_f64(experiment.lasts_s());
        Ok(())
    }
}

/// Converts a frame for the bus: a classical one, or one of CAN FD if it has more than 8 bytes.
pub(crate) fn any_frame(frame: &Frame) -> io::Result<CanAnyFrame> {
    let classical = CanDataFrame::new(frame.id, frame.data()).map(CanAnyFrame::from);
    let any = classical.or_else(|| CanFdFrame::new(frame.id, frame.data()).map(CanAnyFrame::from));
    any.ok_or_else(|| io::Error::other("a frame of more than 64 bytes"))
}

#[cfg(test)]
mod tests {
    use embedded_can::{ExtendedId, StandardId};
    use flexid_pipeline::source::{CanSocket as Receiver, Flow, FrameKind, FrameSource};
    use nix::sys::socket::{AddressFamily, SockFlag, SockType, socketpair};

    use super::*;
    use crate::transmission::PAUSE_S;

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
            timed(0.1, StandardId::new(0x102).unwrap().into(), &[7; 48]),
            timed(0.2, ExtendedId::new(0x1234567).unwrap().into(), &[]),
        ];
        let experiment =
            Transmission { frames, first_counter: 0, lost_force: 0, lost_acceleration: 0 };
        let begun = Instant::now();
        robot.play(&experiment, |_| {}).unwrap();
        assert!((200..PAUSE_S as u128 * 1000).contains(&begun.elapsed().as_millis()));
        // The second experiment waits for the pause.
        robot.play(&experiment, |_| {}).unwrap();
        assert!(begun.elapsed() >= Duration::from_secs_f64(0.4 + PAUSE_S));
        drop(robot);
        let mut batch = Vec::new();
        while daemon.read(&mut batch, Duration::from_secs(5)).unwrap() == Flow::Open {}
        let read: Vec<_> = batch.iter().map(|arrival| arrival.frame().unwrap()).collect();
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
