//! From readings as they come off the bus to records: aligned by counter, gaps bridged, cut at a static pose or along a path.
//!
//! A record starts up to a second before the cut, so that the noise can be read from it. The configuration gives its length. If the
//! robot leaves its pose, the sensor starts anew or a gap is too long to be bridged, the samples so far become records whose lengths are
//! powers of two. A robot that leaves its pose before they are long enough feeds: its record goes on, and says where the robot was in each
//! of its parts.

mod align;
mod bridge;
mod clock;
mod config;
mod cutter;
mod feed;
mod health;
mod invalid;
mod noise;
mod pose;
mod record;
mod sender;
mod setup;
mod spikes;
mod stretch;
mod track;

use heapless::Vec;

use align::{Aligned, Aligner, Channel, Frame};
pub use align::{LATE_S, SILENCE_S};
pub use bridge::MAX_GAP;
use clock::Clock;
pub use clock::{SET_BACK_S, STRAYS_S};
pub use config::{AngleSignal, StreamConfig, StreamError};
use cutter::Cutter;
pub use feed::{LEAP, WITHIN_PART};
pub use health::{AngleHealth, StreamHealth};
pub use invalid::{Invalid, Validity};
use pose::Doubt;
pub use pose::STATIC;
pub(crate) use record::LEAST_EVEN;
pub use record::{MAX_PARTS, Record, Stage};
pub use sender::CYCLE_S;
pub use setup::Setup;
pub use spikes::SPIKE_CONTEXT;
use stretch::Stretch;

use crate::MAX_JOINTS;
use crate::noise::NoiseShape;

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
    /// Setup of what follows. Before the first, the force acts at the TCP, and all axes are measured.
    Setup(Setup),
}

/// Longest silence of all signals after which joint angles still hold, s. In a longer silence, as between two recordings, the robot
/// may have moved.
pub const LONG_SILENCE_S: f64 = 10.0;

