//! The frames that a robot sends, and a source that replays them.

use std::io;
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError};
use flexid_core::motion::EquationOfMotion;
use flexid_core::motion::radau::Radau;
use flexid_core::parameters::{Bushing, Ranges};
use flexid_core::stream::Reading;
use flexid_pipeline::config::Config;
use flexid_pipeline::source::{Arrival, Flow, FrameSource, SourceHealth};
use nalgebra::Vector3;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

pub(crate) const RATE_HZ: f64 = 2000.0;

pub(crate) const POSES: [[f64; 3]; 2] = [[0.0, -0.45, 0.95], [0.7, -1.1, 1.9]];

/// Hands over frames a few at a time, then ends, or breaks.
pub(crate) struct Replay {
    pub(crate) frames: std::vec::IntoIter<Arrival>,
    pub(crate) breaks: bool,
}

impl FrameSource for Replay {
    fn read(&mut self, batch: &mut Vec<Arrival>, _timeout: Duration) -> io::Result<Flow> {
        let before = batch.len();
        batch.extend(self.frames.by_ref().take(50));
        match (batch.len() - before, self.breaks) {
            (0, true) => Err(io::Error::other("unplugged")),
            (0, false) => Ok(Flow::Ended),
            _ => Ok(Flow::Open),
        }
    }

    fn health(&self) -> SourceHealth {
        SourceHealth::default()
    }
}

/// Readings of the accelerometer at the instants at which a force is measured, one after the other.
pub(crate) type Tool = Box<dyn FnMut([f32; 3]) -> [f32; 3]>;

/// A block of a ton, whatever the pose: no robot.
pub(crate) fn block(_: &[f64; 3]) -> Tool {
    Box::new(|force| force.map(|force| force * 1e-3))
}

/// The robot, every parameter in the middle of its bounds.
pub(crate) fn robot(config: &Config, pose: &[f64; 3]) -> Tool {
    let middle = |[lower, upper]: [f64; 2]| (lower * upper).sqrt();
    let Ranges { stiffness, damping } = config.bounds.joints[0];
    let bushing = Bushing { stiffness: stiffness.map(middle), damping: damping.map(middle) };
    let chain = config.model.chain().unwrap();
    let equation =
        EquationOfMotion::new(&chain, pose, config.gravity.into(), &[bushing; 3]).unwrap();
    let start = equation.rest();
    let mut robot = Radau::new(equation, start, 1.0 / RATE_HZ);
    let (accelerometer, mounting) = (config.accelerometer, config.mounting);
    let mut last = Vector3::zeros();
    Box::new(move |force| {
        let force = Vector3::from(force).cast();
        robot.step(|part| last.lerp(&force, part)).unwrap();
        last = force;
        let reading = robot.equation().reading(robot.state(), &force, accelerometer, &mounting);
        reading.acceleration.cast().into()
    })
}

/// Frames of [`frames_with`], with the acceleration lost in every hundredth instant.
pub(crate) fn frames(
    config: &Config,
    poses: &[[f64; 3]],
    at_pose: impl Fn(&[f64; 3]) -> Tool,
) -> Vec<Arrival> {
    frames_with(config, poses, 100, 0.02, at_pose)
}

/// At each pose a quiet time, then smooth noise that pushes the tool. Of `every` so many accelerations the last is lost.
pub(crate) fn frames_with(
    config: &Config,
    poses: &[[f64; 3]],
    every: u32,
    acceleration_noise: f32,
    at_pose: impl Fn(&[f64; 3]) -> Tool,
) -> Vec<Arrival> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut noise = |size: f32| size * ((rng.next_u32() >> 8) as f32 / (1 << 23) as f32 - 1.0);
    let mut frames = Vec::new();
    let mut send = |time_s: f64, reading: Reading| {
        let encoded = config.signals.encode(&[reading]).unwrap();
        frames.extend(encoded.into_iter().map(|frame| Arrival::of_frame(time_s, frame)));
    };
    let period = 1.0 / RATE_HZ;
    for (place, pose) in poses.iter().enumerate() {
        let start = 1.0e9 + 10.0 * place as f64;
        let mut tool = at_pose(pose);
        let mut cutting = [(0.0, 0.0); 3];
        let samples = config.record_samples as u32;
        for counter in 0..5 * samples / 2 {
            let time = start + f64::from(counter) * period;
            if counter % 200 == 0 {
                for (index, &value) in pose.iter().enumerate() {
                    send(time, Reading::Joint { index: index as u8, value });
                }
            }
            // White force counts as noise of the sensor: cutting is smooth.
            let size = if counter < samples { 0.0 } else { 100.0 };
            for (smooth, force) in &mut cutting {
                *smooth = 0.8 * *smooth + noise(size);
                *force = 0.8 * *force + *smooth;
            }
            let value = cutting.map(|(_, force)| force + noise(0.5));
            send(time, Reading::Force { counter, value });
            let acceleration = tool(value);
            if counter % every != every - 1 {
                let value =
                    acceleration.map(|acceleration| acceleration + noise(acceleration_noise));
                send(time + 0.25 * period, Reading::Acceleration { counter, value });
            }
        }
    }
    frames
}

pub(crate) fn source(config: &Config, breaks: bool) -> Replay {
    let frames = frames(config, &POSES, block);
    Replay { frames: frames.into_iter(), breaks }
}

/// A bus that brings batches until the other end is dropped.
pub(crate) struct Feed(pub(crate) Receiver<Vec<Arrival>>);

impl FrameSource for Feed {
    fn read(&mut self, batch: &mut Vec<Arrival>, timeout: Duration) -> io::Result<Flow> {
        match self.0.recv_timeout(timeout) {
            Ok(frames) => batch.extend(frames),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(Flow::Ended),
        }
        Ok(Flow::Open)
    }

    fn health(&self) -> SourceHealth {
        SourceHealth::default()
    }
}
