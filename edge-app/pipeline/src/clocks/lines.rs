//! Both clocks, and the samples of one sensor at the instants of the other.

use std::f64::consts::TAU;

use flexid_core::stream::{Invalid, StreamHealth, Validity};

use super::delay::Delay;
use super::found::{FoundClock, FoundClocks, NAMES, Untold};
use super::kept::{Expected, Kept, Part};
use super::kernel::Kernel;
use super::line::{Frame, Line, Run};
use super::number::Numbered;
use super::signal::Signal;

/// The lines of both sensors.
pub(super) struct Lines {
    pub(super) numbered: [Numbered; 2],
    pub(super) lines: [Line; 2],
    /// The sensor whose instants are taken.
    pub(super) base: usize,
    /// The other one's signal, by its runs.
    signals: Vec<Signal>,
    kernel: Kernel,
    /// Samples of the other sensor that are no measurement, and blocks that have too many.
    pub(super) judged: StreamHealth,
    /// The part of each run.
    pub(super) parts: [Vec<usize>; 2],
}

/// Scatter of the earliest arrivals over a turn, from which on turns are not told: half a turn is then 3.3 standard deviations.
const SCATTER: f64 = 0.15;
/// A recording with fewer frames than one in so many instants gives no record: a stream bridges one in two hundred.
const SPARSEST: i64 = 16;
/// A sensor is the slower one from this ratio of periods on.
const SLOWER: f64 = 1.1;
/// Largest phase at the end of the band of what bends within a record, rad. A jitter of 50 µs costs a quarter of the parameters of the
/// reference scenario, and none is missed; with 100 µs the fit does not settle (tried). At its 200 Hz 50 µs are this phase.
const BEND_RAD: f64 = 0.063;
const NAME_COUNTER: &str =
    "name the sensor's own counter in [signals], or record with stamps of the hardware";
pub(super) const STAMP: &str =
    "record with stamps of the hardware, and let nothing set the clock of the logger meanwhile";

impl Lines {
    /// Tells the lines of what is kept.
    ///
    /// # Errors
    /// The error names the sensor whose clock cannot be told.
    pub(super) fn of(kept: &Kept) -> Result<Self, Untold> {
        let bits = kept.expected.counter_bits;
        let numbered = [0, 1].map(|sensor| Numbered::of(&kept.sensors[sensor], bits[sensor]));
        let lines = [line(kept, &numbered, 0)?, line(kept, &numbered, 1)?];
        let base = usize::from(lines[1].period_s > SLOWER * lines[0].period_s);
        let ratio = lines[base].period_s / lines[1 - base].period_s;
        let block = ratio * kept.expected.record_samples as f64;
        let (signals, judged) = signals(kept, &numbered[1 - base], 1 - base, block as usize);
        let kernel = Kernel::of(ratio);
        let parts = [0, 1].map(|sensor| parts_of_runs(&kept.parts, &numbered[sensor], sensor));
        Ok(Self { numbered, lines, base, signals, kernel, judged, parts })
    }

    /// Frames of a run of the base from a number on, each with its sample.
    pub(super) fn instants(
        &self,
        run: usize,
        first: i64,
    ) -> impl Iterator<Item = (i64, usize)> + '_ {
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
    pub(super) fn covers(&self, run: usize, number: i64, other: usize, delay_s: f64) -> bool {
        let line = &self.lines[1 - self.base];
        let at = line.number(other, self.time_at(run, number, delay_s));
        line.runs.get(other).is_some_and(|own| (own.first as f64..=own.last as f64).contains(&at))
    }

    /// The run of the other sensor that has an instant of the base.
    pub(super) fn other_run(&self, run: usize, number: i64, delay_s: f64) -> Option<usize> {
        let part = self.parts[self.base][run];
        let parts = &self.parts[1 - self.base];
        let first = parts.partition_point(|own| *own < part);
        let end = parts.partition_point(|own| *own <= part);
        let line = &self.lines[1 - self.base];
        let time_s = self.time_at(run, number, delay_s);
        // The runs of a part begin one after the other. Two overlap where the clock was set back by a little.
        let has_begun = |own: &Run| own.number(time_s, line.period_s) >= own.first as f64;
        let begun = line.runs[..end.min(line.runs.len())].get(first..)?.partition_point(has_begun);
        let newest = (first..first + begun).rev().take(2);
        newest.rev().find(|other| self.covers(run, number, *other, delay_s))
    }

