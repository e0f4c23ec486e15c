//! Plausible plants: everything that has an accuracy is off at once, each drawn from its typical accuracy.
//!
//! The robot moves in time with its true geometry, masses and sensors. The fit is that of the default configuration: imperfections
//! have typical accuracies. At the noise limit, plant and model are perfect.

use std::f64::consts::TAU;

use anyhow::{Result, ensure};
use flexid_core::imperfection::{Accuracies, GROUND_LAG, SPREAD_OVER_INERTIA, SensorAccuracies};
use flexid_core::parameters::{Bushing, Bushings};
use flexid_core::verdict::{Trust, Verdict};
use flexid_simulation::experiment::{Cut, Response};
use flexid_simulation::plant::clock::Clock;
use flexid_simulation::plant::motion::{Surroundings, Work};
use flexid_simulation::plant::{Hose, Joints, Pedestal, Plant, Robot, Sensor, Tool};
use rayon::prelude::*;

use crate::common::Random;
use crate::figure::{Figure, median};
use crate::find::{Found, find, find_on_plant};
use crate::intervals::{Intervals, percent};
use crate::oracle;
use crate::records::{Record, Sensors, Signals};
use crate::spread;
use crate::study::{Purpose, Study, name, random};

/// Limits of the share of the intervals that cover, percent.
pub(crate) const COVER: [f64; 2] = [93.0, 98.0];
/// Limits of that share for each parameter by itself.
const EACH: [f64; 2] = [90.0, 99.0];
/// Largest median standard deviation over that of an oracle.
const OVER_ORACLE: f64 = 1.5;
/// Standard deviations by which an interval misses grossly.
pub(crate) const GROSS: f64 = 5.0;
/// Largest share of intervals that miss grossly, percent.
const MISSES: f64 = 0.1;
/// Least share of the runs that the imperfections explain, percent.
const EXPLAINED: f64 = 95.0;
/// Least share of the parameters that an oracle identifies that are identified, percent. Chosen: one robot in ten is not settled, or its
/// model is not trusted.
const KEPT_OF_ORACLE: f64 = 90.0;

/// Rate of the spindle, Hz.
const SPINDLE_HZ: f64 = 47.0;
/// Mass of what stands on the ground, kg. Chosen: the base of a robot of 200 kg payload.
const BASE_KG: f64 = 200.0;
/// Compliance of a ground that is taken for rigid, m/N and rad/Nm.
const RIGID: f64 = 1e-13;

/// The result of one run.
struct Outcome {
    is_consistent: bool,
    identified: Vec<Identified>,
    /// Number of parameters that a perfect model identifies on a perfect plant.
    at_noise_limit: usize,
    /// Number of parameters that the oracle identifies.
    by_oracle: usize,
}

/// An identified parameter.
struct Identified {
    index: usize,
    /// Standard deviation of the logarithm.
    deviation: f64,
    /// Error in standard deviations.
    score: f64,
    /// Standard deviation over that of an oracle.
    over_oracle: f64,
}

