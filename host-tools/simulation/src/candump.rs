//! Logs as `candump -L` writes them: `(seconds.microseconds) interface ID#DATA`.

use std::io::{self, Write};

use socketcan::dump::CanDumpRecord;

use super::bus::any_frame;
use super::transmission::TimedFrame;

/// Start of simulated logs, 2025-12-29, 09:20 UTC, in seconds since the Unix epoch.
pub const EPOCH_S: f64 = 1_767_000_000.0;

/// A writer of a log.
#[derive(Debug)]
pub struct Writer<W> {
    log: W,
    interface: String,
}

impl<W: Write> Writer<W> {
    /// A log of frames on `interface`.
    pub fn new(log: W, interface: &str) -> Self {
        Self { log, interface: interface.to_owned() }
    }

    /// Adds `frames`, whose times count from `start_s` seconds since the Unix epoch.
    ///
    /// # Errors
    /// The log cannot be written.
    pub fn write(&mut self, frames: &[TimedFrame], start_s: f64) -> io::Result<()> {
        for TimedFrame { time_s, frame } in frames {
            let record = CanDumpRecord {
                t_us: ((start_s + time_s) * 1e6).round() as u64,
                device: self.interface.clone(),
                frame: any_frame(frame)?,
                direction: None,
            };
            writeln!(self.log, "{record}")?;
        }
        Ok(())
    }

    /// Writes what is still buffered, and gives back what it has written to.
    ///
    /// # Errors
    /// The log cannot be written.
    pub fn finish(mut self) -> io::Result<W> {
        self.log.flush()?;
        Ok(self.log)
    }
}

#[cfg(test)]
mod tests {
    use embedded_can::{ExtendedId, StandardId};
    use flexid_pipeline::source::{Frame, FrameKind};

    use super::*;

    #[test]
    fn lines_are_those_of_candump() {
        let mut writer = Writer::new(Vec::new(), "can0");
        let frame = |time_s, id, data: &[u8]| TimedFrame {
            time_s,
            frame: Frame::new(id, FrameKind::Data, data),
        };
        let frames = [
            frame(60e-6, StandardId::new(0x41).unwrap().into(), &[0x0A, 0xFF]),
            frame(1.0, StandardId::new(0x42).unwrap().into(), &[1; 12]),
            frame(1.5, ExtendedId::new(0x1234567).unwrap().into(), &[]),
        ];
        writer.write(&frames, EPOCH_S).unwrap();
        assert_eq!(
            String::from_utf8(writer.log).unwrap(),
            "(1767000000.000060) can0 041#0AFF\n\
             (1767000001.000000) can0 042##4010101010101010101010101\n(1767000001.500000) can0 01234567#\n"
        );
    }
}
