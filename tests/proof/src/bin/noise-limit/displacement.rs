//! Displacements at poses and in cuts that no identification has seen, predicted from every kind of record.

use std::fmt;
use std::ops::Range;

use anyhow::{Context, Result};
use flexid_core::parameters::{Bounds, Bushing, Bushings, Ranges};
use flexid_core::verdict::Covariance;
use flexid_simulation::experiment::Cut;
use flexid_simulation::validation::displacement_error;
use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;

use crate::common::Random;
use crate::figure::{Figure, median, root_mean_square};
use crate::find::{Found, find};
use crate::linear::{Motion, motion};
use crate::records::{SAMPLES, Sensors, Signals};
use crate::spread;
use crate::study::{NO_QUIET, Purpose, Study, logarithms, random};

/// Number of unseen cuts, with three directions each.
const UNSEEN: u64 = 5;
/// Number of times that the noise is drawn for each robot. One error is not enough: a few directions of the
/// parameters make nearly all of it, and a robot at the bound passes the limit by chance once in twenty times.
const REPEATS: u64 = 16;
/// Number of draws from the covariance of each repetition.
const DRAWS: usize = 3;
/// Standard deviation of a logarithm that the data do not determine. It reaches beyond the bounds on either side.
const ANYWHERE: f64 = 100.0;
/// Number of robots for whose median the limit is meant.
const ENOUGH: usize = 20;
/// Standard deviation of the logarithm of a robot's error, among robots.
const AMONG_ROBOTS: f64 = 0.5;
/// Standard deviation of the logarithm of a robot's error over its prediction, if a single direction of the
/// parameters makes all of both. Both are then root mean squares, of as many normal numbers as there are repetitions,
/// and draws from them; 0.20. The median of twenty robots then scatters by 0.057: the limits are 3.9 times as far.
const RATIO: f64 = 0.204;
/// Rounding error of a correlation.
const ROUNDING: f64 = 1e-9;
/// Largest error over its prediction, both as root mean squares, of each robot.
const OVER_PREDICTION: f64 = 1.5;
/// Limits of the error over its prediction, median of the robots. A prediction that is too large is as wrong as one
/// too small.
const MEDIAN_OVER_PREDICTION: [f64; 2] = [0.8, 1.25];
/// Largest median of the robots' errors, percent.
const MEDIAN: f64 = 0.2;

/// The start and the end of records.
#[derive(Clone, Copy)]
enum Kind {
    /// The robot rests, the cut comes, the robot rings.
    FromRest,
    /// The robot still rings from the cut before.
    Ringing,
    /// The record lasts from the middle of one cut to the middle of the next.
    MidMilling,
    /// The record comes from a long cut, without a quiet sample.
    NoQuiet,
}

/// The motion of one robot, and the origin of its records.
struct Trial<'a> {
    study: &'a Study,
    robot: u64,
    truth: Bushings,
    kind: Kind,
    /// Cut to identify from, of each pose.
    cuts: Vec<Cut>,
    motions: Vec<Motion>,
    /// Samples of the motion that are the record.
    window: Range<usize>,
    /// Motions from rest before the record, if the record has no quiet samples to read the noise from.
    before: Vec<Motion>,
}

/// Displacement errors of one robot, as parts of one: medians over unseen cuts and directions.
struct Errors {
    /// Errors of the estimates, of every repetition.
    found: Vec<f64>,
    /// Number of repetitions whose estimate is not consistent.
    suspect: usize,
    /// Errors of draws from the estimates' covariances.
    drawn: Vec<f64>,
}

pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let (short, long) = (study.cuts(), study.long_cuts());
    let unseen = study.unseen(UNSEEN);
    let mut figures = Vec::new();
    for (kind, name) in [
        (Kind::FromRest, "records from rest"),
        (Kind::Ringing, "records that start while the robot rings"),
        (Kind::MidMilling, "records cut out in mid-milling, with a pause in them"),
        (Kind::NoQuiet, "records cut out in mid-milling, without a quiet sample"),
    ] {
        let one = |robot: u64| Trial::new(study, robot, kind, &short, &long).errors(&unseen);
        let all = (0..robots as u64).into_par_iter().map(one).collect::<Result<Vec<_>>>()?;
        if details {
            for (robot, errors) in all.iter().enumerate() {
                eprintln!("{name}, robot {robot}: {errors}");
            }
        }
        let medians: Vec<f64> =
            all.iter().map(|errors| 100.0 * median(errors.found.clone())).collect();
        let largest = medians.iter().copied().fold(0.0, f64::max);
        let predicted = all.iter().map(|errors| 100.0 * median(errors.drawn.clone())).collect();
        let middle = median(medians);
        let remark = format!("of the worst {largest:.3} %; predicted {:.3} %", median(predicted));
        let runs = format!("{robots} robots × {REPEATS} noises");
        let ratios: Vec<f64> = all.iter().map(Errors::over_prediction).collect();
        let worst = ratios.iter().copied().fold(0.0, f64::max);
        let suspect: usize = all.iter().map(|errors| errors.suspect).sum();
        let what = format!("{name}: displacement error over its prediction, worst robot");
        figures.push(
            Figure::at_most(what, robots, OVER_PREDICTION, worst, "")
                .remark(format_args!("{suspect} runs not found"))
                .made_of(&runs),
        );
        let what = format!("{name}: the same, median of the robots");
        let [least, most] = MEDIAN_OVER_PREDICTION;
        let chance = beyond(robots, RATIO);
        let limits = [least.min(1.0 / chance), most.max(chance)];
        figures.push(Figure::within(what, robots, limits, median(ratios), "").made_of(&runs));
        let what = format!("{name}: displacement error, median of the robots");
        let limit = MEDIAN * beyond(robots, AMONG_ROBOTS);
        figures
            .push(Figure::at_most(what, robots, limit, middle, " %").remark(remark).made_of(&runs));
    }
    Ok(figures)
}

/// Factor by which chance may move the median of few robots, if the logarithm of one scatters by `deviation`. The
/// limits for enough robots allow for it. The standard error of a median is 1.25 times that of a mean.
fn beyond(robots: usize, deviation: f64) -> f64 {
    let scatter = 1.25 * deviation / (robots as f64).sqrt();
    if robots < ENOUGH { (spread::DEVIATIONS * scatter).exp() } else { 1.0 }
}

impl<'a> Trial<'a> {
    fn new(
        study: &'a Study,
        robot: u64,
        kind: Kind,
        short: &[Vec<Cut>],
        long: &[Vec<Cut>],
    ) -> Self {
        let draw = robot as usize % short.len();
        let next = (draw + 1) % short.len();
        let truth = study.robot(robot);
        let (cuts, window) = match kind {
            Kind::FromRest => (short[draw].clone(), 0..SAMPLES),
            Kind::Ringing | Kind::MidMilling => {
                let mut cuts = short[draw].clone();
                for (cut, next) in cuts.iter_mut().zip(&short[next]) {
                    cut.force.extend(&next.force);
                }
                let start = if matches!(kind, Kind::Ringing) { SAMPLES } else { 3 * SAMPLES / 8 };
                (cuts, start..start + SAMPLES)
            }
            Kind::NoQuiet => (long[draw].clone(), NO_QUIET),
        };
        let moves =
            |cuts: &[Cut]| cuts.iter().map(|cut| motion(&study.chain, &truth, cut)).collect();
        let motions = moves(&cuts);
        let before = if matches!(kind, Kind::NoQuiet) { moves(&short[draw]) } else { Vec::new() };
        Self { study, robot, kind, cuts, motions, window, before, truth }
    }

