//! The rules of time, for recordings whose sensors share no counter.
//!
//! | module     | holds                                                              |
//! | ---------- | ------------------------------------------------------------------ |
//! | `number`   | the numbers of frames: turns of counters, lost frames, runs        |
//! | `line`     | the clock of one sensor: a line through its earliest arrivals      |
//! | `delay`    | the delay between both, by the phase of a mass                     |
//! | `resample` | a signal at other instants                                         |
//! | `found`    | what was found, for people                                         |
//!
//! The instants are those of the slower sensor, of the force if both are as fast. The signal of the other is taken there, behind a low-pass
//! where it is the faster one. The readings that leave have common counters, and times on the lines. Joint angles keep their times.
//!
//! What a fit can make good is a delay, one for each record beside it, and one drift: their standard deviations widen the accuracies. A
//! clock that cannot be told so well gives no reading, but a reason.

mod delay;
mod found;
mod line;
mod number;
mod resample;

use flexid_core::imperfection::Accuracies;
use flexid_core::stream::Reading;
use nalgebra::Rotation3;

pub use delay::Delay;
pub use found::{FoundClock, FoundClocks, Untold};

use delay::{Piece, Settings};
use found::NAMES;
use line::Line;
use number::{Numbered, Sample};
use resample::{Kernel, Signal};

/// What is known of the recording beforehand.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Expected {
    /// Width of the counter of the force and of the acceleration, bits. `None`: without.
    pub(crate) counter_bits: [Option<u32>; 2],
    /// Configured rate, Hz.
    pub(crate) rate_hz: f64,
    /// Upper edge of the band that is fitted, Hz.
    pub(crate) highest_hz: f64,
    /// Samples of a record.
    pub(crate) record_samples: usize,
    /// From the axes of the force sensor and of the accelerometer to those of the TCP.
    pub(crate) axes: [Rotation3<f64>; 2],
    /// True if a fit seeks the delay anyway, with a prior that the configuration states.
    pub(crate) seeks_delay: bool,
}

/// The readings of a recording, until its end.
pub(crate) struct Kept {
    expected: Expected,
    sensors: [Vec<Sample>; 2],
    /// All other readings, with their times, s.
    others: Vec<(f64, Reading)>,
    /// Where the clock of the recording was set back: the first readings behind.
    parts: Vec<Part>,
    /// Time of the first reading, and of the newest, s. Smaller numbers have finer steps.
    times_s: Option<(f64, f64)>,
    /// The lines, once they are told, and the delay, s.
    told: Option<(Lines, f64)>,
}

/// The first force, acceleration and other reading of a part of the recording.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    sensors: [usize; 2],
    others: usize,
}

/// The lines of both sensors.
struct Lines {
    numbered: [Numbered; 2],
    lines: [Line; 2],
    /// The sensor whose instants are taken.
    base: usize,
    /// The other one's signal, by its runs.
    signals: Vec<Signal>,
    kernel: Kernel,
    /// The part of each run.
    parts: [Vec<usize>; 2],
}

/// An arrival that is earlier than the one before by more was made on another clock, s, as core's stream says.
const SET_BACK_S: f64 = 0.01;
/// Between runs of a pause this long, the counters that leave go on, s: for a stream it is a pause. Behind others it is a restart.
const SILENCE_S: f64 = 0.5;
/// Step of the counter at a restart, instants. No time that is shorter than [`SILENCE_S`] has so many.
const RESTART: u32 = 1 << 24;
/// Scatter of the earliest arrivals over a turn, from which on turns are not told: half a turn is then 3.3 standard deviations.
const SCATTER: f64 = 0.15;
/// A recording with fewer frames than one in so many instants gives no record: a stream bridges one in two hundred.
const SPARSEST: i64 = 16;
/// A sensor is the slower one from this ratio of periods on.
const SLOWER: f64 = 1.1;
/// Largest phase at the end of the band of what bends within a record, rad. A jitter of 50 µs costs a quarter of the parameters of the
/// reference scenario, and none is missed; with 100 µs the fit does not settle (tried). At its 200 Hz 50 µs are this phase.
const BEND_RAD: f64 = 0.063;
/// Largest standard deviation of the delay of a record, over the shortest period of the band: a fit begins in the right basin within a
/// quarter of that period, which is three of these. Of 200 Hz that is 0.42 ms: 1 ms was found, 3 ms was not (tried).
const BASIN: f64 = 0.25 / 3.0;

