//! Turns frames into records, by source, signal table and stream.

mod counts;
mod misfit;
mod obstacle;
pub(crate) mod plausibility;
mod unknown;

use std::io;
use std::time::Duration;

use flexid_core::MAX_JOINTS;
use flexid_core::stream::{Reading, Stream};
use flexid_wire::misfits::{self, MisfitKind};
use flexid_wire::state::State;
use flexid_wire::text::clipped;

use crate::config::Config;
use crate::record::{Record, SAMPLES};
use crate::signals::{NoReading, SignalTable};
use crate::source::{Arrival, Flow, Frame, FrameKind, FrameSource};
use crate::unchecked;
pub use counts::Counts;
use misfit::Misfits;
pub(crate) use misfit::frame_id;
use obstacle::ReadingFaults;
pub(crate) use obstacle::{obstacle, rate_used, wrong_rate};
use plausibility::Plausibility;
pub use plausibility::{Excess, Implausible, NoMeasurement};
use unknown::UnknownFrames;

/// Turns frames into records.
pub struct Intake<'a> {
    table: &'a SignalTable,
    stream: Box<Stream<SAMPLES>>,
    counts: Counts,
    batch: Vec<Arrival>,
    seen: Seen,
    misfits: Misfits,
    unknown: UnknownFrames,
    reading_faults: ReadingFaults,
    plausibility: Plausibility,
}

/// Signals that have come at least once.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    force: bool,
    acceleration: bool,
    joints: [bool; MAX_JOINTS],
}

impl<'a> Intake<'a> {
    /// Makes an intake that has not read any frame. The calling thread needs a large stack.
    ///
    /// # Errors
    /// A checked config gives no error.
    pub fn new(config: &'a Config) -> io::Result<Self> {
        Ok(Self {
            table: &config.signals,
            stream: Box::new(Stream::new(config.stream()).map_err(unchecked)?),
            counts: Counts::default(),
            batch: Vec::new(),
            seen: Seen::default(),
            misfits: Misfits::default(),
            unknown: UnknownFrames::default(),
            reading_faults: ReadingFaults::default(),
            plausibility: Plausibility::new(config),
        })
    }

    /// Reads once from `source` and passes each complete record to `sink`.
    ///
    /// # Errors
    /// The source is broken for good. The frames that it brought before have been taken.
    pub fn read(
        &mut self,
        source: &mut dyn FrameSource,
        timeout: Duration,
        mut sink: impl FnMut(&Record),
    ) -> io::Result<Flow> {
        self.batch.clear();
        let flow = source.read(&mut self.batch, timeout);
        let Self {
            table,
            stream,
            counts,
            batch,
            seen,
            misfits,
            unknown,
            reading_faults,
            plausibility,
        } = self;
        for &Arrival { time_s, frame } in &*batch {
            let decoded = table.decode(&frame, |reading| {
                seen.note(&reading);
                reading_faults.note(&reading);
                if !plausibility.note(&reading) {
                    return;
                }
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
                        unknown.note(&frame);
                    }
                    count(&frame, reason, counts, misfits);
                }
            }
        }
        plausibility.note_stream(&stream.health());
        counts.all += batch.len() as u64;
        flow
    }

    /// Ends the stream: no frame will follow. Passes to `sink` what is complete enough for a record.
    pub fn finish(&mut self, mut sink: impl FnMut(&Record)) {
        self.stream.finish(|record| {
            self.plausibility.note_record(record);
            sink(record);
        });
        self.plausibility.note_stream(&self.stream.health());
    }

    /// Ends the present record after frames may have been missed. Passes to `sink` what is complete enough for a record, and
    /// discards all joint angles.
    pub fn forget_angles(&mut self, sink: impl FnMut(&Record)) {
        self.stream.forget_angles(sink);
    }

    /// Returns the counts so far.
    pub fn counts(&self) -> Counts {
        Counts {
            misfit: self.misfits.worst(),
            standing_still: self.reading_faults.standing_still,
            not_finite: self.reading_faults.not_finite,
            implausible: self.plausibility.implausible(),
            stream: self.stream.health(),
            ..self.counts
        }
    }

    /// Returns the part of a full record that the present cut has given so far, 0 to 1.
    pub fn record_fraction(&self) -> f32 {
        self.stream.record_fraction()
    }

    /// Returns the signals of the joints whose angles used to come in a cycle and do not come any more, base first.
    pub fn silent_joints(&self) -> impl Iterator<Item = &str> {
        let came = |joint: &usize| self.seen.joints.get(*joint).is_some_and(|seen| *seen);
        let silent = self.stream.missing_joints().filter(came);
        silent.filter_map(|joint| self.table.joints.get(joint).map(String::as_str))
    }

    /// Returns the unknown identifiers beside the expected ones, if no frame has a known identifier.
    fn unknown(&self) -> Option<misfits::UnknownFrames> {
        let known = self.counts.all - self.counts.unknown - self.counts.bus_errors;
        (known == 0).then(|| self.unknown.beside(&self.table.identifiers())).flatten()
    }

    /// Returns the obstacle to records, or else what the intake waits for.
    pub fn state(&self, config: &Config) -> State {
        let counts = self.counts();
        let recording = counts.stream.records > 0;
        if self.counts.all == 0 {
            return State::NoFrames;
        }
        if self.counts.all == self.counts.bus_errors {
            let interface = clipped(&config.interface);
            return State::OnlyErrors { errors: self.counts.bus_errors, interface };
        }
        if let Some(obstacle) = obstacle(&counts, config).filter(|_| !recording) {
            return State::Obstacle(obstacle);
        }
        if let Some(unknown) = self.unknown() {
            return State::UnknownFrames(unknown);
        }
        if !self.seen.force {
            return State::NoForce;
        }
        if !self.seen.acceleration {
            return State::NoAcceleration;
        }
        let silent = config.model.driven().zip(self.seen.joints).filter(|(_, seen)| !seen);
        let silent: heapless::Vec<_, MAX_JOINTS> =
            silent.map(|(joint, _)| clipped(&joint.name)).collect();
        if !silent.is_empty() {
            return State::NoAngles(silent);
        }
        let readings = &counts.implausible;
        let implausible =
            plausibility::warnings(readings, &counts.at_limit, config).into_iter().next();
        if !recording {
            let seconds = config.record_samples as f64 / config.rate_hz;
            let faint_force_n = plausibility::faint_force(readings);
            State::AwaitingRecord { seconds, faint_force_n, implausible }
        } else if let Some(place) = self.stream.missing_joint() {
            let joint = config.model.driven().nth(place);
            let joint = joint.map(|joint| clipped(&joint.name)).unwrap_or_default();
            State::AngleStopped { joint, implausible }
        } else {
            State::Measuring { implausible }
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
