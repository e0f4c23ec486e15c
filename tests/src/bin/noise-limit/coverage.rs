//! With the scenario's noise: intervals that cover, and errors at the bound.

use anyhow::Result;
use flexid_core::identify::Acceptance;
use rayon::prelude::*;

use crate::bound::{deviations, distance, information};
use crate::figure::{Figure, root_mean_square};
use crate::find::{Found, Task, find};
use crate::linear::motion;
use crate::records::{SAMPLES, Sensors, Signals};
use crate::study::{Purpose, Study, name, random};

/// Runs of the full proof, each with a robot of its own.
const ROBOTS: usize = 1000;
/// Half of an interval that holds 95 %, in standard deviations.
const HALF: f64 = 1.96;
/// How far the share of intervals that cover may be from 95 %, of all and of each parameter; percent.
const OFF_ALL: f64 = 1.0;
const OFF_EACH: f64 = 3.0;
/// Root-mean-square error above the bound.
const ABOVE_BOUND: f64 = 0.1;

/// One run.
struct Run {
    found: Found,
    /// Errors of the logarithms.
    errors: Vec<f64>,
    /// Standard deviations at the bound.
    bound: Vec<f64>,
    /// Errors of all parameters together, over what the bound makes of them: 1 in the mean square.
    together: f64,
}

/// Of one parameter, over the consistent runs that identify it.
struct Parameter {
    name: String,
    /// Errors in standard deviations as reported, and as bounded.
    reported: Vec<f64>,
    bounded: Vec<f64>,
}

pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let robots = robots.min(ROBOTS);
    let cuts = study.cuts();
    let one = |robot: u64| -> Result<Run> {
        let truth = study.robot(robot);
        let mut sensors = Sensors::new(study, random(Purpose::Noise, robot))?;
        let (mut records, mut told) = (Vec::new(), Vec::new());
        for cut in &cuts[robot as usize % cuts.len()] {
            let motion = motion(&study.chain, &truth, cut);
            records.push(sensors.measure(&Signals::new(&cut.pose, &motion))?);
            told.push(information(study, &study.chain, &truth, cut, &motion, 0..SAMPLES)?);
        }
        let (chain, bounds) = (&study.chain, study.scenario.bounds);
        let task = Task { chain, bounds, measurement: study.measurement };
        let found = find(&task, &records, random(Purpose::Search, robot).0)?;
        let errors = found.errors(&truth);
        let told = told.into_iter().sum();
        let (bound, together) = (deviations(&told)?, distance(&told, &errors));
        Ok(Run { errors, found, bound, together })
    };
    let runs = (0..robots as u64).into_par_iter().map(one).collect::<Result<Vec<_>>>()?;
    if details {
        print_misses(&runs);
    }
    Ok(judge(study, &runs, details))
}

fn judge(study: &Study, runs: &[Run], details: bool) -> Vec<Figure> {
    let parameters: Vec<Parameter> = (0..12 * study.chain.joints().len())
        .map(|index| {
            let of = runs.iter().filter(|run| run.is_consistent() && run.found.identified[index]);
            let scores = |deviations: fn(&Run) -> &[f64]| {
                of.clone().map(|run| run.errors[index] / deviations(run)[index]).collect()
            };
            Parameter {
                name: name(index),
                reported: scores(|run| &run.found.deviations),
                bounded: scores(|run| &run.bound),
            }
        })
        .collect();
    if details {
        for parameter in &parameters {
            eprintln!(
                "{}: identified in {}, covered {:.1} %, error {:.3} of the bound",
                parameter.name,
                parameter.reported.len(),
                parameter.coverage(),
                parameter.above_bound()
            );
        }
    }
    // Fewer runs scatter more.
    let wider = (ROBOTS as f64 / runs.len() as f64).sqrt();
    let within = |off: f64| [95.0 - off * wider, (95.0 + off * wider).min(100.0)];
    let all: Vec<f64> = parameters.iter().flat_map(|p| p.reported.iter().copied()).collect();
    let told: Vec<&Parameter> = parameters.iter().filter(|p| !p.reported.is_empty()).collect();
    let by = |key: fn(&Parameter) -> f64, largest: bool| {
        let order = |a: &&&Parameter, b: &&&Parameter| key(a).total_cmp(&key(b));
        if largest { told.iter().max_by(order) } else { told.iter().min_by(order) }
    };
    let mut figures = vec![
        Figure::within(
            "95 % intervals that cover",
            runs.len(),
            within(OFF_ALL),
            coverage(&all),
            " %",
        )
        .remark(format_args!("{} intervals of {} parameters", all.len(), told.len())),
    ];
    for (what, largest) in [("lowest", false), ("highest", true)] {
        if let Some(p) = by(Parameter::coverage, largest) {
            let what = format!("the same, parameter with the {what}");
            figures.push(
                Figure::within(what, runs.len(), within(OFF_EACH), p.coverage(), " %")
                    .remark(format_args!("{}, identified in {}", p.name, p.reported.len())),
            );
        }
    }
    if let Some(p) = by(Parameter::above_bound, true) {
        let limit = 1.0 + ABOVE_BOUND * wider;
        let what = "root-mean-square error over the bound, worst parameter";
        figures.push(
            Figure::at_most(what, runs.len(), limit, p.above_bound(), "").remark(format_args!(
                "{}, identified in {}",
                p.name,
                p.bounded.len()
            )),
        );
        let consistent = runs.iter().filter(|run| run.is_consistent());
        let together: Vec<f64> = consistent.map(|run| run.together).collect();
        let what = "the same, all parameters together, weighted by what the records tell of them";
        figures.push(Figure::at_most(what, runs.len(), limit, root_mean_square(&together), ""));
    }
    let claims = |run: &&Run| !run.is_consistent() && run.found.identified.contains(&true);
    let false_claims = runs.iter().filter(claims).count();
    let what = "runs that the noise does not explain, yet a parameter is called identified";
    figures.push(Figure::count(what, runs.len(), false_claims == 0, false_claims, "none"));
    figures
}

/// Runs that are not as they should be.
fn print_misses(runs: &[Run]) {
    for (robot, run) in runs.iter().enumerate() {
        let Run { found, errors, .. } = run;
        let scores = errors.iter().zip(&found.deviations).map(|(e, d)| (e / d).abs());
        let identified = scores.zip(&found.identified).map(|(z, &yes)| if yes { z } else { 0.0 });
        let (worst, score) =
            identified.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
        if !run.is_consistent() || score > 4.0 {
            eprintln!(
                "robot {robot}: {:?}, χ²/dof {:.3}, {} starts, {} off by {score:.1} σ",
                found.acceptance,
                found.consistency,
                found.starts,
                name(worst)
            );
        }
    }
}

impl Run {
    fn is_consistent(&self) -> bool {
        self.found.acceptance == Acceptance::Consistent
    }
}

impl Parameter {
    fn coverage(&self) -> f64 {
        coverage(&self.reported)
    }

    fn above_bound(&self) -> f64 {
        root_mean_square(&self.bounded)
    }
}

/// Share of the intervals that hold the truth, percent.
fn coverage(scores: &[f64]) -> f64 {
    let covered = scores.iter().filter(|score| score.abs() <= HALF).count();
    100.0 * covered as f64 / scores.len() as f64
}