const NAME_COUNTER: &str =
    "name the sensor's own counter in [signals], or record with stamps of the hardware";
const STAMP: &str =
    "record with stamps of the hardware, and let nothing set the clock of the logger meanwhile";
const RECORD_AT_ONCE: &str = "record all cuts in one log without a pause, name the sensor's own counter in [signals], or record with stamps of the hardware";
const EXCITE: &str = "record cuts at several speeds that are rich above the band, each longer than a record, or state the delay: [calibration] delay_s = 1e-3, if both come within a millisecond";

impl Kept {
    pub(crate) fn new(expected: Expected) -> Self {
        Self {
            expected,
            sensors: Default::default(),
            others: Vec::new(),
            parts: vec![Part::default()],
            times_s: None,
            told: None,
        }
    }

    /// Takes a reading that arrived at a time, s.
    pub(crate) fn push(&mut self, time_s: f64, reading: Reading) {
        if !time_s.is_finite() {
            return;
        }
        let (first_s, newest_s) = self.times_s.unwrap_or((time_s, time_s));
        self.times_s = Some((first_s, time_s));
        if time_s < newest_s - SET_BACK_S {
            let sensors = self.sensors.each_ref().map(Vec::len);
            self.parts.push(Part { sensors, others: self.others.len() });
        }
        let time_s = time_s - first_s;
        match reading {
            Reading::Force { counter, value } => {
                self.sensors[0].push(Sample { time_s, counter, value })
            }
            Reading::Acceleration { counter, value } => {
                self.sensors[1].push(Sample { time_s, counter, value })
            }
            other => self.others.push((time_s, other)),
        }
    }

    /// Tells the clocks.
    ///
    /// # Errors
    /// The error says why they cannot be told.
    pub(crate) fn tell(&mut self) -> Result<FoundClocks, Untold> {
        let lines = self.lines()?;
        let expected = &self.expected;
        let delay = match self.delay(&lines) {
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
            let is_one = self.parts.len() == 1 && found.sensors.iter().all(|own| own.runs == 1);
            return Err(Untold { reason, mend: if is_one { STAMP } else { RECORD_AT_ONCE } });
        }
        self.told = Some((lines, delay.map_or(0.0, |own| own.delay_s)));
        Ok(found)
    }

    /// Passes all readings on, with common counters and instants. It passes none if the clocks were not told.
    pub(crate) fn give(mut self, mut sink: impl FnMut(f64, Reading)) {
        if let Some((lines, delay_s)) = self.told.take() {
            self.give_by(&lines, delay_s, &mut sink);
        }
    }