/// Plants of this scenario.
pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let cuts = study.cuts();
    let cuts = |robot: u64| &cuts[robot as usize % cuts.len()];
    let one = |robot: u64| outcome(study, cuts(robot), robot, details);
    let numbers = study.first..study.first + robots as u64;
    let all = numbers.into_par_iter().map(one).collect::<Result<Vec<_>>>()?;
    let all: Vec<Outcome> = all.into_iter().flatten().collect();
    let drawn = robots;
    let robots = all.len();
    let explained = all.iter().filter(|outcome| outcome.is_consistent).count();
    let least = spread::percentages(robots, EXPLAINED / 100.0, [EXPLAINED, 100.0])[0];
    let held = 100.0 * explained as f64 >= least * robots as f64;
    let mut intervals = Intervals::default();
    for Outcome { identified, .. } in &all {
        intervals.push(identified.iter().map(|one| one.score));
    }
    if details {
        eprintln!("independent intervals per interval: {:.2}", intervals.independence()[0]);
    }
    let identified: Vec<&Identified> = all.iter().flat_map(|outcome| &outcome.identified).collect();
    let gross = identified.iter().filter(|one| one.score.abs() > GROSS).count();
    let share = 100.0 * gross as f64 / identified.len().max(1) as f64;
    let middle =
        |of: fn(&Identified) -> f64| median(identified.iter().map(|one| of(one)).collect());
    let at_noise_limit: usize = all.iter().map(|outcome| outcome.at_noise_limit).sum();
    let by_oracle: usize = all.iter().map(|outcome| outcome.by_oracle).sum();
    Ok(vec![
        Figure::count(
            "drawn plants: fits that the imperfections explain",
            robots,
            held,
            explained,
            &format!("at least {least:.0} %"),
        )
        .remark(format_args!("{} of {drawn} give way", drawn - robots)),
        intervals.cover_on_plants("drawn plants, identified", COVER),
        each(&identified, 12 * study.chain.joints().len()),
        Figure::at_most(
            "drawn plants: intervals that miss by over 5 σ",
            robots,
            MISSES,
            share,
            " %",
        ),
        Figure::at_most(
            "drawn plants: median standard deviation over that of an oracle that knows the priors",
            robots,
            OVER_ORACLE,
            middle(|one| one.over_oracle),
            "",
        ),
        Figure::count(
            "drawn plants: parameters that are identified, of those that the oracle identifies",
            by_oracle,
            by_oracle > 0 && 100.0 * identified.len() as f64 >= KEPT_OF_ORACLE * by_oracle as f64,
            identified.len(),
            &format!("at least {KEPT_OF_ORACLE:.0} %"),
        )
        .remark(format_args!(
            "{at_noise_limit} at the noise limit; median standard deviation {:.2} %",
            100.0 * middle(|one| one.deviation)
        )),
    ])
}

/// `None` of a robot that gives way.
fn outcome(study: &Study, cuts: &[Cut], robot: u64, details: bool) -> Result<Option<Outcome>> {
    let accuracies = Accuracies::typical();
    let Some((plant, simulated)) = drawn_robot(study, &accuracies, robot) else { return Ok(None) };
    let records = records(study, cuts, &plant, &simulated, robot)?;
    ensure!(records.len() == cuts.len(), "{} records of {} cuts", records.len(), cuts.len());
    let (truth, found) = found(study, &records, &accuracies, robot)?;
    let perfect = self::records(study, cuts, &Plant::default(), &truth, robot)?;
    let at_noise_limit = find(&study.task(), &perfect, random(Purpose::Search, robot).0)?;
    let errors = found.errors(&truth);
    let oracle = oracle::deviations(study, &truth, cuts, &accuracies)?;
    let one = |index: usize| {
        let deviation = found.deviations[index];
        let [score, over_oracle] = [errors[index] / deviation, deviation / oracle[index]];
        Identified { index, deviation, score, over_oracle }
    };
    let identified: Vec<_> =
        (0..errors.len()).filter(|&index| found.identifies(index)).map(one).collect();
    if details {
        print(robot, &found, &identified);
        eprintln!("    at the noise limit {} identified", at_noise_limit.identified());
    }
    Ok(Some(Outcome {
        is_consistent: found.is_consistent(),
        identified,
        at_noise_limit: at_noise_limit.identified(),
        by_oracle: oracle.into_iter().filter(is_identified).count(),
    }))
}

/// Returns whether a parameter with this standard deviation of its logarithm is identified, if the fit is sound.
fn is_identified(deviation: &f64) -> bool {
    Trust::new(1.0, true).verdict(1.0, *deviation).0 == Verdict::Identified
}

