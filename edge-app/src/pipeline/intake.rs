//! Frames in, records out: source, signal table, stream.

use std::io;
use std::time::Duration;

use flexid_core::MAX_JOINTS;
use flexid_core::stream::{Reading, Stream, StreamError, StreamHealth};

use super::obstacle::{MisfitKind, Misfits, Oddities, obstacle};
use super::{Misfit, Record, SAMPLES};
use crate::config::Config;
use crate::signals::{NoReading, SignalTable};
use crate::source::{Arrival, Flow, Frame, FrameKind, FrameSource};

/// What has come in so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Frames of all kinds.
    pub all: u64,
    /// Frames of a known identifier, but of another length than the DBC file says.
    pub wrong_length: u64,
    /// Frames of an identifier that has no signal.
    pub unknown: u64,
    /// Remote requests and CAN FD frames of a known identifier.
    pub not_data: u64,
    /// The worst of both kinds.
    pub misfit: Option<Misfit>,
    /// Force and acceleration frames with a value at the limit of its signal.
    pub clipped: u64,
    /// How many for each axis: force x, y, z, acceleration x, y, z.
    pub at_limit: [u64; 6],
    /// Force and acceleration frames whose counter is the one of the frame before.
    pub standing_still: [u64; 2],
    /// Force and acceleration readings that are no finite numbers.
    pub not_finite: u64,
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
    misfits: Misfits,
    oddities: Oddities,
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
            misfits: Misfits::default(),
            oddities: Oddities::default(),
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
                self.oddities.note(&reading);
                self.stream.push(time_s, reading, &mut sink);
            });
            match decoded {
                Ok(limits) => {
                    self.misfits.fits(&frame);
                    self.counts.clipped += u64::from(limits.contains(&true));
                    for (count, limit) in self.counts.at_limit.iter_mut().zip(limits) {
                        *count += u64::from(limit);
                    }
                }
                Err(reason) => count(&frame, reason, &mut self.counts, &mut self.misfits),
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
        Counts {
            misfit: self.misfits.worst(),
            standing_still: self.oddities.standing_still,
            not_finite: self.oddities.not_finite,
            stream: self.stream.health(),
            ..self.counts
        }
    }

    /// What stands in the way of records, or else what is awaited, in words.
    pub fn state(&self, config: &Config) -> String {
        let silent = config.model.joints.iter().zip(self.seen.joints).filter(|(_, seen)| !seen);
        let silent: Vec<&str> = silent.map(|(joint, _)| joint.name.as_str()).collect();
        let counts = self.counts();
        let recording = counts.stream.records > 0;
        if self.counts.all == 0 {
            "waiting for frames".into()
        } else if let Some(obstacle) = obstacle(&counts, config).filter(|_| !recording) {
            obstacle
        } else if !self.seen.force {
            "waiting for force frames: none seen".into()
        } else if !self.seen.acceleration {
            "waiting for acceleration frames: none seen".into()
        } else if !silent.is_empty() {
            format!("waiting for joint angles: {} not seen", silent.join(", "))
        } else if !recording {
            let seconds = config.record_samples as f64 / config.rate_hz;
            format!("waiting for the first record: {seconds:.1} s of milling at one pose")
        } else {
            "measuring".into()
        }
    }
}

/// Counts a frame that gives no reading.
fn count(frame: &Frame, reason: NoReading, counts: &mut Counts, misfits: &mut Misfits) {
    match reason {
        NoReading::WrongLength { expected } => {
            let got = frame.data().len() as u8;
            misfits.add(frame, MisfitKind::Length { got, expected });
            counts.wrong_length += 1;
        }
        NoReading::NotData => {
            let remote = frame.kind == FrameKind::Remote;
            let kind = if remote { MisfitKind::Remote } else { MisfitKind::Fd };
            misfits.add(frame, kind);
            counts.not_data += 1;
        }
        NoReading::UnknownId => counts.unknown += 1,
        NoReading::ErrorFrame => counts.bus_errors += 1,
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
