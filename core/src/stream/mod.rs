//! From readings as they come off the bus to records: aligned by counter, gaps bridged, cut at a static pose.
//!
//! A record starts up to a second before the cut, so that the noise can be read from it. The configuration gives its length. If the
//! robot moves, the sensor starts anew or a gap is too long to be bridged, the samples so far become records whose lengths are
//! powers of two.

mod align;
mod bridge;
mod clock;
mod noise;
mod pose;
mod stretch;

use core::error::Error;
use core::fmt;

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
        /// Counter of the instants; it wraps.
        counter: u32,
        /// Force, N.
        value: [f32; 3],
    },
    /// Acceleration, along the accelerometer's axes.
    Acceleration {
        /// Counter of the instants; it wraps. Force and acceleration of the same instant have the same counter.
        counter: u32,
        /// Acceleration, m/s².
        value: [f32; 3],
    },
    /// Angle (or stroke) of one joint.
    Joint {
        /// Number of the joint, from 0, base first.
        index: u8,
        /// Angle, rad, or stroke, m.
        value: f64,
    },
}

/// Properties of the signals that a stream reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StreamConfig {
    /// Sampling rate of force and acceleration, Hz.
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

impl fmt::Display for StreamError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rate => f.write_str("sampling rate: must be positive and finite"),
            Self::RecordSamples => write!(
                f,
                "samples of a record: must be a power of two from {MIN_SAMPLES} to the stream's capacity"
            ),
            Self::Joints => write!(f, "joints: must be 1 to {MAX_JOINTS}"),
            Self::CounterBits => f.write_str("width of the counters: must be 8 to 32 bits"),
            Self::Resolution => f.write_str("resolutions: must be positive and finite"),
        }
    }
}

impl Error for StreamError {}

/// Counts and measurements of a stream since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StreamHealth {
    /// Force and acceleration readings taken.
    pub frames: u64,
    /// Force and acceleration readings that are missing by their counters.
    pub frames_lost: u64,
    /// Bridged samples of emitted records; force and acceleration count separately.
    pub bridged: u64,
    /// Restarts: a counter disagreed with the time that passed, since the sensor started anew or was silent.
    pub restarts: u64,
    /// Readings whose counter had come before.
    pub repeated: u64,
    /// Records emitted.
    pub records: u64,
    /// Samples discarded, as when the pose moved, the gap was too long or the stretch too short.
    pub samples_discarded: u64,
    /// Readings refused: a value that is not finite, a joint that the robot does not have, a single counter out of sequence.
    pub refused: u64,
    /// Records whose measured rate differs from the configured one: by more than 200 ppm and three standard deviations where the
    /// sensor kept time, by more than 10 % where its sender was held up. A record whose samples came more than 10 % faster is
    /// refused.
    pub wrong_rate: u64,
    /// Records of `wrong_rate` that were refused.
    pub too_fast: u64,
    /// Records whose measured rate contradicts the configured one, but is too uncertain to replace it. They have the configured
    /// rate.
    pub doubtful_rate: u64,
    /// Measured rate of the newest record that one of these three counts, Hz; 0 before the first.
    pub measured_rate_hz: f32,
    /// Standard deviation of `measured_rate_hz`, Hz.
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
    /// Sampling rate, Hz. It is the mean of the measured and the configured rate, weighted by their variances, where the two agree.
    /// Where they do not, it is the measured rate if that is known to 50 ppm, else the configured rate.
    pub rate_hz: f64,
    /// Whether the measured rate contradicts the configured one, but is too uncertain to replace it. A fit to the record is then
    /// wrong by an unknown factor.
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

/// A record is no shorter than a full one divided by this.
const SHORTEST: usize = 8;

/// Longest silence of all signals after which joint angles still hold, s. In a longer silence, as between two recordings, the robot
/// may have moved.
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
    /// Noise of the newest record with a quiet stretch. The noise of the acceleration is that of the newest record in which the
    /// robot rested, if there is one.
    quiet: Option<noise::Noise>,
    /// Arrival of the newest reading, s.
    heard_s: Option<f64>,
    /// Newest angle of each joint and its arrival, s, from when the clock went back until a frame shows whether the same sequence
    /// goes on.
    set_back: Option<[Option<(f64, f64)>; MAX_JOINTS]>,
}

impl StreamConfig {
    fn check(&self, capacity: usize) -> Result<(), StreamError> {
        let samples = self.record_samples;
        if !(self.rate_hz.is_finite() && self.rate_hz > 0.0) {
            Err(StreamError::Rate)
        } else if !samples.is_power_of_two() || !(MIN_SAMPLES..=capacity).contains(&samples) {
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
    /// Makes a stream that has no readings yet.
    ///
    /// # Errors
    ///
    /// Returns an error that names the property of `config` which is out of its range.
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
    /// A clock that is set back while the counters go on is no break. With any other counter, another recording begins that was
    /// made earlier, and angles read before hold no more. A clock that is set forward counts as a sender that was held up, and by
    /// more than 0.5 s as a silence.
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
                // Another recording, made earlier: the robot may have moved between the two.
                self.stretch.pose.forget_all();
            }
            for (index, angle) in (0..).zip(angles) {
                if let Some((angle, time_s)) = angle {
                    self.joint(time_s, index, angle, &mut sink);
                }
            }
        }
    }

    /// Ends the recording, as at the end of a log; `sink` gets the records for which its samples suffice.
    pub fn finish(&mut self, mut sink: impl FnMut(&Record<N>)) {
        let (aligner, health, mut cutter) = self.split();
        aligner.flush(health, &mut |event, health| cutter.take(event, health, &mut sink));
        cutter.take(Aligned::Restart, health, &mut sink);
    }

    /// Ends the recording and forgets all joint angles. It is for times when readings may have been missed, as when a bus was down.
    pub fn forget_angles(&mut self, sink: impl FnMut(&Record<N>)) {
        self.finish(sink);
        self.set_back = None;
        self.stretch.pose.forget_all();
    }

    fn split(&mut self) -> (&mut Aligner, &mut StreamHealth, Cutter<'_, N>) {
        let Self { config, aligner, clock, stretch, record, health, quiet, .. } = self;
        (aligner, health, Cutter { config, clock, stretch, record, quiet })
    }

    /// Counts and measurements so far.
    pub fn health(&self) -> StreamHealth {
        self.health
    }

    /// Part of a full record that the present cut has given so far, 0 to 1; 0 while nothing is cut.
    pub fn record_fraction(&self) -> f32 {
        let samples = if self.stretch.cutting { self.stretch.len() } else { 0 };
        (samples as f32 / self.config.record_samples as f32).min(1.0)
    }

    /// The first joint whose angle is missing. An angle is missing if it has not come since the start, since
    /// [`forget_angles`](Self::forget_angles) or since a silence of 10 s, or if it used to come in a cycle and has not come for
    /// 2 s.
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
            // It may belong to another recording, not to the samples so far.
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
                // The end of a record may lie in a movement that only the next angle shows.
                let standing = self.stretch.standing(self.config);
                if !self.stretch.overflows() {
                    if standing >= full {
                        self.emit(full, health, sink);
                    }
                } else if standing >= full || self.stretch.is_overdue() {
                    // The samples that came since it was full are lost, so that the next ones do not follow on.
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
        // The pose is not known, or nothing was cut.
        if self.stretch.pose.unknown(self.config.joints).is_some() || !self.stretch.cutting {
            (standing, rest) = (0, self.stretch.len());
        }
        // One or two samples that were lost at the very end can be bridged too.
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