/// The share that covers that is nearest to its limits, of each parameter by itself.
fn each(identified: &[&Identified], parameters: usize) -> Figure {
    let of = |index: usize| -> Vec<f64> {
        identified.iter().filter(|one| one.index == index).map(|one| one.score).collect()
    };
    let limits = |scores: &[f64]| spread::percentages(scores.len(), 0.95, EACH);
    let off = |scores: &[f64]| spread::off(percent(scores), 95.0, limits(scores));
    let all = (0..parameters).map(|index| (index, of(index)));
    let all = all.filter(|(_, scores)| !scores.is_empty());
    let nearest = all.max_by(|(_, a), (_, b)| off(a).total_cmp(&off(b)));
    let (index, scores) = nearest.unwrap_or_default();
    let what =
        "drawn plants: 95 % intervals that cover, of each parameter the nearest to its limits";
    Figure::within(what, scores.len(), limits(&scores), percent(&scores), " %").remark(name(index))
}

/// A perfect plant with one error.
pub(crate) fn with(change: impl FnOnce(&mut Plant)) -> Plant {
    let mut plant = Plant::default();
    change(&mut plant);
    plant
}

/// Records of robot `number`, which has these bushings, with the errors of `plant`, of the cuts in which it does not give way and that make a record.
pub(crate) fn records(
    study: &Study,
    cuts: &[Cut],
    plant: &Plant,
    bushings: &[Bushing],
    number: u64,
) -> Result<Vec<Record>> {
    records_struck(study, cuts, plant, bushings, number, |_| None)
}

/// [`records`], of which `struck` says the only axis along which the force is measured, if there is one.
pub(crate) fn records_struck(
    study: &Study,
    cuts: &[Cut],
    plant: &Plant,
    bushings: &[Bushing],
    number: u64,
    struck: impl Fn(usize) -> Option<usize>,
) -> Result<Vec<Record>> {
    let mut draw = random(Purpose::Plant, number);
    let mut sensors = Sensors::new(study, random(Purpose::Noise, number))?;
    let mut records = Vec::new();
    for (index, cut) in cuts.iter().enumerate() {
        // The robot warms up from pose to pose.
        let number = if struck(index).is_some() { index / 3 } else { index } as u64;
        let Some(readings) = readings(study, cut, plant, bushings, number, &mut draw) else {
            continue;
        };
        let (force, acceleration) = (&readings.force, &readings.acceleration);
        let struck = struck(index);
        let measured = sensors.measure(&Signals { pose: &cut.pose, force, acceleration, struck });
        records.extend(measured.ok());
    }
    Ok(records)
}