    /// The other sensor's signal at an instant of the base.
    pub(super) fn other_at(
        &self,
        run: usize,
        number: i64,
        other: usize,
        delay_s: f64,
    ) -> Option<[f32; 3]> {
        let at = self.lines[1 - self.base].number(other, self.time_at(run, number, delay_s));
        self.signals.get(other)?.at(at, &self.kernel)
    }

    pub(super) fn found(&self, expected: &Expected, delay: Option<Delay>) -> FoundClocks {
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

/// Tells the line of a sensor.
fn line(kept: &Kept, numbered: &[Numbered; 2], sensor: usize) -> Result<Line, Untold> {
    let Expected { counter_bits, highest_hz, .. } = kept.expected;
    let (own, name) = (&numbered[sensor], NAMES[sensor]);
    let untold = |reason: String, mend| Err(Untold { reason, mend });
    if own.scatter > SCATTER {
        let scatter_ms = 1e3 * own.scatter * own.period_s;
        let reason = format!(
            "the earliest arrivals of the {name} scatter by {scatter_ms:.2} ms, so that lost frames cannot be counted"
        );
        return untold(reason, NAME_COUNTER);
    }
    let Some(line) = Line::of(&own.frames, own.period_s) else {
        let frames = kept.sensors[sensor].len();
        let reason = format!("{frames} frames of the {name} are too few to tell its clock");
        return untold(reason, "record for some seconds");
    };
    let instants: i64 = line.runs.iter().map(|own| own.last - own.first + 1).sum();
    if instants > SPARSEST * own.frames.len() as i64 {
        let missing = SPARSEST - 1;
        let reason = format!("more than {missing} of {SPARSEST} frames of the {name} are missing");
        let mend = "name the signal that counts its samples, or leave it out; mend the bus";
        return untold(reason, mend);
    }
    if TAU * highest_hz * line.bend_s > BEND_RAD {
        let bend_ms = 1e3 * line.bend_s;
        let reason = format!("the arrivals of the {name} bend by {bend_ms:.2} ms within a record");
        return untold(reason, if counter_bits[sensor].is_some() { STAMP } else { NAME_COUNTER });
    }
    Ok(line)
}

/// Returns the signal of a sensor by its runs, and the counts of its samples that are no measurement. These are judged here, since a sample that is
/// taken between two others does not show that one of them was clipped. A block is about as long as a record.
fn signals(
    kept: &Kept,
    numbered: &Numbered,
    sensor: usize,
    block: usize,
) -> (Vec<Signal>, StreamHealth) {
    let mut validity = Validity::new(kept.expected.steps);
    let mut judged = StreamHealth::default();
    let mut judge = |block: &mut [&mut [f32]; 3]| {
        let mut invalid = [Invalid::default(); 2];
        invalid[sensor] = match sensor {
            0 => validity.remove_from_force(block),
            _ => validity.remove_from_acceleration(block),
        };
        judged.count_invalid(&invalid);
        invalid[sensor].are_many()
    };
    let mut samples = &numbered.samples[..];
    let mut signals = Vec::new();
    for run in numbered.frames.chunk_by(|one, next| one.run == next.run) {
        let (own, behind) = samples.split_at(run.len());
        samples = behind;
        let value =
            |(frame, &sample): (&Frame, &usize)| (frame.number, kept.sensors[sensor][sample].value);
        signals.push(Signal::of(run.iter().zip(own).map(value), block, &mut judge));
    }
    (signals, judged)
}

/// Returns the part of each run.
fn parts_of_runs(all: &[Part], numbered: &Numbered, sensor: usize) -> Vec<usize> {
    let mut parts = Vec::new();
    let mut from = 0;
    for run in numbered.frames.chunk_by(|one, next| one.run == next.run) {
        let first = numbered.samples[from];
        parts.push(all.partition_point(|own| own.sensors[sensor] <= first).saturating_sub(1));
        from += run.len();
    }
    parts
}