    fn lines(&self) -> Result<Lines, Untold> {
        let Expected { counter_bits, highest_hz, .. } = self.expected;
        let numbered =
            [0, 1].map(|sensor| Numbered::of(&self.sensors[sensor], counter_bits[sensor]));
        let line = |sensor: usize| {
            let (own, name) = (&numbered[sensor], NAMES[sensor]);
            let untold = |reason: String, mend| Err(Untold { reason, mend });
            if own.scatter > SCATTER {
                let scatter_s = own.scatter * own.period_s;
                return untold(
                    format!(
                        "the earliest arrivals of the {name} scatter by {:.2} ms, so that lost frames cannot be counted",
                        1e3 * scatter_s
                    ),
                    NAME_COUNTER,
                );
            }
            let Some(line) = Line::of(&own.frames, own.period_s) else {
                return untold(
                    format!(
                        "{} frames of the {name} are too few to tell its clock",
                        self.sensors[sensor].len()
                    ),
                    "record for some seconds",
                );
            };
            let instants: i64 = line.runs.iter().map(|own| own.last - own.first + 1).sum();
            if instants > SPARSEST * own.frames.len() as i64 {
                return untold(
                    format!(
                        "more than {} of {SPARSEST} frames of the {name} are missing",
                        SPARSEST - 1
                    ),
                    "name the signal that counts its samples, or leave it out; mend the bus",
                );
            }
            if std::f64::consts::TAU * highest_hz * line.bend_s > BEND_RAD {
                return untold(
                    format!(
                        "the arrivals of the {name} bend by {:.2} ms within a record",
                        1e3 * line.bend_s
                    ),
                    if counter_bits[sensor].is_some() { STAMP } else { NAME_COUNTER },
                );
            }
            Ok(line)
        };
        let lines = [line(0)?, line(1)?];
        let base = usize::from(lines[1].period_s > SLOWER * lines[0].period_s);
        let other = 1 - base;
        let signals = {
            let (frames, samples) = (&numbered[other].frames, &numbered[other].samples);
            let runs = frames.chunk_by(|one, next| one.run == next.run);
            let mut from = 0;
            runs.map(|run| {
                let own = run.iter().zip(&samples[from..]);
                from += run.len();
                Signal::of(
                    own.map(|(frame, &sample)| (frame.number, self.sensors[other][sample].value)),
                )
            })
            .collect()
        };
        let kernel = Kernel::of(lines[base].period_s / lines[other].period_s);
        let parts = [0, 1].map(|sensor| self.parts_of_runs(&numbered[sensor], sensor));
        Ok(Lines { numbered, lines, base, signals, kernel, parts })
    }

    /// Returns the part of each run.
    fn parts_of_runs(&self, numbered: &Numbered, sensor: usize) -> Vec<usize> {
        let mut parts = Vec::new();
        let mut from = 0;
        for run in numbered.frames.chunk_by(|one, next| one.run == next.run) {
            let first = numbered.samples[from];
            parts.push(
                self.parts.partition_point(|own| own.sensors[sensor] <= first).saturating_sub(1),
            );
            from += run.len();
        }
        parts
    }

    fn delay(&self, lines: &Lines) -> Result<Delay, String> {
        let Expected { record_samples, highest_hz, axes, .. } = self.expected;
        let settings = Settings {
            rate_hz: 1.0 / lines.lines[lines.base].period_s,
            above_hz: highest_hz,
            axes,
        };
        let pieces = |shift_s: f64| {
            let runs = 0..lines.lines[lines.base].runs.len();
            runs.flat_map(move |run| {
                let own = &lines.lines[lines.base].runs[run];
                let starts =
                    (own.first..=own.last - record_samples as i64 + 1).step_by(record_samples);
                starts.map(move |first| self.piece(lines, run, first, shift_s))
            })
        };
        let coarse = delay::delay(pieces(0.0), &settings)?;
        // Once the pieces hold the same instants, nothing is lost at their ends.
        let fine = delay::delay(pieces(coarse.delay_s), &settings)?;
        Ok(Delay { delay_s: coarse.delay_s + fine.delay_s, ..fine })
    }

    /// A piece of a run from an instant on, the acceleration later by `shift_s`.
    fn piece(&self, lines: &Lines, run: usize, first: i64, shift_s: f64) -> Piece {
        let length = self.expected.record_samples;
        let mut piece = Piece::default();
        let missing = [f32::NAN; 3];
        let mut own = lines.instants(run, first).peekable();
        let other = lines.other_run(run, first + length as i64 / 2, shift_s);
        for number in first..first + length as i64 {
            while own.next_if(|(at, _)| *at < number).is_some() {}
            let base = own.next_if(|(at, _)| *at == number);
            let base = base.map_or(missing, |(_, sample)| self.sensors[lines.base][sample].value);
            let other = other
                .and_then(|other| lines.other_at(run, number, other, shift_s))
                .unwrap_or(missing);
            let (force, acceleration) = if lines.base == 0 { (base, other) } else { (other, base) };
            for axis in 0..3 {
                piece.force[axis].push(force[axis]);
                piece.acceleration[axis].push(acceleration[axis]);
            }
        }
        piece
    }

