//! Frames in, records out: source, signal table, stream.

use std::io;
use std::time::Duration;

use flexid_core::MAX_JOINTS;
use flexid_core::stream::{Reading, Stream, StreamError, StreamHealth};

use super::names::clipped_name;
use super::obstacle::{MisfitKind, Misfits, Oddities, obstacle};
use super::plausibility::{self, Oddness, Plausibility};
use super::strangers::Strangers;
use super::{Misfit, Record, SAMPLES};
use crate::config::Config;
use crate::signals::{NoReading, SignalTable};
use crate::source::{Arrival, Flow, Frame, FrameKind, FrameSource};
use crate::summary::count as count_of;

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
    /// What the readings themselves look like.
    pub oddness: Oddness,
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
    strangers: Strangers,
    oddities: Oddities,
    plausibility: Plausibility,
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
            strangers: Strangers::default(),
            oddities: Oddities::default(),
            plausibility: Plausibility::new(config),
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
        let Self { table, stream, counts, batch, seen, misfits, strangers, oddities, plausibility } =
            self;
        for &Arrival { time_s, frame } in &*batch {
            let decoded = table.decode(&frame, |reading| {
                seen.note(&reading);
                oddities.note(&reading);
                plausibility.note(&reading);
                stream.push(time_s, reading, |record| {
                    plausibility.note_record(record);
                    sink(record);
                });
            });
            match decoded {
                Ok(limits) => {
                    misfits.fits(&frame);
                    counts.clipped += u64::from(limits.contains(&true));
                    for (count, limit) in counts.at_limit.iter_mut().zip(limits) {
                        *count += u64::from(limit);
                    }
                }
                Err(reason) => {
                    if reason == NoReading::UnknownId {
                        strangers.note(&frame);
                    }
                    count(&frame, reason, counts, misfits);
                }
            }
        }
        counts.all += batch.len() as u64;
        flow
    }

    /// Nothing more will come: hands over what is complete enough.
    pub fn finish(&mut self, mut sink: impl FnMut(&Record)) {
        self.stream.finish(|record| {
            self.plausibility.note_record(record);
            sink(record);
        });
    }

    /// Frames may have been missed: hands over what is complete enough, and no joint angle holds any more.
    pub fn forget_angles(&mut self, sink: impl FnMut(&Record)) {
        self.stream.forget_angles(sink);
    }

    /// What has come in so far.
    pub fn counts(&self) -> Counts {
        Counts {
            misfit: self.misfits.worst(),
            standing_still: self.oddities.standing_still,
            not_finite: self.oddities.not_finite,
            oddness: self.plausibility.oddness(),
            stream: self.stream.health(),
            ..self.counts
        }
    }

    /// How much of a full record the present cut has given so far, 0 to 1.
    pub fn record_fraction(&self) -> f32 {
        self.stream.record_fraction()
    }

    /// What came instead, if none of the frames that came has a known identifier.
    fn strangers(&self) -> Option<String> {
        let known = self.counts.all - self.counts.unknown - self.counts.bus_errors;
        (known == 0).then(|| self.strangers.beside(&self.table.identifiers())).flatten()
    }

    /// What stands in the way of records, or else what is awaited, in words.
    pub fn state(&self, config: &Config) -> String {
        let counts = self.counts();
        let recording = counts.stream.records > 0;
        if self.counts.all == 0 {
            return "waiting for frames".into();
        }
        if self.counts.all == self.counts.bus_errors {
            let errors = count_of(self.counts.bus_errors, "error");
            let interface = &config.interface;
            return format!(
                "waiting for frames: {errors} of the bus and no frame: is the bit rate of {interface} that of the bus?"
            );
        }
        if let Some(obstacle) = obstacle(&counts, config).filter(|_| !recording) {
            return obstacle;
        }
        if let Some(strangers) = self.strangers() {
            return format!("no frame of [bus] dbc: {strangers}");
        }
        if !self.seen.force {
            return "waiting for force frames: none seen".into();
        }
        if !self.seen.acceleration {
            return "waiting for acceleration frames: none seen".into();
        }
        let silent = config.model.joints.iter().zip(self.seen.joints).filter(|(_, seen)| !seen);
        let silent: Vec<String> = silent.map(|(joint, _)| clipped_name(&joint.name)).collect();
        if !silent.is_empty() {
            return format!("waiting for joint angles: {} not seen", silent.join(", "));
        }
        let state = if !recording {
            let seconds = config.record_samples as f64 / config.rate_hz;
            let faint = plausibility::faint_force(&counts.oddness);
            format!("waiting for the first record: {seconds:.1} s of milling at one pose{faint}")
        } else if let Some(joint) = self.stream.missing_joint() {
            let joint = clipped_name(&config.model.joints[joint].name);
            format!("waiting for joint angles: {joint} does not come any more")
        } else {
            "measuring".into()
        };
        match plausibility::warnings(&counts.oddness, &counts.at_limit, config).first() {
            Some(warning) => format!("{state}; {warning}"),
            None => state,
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
