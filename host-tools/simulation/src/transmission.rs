//! The measurement of a cut by the sensors: noisy, counted samples, in the frames and at the times of a real bus.

use flexid_core::stream::Reading;
use flexid_pipeline::signals::SignalTable;
use flexid_pipeline::source::Frame;
use flexid_wire::bits::SignalError;
use nalgebra::Vector3;
use rand_core::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::experiment::Response;
use super::scenario::Sampling;

/// Time from the instant of a sample until its frame may go on the bus, s.
const LATENCY_S: f64 = 60e-6;
/// Duration of a full frame at 1 Mbit/s, stuffing included, s.
const FRAME_S: f64 = 131e-6;
/// Pause on the bus between two experiments, s.
pub const PAUSE_S: f64 = 1.0;

/// Quality of sensors and bus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Factor of the scenario's noise.
    pub noise: f64,
    /// Probability that a force or acceleration frame is lost.
    pub drop: f64,
}

/// A frame and its time on the bus.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedFrame {
    /// Time from the first sample, s.
    pub time_s: f64,
    /// The frame on the bus.
    pub frame: Frame,
}

/// The frames of one cut on the bus.
#[derive(Clone, Debug, PartialEq)]
pub struct Transmission {
    /// Frames in the order of the bus.
    pub frames: Vec<TimedFrame>,
    /// Counter of the first force and acceleration sample.
    pub first_counter: u32,
    /// Number of force frames that were lost.
    pub lost_force: u64,
    /// Number of acceleration frames that were lost.
    pub lost_acceleration: u64,
}

impl Transmission {
    /// Time from the first sample until the next experiment may begin, s.
    pub fn lasts_s(&self) -> f64 {
        self.frames.last().map_or(0.0, |last| last.time_s) + PAUSE_S
    }
}

/// Measures `response` and sends it. `pose` gives the joint angles after some seconds, rad (m).
///
/// # Errors
/// A signal of the table cannot be written.
pub fn transmit(
    response: &Response,
    pose: impl Fn(f64) -> Vec<f64>,
    sampling: &Sampling,
    quality: Quality,
    signals: &SignalTable,
    rng: &mut impl Rng,
) -> Result<Transmission, SignalError> {
    let mask = u32::MAX >> (32 - signals.counter_bits.clamp(1, 32));
    let first_counter = rng.next_u32() & mask;
    let force_noise = quality.noise * sampling.force_noise();
    let acceleration_noise = quality.noise * sampling.acceleration_noise();
    let pose_every = (sampling.rate_hz / sampling.angle_rate_hz()).round().max(1.0) as usize;

    let angles = |time_s: f64| {
        let angle = |(joint, value)| Reading::Joint { index: joint as u8, value };
        pose(time_s).into_iter().enumerate().map(angle).collect::<Vec<_>>()
    };
    // A frame may carry angles beside a sample.
    let is_sampled = |frame: &Frame| signals.sensors_of(frame.id) != [false; 2];
    let shares = signals.encode(&angles(0.0))?.iter().any(is_sampled);
    let mut bus = Bus { frames: Vec::new(), free_s: 0.0 };
    let (mut lost_force, mut lost_acceleration) = (0, 0);
    let samples = response.force.iter().zip(&response.acceleration);
    for (index, (force, acceleration)) in samples.enumerate() {
        let ready_s = index as f64 / sampling.rate_hz + LATENCY_S;
        let counter = first_counter.wrapping_add(index as u32) & mask;
        let force = Reading::Force { counter, value: noisy(force, force_noise, rng) };
        let acceleration =
            Reading::Acceleration { counter, value: noisy(acceleration, acceleration_noise, rng) };
        let mut readings = vec![force, acceleration];
        if shares || index % pose_every == 0 {
            readings.extend(angles(index as f64 / sampling.rate_hz));
        }
        for frame in signals.encode(&readings)? {
            let is_sampled = is_sampled(&frame);
            if is_sampled && happens(quality.drop, rng) {
                let [force, acceleration] = signals.sensors_of(frame.id);
                lost_force += u64::from(force);
                lost_acceleration += u64::from(acceleration);
            } else if is_sampled || index % pose_every == 0 {
                bus.send(ready_s, frame);
            }
        }
    }
    Ok(Transmission { frames: bus.frames, first_counter, lost_force, lost_acceleration })
}

/// A bus that carries one frame at a time.
struct Bus {
    frames: Vec<TimedFrame>,
    free_s: f64,
}

impl Bus {
    fn send(&mut self, ready_s: f64, frame: Frame) {
        let time_s = ready_s.max(self.free_s);
        self.frames.push(TimedFrame { time_s, frame });
        self.free_s = time_s + FRAME_S;
    }
}

/// Adds normal noise to the readings of a sensor.
pub fn add_noise(readings: &mut [Vector3<f64>], deviation: f64, rng: &mut impl Rng) {
    let values = readings.iter_mut().flat_map(|reading| reading.iter_mut());
    values
        .for_each(|value| *value += deviation * Distribution::<f64>::sample(&StandardNormal, rng));
}

fn noisy(value: &Vector3<f64>, deviation: f64, rng: &mut impl Rng) -> [f32; 3] {
    let mut noise = || deviation * Distribution::<f64>::sample(&StandardNormal, rng);
    [0, 1, 2].map(|axis| (value[axis] + noise()) as f32)
}

