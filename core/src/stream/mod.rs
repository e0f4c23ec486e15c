//! From readings as they come off the bus to records: aligned by counter, gaps bridged, cut at a static pose.
//!
//! A record starts up to a second before the cut, so that the noise can be read from it, and is as long as the
//! configuration says. Where the robot moves, the sensor starts anew or a gap is too long to be bridged, what
//! has been taken becomes records of the powers of two that it still holds.

mod align;
mod bridge;
mod clock;
mod noise;
mod pose;
mod stretch;

use heapless::Vec;

use align::{Aligned, Aligner, Channel, Frame};
use clock::{Clock, SET_BACK_S};
use pose::Moved;
use stretch::Stretch;

use crate::MAX_JOINTS;
use crate::noise::NoiseShape;
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
    /// Records whose instants arrived at another rate than the configuration says: by more than 200 ppm and three standard
    /// deviations where the sensor kept time, by more than 10 % where its sender was held up. Records of samples that came more
    /// than 10 % faster are refused.
    pub wrong_rate: u64,
    /// Of those, records that were refused.
    pub too_fast: u64,
    /// Records whose instants arrived at another rate than the configuration says, but do not tell which. They have the
    /// configured one.
    pub doubtful_rate: u64,
    /// Instants per second of the newest of any of these, as they arrived; 0 before the first. Hz.
    pub measured_rate_hz: f32,
    /// Standard deviation of that, Hz.
    pub measured_rate_std_hz: f32,
}

impl StreamHealth {
    /// Whether `measured_rate_hz` is certain enough to be the rate of the records.
    pub fn measured_rate_is_used(&self) -> bool {
        f64::from(self.measured_rate_std_hz) <= clock::CRYSTAL * f64::from(self.measured_rate_hz)
    }
}

/// One stretch of force and acceleration at one static pose, without holes.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Record<const N: usize> {
    /// Time of the first sample, on the clock of the readings, s.
    pub start_s: f64,
    /// Joint angles, rad (m).
    pub pose: Vec<f64, MAX_JOINTS>,
    /// Samples per second, Hz: as they arrived if that is known to 50 ppm, else as configured, and in between the mean of both.
    pub rate_hz: f64,
    /// Whether the samples arrived at another rate than configured, but do not tell which: what is fitted to them is wrong by
    /// an unknown factor.
    pub has_doubtful_rate: bool,
    /// Force that the tool exerts on the robot, N, along each of the force sensor's axes.
    pub force: [Vec<f32, N>; 3],
    /// Acceleration, m/s², along each of the accelerometer's axes.
    pub acceleration: [Vec<f32, N>; 3],
    /// Standard deviation of the noise of one force sample, per axis, bridging errors included, N.
    pub force_noise: [f32; 3],
    /// Standard deviation of the noise of one acceleration sample, per axis, bridging errors included, m/s².
    pub acceleration_noise: [f32; 3],
    /// Spectrum of the force's noise, per axis.
    pub force_noise_shape: [NoiseShape; 3],
    /// Spectrum of the acceleration's noise, per axis.
    pub acceleration_noise_shape: [NoiseShape; 3],
    /// Whether the robot rests when the record starts.
    pub starts_at_rest: bool,
}

/// Shortest record is this part of a full one.
const SHORTEST: usize = 8;

/// After a silence of all signals that is longer, the robot may have moved unheard, s: between two recordings, say.
const LONG_SILENCE_S: f64 = 10.0;

