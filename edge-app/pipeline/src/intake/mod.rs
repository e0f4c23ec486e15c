//! Turns frames into records, by source, signal table and stream.

mod counts;
mod feeding;
mod misfit;
mod obstacle;
pub(crate) mod plausibility;
mod unknown;
mod window;

use std::io;
use std::time::Duration;

use flexid_core::MAX_JOINTS;
use flexid_core::stream::{Reading, Stream, StreamHealth};
use flexid_wire::misfits::{self, MisfitKind};
use flexid_wire::state::{Obstacle, Sensor, State};
use flexid_wire::text::clipped;

use crate::clocks::{FoundClocks, Recording, Untold};
use crate::config::Config;
use crate::record::{Record, SAMPLES};
use crate::signals::{Decoder, NoReading, SignalTable};
use crate::source::{Arrival, Content, Flow, Frame, FrameSource};
use crate::unchecked;
pub use counts::Counts;
use feeding::Angles;
pub use feeding::Feeding;
use misfit::Misfits;
pub(crate) use misfit::frame_id;
use obstacle::{ReadingFaults, counters_jump, frames_of_record, frames_of_sensors};
pub(crate) use obstacle::{obstacle, rate_used, wrong_rate};
use plausibility::Plausibility;
pub use plausibility::{Excess, Implausible, NoMeasurement};
use unknown::UnknownFrames;
use window::{Mark, Window};

/// Turns frames into records.
pub struct Intake<'a> {
    table: &'a SignalTable,
    decoder: Decoder<'a>,
    stream: Box<Stream<SAMPLES>>,
    counts: Counts,
    batch: Vec<Arrival>,
    heard: Heard,
    misfits: Misfits,
    /// The newest frames, by which obstacles are judged.
    window: Window,
    unknown: UnknownFrames,
    reading_faults: ReadingFaults,
    plausibility: Plausibility,
    angles: Angles,
    /// Readings of sensors with clocks of their own, until the recording ends.
    kept: Option<Box<Recording>>,
    /// What was told of these clocks.
    clocks: Option<Result<FoundClocks, Untold>>,
    /// Their samples that were left out before the stream.
    judged: StreamHealth,
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
    /// True for a joint whose angle has come at least once.
    joints: [bool; MAX_JOINTS],
    /// Newest reading of each joint that is no measurement. `None` if a measurement has come since.
    not_available: [Option<f64>; MAX_JOINTS],
}

