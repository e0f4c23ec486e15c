//! Frames in, records out: source, signal table, stream.

use std::io;
use std::time::Duration;

use flexid_core::MAX_JOINTS;
use flexid_core::stream::{Reading, Stream, StreamError, StreamHealth};

use super::{Record, SAMPLES};
use crate::config::Config;
use crate::signals::{NoReading, SignalTable};
use crate::source::{Arrival, Flow, FrameSource};

/// What has come in so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Frames of all kinds.
    pub all: u64,
    /// Frames of a known identifier and a wrong length.
    pub wrong_length: u64,
    /// Frames that no signal is in, and remote and CAN FD frames.
    pub unknown: u64,
    /// Errors that the bus reported.
    pub bus_errors: u64,
    /// What the stream says.
    pub stream: StreamHealth,
}

/// Turns frames into records.
pub struct Intake<'a> {
    table: &'a SignalTable,
    stream: Box<Stream<SAMPLES>>,
    counts: Counts,
    batch: Vec<Arrival>,
    seen: Seen,
}

/// Which signals have come at all.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    force: bool,
    acceleration: bool,
    joints: [bool; MAX_JOINTS],
}

impl<'a> Intake<'a> {
    /// An intake that has seen nothing. Needs a thread with a large stack.
    ///
    /// # Errors
    /// None for a checked config.
    pub fn new(config: &'a Config) -> Result<Self, StreamError> {
        Ok(Self {
            table: &config.signals,
            stream: Box::new(Stream::new(config.stream())?),
            counts: Counts::default(),
            batch: Vec::new(),
            seen: Seen::default(),
        })
    }

    /// Reads once from `source` and hands the records that are complete to `sink`.
    ///
    /// # Errors
    /// The source is broken for good; what it brought before has been taken.
    pub fn read(
        &mut self,
        source: &mut dyn FrameSource,
        timeout: Duration,
        mut sink: impl FnMut(&Record),
    ) -> io::Result<Flow> {
        self.batch.clear();
        let flow = source.read(&mut self.batch, timeout);
        for &Arrival { time_s, frame } in &self.batch {
            let decoded = self.table.decode(&frame, |reading| {
                self.seen.note(&reading);
                self.stream.push(time_s, reading, &mut sink);
            });
            match decoded {
                Ok(()) => {}
                Err(NoReading::WrongLength) => self.counts.wrong_length += 1,
                Err(NoReading::UnknownId | NoReading::NotData) => self.counts.unknown += 1,
                Err(NoReading::ErrorFrame) => self.counts.bus_errors += 1,
            }
        }
        self.counts.all += self.batch.len() as u64;
        flow
    }

    /// Nothing more will come: hands over what is complete enough.
    pub fn finish(&mut self, sink: impl FnMut(&Record)) {
        self.stream.finish(sink);
    }

    /// What has come in so far.
    pub fn counts(&self) -> Counts {
        Counts { stream: self.stream.health(), ..self.counts }
    }

    /// What is awaited, in words.
    pub fn state(&self, config: &Config) -> String {
        let silent = config.model.joints.iter().zip(self.seen.joints).filter(|(_, seen)| !seen);
        let silent: Vec<&str> = silent.map(|(joint, _)| joint.name.as_str()).collect();
        if self.counts.all == 0 {
            "waiting for frames".into()
        } else if !self.seen.force {
            "waiting for force frames: none seen".into()
        } else if !self.seen.acceleration {
            "waiting for acceleration frames: none seen".into()
        } else if !silent.is_empty() {
            format!("waiting for joint angles: {} not seen", silent.join(", "))
        } else if self.stream.health().records == 0 {
            let seconds = config.record_samples as f64 / config.rate_hz;
            format!("waiting for the first record: {seconds:.1} s of milling at one pose")
        } else {
            "measuring".into()
        }
    }
}

impl Seen {
    fn note(&mut self, reading: &Reading) {
        match reading {
            Reading::Force { .. } => self.force = true,
            Reading::Acceleration { .. } => self.acceleration = true,
            Reading::Joint { index, .. } => {
                if let Some(seen) = self.joints.get_mut(usize::from(*index)) {
                    *seen = true;
                }
            }
        }
    }
}