/// Turns readings into records of up to `N` samples.
#[derive(Clone, Debug)]
pub struct Stream<const N: usize> {
    config: StreamConfig,
    aligner: Aligner,
    clock: Clock,
    stretch: Stretch<N>,
    record: Record<N>,
    health: StreamHealth,
    /// Noise of the newest record that had a quiet stretch; the acceleration's of one that had the robot at rest in it.
    quiet: Option<noise::Noise>,
    /// When the newest reading came, s.
    heard_s: Option<f64>,
    /// Since the clock went back, until a frame tells whether the same sequence goes on: each joint's newest angle, and when it
    /// came, s.
    set_back: Option<[Option<(f64, f64)>; MAX_JOINTS]>,
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
            clock: Clock::new(config.rate_hz),
            stretch: Stretch::new(),
            record: Record {
                start_s: 0.0,
                pose: Vec::new(),
                rate_hz: config.rate_hz,
                has_doubtful_rate: false,
                force: [const { Vec::new() }; 3],
                acceleration: [const { Vec::new() }; 3],
                force_noise: [0.0; 3],
                acceleration_noise: [0.0; 3],
                force_noise_shape: [NoiseShape::WHITE; 3],
                acceleration_noise_shape: [NoiseShape::WHITE; 3],
                starts_at_rest: false,
            },
            health: StreamHealth::default(),
            quiet: None,
            heard_s: None,
            set_back: None,
        })
    }

    /// Takes one reading, which arrived at `time_s`, s on any clock; `sink` gets the records that are complete.
    ///
    /// A clock that is set back while the counters go on is no break; with any other counter it is another recording, made before,
    /// and the angles that were read before it hold no more. One that is set forward is taken for a sender that was held
    /// up, and by more than 0.5 s for a silence.
    pub fn push(&mut self, time_s: f64, reading: Reading, mut sink: impl FnMut(&Record<N>)) {
        if !time_s.is_finite() {
            self.health.refused += 1;
            return;
        }
        let before_s = self.heard_s.replace(time_s).unwrap_or(time_s);
        if time_s - before_s > LONG_SILENCE_S {
            self.health.restarts += u64::from(self.aligner.has_begun());
            self.forget_angles(&mut sink);
        }
        if time_s < before_s - SET_BACK_S && self.aligner.has_begun() {
            self.set_back = Some([None; MAX_JOINTS]);
        }
        let (channel, counter, value) = match reading {
            Reading::Force { counter, value } => (Channel::Force, counter, value),
            Reading::Acceleration { counter, value } => (Channel::Acceleration, counter, value),
            Reading::Joint { index, value } => return self.joint(time_s, index, value, &mut sink),
        };
        if value.iter().any(|value| !value.is_finite()) {
            self.health.refused += 1;
            return;
        }
        let restarts = self.health.restarts;
        let frame = Frame { time_s, counter, channel, value };
        let (aligner, health, mut cutter) = self.split();
        aligner.push(frame, health, &mut |event, health| cutter.take(event, health, &mut sink));
        let restarted = self.health.restarts > restarts;
        if !restarted && self.aligner.is_in_doubt() {
            return;
        }
        if let Some(angles) = self.set_back.take() {
            if restarted {
                // Another recording, made before: of what lies between nothing is known.
                self.stretch.pose.forget_all();
            }
            for (index, angle) in (0..).zip(angles) {
                if let Some((angle, time_s)) = angle {
                    self.joint(time_s, index, angle, &mut sink);
                }
            }
        }
    }

    /// Nothing more will come (the end of a log): `sink` gets what is complete enough.
    pub fn finish(&mut self, mut sink: impl FnMut(&Record<N>)) {
        let (aligner, health, mut cutter) = self.split();
        aligner.flush(health, &mut |event, health| cutter.take(event, health, &mut sink));
        cutter.take(Aligned::Restart, health, &mut sink);
    }

    /// Readings may have been missed, as when a bus was down: ends what is being recorded, and no joint angle holds any more.
    pub fn forget_angles(&mut self, sink: impl FnMut(&Record<N>)) {
        self.finish(sink);
        self.set_back = None;
        self.stretch.pose.forget_all();
    }

    fn split(&mut self) -> (&mut Aligner, &mut StreamHealth, Cutter<'_, N>) {
        let Self { config, aligner, clock, stretch, record, health, quiet, .. } = self;
        (aligner, health, Cutter { config, clock, stretch, record, quiet })
    }

    /// What has been seen so far.
    pub fn health(&self) -> StreamHealth {
        self.health
    }

    /// How much of a full record the present cut has given so far, 0 to 1; 0 while nothing is cut.
    pub fn record_fraction(&self) -> f32 {
        let samples = if self.stretch.cutting { self.stretch.len() } else { 0 };
        (samples as f32 / self.config.record_samples as f32).min(1.0)
    }

    /// The first joint whose angle has never come, or not since [`forget_angles`](Self::forget_angles) or a silence of
    /// 10 s, or used to come in a cycle and has not for 2 s.
    pub fn missing_joint(&self) -> Option<usize> {
        self.stretch.pose.awaited(self.config.joints, self.heard_s.unwrap_or_default())
    }

    fn joint(&mut self, time_s: f64, index: u8, angle: f64, sink: &mut impl FnMut(&Record<N>)) {
        let joint = usize::from(index);
        if !angle.is_finite() || joint >= self.config.joints {
            self.health.refused += 1;
            return;
        }
        if let Some(angles) = &mut self.set_back {
            // It may be another recording's: not of what has been taken so far.
            angles[joint] = Some((angle, time_s));
            return;
        }
        let samples = self.stretch.len();
        if let Err(Moved) = self.stretch.pose.read(joint, angle, time_s, samples) {
            let standing = self.stretch.standing(&self.config);
            let (_, health, mut cutter) = self.split();
            cutter.end(standing, health, sink);
            self.stretch.clear();
            self.stretch.pose.forget(joint);
            // The first reading of the new pose.
            let _ = self.stretch.pose.read(joint, angle, time_s, 0);
        }
    }
}

/// Cuts records out of the stretch.
struct Cutter<'a, const N: usize> {
    config: &'a StreamConfig,
    clock: &'a mut Clock,
    stretch: &'a mut Stretch<N>,
    record: &'a mut Record<N>,
    quiet: &'a mut Option<noise::Noise>,
}

