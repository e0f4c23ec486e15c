//! A progress bar for the reading of recordings and for the work on their records.
//!
//! Each byte of a file counts twice: once when it is read, and once when the work on its record is done. The bar
//! therefore moves where a long recording holds few records, and where the work on a record takes longer than reading
//! it. Without work on the records, each byte counts once. Bytes from a pipe do not count, since their number is unknown.

use std::io::{self, Read};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use flexid_console::progress;
use flexid_pipeline::text::count;
use flexid_wire::messages::{Phase, Progress};
use indicatif::ProgressBar;

/// A counter of the bytes that its readers read; clones share it.
#[derive(Clone, Debug)]
pub(crate) struct Meter {
    bar: ProgressBar,
    bytes: Arc<AtomicU64>,
    /// How often each byte counts.
    times: u64,
}

/// The state of the work on the records, which [`Meter::show`] updates.
#[derive(Clone, Debug, Default)]
pub(crate) struct Work {
    records: u64,
    /// Bytes read when this record was complete.
    complete: u64,
    /// Bytes read when the record before was complete.
    complete_before: u64,
    /// Share of this record's work that is done, from 0 to 1.
    share: f64,
}

impl Meter {
    /// A meter whose bar has no end until bytes are expected.
    pub(crate) fn new() -> Self {
        Self { bar: progress::uneven("reading"), bytes: Arc::default(), times: 2 }
    }

    /// A meter of reading alone, whose bar has no end until bytes are expected.
    pub(crate) fn of_reading() -> Self {
        Self { bar: progress::endless("reading"), bytes: Arc::default(), times: 1 }
    }

    /// A meter that counts and shows no bar.
    #[cfg(test)]
    pub(crate) fn hidden() -> Self {
        use indicatif::ProgressDrawTarget;

        Self {
            bar: ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden()),
            bytes: Arc::default(),
            times: 2,
        }
    }

    /// Adds `bytes` to the expected bytes.
    pub(crate) fn expect(&self, bytes: u64) {
        let expected = self.bar.length().unwrap_or_else(|| {
            self.bar.set_style(match self.times {
                1 => progress::known(),
                _ => progress::known_uneven(),
            });
            0
        });
        self.bar.set_length(expected + self.times * bytes);
    }

    /// A reader that counts the bytes that it reads.
    pub(crate) fn read<R: Read>(&self, bytes: R) -> Metered<R> {
        Metered { bytes, meter: self.clone() }
    }

    /// Shows the state of the work.
    pub(crate) fn show(&self, work: &mut Work, progress: &Progress) {
        let read = self.bytes.load(Ordering::Relaxed);
        work.note(read, progress);
        self.bar.set_position(read + work.bytes());
        self.bar.set_message(doing(progress));
    }

    /// Shows the number of records that reading has given.
    pub(crate) fn show_records(&self, records: u64) {
        self.bar.set_message(format!("reading, {}", count(records, "record")));
    }

    /// Hides the bar while `work` runs.
    pub(crate) fn pause(&self, work: impl FnOnce()) {
        self.bar.suspend(work);
    }

    /// Removes the bar.
    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Work {
    fn note(&mut self, read: u64, progress: &Progress) {
        if progress.records != self.records {
            self.records = progress.records;
            self.complete_before = std::mem::replace(&mut self.complete, read);
            self.share = 0.0;
        }
        self.share = f64::from(progress.fraction).max(self.share);
    }

    /// Number of bytes whose records are done.
    fn bytes(&self) -> u64 {
        let this = (self.complete - self.complete_before) as f64;
        self.complete_before + (self.share * this) as u64
    }
}

/// The progress in words.
fn doing(progress: &Progress) -> String {
    match progress.phase {
        Phase::Waiting => "reading".into(),
        Phase::Searching => format!("record {}: searching", progress.records),
        Phase::Refining => format!("record {}: refining", progress.records),
        Phase::Settled => format!("record {}: settled, judging it", progress.records),
    }
}

/// A reader that counts the bytes that it reads.
pub(crate) struct Metered<R> {
    bytes: R,
    meter: Meter,
}

impl<R: Read> Read for Metered<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let read = self.bytes.read(into)?;
        self.meter.bytes.fetch_add(read as u64, Ordering::Relaxed);
        self.meter.bar.inc(read as u64);
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn progress(records: u64, phase: Phase, fraction: f32) -> Progress {
        Progress {
            phase,
            fraction,
            starts: 1,
            search_evaluations: 0,
            refine_iterations: 0,
            search_loss: 0.0,
            records,
        }
    }

    /// The recording has two records of 100 bytes each.
    #[test]
    fn the_bar_moves_while_a_record_is_worked_off_and_never_back() {
        let meter = Meter::hidden();
        meter.expect(200);
        let mut work = Work::default();
        let mut last = 0;
        let mut at = |records, phase, fraction| {
            meter.show(&mut work, &progress(records, phase, fraction));
            let position = meter.bar.position();
            assert!(position >= last, "{position} after {last}");
            last = position;
            position
        };
        let hundred = || {
            assert_eq!(io::copy(&mut meter.read(&[0; 100][..]), &mut io::sink()).unwrap(), 100);
        };
        hundred();
        assert_eq!(at(1, Phase::Searching, 0.0), 100);
        assert_eq!(at(1, Phase::Searching, 0.25), 125);
        assert_eq!(at(1, Phase::Refining, 0.5), 150);
        assert_eq!(at(1, Phase::Settled, 1.0), 200);
        hundred();
        assert_eq!(at(2, Phase::Refining, 0.5), 350);
        assert_eq!(at(2, Phase::Settled, 1.0), 400);
        assert_eq!(meter.bar.length(), Some(400));
    }
}
