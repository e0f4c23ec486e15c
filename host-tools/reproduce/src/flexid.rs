//! flexid itself on the same robot. It uses force and acceleration with the sensors' noise, and the core's own search
//! and refinement.

use fearless_simd::Level;
use flexid_core::identify::{Identifier, Phase};
use flexid_core::mounting::Mounting;
use flexid_core::parameters::Bushing;
use flexid_core::sensors::Accelerometer;
use flexid_core::spectrum::{Experiment, Measurement};
use flexid_core::stream::Record;
use flexid_pipeline::{BINS, SAMPLES};
use flexid_simulation::scenario::Sampling;
use nalgebra::Vector3;
use rand_core::Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::robot::{Purpose, Robot, Study, Trial, generator};

/// The bushings that flexid finds; the middle of the bounds if it finds none.
pub fn identify(study: &Study, robot: &Robot, seed: u64, level: Level) -> Vec<Bushing> {
    let mut rng = generator(seed, robot.number, Purpose::Flexid);
    let sampling = &study.scenario.measurement;
    let measurement = Measurement {
        band_hz: sampling.band_hz,
        gravity: [0.0; 3],
        accelerometer: Accelerometer::Inertial,
        mounting: Mounting::AT_TCP,
    };
    let mut buffer = Box::new([0.0; SAMPLES]);
    let mut experiments: Vec<Experiment<BINS>> = Vec::new();
    for trial in &robot.seen {
        let record = record(trial, sampling, &mut rng);
        if let Ok(experiment) = Experiment::new(&study.chain, &measurement, &record, &mut buffer) {
            experiments.push(experiment);
        }
    }
    let (chain, bounds) = (study.chain.clone(), *study.bounds());
    let mut identifier = Box::new(Identifier::new(chain, bounds, measurement, level, rng));
    identifier.renew(&experiments);
    while !matches!(identifier.step(&mut experiments), Phase::Settled | Phase::Waiting) {}
    match identifier.estimate() {
        Some(estimate) => estimate.bushings.to_vec(),
        None => bounds.bushings(&vec![0.5; study.parameters()]).unwrap_or_default().to_vec(),
    }
}

/// The sensors' record of `trial`, cut to a power of two of samples.
fn record(trial: &Trial, sampling: &Sampling, rng: &mut impl Rng) -> Box<Record<SAMPLES>> {
    let samples = trial.response.force.len().min(SAMPLES);
    let samples = if samples.is_power_of_two() { samples } else { samples.next_power_of_two() / 2 };
    let mut noisy = |signal: &[Vector3<f64>], deviation: f64| {
        [0, 1, 2].map(|axis| {
            let reading = |value: &Vector3<f64>| {
                let noise: f64 = StandardNormal.sample(rng);
                (value[axis] + deviation * noise) as f32
            };
            signal[..samples].iter().map(reading).collect()
        })
    };
    let (force, acceleration) = (sampling.force_noise(), sampling.acceleration_noise());
    Box::new(Record {
        start_s: 0.0,
        pose: trial.pose.iter().copied().collect(),
        path: Default::default(),
        since_s: 0.0,
        rate_hz: sampling.rate_hz,
        force: noisy(&trial.response.force, force),
        acceleration: noisy(&trial.response.acceleration, acceleration),
        force_noise: [force as f32; 3],
        acceleration_noise: [acceleration as f32; 3],
        force_noise_shape: Default::default(),
        acceleration_noise_shape: Default::default(),
        has_doubtful_rate: false,
        starts_at_rest: true,
        point: [0.0; 3],
    })
}
