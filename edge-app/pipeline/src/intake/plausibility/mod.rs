//! Checks whether readings agree with the configuration: units, broken sensors, angles that the robot cannot have.
//!
//! The residuals alone do not show a wrong unit: it makes the fit as wrong as a wrong mass does. This module therefore counts
//! implausible readings, frame by frame and record by record, and its warnings come before all others. The counts cover the
//! newest frames only: the warning of a fault that was corrected ends after some minutes.

mod axes;
mod channel;
mod joints;
pub(crate) mod rest;
mod scale;

use flexid_core::MAX_JOINTS;
use flexid_core::stream::{Reading, StreamHealth};
use flexid_wire::implausible::{self, SignalFrames, Signals, WrongSamples};
use flexid_wire::text::clipped;

use crate::config::Config;
use crate::record::{MAX_EXPERIMENTS, Record, SAMPLES};
pub(crate) use axes::Axes;
use channel::{Channel, Ends, WINDOW, Window, end_piece};
use joints::Joints;
pub use joints::{Excess, NoMeasurement};
pub(crate) use scale::Scale;

/// Least force of a cut, N. Milling takes tens of newtons and more. The acceleration of a robot's link by one newton (1 N on
/// some 10 kg) is hidden by the noise. A force in kN that is taken for N stays below this limit up to 1000 N.
const LEAST_CUT_N: f32 = 1.0;

/// Most force frames that a tally covers: as many as the longest records that are kept have, 4.4 minutes at 2 kHz.
const STRETCH: u64 = (MAX_EXPERIMENTS * SAMPLES) as u64;
/// Spikes that are rarer than one in so many frames are not reported: 65 s at 2 kHz. A robot that mills a record a minute would
/// have one in each.
const RARE: u64 = 131_072;

/// Implausible readings among the newest frames. The axes are force x, y, z, then acceleration x, y, z.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Implausible {
    /// Number of single samples far beyond their neighbours, or wrong by themselves in a record. Rare ones count as 0.
    pub spikes: [u64; 6],
    /// Number of samples of windows in which this axis never changed although another moved.
    pub stuck: [u64; 6],
    /// Number of samples at a value that the axis reaches again and again, but never exceeds.
    pub flat: [u64; 6],
    /// Number of clipped samples of records.
    pub clipped: [u64; 6],
    /// Number of records that were refused because of them.
    pub refused_clipped: u64,
    /// Number of samples of records that repeat the one before although the axis should have moved.
    pub held: [u64; 6],
    /// Number of records that were refused because of them.
    pub refused_held: u64,
    /// Angle or stroke of each joint that is farthest beyond its limits. A single angle that does not hold is left out.
    pub joints: [Option<Excess>; MAX_JOINTS],
    /// Readings of each joint that are no measurement.
    pub no_measurement: [NoMeasurement; MAX_JOINTS],
    /// Mean acceleration of the newest record that was long enough, m/s².
    pub rest: Option<[f64; 3]>,
    /// Largest absolute value of the force so far, N.
    pub largest_force: f32,
}

/// Counts implausible readings.
#[derive(Clone, Debug)]
pub(super) struct Plausibility {
    channels: [Channel; 6],
    /// False for an axis that is not measured, or not in every cut.
    are_measured: [bool; 6],
    /// Largest counters of force and acceleration.
    last_counters: [u32; 2],
    /// Newest counters of force and acceleration.
    counters: [Option<u32>; 2],
    /// Number of force frames.
    frames: u64,
    joints: Joints,
    /// The tally that is reported, and the next one, which begins half a [`STRETCH`] later.
    tallies: [Tally; 2],
    rest: Option<[f64; 3]>,
    largest_force: f32,
    /// Findings of the stream in records so far.
    in_records: InRecords,
}

/// Wrong samples of records.
#[derive(Clone, Copy, Debug, Default)]
struct InRecords {
    /// Number of single wrong samples, with less distance from their neighbours than spikes of the frames.
    spikes: [u64; 6],
    clipped: [u64; 6],
    refused_clipped: u64,
    held: [u64; 6],
    refused_held: u64,
}

