//! From the sensors' noise, whatever its colour, to honest intervals: through the stream, as the daemon does it.

use std::f64::consts::{PI, SQRT_2, TAU};

use flexid_core::MAX_JOINTS;
use flexid_core::identify::{Acceptance, Estimate};
use flexid_core::parameters::Bushings;
use flexid_core::spectrum::Experiment;
use flexid_core::stream::{AngleSignal, Reading, Record, Stream, StreamConfig};

use crate::common::fits::{identifier, parameters, relative, scores, settle};
use crate::common::milling::{
    ACCELERATION_NOISE, Conditions, FORCE_NOISE, RATE, SAMPLES, cut, motion,
};
use crate::common::{BINS, EXPERIMENTS, MEASUREMENT, Random, mill3};

/// Robots of every case.
const ROBOTS: usize = 4;

const CONFIG: StreamConfig = StreamConfig {
    rate_hz: RATE,
    record_samples: SAMPLES,
    joints: 3,
    counter_bits: 16,
    force_resolution: 0.01,
    acceleration_resolution: 0.001,
    angles: [AngleSignal::FINE; MAX_JOINTS],
};

/// Force and acceleration at every sample.
type Signals = [Vec<[f64; 3]>; 2];

/// Three experiments with a robot, without noise.
struct Robot {
    truth: Bushings,
    signals: Vec<Signals>,
}

fn robots() -> Vec<Robot> {
    let mut random = Random::new(211);
    let robot = |_| {
        let truth = random.bushings(3);
        let signals = EXPERIMENTS.iter().map(|(pose, rpm, feed)| {
            let force = cut(&mut random, *rpm, *feed);
            let motion = motion(&mill3(), pose, &truth, &force, &Conditions::default());
            [force, motion.into_iter().map(|(acceleration, _)| acceleration).collect()]
        });
        let signals = signals.collect();
        Robot { truth, signals }
    };
    (0..ROBOTS).map(robot).collect()
}

fn add_white(signals: &mut Signals, random: &mut Random) {
    for (signal, deviation) in signals.iter_mut().zip([FORCE_NOISE, ACCELERATION_NOISE]) {
        signal
            .as_flattened_mut()
            .iter_mut()
            .for_each(|value| *value += deviation * random.normal());
    }
}

/// Butterworth's low-pass filter of eighth order, its corner in cycles per sample.
fn low_pass(signal: &mut [[f64; 3]], corner: f64) {
    let k = (PI * corner).tan();
    for quality in [0.5098, 0.6013, 0.9000, 2.5629] {
        let a0 = 1.0 + k / quality + k * k;
        let (b0, a1, a2) = (k * k / a0, 2.0 * (k * k - 1.0) / a0, (1.0 - k / quality + k * k) / a0);
        for axis in 0..3 {
            let (mut x, mut y) = ([0.0; 2], [0.0; 2]);
            for value in signal.iter_mut().map(|value| &mut value[axis]) {
                let filtered = b0 * (*value + 2.0 * x[0] + x[1]) - a1 * y[0] - a2 * y[1];
                (x, y) = ([*value, x[0]], [filtered, y[0]]);
                *value = filtered;
            }
        }
    }
}

/// The record that the stream makes of one experiment.
fn record(pose: [f64; 3], [force, acceleration]: &Signals) -> Record<SAMPLES> {
    let mut stream = Box::new(Stream::<SAMPLES>::new(CONFIG).expect("a good configuration"));
    let mut records = Vec::new();
    let mut keep = |record: &Record<SAMPLES>| records.push(record.clone());
    for n in 0..SAMPLES {
        let time_s = n as f64 / RATE;
        if n % 200 == 0 || n + 1 == SAMPLES {
            for (index, value) in pose.into_iter().enumerate() {
                stream.push(time_s, Reading::Joint { index: index as u8, value }, &mut keep);
            }
        }
        let rounded = |value: [f64; 3], step: f32| {
            value.map(|value| (value / f64::from(step)).round() as f32 * step)
        };
        let counter = n as u32;
        let value = rounded(force[n], CONFIG.force_resolution);
        stream.push(time_s, Reading::Force { counter, value }, &mut keep);
        let value = rounded(acceleration[n], CONFIG.acceleration_resolution);
        stream.push(time_s, Reading::Acceleration { counter, value }, &mut keep);
    }
    stream.finish(&mut keep);
    assert_eq!(records.len(), 1);
    records.remove(0)
}

