//! Sensors without a common counter, on the plausible plants of `plants`: frames that are stamped on arrival, through a bus or an adapter,
//! by clocks that are 1 ms and 20 ppm apart.
//!
//! Each cut is a recording of its own: its frames come after a pause, and are not counted.

use std::io;
use std::time::Duration;

use anyhow::{Context, Result, anyhow, ensure};
use flexid_core::imperfection::Accuracies;
use flexid_core::parameters::Bushing;
use flexid_core::stream::Reading;
use flexid_pipeline::clocks::FoundClocks;
use flexid_pipeline::config::Config;
use flexid_pipeline::intake::Intake;
use flexid_pipeline::signals::Clocks;
use flexid_pipeline::source::{Arrival, Content, Flow, FrameSource, SourceHealth};
use flexid_simulation::experiment::Cut;
use flexid_simulation::plant::Plant;
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::common::Random;
use crate::figure::Figure;
use crate::intervals::Intervals;
use crate::plants::{COVER, GROSS, drawn_robot, found, readings, records, standing};
use crate::records::Record;
use crate::study::{Purpose, Study, random};

/// Mean of an exponential delay, part of the frames that are held up, and the longest of their uniform delays, s.
struct Latency(f64, f64, f64);

/// A CAN adapter with few stalls, and one on USB that is polled.
const LATENCIES: [Latency; 2] = [Latency(50e-6, 0.01, 1e-3), Latency(300e-6, 0.05, 5e-3)];
/// Delay of the acceleration, s, and slowness of its clock, parts in a million.
const APART: (f64, f64) = (1e-3, 20.0);
/// Further delays that must be found, s: with [`APART`] from -20 to 20 ms.
const FURTHER_S: [f64; 6] = [-21e-3, -8e-3, -1e-3, 0.0, 9e-3, 19e-3];
/// Largest error of a delay, µs.
const DELAY_US: f64 = 50.0;
/// Least share of the parameters that counters identify, percent.
const OF_COUNTERS: f64 = 95.0;
/// Samples at rest before a cut: the reach of a kernel, and the largest delay.
const BEFORE: usize = 128;
/// Samples from one joint angle to the next.
const ANGLES_EVERY: usize = 200;
/// Silence between two cuts, s.
const PAUSE_S: f64 = 1.0;

/// The result of one robot.
struct Outcome {
    by_counters: usize,
    /// Error of each identified parameter in standard deviations.
    scores: Vec<f64>,
    /// Largest error of a delay, µs, and in its standard deviations.
    delay_us: f64,
    delay_score: f64,
}

/// The first robots of this scenario that do not give way, with one latency and the other in turn.
pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let cuts = study.cuts();
    let numbers = standing(study, robots);
    let one = |(index, robot): (usize, &u64)| {
        let latency = &LATENCIES[index % LATENCIES.len()];
        outcome(study, &cuts[*robot as usize % cuts.len()], *robot, latency, details)
    };
    let all = numbers.par_iter().enumerate().map(one).collect::<Result<Vec<_>>>()?;
    let mut intervals = Intervals::default();
    for Outcome { scores, .. } in &all {
        intervals.push(scores.iter().copied());
    }
    let scores = || all.iter().flat_map(|one| one.scores.iter().map(|score| score.abs()));
    let (identified, by_counters) = (scores().count(), all.iter().map(|one| one.by_counters).sum());
    Ok(vec![
        Figure::count(
            "clocks apart: parameters that are identified, of those that counters identify",
            by_counters,
            by_counters > 0 && 100.0 * identified as f64 >= OF_COUNTERS * by_counters as f64,
            identified,
            &format!("at least {OF_COUNTERS:.0} %"),
        )
        .made_of(robots),
        intervals.cover_on_plants("clocks apart, identified", COVER),
        Figure::at_most(
            "clocks apart: largest error of an identified parameter",
            robots,
            GROSS,
            scores().fold(0.0, f64::max),
            " σ",
        ),
        Figure::at_most(
            "clocks apart by -20 to 20 ms: largest error of the delay",
            robots,
            DELAY_US,
            all.iter().map(|one| one.delay_us).fold(0.0, f64::max),
            " µs",
        ),
        Figure::at_most(
            "clocks apart by -20 to 20 ms: largest error of the delay in its deviations",
            robots,
            GROSS,
            all.iter().map(|one| one.delay_score).fold(0.0, f64::max),
            " σ",
        ),
    ])
}