/// Implausible readings in a stretch of frames.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    /// Number of force frames.
    frames: u64,
    spikes: [u64; 6],
    in_records: InRecords,
    stuck: [u64; 6],
    ends: [Ends; 6],
    joints: [Option<Excess>; MAX_JOINTS],
}

impl InRecords {
    /// Adds what came after `before`.
    fn add(&mut self, now: &Self, before: &Self) {
        for axis in 0..6 {
            self.spikes[axis] += now.spikes[axis] - before.spikes[axis];
            self.clipped[axis] += now.clipped[axis] - before.clipped[axis];
            self.held[axis] += now.held[axis] - before.held[axis];
        }
        self.refused_clipped += now.refused_clipped - before.refused_clipped;
        self.refused_held += now.refused_held - before.refused_held;
    }
}

impl Tally {
    fn note_angle(&mut self, joint: usize, excess: Excess) {
        self.joints[joint] = Some(excess.worse(self.joints[joint]));
    }
}

impl Plausibility {
    pub(super) fn new(config: &Config) -> Self {
        let signals = &config.signals;
        let steps = [signals.force_resolution, signals.acceleration_resolution];
        Self {
            channels: std::array::from_fn(|axis| Channel::new(steps[axis / 3])),
            are_measured: std::array::from_fn(|axis| signals.is_measured(axis)),
            last_counters: [0, 1].map(|sensor| signals.last_counter(sensor)),
            counters: [None; 2],
            frames: 0,
            joints: Joints::new(&config.model, &config.signals),
            tallies: [Tally::default(); 2],
            rest: None,
            largest_force: 0.0,
            in_records: InRecords::default(),
        }
    }

    /// Takes a reading. Returns whether it is a measurement.
    pub(super) fn note(&mut self, reading: &Reading) -> bool {
        match reading {
            Reading::Force { counter, value } => {
                let largest = value.iter().fold(0.0_f32, |largest, v| largest.max(v.abs()));
                self.largest_force = self.largest_force.max(largest);
                self.sensor(0, *counter, value);
                self.count_frame();
            }
            Reading::Acceleration { counter, value } => self.sensor(1, *counter, value),
            Reading::Joint { index, value } => {
                let joint = usize::from(*index);
                if !self.joints.is_measurement(joint, *value) {
                    return false;
                }
                if let Some(excess) = self.joints.note(joint, *value, self.frames) {
                    self.tallies.iter_mut().for_each(|tally| tally.note_angle(joint, excess));
                }
            }
            Reading::Setup(_) => {}
        }
        true
    }

    pub(super) fn note_record(&mut self, record: &Record) {
        if let Some(mean) = rest::mean(record) {
            self.rest = Some(mean);
        }
    }

    /// Notes what the stream has found in all records so far.
    pub(super) fn note_stream(&mut self, health: &StreamHealth) {
        let &StreamHealth { spikes, clipped, refused_clipped, held, refused_held, .. } = health;
        let now = InRecords { spikes, clipped, refused_clipped, held, refused_held };
        let before = std::mem::replace(&mut self.in_records, now);
        for tally in &mut self.tallies {
            tally.in_records.add(&now, &before);
        }
    }

    pub(super) fn implausible(&self) -> Implausible {
        let [tally, _] = &self.tallies;
        let flat = |axis: usize| self.channels[axis].flat(&tally.ends[axis]);
        let is_rare = |spikes: u64| spikes * RARE < tally.frames;
        Implausible {
            spikes: std::array::from_fn(|axis| {
                // Most of the former are among the latter.
                let spikes = tally.spikes[axis].max(tally.in_records.spikes[axis]);
                if is_rare(spikes) { 0 } else { spikes }
            }),
            stuck: tally.stuck,
            flat: std::array::from_fn(flat),
            clipped: tally.in_records.clipped,
            refused_clipped: tally.in_records.refused_clipped,
            held: tally.in_records.held,
            refused_held: tally.in_records.refused_held,
            joints: tally.joints,
            no_measurement: self.joints.none,
            rest: self.rest,
            largest_force: self.largest_force,
        }
    }

