//! From readings as they come off the bus to records: aligned by counter, gaps bridged, cut at a static pose.
//!
//! A record starts up to a second before the cut, so that the noise can be read from it, and is as long as the
//! configuration says. Where the robot moves, the sensor starts anew or a gap is too long to be bridged, what
//! has been taken becomes records of the powers of two that it still holds.

mod align;
mod bridge;
mod noise;
mod stretch;

use heapless::Vec;

use align::{Aligned, Aligner, Channel, Frame};
use stretch::{Moved, Stretch};

use crate::MAX_JOINTS;
use crate::spectrum::fft::MIN_SAMPLES;

/// One decoded frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// Force that the tool exerts on the robot, along the force sensor's axes.
    Force {
        /// Counts the instants; wraps.
        counter: u32,
        /// N.
        value: [f32; 3],
    },
    /// Acceleration, along the accelerometer's axes.
    Acceleration {
        /// Counts the instants; wraps; equal to the force's at the same instant.
        counter: u32,
        /// m/s².
        value: [f32; 3],
    },
    /// Angle (or stroke) of one joint.
    Joint {
        /// From 0, base first.
        index: u8,
        /// rad or m.
        value: f64,
    },
}

/// What the stream must know of the signals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreamConfig {
    /// Force and acceleration samples per second, Hz.
    pub rate_hz: f64,
    /// Samples of a full record: a power of two up to the stream's capacity.
    pub record_samples: usize,
    /// Number of joint angles that a pose needs.
    pub joints: usize,
    /// Width of the counters, bits (8 to 32).
    pub counter_bits: u32,
    /// Smallest step of the force signal, N.
    pub force_resolution: f32,
    /// Smallest step of the acceleration signal, m/s².
    pub acceleration_resolution: f32,
}

/// Why a stream refuses its configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StreamError {
    /// `rate_hz` is not positive and finite.
    Rate,
    /// `record_samples` is not a power of two from 256 to the capacity.
    RecordSamples,
    /// `joints` is not 1 to [`MAX_JOINTS`].
    Joints,
    /// `counter_bits` is not 8 to 32.
    CounterBits,
    /// A resolution is not positive and finite.
    Resolution,
}

/// What the stream has seen since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StreamHealth {
    /// Force and acceleration readings taken.
    pub frames: u64,
    /// Force and acceleration readings that their counters say are missing.
    pub frames_lost: u64,
    /// Of the samples in emitted records, those that were bridged, force and acceleration each counted.
    pub bridged: u64,
    /// Counters that disagreed with the time that passed: the sensor started anew, or was silent.
    pub restarts: u64,
    /// Readings whose counter had already been seen.
    pub repeated: u64,
    /// Records emitted.
    pub records: u64,
    /// Samples given up because the pose moved, the gap was too long or the stretch too short.
    pub samples_discarded: u64,
    /// Readings refused: a value that is not finite, a joint that the robot does not have, a single odd counter.
    pub refused: u64,
    /// Records whose instants arrived at another rate than the configuration says. Faster ones are refused; slower
    /// ones may come from a sender that was held up, and are kept.
    pub wrong_rate: u64,
    /// Instants per second of the newest of those, as they arrived; 0 before the first. Hz.
    pub measured_rate_hz: f32,
}

/// One stretch of force and acceleration at one static pose, without holes.
#[derive(Clone, Debug, PartialEq)]
pub struct Record<const N: usize> {
    /// Time of the first sample, on the clock of the readings, s.
    pub start_s: f64,
    /// Joint angles, rad (m).
    pub pose: Vec<f64, MAX_JOINTS>,
    /// Samples per second, Hz.
    pub rate_hz: f64,
    /// Force that the tool exerts on the robot, N, along each of the force sensor's axes.
    pub force: [Vec<f32, N>; 3],
    /// Acceleration, m/s², along each of the accelerometer's axes.
    pub acceleration: [Vec<f32, N>; 3],
    /// Standard deviation of the noise of one force sample, per axis, bridging errors included, N.
    pub force_noise: [f32; 3],
    /// Standard deviation of the noise of one acceleration sample, per axis, bridging errors included, m/s².
    pub acceleration_noise: [f32; 3],
    /// Whether the robot rests when the record starts.
    pub starts_at_rest: bool,
}

/// Shortest record is this part of a full one.
const SHORTEST: usize = 8;

/// Part by which the measured rate may differ from the configured one.
const RATE_TOLERANCE: f64 = 0.1;

/// Turns readings into records of up to `N` samples.
#[derive(Clone, Debug)]
pub struct Stream<const N: usize> {
    config: StreamConfig,
    aligner: Aligner,
    stretch: Stretch<N>,
    record: Record<N>,
    health: StreamHealth,
    /// Noise of the newest record that had a quiet stretch.
    quiet: Option<noise::Noise>,
}

