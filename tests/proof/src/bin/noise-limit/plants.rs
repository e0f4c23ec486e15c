//! Plausible plants: everything that has an accuracy is off at once, each drawn from its typical accuracy.
//!
//! The robot moves in time with its true geometry, masses and sensors. The fit is that of the default configuration: imperfections
//! have typical accuracies. At the noise limit, plant and model are perfect.

use std::f64::consts::TAU;

use anyhow::{Result, ensure};
use flexid_core::imperfection::{Accuracies, SensorAccuracies};
use flexid_core::parameters::Bushings;
use flexid_simulation::experiment::Cut;
use flexid_simulation::plant::clock::Clock;
use flexid_simulation::plant::motion::{Surroundings, Work};
use flexid_simulation::plant::{Joints, Plant, Robot, Sensor, Tool};
use rayon::prelude::*;

use crate::common::Random;
use crate::figure::{Figure, median};
use crate::find::{Found, find, find_on_plant};
use crate::intervals::Intervals;
use crate::records::{Record, Sensors, Signals};
use crate::spread;
use crate::study::{Purpose, Study, name, random};

/// Limits of the share of the intervals that cover, percent.
const COVER: [f64; 2] = [93.0, 98.0];
/// Standard deviations by which an interval misses grossly.
const GROSS: f64 = 5.0;
/// Largest share of intervals that miss grossly, percent.
const MISSES: f64 = 0.1;
/// Least share of the runs that the imperfections explain, percent.
const EXPLAINED: f64 = 95.0;
/// Least share of the parameters identified on a perfect plant that are identified, percent.
const KEPT: f64 = 80.0;

/// Rate of the spindle, Hz.
const SPINDLE_HZ: f64 = 47.0;

/// The result of one run.
struct Outcome {
    is_consistent: bool,
    /// Errors of the identified parameters, in standard deviations.
    scores: Vec<f64>,
    /// Their standard deviations.
    widths: Vec<f64>,
    /// Number of parameters that a perfect model identifies on a perfect plant.
    at_noise_limit: usize,
}

/// As [`prove`], of the scenario of six joints.
pub(crate) fn prove_of_six_joints(_: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    prove(&Study::of_six_joints()?, robots, details)
}

/// Plants of this scenario.
pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let cuts = study.cuts();
    let one = |robot: u64| outcome(study, &cuts[robot as usize % cuts.len()], robot, details);
    let all = (0..robots as u64).into_par_iter().map(one).collect::<Result<Vec<_>>>()?;
    let explained = all.iter().filter(|outcome| outcome.is_consistent).count();
    let least = spread::percentages(robots, EXPLAINED / 100.0, [EXPLAINED, 100.0])[0];
    let held = 100.0 * explained as f64 >= least * robots as f64;
    let mut intervals = Intervals::default();
    for Outcome { scores, .. } in &all {
        intervals.push(scores.iter().copied());
    }
    let scores: Vec<f64> = all.iter().flat_map(|outcome| outcome.scores.iter().copied()).collect();
    let widths: Vec<f64> = all.iter().flat_map(|outcome| outcome.widths.iter().copied()).collect();
    let gross = scores.iter().filter(|score| score.abs() > GROSS).count();
    let share = 100.0 * gross as f64 / scores.len().max(1) as f64;
    let at_noise_limit: usize = all.iter().map(|outcome| outcome.at_noise_limit).sum();
    Ok(vec![
        Figure::count(
            "drawn plants: fits that the imperfections explain",
            robots,
            held,
            explained,
            &format!("at least {least:.0} %"),
        ),
        intervals.cover_within("drawn plants, identified", COVER),
        Figure::at_most(
            "drawn plants: intervals that miss by over 5 σ",
            robots,
            MISSES,
            share,
            " %",
        ),
        Figure::count(
            "drawn plants: parameters that are identified, of those that are at the noise limit",
            at_noise_limit,
            100.0 * scores.len() as f64 >= KEPT * at_noise_limit as f64,
            scores.len(),
            &format!("at least {KEPT:.0} %"),
        )
        .remark(format_args!("median standard deviation {:.2} %", 100.0 * median(widths))),
    ])
}

fn outcome(study: &Study, cuts: &[Cut], robot: u64, details: bool) -> Result<Outcome> {
    let accuracies = Accuracies::typical();
    let mut draw = random(Purpose::Draw, robot);
    let plant =
        drawn(&accuracies, study.chain.joints().len(), study.measurement.band_hz, &mut draw);
    let records = records(study, cuts, &plant, robot)?;
    ensure!(records.len() == cuts.len(), "{} records of {} cuts", records.len(), cuts.len());
    let (truth, found) = found(study, &records, &accuracies, robot)?;
    let perfect = self::records(study, cuts, &Plant::default(), robot)?;
    let at_noise_limit = find(&study.task(), &perfect, random(Purpose::Search, robot).0)?;
    let errors = found.errors(&truth);
    let identified: Vec<usize> =
        (0..errors.len()).filter(|index| found.identifies(*index)).collect();
    let scores: Vec<f64> =
        identified.iter().map(|&index| errors[index] / found.deviations[index]).collect();
    if details {
        print(robot, &found, &identified, &scores);
        eprintln!("    at the noise limit {} identified", at_noise_limit.identified());
    }
    Ok(Outcome {
        is_consistent: found.is_consistent(),
        scores,
        widths: identified.iter().map(|&index| found.deviations[index]).collect(),
        at_noise_limit: at_noise_limit.identified(),
    })
}