    /// Counts a force frame, and ends the window and the tally that end with it.
    fn count_frame(&mut self) {
        self.frames += 1;
        self.tallies.iter_mut().for_each(|tally| tally.frames += 1);
        if self.frames.is_multiple_of(WINDOW.into()) {
            self.end_window();
        }
        if self.frames.is_multiple_of(STRETCH / 2) {
            self.tallies = [self.tallies[1], Tally::default()];
        }
    }

    /// Takes a frame of the force (`sensor` 0) or of the acceleration (`sensor` 1).
    fn sensor(&mut self, sensor: usize, counter: u32, value: &[f32; 3]) {
        if value.iter().any(|value| !value.is_finite()) {
            return;
        }
        let before = self.counters[sensor].replace(counter);
        let last = self.last_counters[sensor];
        let follows = before.is_some_and(|before| before.wrapping_add(1) & last == counter);
        let first = 3 * sensor;
        let mut spikes = [false; 3];
        for (axis, value) in value.iter().enumerate() {
            let channel = &mut self.channels[first + axis];
            if !follows {
                channel.interrupt();
            }
            spikes[axis] = channel.push(*value);
        }
        let axes = first..first + 3;
        let ends = self.tallies.iter_mut().map(|tally| &mut tally.ends[axes.clone()]);
        end_piece(&mut self.channels[axes.clone()], ends);
        // A short impact shakes all axes at once, so that only a spike of a single axis counts.
        if let [true, false, false] | [false, true, false] | [false, false, true] = spikes {
            for tally in &mut self.tallies {
                for (axis, spike) in spikes.into_iter().enumerate() {
                    tally.spikes[first + axis] += u64::from(spike);
                }
            }
        }
    }

    fn end_window(&mut self) {
        let windows = self.channels.each_mut().map(Channel::end_window);
        let moves = windows.contains(&Window::Moves);
        let standing = self.joints.standing(self.frames);
        for tally in &mut self.tallies {
            for (axis, window) in windows.into_iter().enumerate() {
                let is_stuck = moves && window == Window::Stuck && self.are_measured[axis];
                tally.stuck[axis] += u64::from(if is_stuck { WINDOW } else { 0 });
            }
            for (joint, excess) in standing.into_iter().enumerate() {
                if let Some(excess) = excess {
                    tally.note_angle(joint, excess);
                }
            }
        }
    }
}

/// Returns the kinds of implausible readings, the gravest first: wrong units, then broken channels. `at_limit` counts the samples
/// at the limit of each signal, which have a warning of their own.
pub(crate) fn warnings(
    implausible_readings: &Implausible,
    at_limit: &[u64; 6],
    config: &Config,
) -> Vec<implausible::Implausible> {
    use implausible::Implausible::{BeyondLimits, Clipped, Flat, Held, Spikes, Stuck};
    let Implausible { clipped, held, .. } = implausible_readings;
    // A finding in records takes the place of the same in frames, and a value at the limit has a warning of its own.
    let unless = |counts: &[u64; 6], named: &dyn Fn(usize) -> bool| -> [u64; 6] {
        std::array::from_fn(|axis| if named(axis) { 0 } else { counts[axis] })
    };
    let cut_off = |axis: usize| clipped[axis] > 0 || at_limit[axis] > 0;
    let stuck = unless(&implausible_readings.stuck, &|axis| held[axis] > 0);
    let flat = unless(&implausible_readings.flat, &cut_off);
    // In a signal that is cut off, each sample that is not stands out like a spike.
    let is_flat = |axis: usize| implausible_readings.flat[axis] > 0 || cut_off(axis);
    let spikes = unless(&implausible_readings.spikes, &is_flat);
    let of_records = |counts: &[u64; 6], refused: u64| {
        signals(counts, config).map(|signals| WrongSamples { signals, refused })
    };
    let warnings = [
        joints::warning(&implausible_readings.joints, config).map(BeyondLimits),
        implausible_readings.rest.and_then(|mean| rest::warning(mean, config)),
        of_records(held, implausible_readings.refused_held).map(Held),
        of_records(clipped, implausible_readings.refused_clipped).map(Clipped),
        signals(&stuck, config).map(Stuck),
        signals(&flat, config).map(Flat),
        signals(&spikes, config).map(Spikes),
    ];
    warnings.into_iter().flatten().collect()
}

