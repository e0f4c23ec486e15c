//! Whether readings can be what the configuration says they are: units, broken sensors, angles that the robot cannot have.
//!
//! A wrong unit is not seen in the residuals alone: it makes the fit as wrong as a wrong mass does. What can be said of the
//! readings themselves is counted here, frame by frame and record by record, and told before all else.

mod channel;
mod joints;
mod rest;
mod scale;

use flexid_core::MAX_JOINTS;
use flexid_core::stream::Reading;

use super::Record;
use super::names::{clipped_name, enumerate};
use crate::config::Config;
use crate::summary::count;
use channel::{Channel, Window};
use joints::Beyond;
pub use joints::Excess;
pub(super) use scale::Scale;

/// Bytes for the names of signals in a line.
const ROOM: usize = 120;
/// A force that never reaches this, N, is that of no cut: milling takes tens of newtons and more, and of a newton the
/// acceleration of a robot's link (1 N on some 10 kg) drowns in the noise. The same force in kN stays below it up to 1000 N.
const LEAST_CUT_N: f32 = 1.0;

/// What is odd about the readings so far; force x, y, z, then acceleration x, y, z.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Oddness {
    /// Single samples far beyond their neighbours.
    pub spikes: [u64; 6],
    /// Samples of windows in which this axis never changed although another moved.
    pub stuck: [u64; 6],
    /// Samples at a value that the axis never exceeds, though it reaches it again and again.
    pub flat: [u64; 6],
    /// The angle or stroke of each joint that is farthest beyond what the joint can reach.
    pub joints: [Option<Excess>; MAX_JOINTS],
    /// Mean acceleration of the newest record that was long enough, m/s².
    pub rest: Option<[f64; 3]>,
    /// Largest force of all, either sign, N.
    pub largest_force: f32,
}

/// Counts what is odd.
#[derive(Clone, Debug)]
pub(super) struct Plausibility {
    channels: [Channel; 6],
    /// What the counters count up to, and where force and acceleration stand.
    last_counter: u32,
    counters: [Option<u32>; 2],
    frames: u64,
    beyond: Beyond,
    odd: Oddness,
}

impl Plausibility {
    pub(super) fn new(config: &Config) -> Self {
        let signals = &config.signals;
        let [force, acceleration] =
            [signals.force_resolution, signals.acceleration_resolution].map(Channel::new);
        Self {
            channels: [force, force, force, acceleration, acceleration, acceleration],
            last_counter: u32::MAX >> (32 - signals.counter_bits.clamp(1, 32)),
            counters: [None; 2],
            frames: 0,
            beyond: Beyond::new(&config.model),
            odd: Oddness::default(),
        }
    }

    pub(super) fn note(&mut self, reading: &Reading) {
        match reading {
            Reading::Force { counter, value } => {
                let largest = value.iter().fold(0.0_f32, |largest, v| largest.max(v.abs()));
                self.odd.largest_force = self.odd.largest_force.max(largest);
                self.frames += 1;
                self.sensor(0, *counter, value);
                if channel::ends_window(self.frames) {
                    self.end_window();
                }
            }
            Reading::Acceleration { counter, value } => self.sensor(1, *counter, value),
            Reading::Joint { index, value } => {
                self.beyond.note(usize::from(*index), *value, &mut self.odd.joints);
            }
        }
    }

    pub(super) fn note_record(&mut self, record: &Record) {
        if let Some(mean) = rest::mean(record) {
            self.odd.rest = Some(mean);
        }
    }

    pub(super) fn oddness(&self) -> Oddness {
        Oddness { flat: self.channels.each_ref().map(Channel::flat), ..self.odd }
    }

    /// Takes a frame of the force (0) or the acceleration (1).
    fn sensor(&mut self, sensor: usize, counter: u32, value: &[f32; 3]) {
        if value.iter().any(|value| !value.is_finite()) {
            return;
        }
        let before = self.counters[sensor].replace(counter);
        let follows =
            before.is_some_and(|before| before.wrapping_add(1) & self.last_counter == counter);
        let first = 3 * sensor;
        let mut spikes = [false; 3];
        for (axis, value) in value.iter().enumerate() {
            let channel = &mut self.channels[first + axis];
            if !follows {
                channel.interrupt();
            }
            spikes[axis] = channel.push(*value);
        }
        // A short impact shakes all axes at once: no axis by itself.
        if let [true, false, false] | [false, true, false] | [false, false, true] = spikes {
            for (axis, spike) in spikes.into_iter().enumerate() {
                self.odd.spikes[first + axis] += u64::from(spike);
            }
        }
    }