/// A perfect plant with one error.
pub(crate) fn with(change: impl FnOnce(&mut Plant)) -> Plant {
    let mut plant = Plant::default();
    change(&mut plant);
    plant
}

/// Records of robot `number` with the errors of `plant`, of the cuts in which it does not give way and that make a record.
pub(crate) fn records(
    study: &Study,
    cuts: &[Cut],
    plant: &Plant,
    number: u64,
) -> Result<Vec<Record>> {
    let truth = study.robot(number);
    let mut draw = random(Purpose::Plant, number);
    let mut sensors = Sensors::new(study, random(Purpose::Noise, number))?;
    let mut records = Vec::new();
    for (number, cut) in (0..).zip(cuts) {
        let work = Work { cut, model: &study.chain, bushings: &truth, number };
        // The sensors of the study add the noise.
        let samples = study.scenario.measurement.samples();
        let turn = TAU * SPINDLE_HZ / study.scenario.measurement.rate_hz;
        let spindle = (0..samples).map(|sample| turn * sample as f64).collect();
        let surroundings = Surroundings { force_noise: 0.0, acceleration_noise: 0.0, spindle };
        let Some(readings) = plant.readings(work, &surroundings, &mut draw.0) else { continue };
        let (force, acceleration) = (&readings.force, &readings.acceleration);
        let measured = sensors.measure(&Signals { pose: &cut.pose, force, acceleration });
        records.extend(measured.ok());
    }
    Ok(records)
}

/// Robot `number`, and what is found of it.
pub(crate) fn found(
    study: &Study,
    records: &[Record],
    accuracies: &Accuracies,
    number: u64,
) -> Result<(Bushings, Found)> {
    let search = random(Purpose::Search, number).0;
    let found = find_on_plant(&study.task(), accuracies, records, search)?;
    Ok((study.robot(number), found))
}

fn print(robot: u64, found: &Found, identified: &[usize], scores: &[f64]) {
    let estimate = &found.estimate;
    let worst = (0..scores.len()).max_by(|&a, &b| scores[a].abs().total_cmp(&scores[b].abs()));
    let worst = worst.map_or_else(String::new, |worst| {
        format!(", worst {} by {:.1} σ", name(identified[worst]), scores[worst])
    });
    eprintln!(
        "robot {robot}: {:?}, χ²/dof {:.3}, whiteness {:.1}, {} starts, {} identified{worst}",
        estimate.acceptance,
        estimate.consistency,
        estimate.whiteness,
        found.starts,
        identified.len()
    );
}

/// A plant whose every error is drawn from a normal distribution.
fn drawn(accuracies: &Accuracies, joints: usize, band_hz: [f64; 2], random: &mut Random) -> Plant {
    let sensor = |own: &SensorAccuracies, random: &mut Random| {
        let resonance = own.resonance * random.normal().abs();
        Sensor {
            angle_rad: three(own.angle, random),
            gain: three(own.gain, random).map(f64::exp),
            crosstalk: own.crosstalk * random.normal(),
            resonance_hz: 1.0 / (std::f64::consts::TAU * resonance.sqrt()),
            high_pass_hz: own.high_pass * random.normal().abs() / std::f64::consts::TAU,
            ..Sensor::default()
        }
    };
    let force_sensor = sensor(&accuracies.force, random);
    let accelerometer = sensor(&accuracies.accelerometer, random);
    let late_s = accuracies.delay * random.normal();
    Plant {
        force_sensor,
        accelerometer: Sensor {
            offset_m: three(accuracies.accelerometer_place, random),
            clock: Clock { late_s, late_spread_s: accuracies.record_delay, ..Clock::default() },
            ..accelerometer
        },
        tool: Tool {
            angle_rad: three(accuracies.tool_angle, random),
            tcp_m: three(accuracies.tool_centre_point, random),
        },
        robot: Robot {
            mass: (0..joints).map(|_| (accuracies.mass * random.normal()).exp()).collect(),
            centre_of_mass_m: (0..joints)
                .map(|_| three(accuracies.centre_of_mass, random))
                .collect(),
            joint_angle_rad: (0..joints)
                .map(|_| accuracies.joint_angle * random.normal())
                .collect(),
            elastic_centre_m: (0..joints)
                .map(|_| three(accuracies.elastic_centre, random))
                .collect(),
            inertia: (0..joints).map(|_| (accuracies.inertia * random.normal()).exp()).collect(),
            ..Robot::default()
        },
        joints: Joints {
            hysteretic: (accuracies.hysteresis * random.normal().abs()).min(1.0),
            hysteretic_at_hz: (band_hz[0] * band_hz[1]).sqrt(),
            servo: accuracies.servo * random.normal().abs(),
            loaded_per_knm: 1e3 * accuracies.load * random.normal().abs(),
            warm_up_per_cut: accuracies.record_stiffness * random.normal(),
            ..Joints::default()
        },
        ..Plant::default()
    }
}

fn three(deviation: f64, random: &mut Random) -> [f64; 3] {
    [0, 1, 2].map(|_| deviation * random.normal())
}