fn happens(probability: f64, rng: &mut impl Rng) -> bool {
    f64::from(rng.next_u32()) < probability * 2_f64.powi(32)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use flexid_pipeline::config::Config;
    use flexid_pipeline::signals::Decoder;
    use rand_core::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::reference::mill3;

    const POSE: [f64; 3] = [0.0, -0.45, 0.95];

    fn signals() -> SignalTable {
        signals_of("../scenario/mill3-edge.toml")
    }

    fn signals_of(config: &str) -> SignalTable {
        Config::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join(config)).unwrap().signals
    }

    /// The transmission while the TCP stands still under `force`.
    fn sent(samples: usize, force: Vector3<f64>, quality: Quality) -> Transmission {
        sent_by(&signals(), samples, force, quality)
    }

    fn sent_by(
        signals: &SignalTable,
        samples: usize,
        force: Vector3<f64>,
        quality: Quality,
    ) -> Transmission {
        let response = Response {
            force: vec![force; samples],
            displacement: vec![Vector3::zeros(); samples],
            acceleration: vec![Vector3::zeros(); samples],
        };
        let sampling = mill3().0.measurement;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(9);
        transmit(&response, |_| POSE.to_vec(), &sampling, quality, signals, &mut rng).unwrap()
    }

    fn readings(sent: &Transmission) -> Vec<Reading> {
        readings_by(&signals(), sent)
    }

    fn readings_by(table: &SignalTable, sent: &Transmission) -> Vec<Reading> {
        let mut readings = Vec::new();
        let mut decoder = Decoder::new(table);
        for timed in &sent.frames {
            decoder.decode(timed.time_s, &timed.frame, |reading| readings.push(reading)).unwrap();
        }
        readings
    }

    /// The first frames have the times of an independent recording of the reference scenario.
    #[test]
    fn frames_take_their_turn_on_the_bus() {
        let sent = sent(300, Vector3::zeros(), Quality { noise: 1.0, drop: 0.0 });
        let microseconds: Vec<_> =
            sent.frames.iter().map(|frame| (frame.time_s * 1e6).round() as u32).collect();
        let recorded = [60, 191, 322, 453, 584, 715, 846, 1060, 1191, 1560, 1691];
        assert_eq!(microseconds[..recorded.len()], recorded);
        assert_eq!(sent.frames.len(), 2 * 300 + 2 * 3, "joint angles ten times a second");
    }

    #[test]
    fn noise_has_the_density_of_the_scenario() {
        let quality = Quality { noise: 1.0, drop: 0.0 };
        let sent = sent(8192, Vector3::new(100.0, 0.0, -5000.0), quality);
        let (mut sums, mut counters) = ([[0.0_f64; 2]; 2], Vec::new());
        for reading in readings(&sent) {
            let (channel, value) = match reading {
                Reading::Force { counter, value } => {
                    counters.push(counter);
                    assert_eq!(value[2], -3276.8, "saturates as the frame layout says");
                    (0, f64::from(value[0]) - 100.0)
                }
                Reading::Acceleration { value, .. } => (1, f64::from(value[0])),
                Reading::Joint { index, value } => {
                    assert!((value - POSE[usize::from(index)]).abs() < 1e-9);
                    continue;
                }
                Reading::Setup(_) => continue,
            };
            sums[channel][0] += value;
            sums[channel][1] += value * value;
        }
        let deviation =
            |[sum, squares]: [f64; 2]| (squares / 8192.0 - (sum / 8192.0).powi(2)).sqrt();
        // The deviations contain the uniform error of rounding to 0.1 N and 0.002 m/s².
        let force = 0.1581_f64.hypot(0.1 / 12_f64.sqrt());
        let acceleration = 0.015506_f64.hypot(0.002 / 12_f64.sqrt());
        assert!((deviation(sums[0]) / force - 1.0).abs() < 0.03, "{} N", deviation(sums[0]));
        assert!((deviation(sums[1]) / acceleration - 1.0).abs() < 0.03);
        assert_eq!(counters[0], sent.first_counter);
        assert!(counters.windows(2).all(|pair| pair[1] == (pair[0] + 1) % 65_536));
    }

    #[test]
    fn lost_frames_are_counted() {
        let sent = sent(8192, Vector3::zeros(), Quality { noise: 1.0, drop: 0.1 });
        let force = readings(&sent).iter().filter(|r| matches!(r, Reading::Force { .. })).count();
        assert_eq!(force as u64 + sent.lost_force, 8192);
        assert!((700..950).contains(&sent.lost_force) && sent.lost_acceleration > 700);
    }

    #[test]
    fn a_frame_of_both_sensors_is_lost_whole() {
        let table = signals_of("../../edge-app/pipeline/tests/sensors/can-fd.toml");
        let force = Vector3::new(500.0, 0.0, 0.0);
        let sent = sent_by(&table, 1000, force, Quality { noise: 1.0, drop: 0.1 });
        assert!(sent.lost_force > 50 && sent.lost_force == sent.lost_acceleration);
        let forces: Vec<f32> = readings_by(&table, &sent)
            .into_iter()
            .filter_map(|reading| match reading {
                Reading::Force { value, .. } => Some(value[0]),
                _ => None,
            })
            .collect();
        assert_eq!(forces.len() as u64 + sent.lost_force, 1000);
        assert!(forces.iter().all(|own| (own - 500.0).abs() < 2.0));
    }
}