/// Turns readings into records of up to `N` samples.
#[derive(Clone, Debug)]
pub struct Stream<const N: usize> {
    config: StreamConfig,
    aligner: Aligner,
    clock: Clock,
    stretch: Stretch<N>,
    record: Record<N>,
    setup: Setup,
    health: StreamHealth,
    /// Noise of the newest record with a quiet stretch. The noise of the acceleration is that of the newest record in which the
    /// robot rested, if there is one.
    quiet: Option<noise::Noise>,
    validity: Validity,
    /// Arrival of the newest reading, s.
    heard_s: Option<f64>,
    /// Newest angle of each joint and its arrival, s, from when the clock went back until a frame shows whether the same sequence
    /// goes on.
    set_back: Option<[Option<(f64, f64)>; MAX_JOINTS]>,
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
                path: Vec::new(),
                since_s: 0.0,
                rate_hz: config.rate_hz,
                has_doubtful_rate: false,
                force: [const { Vec::new() }; 3],
                acceleration: [const { Vec::new() }; 3],
                force_noise: [0.0; 3],
                acceleration_noise: [0.0; 3],
                force_noise_shape: [NoiseShape::WHITE; 3],
                acceleration_noise_shape: [NoiseShape::WHITE; 3],
                starts_at_rest: false,
                point: [0.0; 3],
            },
            setup: Setup::default(),
            health: StreamHealth::default(),
            quiet: None,
            validity: Validity::new([config.force_resolution, config.acceleration_resolution]),
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
            let (aligner, health, mut cutter) = self.split();
            aligner.restart(health, &mut |event, health| cutter.take(event, health, &mut sink));
            self.forget();
        }
        if time_s < before_s - SET_BACK_S && self.aligner.has_begun() {
            self.set_back = Some([None; MAX_JOINTS]);
        }
        if self.set_back.is_none()
            && let Some((joint, doubt)) = self.stretch.pose.moved(time_s)
        {
            self.moved(joint, &doubt, &mut sink);
        }
        if self.stretch.rests_again(&self.config) {
            self.come_to_rest(&mut sink);
        }
        let (channel, counter, value) = match reading {
            Reading::Force { counter, value } => (Channel::Force, counter, value),
            Reading::Acceleration { counter, value } => (Channel::Acceleration, counter, value),
            Reading::Joint { index, value } => return self.joint(time_s, index, value),
            Reading::Setup(setup) => return self.set_up(setup, &mut sink),
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
                    self.joint(time_s, index, angle);
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
        self.forget();
    }

    fn forget(&mut self) {
        self.set_back = None;
        self.stretch.pose.forget_all();
    }

    fn split(&mut self) -> (&mut Aligner, &mut StreamHealth, Cutter<'_, N>) {
        let Self {
            config, aligner, clock, stretch, record, setup, health, quiet, validity, ..
        } = self;
        (aligner, health, Cutter { config, clock, stretch, record, setup, quiet, validity })
    }

    fn set_up(&mut self, setup: Setup, sink: &mut impl FnMut(&Record<N>)) {
        if setup == self.setup {
            return;
        }
        self.finish(sink);
        if (setup.force, setup.acceleration) != (self.setup.force, self.setup.acceleration) {
            // The noise of an axis that was not measured is not known.
            self.quiet = None;
        }
        self.setup = setup;
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

    /// The first joint whose angle is missing.
    pub fn missing_joint(&self) -> Option<usize> {
        self.missing_joints().next()
    }

    /// The joints whose angle is missing. An angle is missing if it has not come since the start, since
    /// [`forget_angles`](Self::forget_angles) or since a silence of 10 s, or if it used to come in a cycle and has not come for
    /// 2 s.
    pub fn missing_joints(&self) -> impl Iterator<Item = usize> {
        self.stretch.pose.awaited(self.config.joints, self.heard_s.unwrap_or_default())
    }

    fn joint(&mut self, time_s: f64, index: u8, angle: f64) {
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
        let (came, signal) = (self.stretch.came(), self.config.angles[joint]);
        let samples = [came, came + self.aligner.waiting()];
        let spacing = self.config.record_samples / (2 * MAX_PARTS);
        let pose = &mut self.stretch.pose;
        if let Some(wrong) = pose.read(joint, angle, time_s, samples, &signal, spacing) {
            let health = &mut self.health.angles[joint];
            health.wrong += u64::from(wrong.readings);
            health.wrong_value = wrong.place.first;
        }
        let step = self.stretch.pose.step(joint);
        self.health.angles[joint].step = if step > STATIC { step } else { 0.0 };
    }

    /// Makes records of the samples up to where a robot that has fed has come to rest.
    fn come_to_rest(&mut self, sink: &mut impl FnMut(&Record<N>)) {
        let Some(since) = self.stretch.pose.rests_since(self.config.joints) else { return };
        let kept = self.stretch.len().saturating_sub(since);
        let is_cut = self.stretch.cutting && self.stretch.cut_from < since;
        let (_, health, mut cutter) = self.split();
        let left = if is_cut { cutter.divide(since, health, sink) } else { since };
        health.samples_discarded += left as u64;
        self.stretch.keep(kept, &self.config);
    }

    /// Ends the stretch where a joint has left the pose. The samples since all joints are where they were read last begin another
    /// stretch.
    fn moved(&mut self, joint: usize, doubt: &Doubt, sink: &mut impl FnMut(&Record<N>)) {
        let has_fed = self.stretch.feeds;
        let standing = match has_fed {
            true => doubt.since.min(self.stretch.len()),
            false => self.stretch.standing(&self.config),
        };
        if self.stretch.feeds_from(standing, joint, &self.config) {
            return self.stretch.pose.settle(joint);
        }
        self.stretch.feeds = has_fed;
        let is_short = (1..self.config.record_samples).contains(&standing);
        // A robot that stands for a while and then feeds loses nothing.
        let leaps = (0..self.config.joints).any(|joint| self.stretch.leaps(standing, joint));
        if self.stretch.cutting && is_short && leaps && !self.stretch.has_given_full {
            let health = &mut self.health.angles[joint];
            let smallest = if health.ended == 0 { f64::INFINITY } else { health.ended_by };
            (health.ended, health.ended_by) = (health.ended + 1, smallest.min(doubt.by));
        }
        // What came while the stretch was full is lost: the newest samples do not follow on.
        let arrived = self.stretch.pose.arrived();
        let overflows = self.stretch.overflows();
        let kept = if overflows { 0 } else { self.stretch.len().saturating_sub(arrived) };
        let (_, health, mut cutter) = self.split();
        cutter.end(standing, health, sink);
        self.health.samples_discarded -= kept as u64;
        self.stretch.keep(kept, &self.config);
        self.stretch.pose.settle(joint);
    }
}
