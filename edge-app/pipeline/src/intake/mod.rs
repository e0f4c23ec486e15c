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
use flexid_wire::state::{Sensor, State};
use flexid_wire::text::clipped;

use crate::config::Config;
use crate::record::{Record, SAMPLES};
use crate::signals::{NoReading, SignalTable};
use crate::source::{Arrival, Flow, Frame, FrameKind, FrameSource};
use crate::unchecked;
pub use counts::Counts;
use misfit::Misfits;
pub(crate) use misfit::frame_id;
use obstacle::{ReadingFaults, counters_jump, frames_of_record, frames_of_sensors};
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
    heard: Heard,
    misfits: Misfits,
    /// Counts and misfits at the newest record. Obstacles are judged by what has come since.
    at_record: Counts,
    misfits_since: Misfits,
    unknown: UnknownFrames,
    reading_faults: ReadingFaults,
    plausibility: Plausibility,
}

/// Silence of a sensor after which its frames do not come any more, s: that of a joint angle that comes in a cycle.
const SILENCE_S: f64 = 2.0;

/// When signals came.
#[derive(Clone, Copy, Debug, Default)]
struct Heard {
    /// Time of the newest frame of any kind, s.
    newest_s: f64,
    /// Time of the newest frame of force and of acceleration, s. `None` if none has come.
    sensors_s: [Option<f64>; 2],
    /// Whether the angle of each joint has come at least once.
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
            heard: Heard::default(),
            misfits: Misfits::default(),
            at_record: Counts::default(),
            misfits_since: Misfits::default(),
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
            heard,
            misfits,
            misfits_since,
            unknown,
            reading_faults,
            plausibility,
            ..
        } = self;
        for &Arrival { time_s, frame } in &*batch {
            heard.newest_s = time_s;
            let decoded = table.decode(&frame, |reading| {
                reading_faults.note(&reading);
                if !plausibility.note(&reading) {
                    return;
                }
                heard.note(time_s, &reading);
                stream.push(time_s, reading, |record| {
                    plausibility.note_record(record);
                    sink(record);
                });
            });
            match decoded {
                Ok(limits) => {
                    misfits.fits(&frame);
                    misfits_since.fits(&frame);
                    counts.clipped += u64::from(limits.contains(&true));
                    for (count, limit) in counts.at_limit.iter_mut().zip(limits) {
                        *count += u64::from(limit);
                    }
                }
                Err(reason) => {
                    if reason == NoReading::UnknownId {
                        unknown.note(&frame);
                    }
                    count(&frame, reason, counts, [misfits, misfits_since]);
                }
            }
        }
        plausibility.note_stream(&stream.health());
        counts.all += batch.len() as u64;
        self.note_records();
        flow
    }

    /// Ends the stream: no frame will follow. Passes to `sink` what is complete enough for a record.
    pub fn finish(&mut self, mut sink: impl FnMut(&Record)) {
        self.stream.finish(|record| {
            self.plausibility.note_record(record);
            sink(record);
        });
        self.plausibility.note_stream(&self.stream.health());
        self.note_records();
    }

    /// Ends the present record after frames may have been missed. Passes to `sink` what is complete enough for a record, and
    /// discards all joint angles.
    pub fn forget_angles(&mut self, sink: impl FnMut(&Record)) {
        self.stream.forget_angles(sink);
        self.note_records();
    }

    /// Lets obstacles be judged from here on, if a record has come.
    fn note_records(&mut self) {
        if self.stream.health().records > self.at_record.stream.records {
            self.at_record = self.counts();
            self.misfits_since.begin_anew();
        }
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
        let came = |joint: &usize| self.heard.joints.get(*joint).is_some_and(|seen| *seen);
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
        let since = counts.since(&self.at_record, self.misfits_since.worst());
        if self.counts.all == 0 {
            return State::NoFrames;
        }
        if self.counts.all == self.counts.bus_errors {
            let interface = clipped(&config.interface);
            return State::OnlyErrors { errors: self.counts.bus_errors, interface };
        }
        // Behind a record, what has come is judged once it is as long as another.
        let is_enough = !recording || frames_of_sensors(&since) >= frames_of_record(config);
        if let Some(obstacle) = obstacle(&since, config).filter(|_| is_enough) {
            return State::Obstacle(obstacle);
        }
        if let Some(unknown) = self.unknown() {
            return State::UnknownFrames(unknown);
        }
        let [force, acceleration] = self.heard.sensors_s;
        if force.is_none() {
            return State::NoForce;
        }
        if acceleration.is_none() {
            return State::NoAcceleration;
        }
        if let Some(sensor) = self.heard.silent_sensor() {
            return State::SensorSilent(sensor);
        }
        let silent = config.model.driven().zip(self.heard.joints).filter(|(_, seen)| !seen);
        let silent: heapless::Vec<_, MAX_JOINTS> =
            silent.map(|(joint, _)| clipped(&joint.name)).collect();
        if !silent.is_empty() {
            return State::NoAngles(silent);
        }
        if let Some(obstacle) = counters_jump(&since.stream, config) {
            return State::Obstacle(obstacle);
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
fn count(frame: &Frame, reason: NoReading, counts: &mut Counts, misfits: [&mut Misfits; 2]) {
    let add = |kind| misfits.into_iter().for_each(|misfits| misfits.add(frame, kind));
    match reason {
        NoReading::WrongLength { expected } => {
            let got = frame.data().len() as u8;
            add(MisfitKind::Length { got, expected });
            counts.wrong_length += 1;
        }
        NoReading::NotData => {
            let remote = frame.kind == FrameKind::Remote;
            add(if remote { MisfitKind::Remote } else { MisfitKind::Fd });
            counts.not_data += 1;
        }
        NoReading::UnknownId => counts.unknown += 1,
        NoReading::ErrorFrame => counts.bus_errors += 1,
    }
}

impl Heard {
    fn note(&mut self, time_s: f64, reading: &Reading) {
        match reading {
            Reading::Force { .. } => self.sensors_s[0] = Some(time_s),
            Reading::Acceleration { .. } => self.sensors_s[1] = Some(time_s),
            Reading::Joint { index, .. } => {
                if let Some(heard) = self.joints.get_mut(usize::from(*index)) {
                    *heard = true;
                }
            }
        }
    }

    /// Returns the sensor that has come, but does not come any more while other frames do.
    fn silent_sensor(&self) -> Option<Sensor> {
        let sensors = [Sensor::Force, Sensor::Acceleration].into_iter().zip(self.sensors_s);
        let is_silent = |heard_s: f64| self.newest_s - heard_s > SILENCE_S;
        sensors.filter(|(_, heard)| heard.is_some_and(is_silent)).map(|(sensor, _)| sensor).next()
    }
}
