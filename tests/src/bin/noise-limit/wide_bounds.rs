//! Without expert knowledge: bounds ten times as wide on both sides.

use anyhow::{Result, anyhow};
use flexid_core::identify::Acceptance;
use flexid_core::parameters::Bounds;
use rayon::prelude::*;

use crate::bound::{distance, information};
use crate::figure::Figure;
use crate::find::{Found, Task, find};
use crate::linear::motion;
use crate::records::{SAMPLES, Sensors, Signals};
use crate::study::{Purpose, Study, random};

/// Robots of the full proof.
const ROBOTS: usize = 100;
/// Of a hundred, those that must be found.
const LEAST: usize = 95;
/// How much wider on each side.
const WIDER: f64 = 10.0;
/// A found robot's error, measured in all parameters together by the information matrix, is at most this many times what
/// the noise makes of it; the square's expectation is the number of parameters.
const FOUND: f64 = 2.0;

pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let robots = robots.min(ROBOTS);
    let cuts = study.cuts();
    let bounds = widened(&study.scenario.bounds)?;
    let one = |robot: u64| -> Result<(Found, f64)> {
        let truth = study.robot(robot);
        let mut sensors = Sensors::new(study, random(Purpose::Noise, robot))?;
        let (mut records, mut told) = (Vec::new(), Vec::new());
        for cut in &cuts[robot as usize % cuts.len()] {
            let motion = motion(&study.chain, &truth, cut);
            records.push(sensors.measure(&Signals::new(&cut.pose, &motion))?);
            told.push(information(study, &study.chain, &truth, cut, &motion, 0..SAMPLES)?);
        }
        let task = Task { chain: &study.chain, bounds, measurement: study.measurement };
        let found = find(&task, &records, random(Purpose::Search, robot).0)?;
        let distance = distance(&told.into_iter().sum(), &found.errors(&truth));
        if details && (distance > 1.5 || found.acceptance != Acceptance::Consistent) {
            let identified = found.identified.iter().filter(|yes| **yes).count();
            eprintln!(
                "robot {robot}: {:?}, χ²/dof {:.3}, {} starts, {distance:.1} times the noise's error, {identified} identified",
                found.acceptance, found.consistency, found.starts
            );
        }
        Ok((found, distance))
    };
    let runs = (0..robots as u64).into_par_iter().map(one).collect::<Result<Vec<_>>>()?;
    let is_found = |(found, distance): &&(Found, f64)| {
        found.acceptance == Acceptance::Consistent && *distance <= FOUND
    };
    let found = runs.iter().filter(is_found).count();
    let false_claims =
        runs.iter().filter(|run| !is_found(run) && run.0.identified.iter().any(|yes| *yes)).count();
    let first = runs.iter().filter(|run| run.0.starts == 1).count();
    Ok(vec![
        Figure::count(
            "robots found in bounds ten times as wide",
            robots,
            found * ROBOTS >= LEAST * robots,
            found,
            "95 of 100",
        )
        .remark(format_args!("{first} at the first start")),
        Figure::count(
            "others of which a parameter is called identified",
            robots,
            false_claims == 0,
            false_claims,
            "none",
        ),
    ])
}

fn widened(bounds: &Bounds) -> Result<Bounds> {
    let widen =
        |ranges: &[[f64; 2]; 6]| ranges.map(|[lower, upper]| [lower / WIDER, upper * WIDER]);
    let bounds = Bounds { stiffness: widen(&bounds.stiffness), damping: widen(&bounds.damping) };
    bounds.check().map_err(|error| anyhow!("no bounds: {error:?}"))?;
    Ok(bounds)
}
