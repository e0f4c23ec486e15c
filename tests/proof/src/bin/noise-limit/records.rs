//! Records of a motion: exact ones, and those that the stream makes from noisy readings.

use std::ops::Range;

use anyhow::{Result, anyhow, ensure};
use flexid_core::spectrum::{Experiment, Measurement};
use flexid_core::stream::{self, Reading, Setup, Stream, StreamConfig};
use nalgebra::Vector3;

use crate::common::Random;
use crate::linear::Motion;
use crate::study::Study;

/// Number of samples of a record.
pub(crate) const SAMPLES: usize = 8192;
/// Capacity for samples, with room for those before the joint angle that confirms them.
const CAPACITY: usize = 2 * SAMPLES;
/// Number of bins that the band needs.
pub(crate) const BINS: usize = 1024;
/// Number of samples from one joint angle to the next.
const ANGLES_EVERY: usize = 200;
/// Silence between two stretches, s.
const PAUSE_S: f64 = 1.0;

pub(crate) type Record = stream::Record<CAPACITY>;

/// Force and acceleration at every sample, without noise.
#[derive(Clone, Copy)]
pub(crate) struct Signals<'a> {
    pub(crate) pose: &'a [f64],
    pub(crate) force: &'a [Vector3<f64>],
    pub(crate) acceleration: &'a [Vector3<f64>],
    /// The only axis along which the force is measured, if it is that of a hammer.
    pub(crate) struck: Option<usize>,
}

impl<'a> Signals<'a> {
    pub(crate) fn new(pose: &'a [f64], motion: &'a Motion) -> Self {
        Self { pose, force: &motion.force, acceleration: &motion.acceleration, struck: None }
    }

    pub(crate) fn part(&self, window: Range<usize>) -> Self {
        let (force, acceleration) = (&self.force[window.clone()], &self.acceleration[window]);
        Self { force, acceleration, ..*self }
    }

    /// A record from rest without noise, weighted as if it had the scenario's noise.
    pub(crate) fn exact(&self, study: &Study) -> Record {
        let sampling = &study.scenario.measurement;
        let along = |signal: &[Vector3<f64>]| {
            [0, 1, 2].map(|axis| signal.iter().map(|value| value[axis] as f32).collect())
        };
        Record {
            start_s: 0.0,
            pose: self.pose.iter().copied().collect(),
            path: Default::default(),
            since_s: 0.0,
            rate_hz: sampling.rate_hz,
            force: along(self.force),
            acceleration: along(self.acceleration),
            force_noise: [sampling.force_noise() as f32; 3],
            acceleration_noise: [sampling.acceleration_noise() as f32; 3],
            force_noise_shape: Default::default(),
            acceleration_noise_shape: Default::default(),
            has_doubtful_rate: false,
            starts_at_rest: true,
            point: [0.0; 3],
        }
    }
}

/// Sensors with the scenario's noise, and the stream that the daemon runs behind them.
pub(crate) struct Sensors<'a> {
    study: &'a Study,
    stream: Box<Stream<CAPACITY>>,
    random: Random,
    time_s: f64,
}

impl<'a> Sensors<'a> {
    pub(crate) fn new(study: &'a Study, random: Random) -> Result<Self> {
        Self::with_joints(study, study.chain.joints().len(), random)
    }

    /// The sensors of a robot with another number of joints than the scenario's.
    pub(crate) fn with_joints(study: &'a Study, joints: usize, random: Random) -> Result<Self> {
        let stream = Stream::new(StreamConfig { joints, ..study.config.stream() })
            .map_err(|error| anyhow!("the stream refuses the scenario: {error:?}"))?;
        Ok(Self { study, stream: Box::new(stream), random, time_s: 0.0 })
    }

    /// The last record that the stream makes of one stretch of signals; it must be full.
    pub(crate) fn measure(&mut self, signals: &Signals) -> Result<Record> {
        let sampling = self.study.scenario.measurement;
        let mut last = None;
        let start_s = self.time_s + PAUSE_S;
        let mut keep = |record: &Record| last = Some(record.clone());
        let force = [0, 1, 2].map(|axis| signals.struck.is_none_or(|struck| struck == axis));
        let setup = Setup { force, ..Setup::default() };
        self.stream.push(start_s, Reading::Setup(setup), &mut keep);
        for (n, (force, acceleration)) in signals.force.iter().zip(signals.acceleration).enumerate()
        {
            self.time_s = start_s + n as f64 / sampling.rate_hz;
            if n % ANGLES_EVERY == 0 || n + 1 == signals.force.len() {
                for (index, &value) in signals.pose.iter().enumerate() {
                    let reading = Reading::Joint { index: index as u8, value };
                    self.stream.push(self.time_s, reading, &mut keep);
                }
            }
            let counter = n as u32 % (1 << self.study.config.signals.counter_bits.min(31));
            let mut value = noisy(&mut self.random, force, sampling.force_noise());
            (0..3).filter(|axis| !setup.force[*axis]).for_each(|axis| value[axis] = 0.0);
            self.stream.push(self.time_s, Reading::Force { counter, value }, &mut keep);
            let value = noisy(&mut self.random, acceleration, sampling.acceleration_noise());
            self.stream.push(self.time_s, Reading::Acceleration { counter, value }, &mut keep);
        }
        self.stream.finish(&mut keep);
        let record = last.ok_or_else(|| anyhow!("the stream makes no record of the signals"))?;
        ensure!(record.force[0].len() == SAMPLES, "the stream makes a short record");
        Ok(record)
    }
}

fn noisy(random: &mut Random, value: &Vector3<f64>, deviation: f64) -> [f32; 3] {
    [0, 1, 2].map(|axis| (value[axis] + deviation * random.normal()) as f32)
}

/// The experiment that a fit reads, from a record.
pub(crate) fn experiment(
    chain: &flexid_core::chain::Chain,
    measurement: &Measurement,
    record: &Record,
) -> Result<Experiment<BINS>> {
    Experiment::new(chain, measurement, record, &mut Box::new([0.0; CAPACITY]))
        .map_err(|error| anyhow!("a record has no spectrum: {error:?}"))
}