    fn end_window(&mut self) {
        let windows = self.channels.each_mut().map(Channel::end_window);
        if windows.contains(&Window::Moves) {
            for (stuck, window) in self.odd.stuck.iter_mut().zip(windows) {
                *stuck += if window == Window::Stuck { channel::FRAMES } else { 0 };
            }
        }
    }
}

/// What is implausible, in words with the mend, the gravest first: wrong units, then broken channels. `at_limit` are the samples
/// at the end of what a signal carries, which have a warning of their own.
pub(super) fn warnings(odd: &Oddness, at_limit: &[u64; 6], config: &Config) -> Vec<String> {
    let mut warnings: Vec<String> = joints::warning(&odd.joints, config).into_iter().collect();
    warnings.extend(odd.rest.and_then(|mean| rest::warning(mean, config)));
    let mut channels = |samples: [u64; 6], what: &str, mend: &str| {
        let axes = config.signals.axes.iter().zip(samples).filter(|(_, samples)| *samples > 0);
        let axes: Vec<String> = axes
            .map(|(name, samples)| format!("{} in {}", clipped_name(name), count(samples, "frame")))
            .collect();
        if !axes.is_empty() {
            warnings.push(format!("{what}: {}: {mend}", enumerate(&axes, ROOM)));
        }
    };
    channels(odd.stuck, "stuck while others move", "check the sensor and its wiring");
    let flat = std::array::from_fn(|axis| if at_limit[axis] == 0 { odd.flat[axis] } else { 0 });
    channels(flat, "flat at its largest value", "the sensor is overdriven: widen its range");
    // Where a signal is cut off, each sample that is not stands out.
    let whole = |axis: usize| odd.flat[axis] == 0 && at_limit[axis] == 0;
    let spikes = std::array::from_fn(|axis| if whole(axis) { odd.spikes[axis] } else { 0 });
    channels(spikes, "spikes of single samples", "check wiring, shield and supply");
    warnings
}

/// That the force so far is that of no cut; empty where it may be one.
pub(super) fn faint_force(odd: &Oddness) -> String {
    let largest = odd.largest_force;
    if largest > 0.0 && largest < LEAST_CUT_N {
        format!("; no force above {largest:.2} N so far: in kN?")
    } else {
        String::new()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn config() -> Config {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-tools/scenario/mill3-edge.toml");
        Config::load(&file).unwrap()
    }

    fn told(config: &Config, readings: impl Iterator<Item = Reading>) -> Vec<String> {
        let mut plausibility = Plausibility::new(config);
        readings.for_each(|reading| plausibility.note(&reading));
        warnings(&plausibility.oddness(), &[0; 6], config)
    }

    /// A cut of 100 N, changed by `spoil`.
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
        assert_eq!(told(&config, cut(|_, _| {})), Vec::<String>::new());
        let stuck = told(&config, cut(|_, values| values[2] = 1.5));
        assert_eq!(
            stuck,
            ["stuck while others move: Fz in 8192 frames: check the sensor and its wiring"]
        );
        let spiked = told(
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
        let clipped = told(&config, cut(|_, values| values[0] = values[0].min(70.0)));
        assert!(clipped[0].starts_with("flat at its largest value: Fx in "), "{clipped:?}");
        assert_eq!(clipped.len(), 1, "{clipped:?}");
        // A jump where frames are missing is none in the signal.
        let rests = |counter: u32, values: &mut [f32; 6]| {
            values[0] = 0.01 * values[0] + if counter == 5003 { 300.0 } else { 0.0 };
        };
        let whole = told(&config, cut(rests));
        let spike = "spikes of single samples: Fx in 1 frame: check wiring, shield and supply";
        assert_eq!(whole, [spike]);
        let missing =
            |reading: &Reading| !matches!(reading, Reading::Force { counter: 5001 | 5002, .. });
        assert_eq!(told(&config, cut(rests).filter(missing)), Vec::<String>::new());
        // The short impact of a tooth is in all axes.
        let tooth = |counter: u32, values: &mut [f32; 6]| {
            let force = if counter.is_multiple_of(50) { 900.0 } else { 0.0 };
            values[..3].copy_from_slice(&[force, 0.5 * force, -0.3 * force]);
        };
        assert_eq!(told(&config, cut(tooth)), Vec::<String>::new());
    }

    #[test]
    fn a_force_that_no_cut_makes_is_asked_for_its_unit() {
        let faint = |largest_force| faint_force(&Oddness { largest_force, ..Oddness::default() });
        assert_eq!(faint(0.2), "; no force above 0.20 N so far: in kN?");
        assert_eq!([faint(0.0), faint(2.0)], ["", ""]);
    }
}