impl StreamConfig {
    fn check(&self, capacity: usize) -> Result<(), StreamError> {
        let samples = self.record_samples;
        if !(self.rate_hz.is_finite() && self.rate_hz > 0.0) {
            Err(StreamError::Rate)
        } else if !samples.is_power_of_two() || !(256..=capacity).contains(&samples) {
            Err(StreamError::RecordSamples)
        } else if !(1..=MAX_JOINTS).contains(&self.joints) {
            Err(StreamError::Joints)
        } else if !(8..=32).contains(&self.counter_bits) {
            Err(StreamError::CounterBits)
        } else if ![self.force_resolution, self.acceleration_resolution]
            .iter()
            .all(|step| step.is_finite() && *step > 0.0)
        {
            Err(StreamError::Resolution)
        } else {
            Ok(())
        }
    }
}

impl<const N: usize> Stream<N> {
    /// Before the first reading.
    pub fn new(config: StreamConfig) -> Result<Self, StreamError> {
        config.check(N)?;
        Ok(Self {
            config,
            aligner: Aligner::new(config.rate_hz, config.counter_bits),
            stretch: Stretch::new(),
            record: Record {
                start_s: 0.0,
                pose: Vec::new(),
                rate_hz: config.rate_hz,
                force: [const { Vec::new() }; 3],
                acceleration: [const { Vec::new() }; 3],
                force_noise: [0.0; 3],
                acceleration_noise: [0.0; 3],
                starts_at_rest: false,
            },
            health: StreamHealth::default(),
            quiet: None,
        })
    }

    /// Takes one reading, which arrived at `time_s`, s on any clock; `sink` gets the records that are complete.
    pub fn push(&mut self, time_s: f64, reading: Reading, mut sink: impl FnMut(&Record<N>)) {
        let (channel, counter, value) = match reading {
            Reading::Force { counter, value } => (Channel::Force, counter, value),
            Reading::Acceleration { counter, value } => (Channel::Acceleration, counter, value),
            Reading::Joint { index, value } => return self.joint(index, value, &mut sink),
        };
        if !time_s.is_finite() || value.iter().any(|value| !value.is_finite()) {
            self.health.refused += 1;
            return;
        }
        let Self { config, aligner, stretch, record, health, quiet } = self;
        let frame = Frame { time_s, counter, channel, value };
        aligner.push(frame, health, &mut |event, health| {
            let mut cutter = Cutter { config, stretch, record, health, quiet };
            cutter.take(event, &mut sink);
        });
    }

    /// Nothing more will come (the end of a log): `sink` gets what is complete enough.
    pub fn finish(&mut self, mut sink: impl FnMut(&Record<N>)) {
        let Self { config, aligner, stretch, record, health, quiet } = self;
        aligner.flush(health, &mut |event, health| {
            let mut cutter = Cutter { config, stretch, record, health, quiet };
            cutter.take(event, &mut sink);
        });
        let mut cutter = Cutter { config, stretch, record, health, quiet };
        cutter.take(Aligned::Restart, &mut sink);
    }

    /// What has been seen so far.
    pub fn health(&self) -> StreamHealth {
        self.health
    }

    /// The first joint whose angle the present stretch lacks.
    pub fn missing_joint(&self) -> Option<usize> {
        (1..=self.config.joints).find(|&joints| !self.stretch.pose.is_known(joints)).map(|j| j - 1)
    }

    fn joint(&mut self, index: u8, angle: f64, sink: &mut impl FnMut(&Record<N>)) {
        let joint = usize::from(index);
        if !angle.is_finite() || joint >= self.config.joints {
            self.health.refused += 1;
            return;
        }
        let samples = self.stretch.len();
        if let Err(Moved) = self.stretch.pose.read(joint, angle, samples) {
            let Self { config, stretch, record, health, quiet, .. } = self;
            let standing = stretch.pose.confirmed(config.joints);
            let mut cutter = Cutter { config, stretch, record, health, quiet };
            cutter.end(standing, sink);
            self.stretch.clear();
            // The first reading of the new pose.
            let _ = self.stretch.pose.read(joint, angle, 0);
        }
    }
}

/// Cuts records out of the stretch.
struct Cutter<'a, const N: usize> {
    config: &'a StreamConfig,
    stretch: &'a mut Stretch<N>,
    record: &'a mut Record<N>,
    health: &'a mut StreamHealth,
    quiet: &'a mut Option<noise::Noise>,
}