impl<'a> Intake<'a> {
    /// Makes an intake that has not read any frame. The calling thread needs a large stack.
    ///
    /// # Errors
    /// A checked config gives no error.
    pub fn new(config: &'a Config) -> io::Result<Self> {
        Ok(Self {
            table: &config.signals,
            decoder: Decoder::new(&config.signals),
            stream: Box::new(Stream::new(config.stream()).map_err(unchecked)?),
            counts: Counts::default(),
            batch: Vec::new(),
            heard: Heard::default(),
            misfits: Misfits::default(),
            window: Window::new(frames_of_record(config)),
            unknown: UnknownFrames::default(),
            reading_faults: ReadingFaults::default(),
            plausibility: Plausibility::new(config),
            angles: Angles::new(config.record_samples as f64 / config.rate_hz),
            kept: config.own_clocks().map(|expected| Box::new(Recording::new(expected))),
            clocks: None,
            judged: StreamHealth::default(),
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
        let mut batch = std::mem::take(&mut self.batch);
        batch.clear();
        let flow = source.read(&mut batch, timeout);
        batch.iter().for_each(|arrival| self.take(arrival, &mut sink));
        self.batch = batch;
        self.plausibility.note_stream(&self.stream_health());
        flow
    }

    fn take(&mut self, &Arrival { time_s, content }: &Arrival, sink: &mut impl FnMut(&Record)) {
        let Self {
            decoder,
            stream,
            counts,
            heard,
            misfits,
            window,
            unknown,
            reading_faults,
            plausibility,
            angles,
            kept,
            ..
        } = self;
        heard.newest_s = time_s;
        counts.all += 1;
        let (mut has_record, mut is_over) = (false, false);
        let mut note = |reading| {
            reading_faults.note(&reading);
            let is_measurement = plausibility.note(&reading);
            heard.note(time_s, &reading, is_measurement);
            if !is_measurement {
                return;
            }
            let is_of_sensor = !matches!(reading, Reading::Joint { .. } | Reading::Setup(_));
            is_over |= is_of_sensor && window.note();
            if let Some(kept) = kept {
                return kept.push(time_s, reading);
            }
            angles.note(time_s, &reading);
            stream.push(time_s, reading, |record| {
                has_record = true;
                plausibility.note_record(record);
                angles.note_record(record);
                sink(record);
            });
        };
        let decoded = match content {
            Content::Frame(frame) => Some((frame, decoder.decode(time_s, &frame, note))),
            Content::Reading(reading) => {
                note(reading);
                None
            }
        };
        match decoded {
            None => {}
            Some((frame, Ok(limits))) => {
                let left_out = decoder.left_out() - counts.left_out;
                counts.left_out += left_out;
                is_over |= left_out > 0 && window.note();
                match left_out {
                    0 => misfits.fits(&frame),
                    frames => misfits.add(&frame, MisfitKind::Incomplete, frames),
                }
                counts.clipped += u64::from(limits.contains(&true));
                for (count, limit) in counts.at_limit.iter_mut().zip(limits) {
                    *count += u64::from(limit);
                }
            }
            Some((frame, Err(reason))) => {
                match reason {
                    NoReading::UnknownId => unknown.note(&frame),
                    NoReading::WrongLength { .. } | NoReading::NotData => is_over |= window.note(),
                    NoReading::ErrorFrame => {}
                }
                count(&frame, reason, counts, misfits);
            }
        }
        if has_record {
            self.window.begin_anew(self.mark());
        } else if is_over {
            self.window.advance(self.mark());
        }
    }

    /// Ends the stream: no frame will follow. Passes to `sink` what is complete enough for a record.
    pub fn finish(&mut self, mut sink: impl FnMut(&Record)) {
        let mut has_record = false;
        self.tell_clocks();
        if let Some(kept) = self.kept.take() {
            kept.give(|time_s, reading| {
                self.angles.note(time_s, &reading);
                self.stream.push(time_s, reading, |record| {
                    has_record = true;
                    self.plausibility.note_record(record);
                    self.angles.note_record(record);
                    sink(record);
                });
            });
        }
        self.stream.finish(|record| {
            has_record = true;
            self.plausibility.note_record(record);
            self.angles.note_record(record);
            sink(record);
        });
        self.plausibility.note_stream(&self.stream_health());
        if has_record {
            self.window.begin_anew(self.mark());
        }
    }

    /// Tells the clocks of a recording that has ended. Returns `None` if one counter counts the instants of both sensors.
    pub fn tell_clocks(&mut self) -> Option<&Result<FoundClocks, Untold>> {
        if let Some(kept) = self.kept.as_mut().filter(|_| self.clocks.is_none()) {
            self.clocks = Some(kept.tell());
            self.judged = kept.judged();
        }
        self.clocks.as_ref()
    }

    /// Ends the present record after frames may have been missed. Passes to `sink` what is complete enough for a record, and
    /// discards all joint angles.
    pub fn forget_angles(&mut self, sink: impl FnMut(&Record)) {
        self.finish(sink);
        self.stream.forget_angles(|_| {});
    }

    /// Returns what has come in so far, as a window begins with it.
    fn mark(&self) -> Mark {
        Mark { counts: self.counts(), misfits: self.misfits.seen().to_vec() }
    }

    /// Returns the counts so far.
    pub fn counts(&self) -> Counts {
        Counts {
            misfit: self.misfits.worst_since(&[]),
            standing_still: self.reading_faults.standing_still,
            not_finite: self.reading_faults.not_finite,
            implausible: self.plausibility.implausible(),
            feeding: self.angles.feeding,
            stream: self.stream_health(),
            ..self.counts
        }
    }

    /// Returns what the stream has counted. Where sensors have clocks of their own, these tell which frames are missing, and which samples never came
    /// to the stream.
    fn stream_health(&self) -> StreamHealth {
        let mut health = self.stream.health();
        health.add_invalid(&self.judged);
        if let Some(Ok(found)) = &self.clocks {
            health.frames = found.sensors.iter().map(|own| own.frames).sum();
            health.frames_lost = found.lost();
            health.frames_unheard = health.frames_unheard.min(health.frames_lost);
        }
        health
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
        let Mark { counts: earlier, misfits } = self.window.begin();
        let since = counts.since(earlier, self.misfits.worst_since(misfits));
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
            return State::Obstacle(match obstacle {
                Obstacle::Misfit(misfit) => Obstacle::Misfit(self.misfits.so_far(misfit)),
                other => other,
            });
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
        let Heard { joints: heard, not_available, .. } = &self.heard;
        let name = |joint: usize| {
            let joint = config.model.driven().nth(joint);
            joint.map(|joint| clipped(&joint.name)).unwrap_or_default()
        };
        let is_silent = |joint: &usize| !heard[*joint] && not_available[*joint].is_none();
        let silent = (0..config.model.driven().count()).filter(is_silent);
        let silent: heapless::Vec<_, MAX_JOINTS> = silent.map(name).collect();
        if !silent.is_empty() {
            return State::NoAngles(silent);
        }
        let mut missing = self.stream.missing_joints();
        let not_available = missing.find_map(|joint| Some((joint, not_available[joint]?)));
        if let Some((joint, value)) = not_available {
            return State::AngleNotAvailable { joint: name(joint), value };
        }
        if let Some(obstacle) = counters_jump(&since.stream, config) {
            return State::Obstacle(obstacle);
        }
        let readings = &counts.implausible;
        let implausible =
            plausibility::warnings(readings, &counts.at_limit, config).into_iter().next();
        if let Some(joint) = self.stream.missing_joint() {
            State::AngleStopped { joint: name(joint), implausible }
        } else if !recording {
            let seconds = config.record_samples as f64 / config.rate_hz;
            let faint_force_n = plausibility::faint_force(readings);
            State::AwaitingRecord { seconds, faint_force_n, implausible }
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
            misfits.add(frame, MisfitKind::Length { got, expected }, 1);
            counts.wrong_length += 1;
        }
        NoReading::NotData => {
            misfits.add(frame, MisfitKind::Remote, 1);
            counts.not_data += 1;
        }
        NoReading::UnknownId => counts.unknown += 1,
        NoReading::ErrorFrame => counts.bus_errors += 1,
    }
}

impl Heard {
    fn note(&mut self, time_s: f64, reading: &Reading, is_measurement: bool) {
        match *reading {
            Reading::Force { .. } => self.sensors_s[0] = Some(time_s),
            Reading::Acceleration { .. } => self.sensors_s[1] = Some(time_s),
            Reading::Joint { index, value } => {
                let joint = usize::from(index);
                if let (Some(heard), Some(not_available)) =
                    (self.joints.get_mut(joint), self.not_available.get_mut(joint))
                {
                    *heard |= is_measurement;
                    *not_available = (!is_measurement).then_some(value);
                }
            }
            Reading::Setup(_) => {}
        }
    }

    /// Returns the sensor that has come, but does not come any more while other frames do.
    fn silent_sensor(&self) -> Option<Sensor> {
        let sensors = [Sensor::Force, Sensor::Acceleration].into_iter().zip(self.sensors_s);
        let is_silent = |heard_s: f64| self.newest_s - heard_s > SILENCE_S;
        sensors.filter(|(_, heard)| heard.is_some_and(is_silent)).map(|(sensor, _)| sensor).next()
    }
}
