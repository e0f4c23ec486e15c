//! The rules of time, for recordings whose sensors share no counter.
//!
//! | module     | holds                                                              |
//! | ---------- | ------------------------------------------------------------------ |
//! | `number`   | the numbers of frames: turns of counters, lost frames, runs        |
//! | `line`     | the clock of one sensor: a line through its earliest arrivals      |
//! | `delay`    | the delay between both, by the phase of a mass                     |
//! | `lines`    | both clocks, and the samples of one at the instants of the other   |
//! | `signal`   | the signal of a sensor at any instant                              |
//! | `kernel`   | the windowed sinc                                                  |
//! | `kept`     | the readings, until the end                                        |
//! | `give`     | the readings that leave                                            |
//! | `found`    | what was found, for people                                         |
//!
//! The instants are those of the slower sensor, of the force if both are as fast. The signal of the other is taken there, behind a low-pass
//! where it is the faster one. The readings that leave have common counters, and times on the lines. Joint angles keep their times.
//!
//! What a fit can make good is a delay, one for each record beside it, and one drift: their standard deviations widen the accuracies. A
//! clock that cannot be told so well gives no reading, but a reason.

mod delay;
mod found;
mod give;
mod kept;
mod kernel;
mod line;
mod lines;
mod number;
mod signal;

use flexid_core::stream::{Reading, StreamHealth};

pub use delay::Delay;
pub use found::{FoundClock, FoundClocks, Untold};

pub(crate) use kept::Expected;
use kept::Kept;
use lines::{Lines, STAMP};

/// The readings of a recording, and what its end told of their clocks.
pub(crate) struct Recording {
    kept: Kept,
    /// The lines, once they are told, and the delay, s.
    told: Option<(Lines, f64)>,
    judged: StreamHealth,
}

/// Largest standard deviation of the delay of a record, over the shortest period of the band: a fit begins in the right basin within a
/// quarter of that period, which is three of these. Of 200 Hz that is 0.42 ms: 1 ms was found, 3 ms was not (tried).
const BASIN: f64 = 0.25 / 3.0;

const RECORD_AT_ONCE: &str = "record all cuts in one log without a pause, name the sensor's own counter in [signals], or record with stamps of the hardware";
const EXCITE: &str = "record cuts at several speeds that are rich above the band, each longer than a record, or state the delay: [calibration] delay_s = 1e-3, if both come within a millisecond";

impl Recording {
    pub(crate) fn new(expected: Expected) -> Self {
        Self { kept: Kept::new(expected), told: None, judged: StreamHealth::default() }
    }

    /// Takes a reading that arrived at a time, s.
    pub(crate) fn push(&mut self, time_s: f64, reading: Reading) {
        self.kept.push(time_s, reading);
    }

    /// Tells the clocks.
    ///
    /// # Errors
    /// The error says why they cannot be told.
    pub(crate) fn tell(&mut self) -> Result<FoundClocks, Untold> {
        let lines = Lines::of(&self.kept)?;
        self.judged = lines.judged;
        let expected = &self.kept.expected;
        let delay = match self.kept.delay(&lines) {
            Ok(delay) => Some(delay),
            Err(_) if expected.seeks_delay => None,
            Err(reason) => {
                let reason =
                    format!("the delay between force and acceleration is not told: {reason}");
                return Err(Untold { reason, mend: EXCITE });
            }
        };
        let found = lines.found(expected, delay);
        let record_s = expected.record_samples as f64 / expected.rate_hz;
        let std_s = found.record_delay_std_s.hypot(0.5 * record_s * found.drift_std);
        if std_s > BASIN / expected.highest_hz {
            let reason = format!(
                "the clocks of force and acceleration are known to {:.2} ms in a record",
                1e3 * std_s
            );
            let is_one =
                self.kept.parts.len() == 1 && found.sensors.iter().all(|own| own.runs == 1);
            return Err(Untold { reason, mend: if is_one { STAMP } else { RECORD_AT_ONCE } });
        }
        self.told = Some((lines, delay.map_or(0.0, |own| own.delay_s)));
        Ok(found)
    }

    /// Returns the counts of samples that are no measurement and were left out, and of blocks that have too many. The stream counts those of the slower
    /// sensor.
    pub(crate) fn judged(&self) -> StreamHealth {
        self.judged
    }

    /// Passes all readings on, with common counters and instants. It passes none if the clocks were not told.
    pub(crate) fn give(mut self, mut sink: impl FnMut(f64, Reading)) {
        if let Some((lines, delay_s)) = self.told.take() {
            self.kept.give_by(&lines, delay_s, &mut sink);
        }
    }
}

#[cfg(test)]
mod tests;
