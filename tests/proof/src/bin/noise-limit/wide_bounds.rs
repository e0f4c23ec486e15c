//! Identification without an expert: bounds ten times as wide on both sides, and those that follow from the masses.

use anyhow::{Result, anyhow};
use flexid_core::parameters::{Bounds, Ranges};
use rayon::prelude::*;

use crate::figure::Figure;
use crate::find::Task;
use crate::run::Run;
use crate::spread;
use crate::study::Study;

/// Smallest share of the robots that must be found, of a hundred or more; fewer scatter.
const LEAST: f64 = 0.95;
/// Factor by which the bounds are wider on each side.
const WIDER: f64 = 10.0;
/// Largest error of a found robot, over what the noise makes of it. The information matrix measures the error in all
/// parameters together; the square's expectation is the number of parameters.
const FOUND: f64 = 2.0;

pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    prove_in(widened(&study.scenario.bounds)?, "bounds ten times as wide", study, robots, details)
}

/// [`prove`] within the bounds of a configuration without `[bounds]`.
pub(crate) fn prove_from_masses(
    study: &Study,
    robots: usize,
    details: bool,
) -> Result<Vec<Figure>> {
    prove_in(Bounds::of(&study.chain), "bounds from the masses", study, robots, details)
}

fn prove_in(
    bounds: Bounds,
    what: &str,
    study: &Study,
    robots: usize,
    details: bool,
) -> Result<Vec<Figure>> {
    let cuts = study.cuts();
    let task = Task { bounds, ..study.task() };
    let one = |robot| Run::new(study, &task, &cuts, robot);
    let runs = (0..robots as u64).into_par_iter().map(one).collect::<Result<Vec<_>>>()?;
    if details {
        print_misses(&runs);
    }
    let is_found = |run: &&Run| run.found.is_consistent() && run.distance() <= FOUND;
    let found = runs.iter().filter(is_found).count();
    let false_claims =
        runs.iter().filter(|run| !is_found(run) && run.found.identified() > 0).count();
    let first = runs.iter().filter(|run| run.found.starts == 1).count();
    let demanded = (LEAST * robots as f64).ceil() as usize;
    let least = if robots < 100 { spread::counts(robots, LEAST)[0] } else { demanded };
    Ok(vec![
        Figure::count(
            format!("robots found in {what}"),
            robots,
            found >= least,
            found,
            &format!("≥ {least}"),
        )
        .remark(format_args!("{first} at the first start")),
        Figure::count(
            format!("{what}: others of which a parameter is called identified"),
            robots,
            false_claims == 0,
            false_claims,
            "none",
        ),
    ])
}

/// Prints robots that are not found, or hardly.
fn print_misses(runs: &[Run]) {
    for (robot, run) in runs.iter().enumerate() {
        let Run { found, .. } = run;
        if run.distance() > 1.5 || !found.is_consistent() {
            eprintln!(
                "robot {robot}: {:?}, χ²/dof {:.3}, SSP {:.3}, {} starts, {:.1} times the noise's error, {} identified",
                found.estimate.acceptance,
                found.estimate.consistency,
                found.estimate.ssp_median,
                found.starts,
                run.distance(),
                found.identified()
            );
        }
    }
}

fn widened(bounds: &Bounds) -> Result<Bounds> {
    let widen =
        |ranges: &[[f64; 2]; 6]| ranges.map(|[lower, upper]| [lower / WIDER, upper * WIDER]);
    let ranges =
        |own: Ranges| Ranges { stiffness: widen(&own.stiffness), damping: widen(&own.damping) };
    let bounds = Bounds { joints: bounds.joints.map(ranges) };
    bounds.check().map_err(|error| anyhow!("no bounds: {error:?}"))?;
    Ok(bounds)
}