fn outcome(
    study: &Study,
    cuts: &[Cut],
    robot: u64,
    latency: &Latency,
    details: bool,
) -> Result<Outcome> {
    let accuracies = Accuracies::typical();
    let (mut plant, bushings) = drawn_robot(study, &accuracies, robot).unwrap_or_default();
    let of_counters = records(study, cuts, &plant, &bushings, robot)?;
    let (_, by_counters) = found(study, &of_counters, &accuracies, robot)?;
    let clock = &mut plant.accelerometer.clock;
    (clock.late_s, clock.ppm) = (clock.late_s + APART.0, clock.ppm + APART.1);
    let late_s = clock.late_s;
    let motions = motions(study, cuts, &plant, &bushings, robot);
    let (mut delay_us, mut delay_score) = (0.0_f64, 0.0_f64);
    let mut told = None;
    for further_s in FURTHER_S {
        let (clocks, records) = told_of(study, &motions, &plant, robot, latency, further_s)?;
        let delay = clocks.delay.context("no delay is told")?;
        let off_us = 1e6 * (delay.delay_s - late_s - further_s);
        delay_us = delay_us.max(off_us.abs());
        delay_score = delay_score.max(1e-6 * off_us.abs() / delay.std_s);
        if details {
            eprintln!(
                "robot {robot}, {further_s}: {clocks}, off by {off_us:.1} us, {:.1} us from record to record",
                1e6 * clocks.record_delay_std_s
            );
        }
        if further_s == 0.0 {
            told = Some((clocks, records));
        }
    }
    let (clocks, of_clocks) = told.context("no clocks are told")?;
    ensure!(
        of_clocks.len() == of_counters.len(),
        "{} records of {}",
        of_clocks.len(),
        of_counters.len()
    );
    let accuracies = Config { accuracies, assumes_perfect: false, ..study.config.clone() }
        .with_clocks(&clocks)
        .accuracies;
    let (truth, by_clocks) = found(study, &of_clocks, &accuracies, robot)?;
    let errors = by_clocks.errors(&truth);
    let identified = (0..errors.len()).filter(|&index| by_clocks.identifies(index));
    let scores: Vec<f64> =
        identified.map(|index| errors[index] / by_clocks.deviations[index]).collect();
    if details {
        let worst = scores.iter().fold(0.0_f64, |worst, own| worst.max(own.abs()));
        eprintln!(
            "robot {robot}: counters {}, clocks {} ({:?}, χ²/dof {:.3}), worst {worst:.1} σ",
            by_counters.identified(),
            by_clocks.identified(),
            by_clocks.estimate.acceptance,
            by_clocks.estimate.consistency
        );
    }
    Ok(Outcome { by_counters: by_counters.identified(), scores, delay_us, delay_score })
}

/// Pose, force and acceleration of a cut, without noise.
struct Motion {
    pose: Vec<f64>,
    force: Vec<Vector3<f64>>,
    acceleration: Vec<Vector3<f64>>,
}

fn motions(
    study: &Study,
    cuts: &[Cut],
    plant: &Plant,
    bushings: &[Bushing],
    robot: u64,
) -> Vec<Motion> {
    let mut draw = random(Purpose::Plant, robot);
    let motion = |(number, cut): (u64, &Cut)| {
        let readings = readings(study, cut, plant, bushings, number, &mut draw)?;
        let before = || vec![Vector3::zeros(); BEFORE];
        Some(Motion {
            pose: cut.pose.to_vec(),
            force: [before(), readings.force].concat(),
            acceleration: [before(), readings.acceleration].concat(),
        })
    };
    (0..).zip(cuts).filter_map(motion).collect()
}