    /// Passes all readings on, the acceleration later by `delay_s` than the force.
    fn give_by(&self, lines: &Lines, delay_s: f64, sink: &mut impl FnMut(f64, Reading)) {
        let base = lines.base;
        let first_s = self.times_s.map_or(0.0, |(first_s, _)| first_s);
        let mut counter = 0_u32;
        let mut newest_s = f64::NEG_INFINITY;
        for (part, begin) in self.parts.iter().enumerate() {
            let end = self.parts.get(part + 1).map_or(self.others.len(), |next| next.others);
            let mut others = self.others[begin.others..end].iter().peekable();
            for run in (0..lines.parts[base].len()).filter(|run| lines.parts[base][*run] == part) {
                let Some((first, last)) = self.known(lines, run, delay_s) else { continue };
                let begins_s = lines.lines[base].time_s(run, first as f64);
                let is_pause = (SILENCE_S..f64::INFINITY).contains(&(begins_s - newest_s));
                counter = counter.wrapping_add(if is_pause { 1 } else { RESTART });
                let mut own = lines.instants(run, first).peekable();
                let mut other_run = None;
                for number in first..=last {
                    let time_s = lines.lines[base].time_s(run, number as f64);
                    while let Some((at_s, reading)) = others.next_if(|(at_s, _)| *at_s <= time_s) {
                        sink(first_s + at_s, *reading);
                    }
                    while own.next_if(|(at, _)| *at < number).is_some() {}
                    let base_value = own.next_if(|(at, _)| *at == number);
                    let base_value = base_value.map(|(_, sample)| self.sensors[base][sample].value);
                    if other_run.is_none_or(|other| !lines.covers(run, number, other, delay_s)) {
                        other_run = lines.other_run(run, number, delay_s);
                    }
                    let other_value =
                        other_run.and_then(|other| lines.other_at(run, number, other, delay_s));
                    let values = if base == 0 {
                        [base_value, other_value]
                    } else {
                        [other_value, base_value]
                    };
                    let counter = counter.wrapping_add((number - first) as u32);
                    if let Some(value) = values[0] {
                        sink(first_s + time_s, Reading::Force { counter, value });
                    }
                    if let Some(value) = values[1] {
                        sink(first_s + time_s, Reading::Acceleration { counter, value });
                    }
                    newest_s = time_s;
                }
                counter = counter.wrapping_add((last - first) as u32);
            }
            others.for_each(|(at_s, reading)| sink(first_s + at_s, *reading));
            newest_s = f64::NEG_INFINITY;
        }
    }

    /// First and last instant of a run at which the other sensor is known: at both ends it is not, within the reach of the kernel.
    fn known(&self, lines: &Lines, run: usize, delay_s: f64) -> Option<(i64, i64)> {
        let own = &lines.lines[lines.base].runs[run];
        let is_known = |number: &i64| {
            let other = lines.other_run(run, *number, delay_s);
            other.is_some_and(|other| lines.other_at(run, *number, other, delay_s).is_some())
        };
        let first = (own.first..=own.last).find(is_known)?;
        (first..=own.last).rev().find(is_known).map(|last| (first, last))
    }
}