/// Identifies robots from signals that are spoilt, and holds every estimate to be consistent, and the errors of all to be as
/// their standard deviations say.
fn assert_honest(robots: &[Robot], what: &str, spoil: impl Fn(&mut Signals, &mut Random)) {
    let mut random = Random::new(212);
    let mut buffer = Box::new([0.0; SAMPLES]);
    let mut all = Vec::new();
    for Robot { truth, signals } in robots {
        let experiments = signals.iter().zip(EXPERIMENTS).map(|(signals, (pose, ..))| {
            let mut signals = signals.clone();
            spoil(&mut signals, &mut random);
            let record = record(pose, &signals);
            Experiment::<BINS>::new(&mill3(), &MEASUREMENT, &record, &mut buffer).expect("good")
        });
        let experiments: Vec<_> = experiments.collect();
        let estimate = settle(&mut identifier(parameters(3)), &experiments);
        let Estimate { consistency, structure, acceptance, .. } = estimate;
        let deviations = relative(&estimate);
        let scores = scores(&estimate.bushings, truth, &deviations);
        println!(
            "{what}: chi^2/dof {consistency:.3}, structure {:.3}, errors {:.2} sigma, deviations {:.4}",
            structure.size,
            rms(&scores),
            deviations.iter().map(|deviation| deviation.ln()).sum::<f64>().exp().powf(1.0 / 36.0),
        );
        assert_eq!(acceptance, Acceptance::Consistent, "{what}: {consistency}");
        all.extend(scores.into_iter().zip(deviations).filter(|(_, d)| *d < 0.05).map(|(s, _)| s));
    }
    let covered = all.iter().filter(|score| score.abs() < 1.96).count() as f64 / all.len() as f64;
    println!("{what}: errors {:.3} sigma, {:.1} % covered", rms(&all), 100.0 * covered);
    // Of some 130 errors, correlated as those of one robot are.
    assert!((0.6..1.6).contains(&rms(&all)), "{what}: {}", rms(&all));
    assert!(covered > 0.85, "{what}: {covered}");
}

fn rms(scores: &[f64]) -> f64 {
    (scores.iter().map(|score| score * score).sum::<f64>() / scores.len() as f64).sqrt()
}

#[test]
fn noise_of_any_colour_gives_honest_intervals() {
    let robots = robots();
    assert_honest(&robots, "white", add_white);
    for corner in [0.2, 0.4] {
        assert_honest(&robots, &format!("both filtered at {corner}"), |signals, random| {
            add_white(signals, random);
            signals.iter_mut().for_each(|signal| low_pass(signal, corner));
        });
    }
    assert_honest(&robots, "noise filtered at 0.2", |signals, random| {
        let mut noise = signals.each_ref().map(|signal| vec![[0.0; 3]; signal.len()]);
        add_white(&mut noise, random);
        noise.iter_mut().for_each(|noise| low_pass(noise, 0.2));
        for (signal, noise) in signals.iter_mut().zip(&noise) {
            for (value, noise) in signal.as_flattened_mut().iter_mut().zip(noise.as_flattened()) {
                *value += noise;
            }
        }
    });
    assert_honest(&robots, "hum", |signals, random| {
        add_white(signals, random);
        let [force, acceleration] = signals;
        for (signal, size) in [(force, 0.5), (acceleration, 0.05)] {
            for harmonic in [1.0, 2.0, 3.0] {
                let phase = random.uniform(0.0, TAU);
                for (n, value) in signal.iter_mut().enumerate() {
                    let angle = TAU * harmonic * 50.03 * n as f64 / RATE + phase;
                    let sine = SQRT_2 * size / harmonic * angle.sin();
                    value.iter_mut().for_each(|value| *value += sine);
                }
            }
        }
    });
}