/// Clocks and records of these motions, the acceleration `further_s` later.
fn told_of(
    study: &Study,
    motions: &[Motion],
    plant: &Plant,
    robot: u64,
    latency: &Latency,
    further_s: f64,
) -> Result<(FoundClocks, Vec<Record>)> {
    let mut random = random(Purpose::Noise, robot);
    let sampling = &study.scenario.measurement;
    let pace = 1.0 + 1e-6 * plant.accelerometer.clock.ppm;
    let mut source = Readings::default();
    let mut start_s = 1.0;
    for motion in motions {
        let count = motion.force.len();
        let mut sensors = [
            (0.0, 1.0, &motion.force, sampling.force_noise()),
            (further_s, pace, &motion.acceleration, sampling.acceleration_noise()),
        ]
        .map(|(late_s, pace, values, noise)| {
            let mut newest_s = 0.0_f64;
            let mut at = |number: usize| {
                let sampled_s = start_s + late_s + number as f64 * pace / sampling.rate_hz;
                newest_s = newest_s.max(sampled_s + latency.draw(&mut random));
                // candump writes microseconds.
                (1e6 * newest_s).round() * 1e-6
            };
            let times: Vec<f64> = (0..count).map(&mut at).collect();
            let value = |own: &Vector3<f64>| {
                [0, 1, 2].map(|axis| (own[axis] + noise * random.normal()) as f32)
            };
            let values: Vec<[f32; 3]> = values.iter().map(value).collect();
            times.into_iter().zip(values)
        });
        for (number, (time_s, value)) in sensors[0].by_ref().enumerate() {
            if number % ANGLES_EVERY == 0 || number + 1 == count {
                for (index, &value) in motion.pose.iter().enumerate() {
                    source.push(time_s, Reading::Joint { index: index as u8, value });
                }
            }
            source.push(time_s, Reading::Force { counter: 0, value });
        }
        for (time_s, value) in sensors[1].by_ref() {
            source.push(time_s, Reading::Acceleration { counter: 0, value });
        }
        start_s += count as f64 / sampling.rate_hz + PAUSE_S;
    }
    source.arrivals.sort_by(|one, other| one.time_s.total_cmp(&other.time_s));
    let mut config = study.config.clone();
    config.signals.clocks = Clocks::Own([None; 2]);
    let mut intake = Intake::new(&config)?;
    while intake.read(&mut source, Duration::MAX, |_| ())? == Flow::Open {}
    let told = intake.tell_clocks().context("the clocks are common")?.clone();
    let told = told.map_err(|untold| anyhow!("{untold}"))?;
    let mut records = Vec::new();
    intake.finish(|record| records.push(as_in_study(record)));
    Ok((
        told,
        records.into_iter().filter(|own| own.force[0].len() == crate::records::SAMPLES).collect(),
    ))
}

/// The record in the size of the study's.
fn as_in_study(record: &flexid_pipeline::Record) -> Record {
    let all = |of: &[heapless::Vec<f32, { flexid_pipeline::SAMPLES }>; 3]| {
        of.each_ref().map(|own| own.iter().copied().collect())
    };
    Record {
        start_s: record.start_s,
        pose: record.pose.clone(),
        path: record.path.clone(),
        since_s: record.since_s,
        rate_hz: record.rate_hz,
        has_doubtful_rate: record.has_doubtful_rate,
        force: all(&record.force),
        acceleration: all(&record.acceleration),
        force_noise: record.force_noise,
        acceleration_noise: record.acceleration_noise,
        force_noise_shape: record.force_noise_shape.clone(),
        acceleration_noise_shape: record.acceleration_noise_shape.clone(),
        starts_at_rest: record.starts_at_rest,
        point: record.point,
    }
}

impl Latency {
    fn draw(&self, random: &mut Random) -> f64 {
        let stall =
            if random.uniform(0.0, 1.0) < self.1 { random.uniform(0.0, self.2) } else { 0.0 };
        stall - self.0 * random.uniform(f64::MIN_POSITIVE, 1.0).ln()
    }
}

/// Readings in the order of their arrival.
#[derive(Default)]
struct Readings {
    arrivals: Vec<Arrival>,
}

impl Readings {
    fn push(&mut self, time_s: f64, reading: Reading) {
        self.arrivals.push(Arrival { time_s, content: Content::Reading(reading) });
    }
}

impl FrameSource for Readings {
    fn read(&mut self, batch: &mut Vec<Arrival>, _: Duration) -> io::Result<Flow> {
        batch.append(&mut self.arrivals);
        Ok(Flow::Ended)
    }

    fn health(&self) -> SourceHealth {
        SourceHealth::default()
    }
}