/// Returns the signals of the sensors of which `frames` counts any. Returns `None` if there is none.
pub(crate) fn signals(frames: &[u64; 6], config: &Config) -> Option<Signals> {
    let concerned = config.signals.axes.iter().zip(frames).filter(|(_, frames)| **frames > 0);
    let signals: Signals = concerned
        .map(|(signal, frames)| SignalFrames { signal: clipped(signal), frames: *frames })
        .collect();
    (!signals.is_empty()).then_some(signals)
}

/// Returns the largest force so far, N, if it is smaller than that of a cut.
pub(crate) fn faint_force(implausible_readings: &Implausible) -> Option<f32> {
    let largest = implausible_readings.largest_force;
    (largest > 0.0 && largest < LEAST_CUT_N).then_some(largest)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn config() -> Config {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-tools/scenario/mill3-edge.toml");
        Config::load(&file).unwrap()
    }

    fn line(config: &Config, readings: impl Iterator<Item = Reading>) -> Vec<String> {
        let mut plausibility = Plausibility::new(config);
        readings.for_each(|reading| _ = plausibility.note(&reading));
        lines(&plausibility, config)
    }

    fn lines(plausibility: &Plausibility, config: &Config) -> Vec<String> {
        let warnings = warnings(&plausibility.implausible(), &[0; 6], config);
        warnings.iter().map(ToString::to_string).collect()
    }

    /// Returns the readings of a cut of 100 N, changed by `spoil`.
    fn cut(spoil: impl Fn(u32, &mut [f32; 6])) -> impl Iterator<Item = Reading> {
        (0..10_000_u32).flat_map(move |counter| {
            let tone = |axis: usize| (0.3 * counter as f32 + axis as f32).sin();
            let mut values: [f32; 6] =
                std::array::from_fn(|axis| if axis < 3 { 100.0 } else { 5.0 } * tone(axis));
            spoil(counter, &mut values);
            let [fx, fy, fz, ax, ay, az] = values;
            [
                Reading::Force { counter, value: [fx, fy, fz] },
                Reading::Acceleration { counter, value: [ax, ay, az] },
            ]
        })
    }

    #[test]
    fn broken_channels_are_named_with_their_count() {
        let config = config();
        assert_eq!(line(&config, cut(|_, _| {})), Vec::<String>::new());
        let stuck = line(&config, cut(|_, values| values[2] = 1.5));
        assert_eq!(
            stuck,
            ["stuck while others move: Fz in 8192 frames: check the sensor and its wiring"]
        );
        let spiked = line(
            &config,
            cut(|counter, values| {
                if counter % 1000 == 999 {
                    values[3] += 900.0;
                    values[1] -= if counter == 4999 { 4000.0 } else { 0.0 };
                }
            }),
        );
        assert_eq!(
            spiked,
            [
                "spikes of single samples: Fy in 1 frame and ax in 9 frames: check wiring, shield and supply"
            ]
        );
        let clipped = line(&config, cut(|_, values| values[0] = values[0].min(70.0)));
        assert!(clipped[0].starts_with("flat at its largest value: Fx in "), "{clipped:?}");
        assert_eq!(clipped.len(), 1, "{clipped:?}");
        // A jump across missing frames is no jump of the signal.
        let rests = |counter: u32, values: &mut [f32; 6]| {
            values[0] = 0.01 * values[0] + if counter == 5003 { 300.0 } else { 0.0 };
        };
        let whole = line(&config, cut(rests));
        let spike = "spikes of single samples: Fx in 1 frame: check wiring, shield and supply";
        assert_eq!(whole, [spike]);
        let missing =
            |reading: &Reading| !matches!(reading, Reading::Force { counter: 5001 | 5002, .. });
        assert_eq!(line(&config, cut(rests).filter(missing)), Vec::<String>::new());
        // The short impact of a tooth shows on all axes.
        let tooth = |counter: u32, values: &mut [f32; 6]| {
            let force = if counter.is_multiple_of(50) { 900.0 } else { 0.0 };
            values[..3].copy_from_slice(&[force, 0.5 * force, -0.3 * force]);
        };
        assert_eq!(line(&config, cut(tooth)), Vec::<String>::new());
    }

    /// Reads a cut of `frames` frames, changed by `spoil`.
    fn go_on(
        plausibility: &mut Plausibility,
        frames: u64,
        spoil: impl Fn(u64, &mut [f32; 6]) + Copy,
    ) {
        for first in (0..frames).step_by(10_000) {
            let spoil =
                |counter: u32, values: &mut [f32; 6]| spoil(first + u64::from(counter), values);
            cut(spoil)
                .take(2 * (frames - first) as usize)
                .for_each(|reading| _ = plausibility.note(&reading));
        }
    }

    #[test]
    fn what_was_mended_is_warned_of_no_more() {
        let config = config();
        let mut plausibility = Plausibility::new(&config);
        let joint = |index, value| Reading::Joint { index, value };
        let line = |plausibility: &Plausibility| lines(plausibility, &config);
        let spoil = |frame: u64, values: &mut [f32; 6]| {
            values[0] = values[0].min(70.0);
            values[2] = 1.5;
            values[3] += if frame % 1000 == 999 { 900.0 } else { 0.0 };
        };
        [90.0, 90.0, 0.0].iter().for_each(|angle| _ = plausibility.note(&joint(1, *angle)));
        // The faults last for a long time.
        go_on(&mut plausibility, STRETCH, spoil);
        [90.0, 90.0, 0.0].iter().for_each(|angle| _ = plausibility.note(&joint(1, *angle)));
        plausibility.note(&joint(2, 90.0));
        go_on(&mut plausibility, 20_000, spoil);
        let all = line(&plausibility);
        let starts = [
            "q2 reads 90",
            "stuck while",
            "flat at its largest value: Fx",
            "spikes of single samples: ax",
        ];
        assert_eq!(all.len(), starts.len(), "{all:?}");
        assert!(all.iter().zip(starts).all(|(line, start)| line.starts_with(start)), "{all:?}");
        go_on(&mut plausibility, STRETCH - 20_000, |_, _| {});
        let [still] = &line(&plausibility)[..] else { panic!("{:?}", line(&plausibility)) };
        assert!(still.starts_with("q3 reads 90.0000"), "it holds: {still}");
    }

    #[test]
    fn rare_spikes_are_none() {
        let config = config();
        let mut plausibility = Plausibility::new(&config);
        let spikes = |every: u64| {
            move |frame: u64, values: &mut [f32; 6]| {
                values[1] += if frame % every == every - 100 { 4000.0 } else { 0.0 };
            }
        };
        for (every, named) in [(RARE, true), (4 * RARE, false)] {
            go_on(&mut plausibility, STRETCH, spikes(every));
            let line = plausibility.implausible().spikes;
            assert_eq!(line[1] > 0, named, "{every}: {line:?}");
        }
    }

    #[test]
    fn a_force_that_no_cut_makes_is_asked_for_its_unit() {
        let faint =
            |largest_force| faint_force(&Implausible { largest_force, ..Implausible::default() });
        assert_eq!([faint(0.0), faint(0.2), faint(2.0)], [None, Some(0.2), None]);
    }
}