impl Lines {
    /// Frames of a run of the base from a number on, each with its sample.
    fn instants(&self, run: usize, first: i64) -> impl Iterator<Item = (i64, usize)> + '_ {
        let Numbered { frames, samples, .. } = &self.numbered[self.base];
        let from = frames.partition_point(|own| (own.run, own.number) < (run, first));
        let own =
            frames[from..].iter().zip(&samples[from..]).take_while(move |(own, _)| own.run == run);
        own.map(|(own, &sample)| (own.number, sample))
    }

    /// Time on the other sensor's line of an instant of the base, s.
    fn time_at(&self, run: usize, number: i64, delay_s: f64) -> f64 {
        let late_s = if self.base == 0 { delay_s } else { -delay_s };
        self.lines[self.base].time_s(run, number as f64) + late_s
    }

    /// Returns whether a run of the other sensor has an instant of the base.
    fn covers(&self, run: usize, number: i64, other: usize, delay_s: f64) -> bool {
        let line = &self.lines[1 - self.base];
        let at = line.number(other, self.time_at(run, number, delay_s));
        line.runs.get(other).is_some_and(|own| (own.first as f64..=own.last as f64).contains(&at))
    }

    /// The run of the other sensor that has an instant of the base.
    fn other_run(&self, run: usize, number: i64, delay_s: f64) -> Option<usize> {
        let part = self.parts[self.base][run];
        let parts = &self.parts[1 - self.base];
        let first = parts.partition_point(|own| *own < part);
        let end = parts.partition_point(|own| *own <= part);
        (first..end).find(|other| self.covers(run, number, *other, delay_s))
    }

    /// The other sensor's signal at an instant of the base.
    fn other_at(&self, run: usize, number: i64, other: usize, delay_s: f64) -> Option<[f32; 3]> {
        let at = self.lines[1 - self.base].number(other, self.time_at(run, number, delay_s));
        self.signals.get(other)?.at(at, &self.kernel)
    }

    fn found(&self, expected: &Expected, delay: Option<Delay>) -> FoundClocks {
        let sensors = [0, 1].map(|sensor| {
            let (line, numbered) = (&self.lines[sensor], &self.numbered[sensor]);
            let rate_hz = 1.0 / line.period_s;
            let instants: i64 = line.runs.iter().map(|own| own.last - own.first + 1).sum();
            let frames = numbered.frames.len() as u64;
            FoundClock {
                rate_hz,
                ppm: 1e6 * (rate_hz / expected.rate_hz - 1.0),
                ppm_std: 1e6 * line.drift_std,
                frames,
                late: line.late,
                lost: (instants.max(0) as u64).saturating_sub(frames),
                runs: line.runs.len(),
            }
        });
        let drift_std = self.lines[0].drift_std.hypot(self.lines[1].drift_std);
        // Of a single run the offset is the delay of all records.
        let runs = self.lines.iter().map(|own| own.runs.len()).max().unwrap_or_default();
        let square = |value: f64| value * value;
        let worst = |line: &Line| {
            let offset = line
                .runs
                .iter()
                .map(|own| own.std_s)
                .filter(|own| own.is_finite())
                .fold(0.0, f64::max);
            if runs > 1 { offset } else { line.wander_s }
        };
        let longest = |line: &Line| {
            line.runs.iter().map(|own| own.last - own.first).max().unwrap_or_default() as f64
                * line.period_s
        };
        let span_s = self.lines.iter().map(longest).fold(0.0, f64::max);
        let spread_s = delay.filter(|_| runs > 1).map_or(0.0, |own| own.spread_s);
        let variance = self.lines.iter().map(|line| square(worst(line))).sum::<f64>()
            + square(drift_std * span_s) / 12.0
            + square(spread_s);
        FoundClocks { sensors, delay, drift_std, record_delay_std_s: variance.sqrt() }
    }
}

impl FoundClocks {
    /// Returns accuracies that are wide enough for what the clocks leave unknown, beside what is `typical` without them. A delay that a fit seeks
    /// has a prior of its own.
    pub(crate) fn widen(
        &self,
        own: &Accuracies,
        typical: &Accuracies,
        seeks_delay: bool,
    ) -> Accuracies {
        let wider = |own: f64, typical: f64, std: f64| own.max(typical.hypot(std));
        let delay_std_s = self.delay.map_or(0.0, |delay| delay.std_s);
        Accuracies {
            delay: if seeks_delay {
                own.delay
            } else {
                wider(own.delay, typical.delay, delay_std_s)
            },
            delay_drift: wider(own.delay_drift, typical.delay_drift, self.drift_std),
            record_delay: wider(own.record_delay, typical.record_delay, self.record_delay_std_s),
            ..*own
        }
    }
}

#[cfg(test)]
mod tests;
