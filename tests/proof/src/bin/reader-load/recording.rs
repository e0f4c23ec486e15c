//! The frames of a recording, as the kernel delivers them.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;
use std::time::Duration;

use anyhow::{Context as _, Result};
use flate2::read::GzDecoder;

/// Bytes of the kernel's `struct can_frame`.
const CAN_FRAME: usize = 16;

/// A frame of a recording.
pub(crate) struct Recorded {
    /// Time since the first frame.
    pub(crate) at: Duration,
    /// The frame as the kernel delivers it.
    pub(crate) frame: [u8; CAN_FRAME],
}

/// The frames of a compressed `candump -L` log.
pub(crate) fn frames(log: &Path) -> Result<Vec<Recorded>> {
    let mut text = String::new();
    GzDecoder::new(File::open(log)?).read_to_string(&mut text)?;
    let mut first = None;
    text.lines()
        .map(|line| {
            let (time_s, frame) = parse(line).with_context(|| format!("no frame: {line}"))?;
            let at = Duration::from_secs_f64(time_s - *first.get_or_insert(time_s));
            Ok(Recorded { at, frame })
        })
        .collect()
}

/// Time, s, and frame of a line like `(1767000000.000060) can0 101#00000000FFFFD289`.
fn parse(line: &str) -> Option<(f64, [u8; CAN_FRAME])> {
    let mut fields = line.split(' ');
    let time_s = fields.next()?.strip_prefix('(')?.strip_suffix(')')?.parse().ok()?;
    let (id, data) = fields.nth(1)?.split_once('#')?;
    let mut frame = [0; CAN_FRAME];
    frame[..4].copy_from_slice(&u32::from_str_radix(id, 16).ok()?.to_ne_bytes());
    frame[4] = u8::try_from(data.len() / 2).ok()?;
    for (byte, digits) in frame[8..].iter_mut().zip(data.as_bytes().chunks(2)) {
        *byte = u8::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok()?;
    }
    Some((time_s, frame))
}

impl Recorded {
    /// Returns whether the frame is a force or an acceleration.
    pub(crate) fn is_measurement(&self) -> bool {
        [0x101u32, 0x102].iter().any(|id| self.frame[..4] == id.to_ne_bytes())
    }
}