/// What the sensors of `plant` read in a cut, the `number`th, without noise. `None` of a robot that gives way.
pub(crate) fn readings(
    study: &Study,
    cut: &Cut,
    plant: &Plant,
    bushings: &[Bushing],
    number: u64,
    draw: &mut Random,
) -> Option<Response> {
    let work = Work { cut, model: &study.chain, bushings, number };
    // The sensors of the study add the noise.
    let samples = study.scenario.measurement.samples();
    let turn = TAU * SPINDLE_HZ / study.scenario.measurement.rate_hz;
    let spindle = (0..samples).map(|sample| turn * sample as f64).collect();
    let surroundings = Surroundings { force_noise: 0.0, acceleration_noise: 0.0, spindle };
    plant.readings(work, &surroundings, &mut draw.0, |_| ())
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

fn print(robot: u64, found: &Found, identified: &[Identified]) {
    let estimate = &found.estimate;
    let worst = identified.iter().max_by(|a, b| a.score.abs().total_cmp(&b.score.abs()));
    let worst = worst.map_or_else(String::new, |worst| {
        format!(", worst {} by {:.1} σ", name(worst.index), worst.score)
    });
    eprintln!(
        "robot {robot}: {:?}, χ²/dof {:.3}, structure {:.3} ({:.3} where it is largest), {} starts, {} identified{worst}",
        estimate.acceptance,
        estimate.consistency,
        estimate.structure.size,
        estimate.structure.largest(),
        found.starts,
        identified.len()
    );
    for Identified { index, deviation, score, over_oracle } in identified {
        eprintln!(
            "    {}: {:.2} %, {over_oracle:.2} of the oracle's, off by {score:.1} σ",
            name(*index),
            100.0 * deviation
        );
    }
}

/// Robot `number` on a drawn plant: the plant, and the bushings in series with links that give way. `None` of a robot that gives way: below
/// the middle of the band a joint with hysteresis is softer than its stiffness there, and an overdamped one may have none left at rest.
pub(crate) fn drawn_robot(
    study: &Study,
    accuracies: &Accuracies,
    number: u64,
) -> Option<(Plant, Bushings)> {
    let mut draw = random(Purpose::Draw, number);
    let plant = drawn(accuracies, study.chain.joints().len(), study.measurement.band_hz, &mut draw);
    let bushings = with_links(&study.robot(number), accuracies, &mut draw);
    (plant.stiffness_at_rest(&bushings) > 0.0).then_some((plant, bushings))
}

/// Numbers of the first so many robots on typical plants that do not give way.
pub(crate) fn standing(study: &Study, robots: usize) -> Vec<u64> {
    let accuracies = Accuracies::typical();
    let stands = |robot: &u64| drawn_robot(study, &accuracies, *robot).is_some();
    (study.first..).filter(stands).take(robots).collect()
}

/// A plant whose every error is drawn from a normal distribution, but for links ([`with_links`]).
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
            clock: Clock {
                late_s,
                late_spread_s: accuracies.record_delay,
                ppm: 1e6 * accuracies.delay_drift * random.normal(),
                ..Clock::default()
            },
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
            spread: (0..joints)
                .map(|_| {
                    [(); 6].map(|()| SPREAD_OVER_INERTIA * accuracies.inertia * random.normal())
                })
                .collect(),
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
        pedestal: Some(ground(accuracies, random)),
        hose: Some(Hose {
            stiffness_n_per_m: accuracies.hose * random.normal().abs(),
            damping_ns_per_m: accuracies.hose_damping * random.normal().abs(),
        }),
        ..Plant::default()
    }
}

/// The joints in series with links that give way. The compliance c of each along each degree of freedom is drawn, none negative:
///
/// ```text
/// 1/(1/z + c) ≈ k/(1 + k c) + s d/(1 + k c)²        z = k + s d
/// ```
///
/// No link is in series with the first joint.
fn with_links(joints: &[Bushing], accuracies: &Accuracies, random: &mut Random) -> Bushings {
    let Accuracies { structure_translation, structure_rotation, .. } = *accuracies;
    let mut softer: Bushings = joints.iter().cloned().collect();
    for bushing in softer.iter_mut().skip(1) {
        for dof in 0..6 {
            let deviation = if dof < 3 { structure_translation } else { structure_rotation };
            let times = 1.0 + bushing.stiffness[dof] * deviation * random.normal().abs();
            bushing.stiffness[dof] /= times;
            bushing.damping[dof] /= times * times;
        }
    }
    softer
}

/// A ground whose compliances are drawn, none negative.
fn ground(accuracies: &Accuracies, random: &mut Random) -> Pedestal {
    let Accuracies { ground_translation, ground_rotation, .. } = *accuracies;
    let stiffness = [0, 1, 2, 3, 4, 5].map(|dof| {
        let deviation = if dof < 3 { ground_translation } else { ground_rotation };
        1.0 / (deviation * random.normal().abs()).max(RIGID)
    });
    let damping = stiffness.map(|own| GROUND_LAG * random.normal().abs() * own);
    Pedestal { mass_kg: BASE_KG, stiffness, damping }
}

fn three(deviation: f64, random: &mut Random) -> [f64; 3] {
    [0, 1, 2].map(|_| deviation * random.normal())
}