impl<const N: usize> Cutter<'_, N> {
    fn take(
        &mut self,
        event: Aligned,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(&Record<N>),
    ) {
        match event {
            Aligned::Instant(instant) => {
                if instant.force.is_some() || instant.acceleration.is_some() {
                    self.clock.arrive(instant.time_s);
                } else {
                    self.clock.miss(1);
                }
                let full = self.config.record_samples;
                let let_go = self.stretch.push(&instant, self.config);
                health.samples_discarded += let_go as u64;
                if self.stretch.newest_missing() > bridge::MAX_GAP {
                    let standing = self.stretch.len() - self.stretch.newest_missing();
                    self.end(standing, health, sink);
                    return self.stretch.clear_samples();
                }
                // The end of a record may lie in a movement that the next angle will tell of.
                let standing = self.stretch.standing(self.config);
                if !self.stretch.overflows() {
                    if standing >= full {
                        self.emit(full, health, sink);
                    }
                } else if standing >= full || self.stretch.is_overdue() {
                    // What came since it was full is lost; the next samples do not join on.
                    self.end(standing, health, sink);
                    self.stretch.clear_samples();
                }
            }
            Aligned::Gap(missing) => {
                self.end(self.stretch.len(), health, sink);
                self.stretch.clear_samples();
                match missing {
                    Some(instants) => self.clock.miss(instants),
                    None => self.clock.end_run(),
                }
            }
            Aligned::Restart => {
                self.end(self.stretch.len(), health, sink);
                self.stretch.clear();
                self.clock.end_run();
            }
        }
    }

    /// Makes records of the first `standing` samples and discards the rest.
    fn end(
        &mut self,
        standing: usize,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(&Record<N>),
    ) {
        let full = self.config.record_samples;
        let (mut standing, mut rest) = (standing, self.stretch.len() - standing);
        // Nothing is known of the pose, or nothing was cut.
        if self.stretch.pose.unknown(self.config.joints).is_some() || !self.stretch.cutting {
            (standing, rest) = (0, self.stretch.len());
        }
        // A sample or two that were lost at the very end can be bridged, too.
        let short = full - standing.min(full);
        let open = self.stretch.newest_missing() + short;
        if rest == 0 && short > 0 && open <= bridge::MAX_GAP {
            for _ in 0..short {
                self.stretch.push(&align::Instant::default(), self.config);
            }
            standing = full;
        }
        while standing >= (full / SHORTEST).max(MIN_SAMPLES) && self.stretch.cutting {
            let samples = full.min(1 << standing.ilog2());
            self.emit(samples, health, sink);
            standing -= samples;
        }
        health.samples_discarded += (standing + rest) as u64;
    }

    /// Makes a record of the oldest `samples`, bridged, with its noise.
    fn emit(
        &mut self,
        samples: usize,
        health: &mut StreamHealth,
        sink: &mut impl FnMut(&Record<N>),
    ) {
        let Self { config, clock, stretch, record, quiet } = self;
        let rate = clock.rate();
        if rate.is_wrong || rate.is_doubtful || rate.is_refused {
            health.measured_rate_hz = rate.measured_hz as f32;
            health.measured_rate_std_hz = rate.deviation_hz as f32;
        }
        health.wrong_rate += u64::from(rate.is_wrong || rate.is_refused);
        health.doubtful_rate += u64::from(rate.is_doubtful && !rate.is_refused);
        if rate.is_refused {
            health.too_fast += 1;
            health.samples_discarded += samples as u64;
            stretch.discard(samples, config.rate_hz);
            return stretch.look_for_cut(config);
        }
        record.rate_hz = rate.rate_hz;
        record.has_doubtful_rate = rate.is_doubtful;
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
        let own = noise::estimate(force, acceleration, config.force_resolution);
        let noise = own.or_else(quiet.as_ref());
        if own.quiet {
            **quiet = Some(noise.clone());
        }
        for axis in 0..3 {
            let added = |bridged: &bridge::Bridged| {
                bridged.samples as f32 / samples as f32 * bridged.mean_square_error
            };
            let rounding = |step: f32| step * step / 12.0;
            let least = rounding(config.force_resolution);
            let force = noise.force[axis].raised(least, added(&bridged[axis]));
            record.force_noise[axis] = libm::sqrtf(force.power);
            record.force_noise_shape[axis] = force.shape;
            let least = rounding(config.acceleration_resolution);
            let acceleration = noise.acceleration[axis].raised(least, added(&bridged[3 + axis]));
            record.acceleration_noise[axis] = libm::sqrtf(acceleration.power);
            record.acceleration_noise_shape[axis] = acceleration.shape;
        }
        record.starts_at_rest = noise.starts_at_rest;
        health.bridged += (bridged[0].samples + bridged[3].samples) as u64;
        health.records += 1;
        sink(record);
    }
}
