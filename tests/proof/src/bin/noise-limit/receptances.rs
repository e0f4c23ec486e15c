//! Measured receptances in place of cuts: the responses to a hammer along each axis of the TCP in each pose, with 1 % noise and the coherence that
//! says so, of perfect plants and of the plausible ones of `plants`.
//!
//! The robot is struck in time. The responses are the ratio of both readings, weighted by `e^(−σt)`, so that the end of the motion is gone:
//!
//! ```text
//! A(s)/F(s)        s = σ + iω        σT = 12
//! ```

use std::f64::consts::TAU;

use anyhow::{Context, Result};
use flexid_core::imperfection::Accuracies;
use flexid_core::parameters::Bushings;
use flexid_core::spectrum::{Experiment, MeasuredBin, MeasuredReceptance};
use flexid_simulation::experiment::Cut;
use flexid_simulation::plant::Plant;
use nalgebra::{Complex, Vector3};
use rayon::prelude::*;

use crate::figure::Figure;
use crate::find::{Found, find, find_from};
use crate::hammer::blows;
use crate::intervals::Intervals;
use crate::plants::{COVER, GROSS, drawn_robot, found, readings, records, standing};
use crate::records::BINS;
use crate::study::{Purpose, Study, random};

/// Least share of the parameters that as many cuts as poses identify, percent.
const OF_CUTS: f64 = 80.0;
/// Standard deviation of each magnitude, relative.
const NOISE: f64 = 0.01;
/// σT: the ringing that is cut off has a part of 6e-6 left, far below the noise.
const DECAY: f64 = 12.0;

/// The result of one robot.
struct Outcome {
    by_cuts: usize,
    /// Error of each identified parameter in standard deviations.
    scores: Vec<f64>,
}

/// The first robots of this scenario that do not give way, on perfect plants and on drawn ones.
pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let numbers = standing(study, robots);
    let mut figures = Vec::new();
    for (name, accuracies) in [("perfect", Accuracies::default()), ("drawn", Accuracies::typical())]
    {
        let one = |robot: &u64| outcome(study, &accuracies, *robot, details);
        let all = numbers.par_iter().map(one).collect::<Result<Vec<_>>>()?;
        let mut intervals = Intervals::default();
        for Outcome { scores, .. } in &all {
            intervals.push(scores.iter().copied());
        }
        let scores = || all.iter().flat_map(|one| one.scores.iter().map(|score| score.abs()));
        let (identified, by_cuts) = (scores().count(), all.iter().map(|one| one.by_cuts).sum());
        figures.push(
            Figure::count(
                &format!("receptances of {name} plants, three a pose: parameters that are identified, of those that a cut a pose identifies"),
                by_cuts,
                by_cuts > 0 && 100.0 * identified as f64 >= OF_CUTS * by_cuts as f64,
                identified,
                &format!("at least {OF_CUTS:.0} %"),
            )
            .made_of(robots),
        );
        let what = format!("receptances of {name} plants, identified");
        figures.push(intervals.cover_on_plants(&what, COVER));
        figures.push(Figure::at_most(
            &format!("receptances of {name} plants: largest error of an identified parameter"),
            robots,
            GROSS,
            scores().fold(0.0, f64::max),
            " σ",
        ));
    }
    Ok(figures)
}

fn outcome(study: &Study, accuracies: &Accuracies, robot: u64, details: bool) -> Result<Outcome> {
    let cuts = study.cuts();
    let cuts = &cuts[robot as usize % cuts.len()];
    let is_perfect = accuracies.are_perfect();
    let (plant, bushings) = match is_perfect {
        true => (Plant::default(), study.robot(robot)),
        false => drawn_robot(study, accuracies, robot).unwrap_or_default(),
    };
    let of_cuts = records(study, cuts, &plant, &bushings, robot)?;
    let search = || random(Purpose::Search, robot).0;
    let by_cuts = match is_perfect {
        true => find(&study.task(), &of_cuts, search())?,
        false => found(study, &of_cuts, accuracies, robot)?.1,
    };
    let tests = tests(study, cuts, &plant, &bushings, robot)?;
    let by_tests = find_from(&study.task(), accuracies, tests, search())?;
    let errors = by_tests.errors(&study.robot(robot));
    let identified = (0..errors.len()).filter(|&index| by_tests.identifies(index));
    let scores: Vec<f64> =
        identified.map(|index| errors[index] / by_tests.deviations[index]).collect();
    if details {
        let of = |found: &Found| {
            let Found { estimate, starts, .. } = found;
            let (acceptance, consistency) = (estimate.acceptance, estimate.consistency);
            format!(
                "{} ({acceptance:?}, χ²/dof {consistency:.3}, {starts} starts)",
                found.identified()
            )
        };
        let held = scores.iter().filter(|score| score.abs() < 1.96).count();
        eprintln!(
            "robot {robot}: cuts {}, receptances {}, {held} hold",
            of(&by_cuts),
            of(&by_tests)
        );
    }
    Ok(Outcome { by_cuts: by_cuts.identified(), scores })
}

/// The responses to a blow along each axis in the pose of each cut.
fn tests(
    study: &Study,
    cuts: &[Cut],
    plant: &Plant,
    bushings: &Bushings,
    robot: u64,
) -> Result<Vec<Experiment<BINS>>> {
    let mut draw = random(Purpose::Plant, robot);
    let mut noise = random(Purpose::Noise, robot);
    let sampling = &study.scenario.measurement;
    let seconds = sampling.samples() as f64 / sampling.rate_hz;
    let decay = DECAY / seconds;
    let [first_bin, last_bin] = sampling.band_hz.map(|edge| (edge * seconds).round() as usize);
    let mut tests = Vec::new();
    for (index, blow) in blows(study, cuts, plant).iter().enumerate() {
        let number = (index / 3) as u64;
        let read = readings(study, blow, plant, bushings, number, &mut draw)
            .context("a robot that stands does not give way")?;
        let axis = index % 3;
        let mut axes = [const { Vec::new() }; 3];
        for bin in first_bin..=last_bin {
            let s = Complex::new(decay, TAU * bin as f64 / seconds);
            let force = transform(&read.force, s, sampling.rate_hz)[axis];
            let response = transform(&read.acceleration, s, sampling.rate_hz);
            for (bins, own) in axes.iter_mut().zip(response) {
                let exact = own / force;
                let deviation = NOISE * exact.norm();
                let accelerance =
                    [exact.re, exact.im].map(|part| part + deviation * noise.normal());
                bins.push(MeasuredBin { accelerance, variance: 2.0 * deviation * deviation });
            }
        }
        let mut direction = [0.0; 3];
        direction[axis] = 1.0;
        let measured = MeasuredReceptance {
            pose: &blow.pose,
            point: [0.0; 3],
            direction,
            spacing_hz: 1.0 / seconds,
            first_hz: first_bin as f64 / seconds,
            decay,
            axes: axes.each_ref().map(Vec::as_slice),
        };
        let test = Experiment::of_receptance(&study.chain, &study.measurement, &measured);
        tests.push(test.context("a modal test has no spectrum")?);
    }
    Ok(tests)
}

/// `Σ x(n) e^(−s n / rate)` of each axis.
fn transform(series: &[Vector3<f64>], s: Complex<f64>, rate_hz: f64) -> [Complex<f64>; 3] {
    let turn = (-s / rate_hz).exp();
    let mut weight = Complex::ONE;
    let mut sums = [Complex::ZERO; 3];
    for sample in series {
        (0..3).for_each(|axis| sums[axis] += weight * sample[axis]);
        weight *= turn;
    }
    sums
}