impl<const N: usize> Cutter<'_, N> {
    fn take(&mut self, event: Aligned, sink: &mut impl FnMut(&Record<N>)) {
        match event {
            Aligned::Instant(instant) => {
                let full = self.config.record_samples;
                let let_go = self.stretch.push(&instant, self.config);
                self.health.samples_discarded += let_go as u64;
                if self.stretch.newest_missing() > bridge::MAX_GAP {
                    let standing = self.stretch.len() - self.stretch.newest_missing();
                    self.end(standing, sink);
                    return self.stretch.clear_samples();
                }
                // The end of a record may lie in a movement that the next angle will tell of.
                let standing = self.stretch.pose.confirmed(self.config.joints);
                if !self.stretch.overflows() {
                    if standing >= full {
                        self.emit(full, sink);
                    }
                } else if standing >= full || self.stretch.is_overdue() {
                    // What came since it was full is lost; the next samples do not join on.
                    self.end(standing, sink);
                    self.stretch.clear_samples();
                }
            }
            Aligned::Gap => {
                self.end(self.stretch.len(), sink);
                self.stretch.clear_samples();
            }
            Aligned::Restart => {
                self.end(self.stretch.len(), sink);
                self.stretch.clear();
            }
        }
    }

    /// Makes records of the first `standing` samples and discards the rest.
    fn end(&mut self, standing: usize, sink: &mut impl FnMut(&Record<N>)) {
        let full = self.config.record_samples;
        let (mut standing, mut rest) = (standing, self.stretch.len() - standing);
        // Nothing is known of the pose, or nothing was cut.
        if !self.stretch.pose.is_known(self.config.joints) || !self.stretch.cutting {
            (standing, rest) = (0, self.stretch.len());
        }
        // A sample or two that were lost at the very end can be bridged, too.
        let short = full - standing.min(full);
        let open = self.stretch.newest_missing() + short;
        if rest == 0 && short > 0 && open <= bridge::MAX_GAP {
            for _ in 0..short {
                let lost = align::Instant { time_s: self.stretch.next_s(), ..Default::default() };
                self.stretch.push(&lost, self.config);
            }
            standing = full;
        }
        while standing >= (full / SHORTEST).max(MIN_SAMPLES) && self.stretch.cutting {
            let samples = full.min(1 << standing.ilog2());
            self.emit(samples, sink);
            standing -= samples;
        }
        self.health.samples_discarded += (standing + rest) as u64;
    }

    /// Makes a record of the oldest `samples`, bridged, with its noise.
    fn emit(&mut self, samples: usize, sink: &mut impl FnMut(&Record<N>)) {
        let Self { config, stretch, record, health, quiet } = self;
        let ratio = stretch.measured_rate_hz().map_or(1.0, |rate_hz| rate_hz / config.rate_hz);
        if (ratio - 1.0).abs() > RATE_TOLERANCE {
            health.wrong_rate += 1;
            health.measured_rate_hz = (ratio * config.rate_hz) as f32;
        }
        if ratio > 1.0 + RATE_TOLERANCE {
            health.samples_discarded += samples as u64;
            stretch.discard(samples, config.rate_hz);
            return stretch.look_for_cut(config);
        }
        record.start_s = stretch.start_s;
        record.pose = stretch.pose.mean(config.joints);
        let mut bridged = [bridge::Bridged::default(); 6];
        let signals = stretch.force.iter().chain(&stretch.acceleration);
        let copies = record.force.iter_mut().chain(&mut record.acceleration);
        let mut bridgeable = true;
        for ((signal, copy), bridged) in signals.zip(copies).zip(&mut bridged) {
            copy.clear();
            let _ = copy.extend_from_slice(&signal[..samples]);
            match bridge::bridge(copy) {
                Ok(done) => *bridged = done,
                Err(bridge::Unbridgeable) => bridgeable = false,
            }
        }
        stretch.discard(samples, config.rate_hz);
        stretch.look_for_cut(config);
        if !bridgeable {
            health.samples_discarded += samples as u64;
            return;
        }
        let force = record.force.each_ref().map(|signal| signal.as_slice());
        let acceleration = record.acceleration.each_ref().map(|signal| signal.as_slice());
        let own = noise::estimate(force, acceleration);
        // A record without a quiet stretch is as noisy as the last that had one; the first of all, as its white part.
        let noise = match (own.quiet, **quiet) {
            (false, Some(last)) => noise::Noise { starts_at_rest: false, ..last },
            _ => own,
        };
        if own.quiet {
            **quiet = Some(own);
        }
        let resolution = |step: f32| step * step / 12.0;
        let total = |sensor: f32, step: f32, bridged: &bridge::Bridged| {
            let share = bridged.samples as f32 / samples as f32;
            let square = (sensor * sensor).max(resolution(step));
            libm::sqrtf(square + share * bridged.mean_square_error)
        };
        for axis in 0..3 {
            record.force_noise[axis] =
                total(noise.force[axis], config.force_resolution, &bridged[axis]);
            record.acceleration_noise[axis] =
                total(noise.acceleration[axis], config.acceleration_resolution, &bridged[3 + axis]);
        }
        record.starts_at_rest = noise.starts_at_rest;
        health.bridged += (bridged[0].samples + bridged[3].samples) as u64;
        health.records += 1;
        sink(record);
    }
}