    fn errors(&self, unseen: &[Cut]) -> Result<Errors> {
        let Self { study, truth, .. } = self;
        let (band, rate_hz) = (study.measurement.band_hz, study.scenario.measurement.rate_hz);
        let displaced = |bushings: &Bushings| -> Vec<Vec<Vector3<f64>>> {
            unseen.iter().map(|cut| motion(&study.chain, bushings, cut).displacement).collect()
        };
        let reference = displaced(truth);
        let error = |bushings: &Bushings| {
            let pairs = reference.iter().zip(displaced(bushings));
            median(pairs.flat_map(|(a, b)| displacement_error(a, &b, rate_hz, band)).collect())
        };
        let one = |repeat: u64| -> Result<(f64, [f64; DRAWS], bool)> {
            let number = REPEATS * (4 * self.robot + self.kind as u64) + repeat;
            let found = self.find(number)?;
            let factor = factor(&found.estimate.covariance)?;
            let mut random = random(Purpose::Draw, number);
            let drawn = [(); DRAWS]
                .map(|()| error(&drawn(truth, &factor, &study.scenario.bounds, &mut random)));
            Ok((error(&found.estimate.bushings), drawn, found.is_consistent()))
        };
        let all = (0..REPEATS).into_par_iter().map(one).collect::<Result<Vec<_>>>()?;
        Ok(Errors {
            found: all.iter().map(|(found, ..)| *found).collect(),
            drawn: all.iter().flat_map(|(_, drawn, _)| *drawn).collect(),
            suspect: all.iter().filter(|(.., consistent)| !consistent).count(),
        })
    }

    /// Identifies the robot, with noise of its own.
    fn find(&self, number: u64) -> Result<Found> {
        let study = self.study;
        let mut sensors = Sensors::new(study, random(Purpose::Noise, number))?;
        let mut records = Vec::new();
        for (index, (cut, motion)) in self.cuts.iter().zip(&self.motions).enumerate() {
            if let Some(before) = self.before.get(index) {
                sensors.measure(&Signals::new(&cut.pose, before))?;
            }
            let signals = Signals::new(&cut.pose, motion).part(self.window.clone());
            records.push(sensors.measure(&signals)?);
        }
        find(&study.task(), &records, random(Purpose::Search, number).0)
    }
}

impl Errors {
    fn over_prediction(&self) -> f64 {
        root_mean_square(&self.found) / root_mean_square(&self.drawn)
    }
}

impl fmt::Display for Errors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let predicted = root_mean_square(&self.drawn);
        let beyond = |errors: &[f64]| {
            errors.iter().filter(|error| **error > OVER_PREDICTION * predicted).count()
        };
        write!(
            f,
            "{:.3} %, predicted {:.3} %, ratio {:.2}; {} not found; beyond the limit alone: {} of {REPEATS}, of draws {} of {}",
            100.0 * root_mean_square(&self.found),
            100.0 * predicted,
            self.over_prediction(),
            self.suspect,
            beyond(&self.found),
            beyond(&self.drawn),
            self.drawn.len()
        )
    }
}

/// `F` of a covariance `F Fᵀ`, as an estimate reports it.
fn factor(covariance: &Covariance) -> Result<DMatrix<f64>> {
    let n = covariance.unknowns();
    let correlation = DMatrix::from_fn(n, n, |i, j| match i == j {
        true => 1.0 + ROUNDING,
        false => covariance.correlation(i, j),
    });
    let mut factor = correlation.cholesky().context("a covariance that is none")?.unpack();
    for (i, mut row) in factor.row_iter_mut().enumerate() {
        row *= covariance.deviation(i).min(ANYWHERE);
    }
    Ok(factor)
}

/// A robot that could be mistaken for `truth`. Its logarithms differ by a draw from the covariance `factor factorᵀ`,
/// within the bounds.
fn drawn(
    truth: &Bushings,
    factor: &DMatrix<f64>,
    bounds: &Bounds,
    random: &mut Random,
) -> Bushings {
    let off = factor * DVector::from_fn(factor.nrows(), |_, _| random.normal());
    let values: Vec<f64> =
        logarithms(truth).iter().zip(&off).map(|(l, off)| (l + off).exp()).collect();
    let within = |value: f64, [lower, upper]: [f64; 2]| value.clamp(lower, upper);
    let (joints, _) = values.as_chunks::<12>();
    let bushing = |(joint, own): (&[f64; 12], &Ranges)| Bushing {
        stiffness: std::array::from_fn(|dof| within(joint[dof], own.stiffness[dof])),
        damping: std::array::from_fn(|dof| within(joint[6 + dof], own.damping[dof])),
    };
    joints.iter().zip(&bounds.joints).map(bushing).collect()
}
