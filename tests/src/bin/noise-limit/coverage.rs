//! With the scenario's noise: intervals that cover, and errors at the bound.

use anyhow::Result;
use flexid_core::verdict::Verdict;
use rayon::prelude::*;

use crate::bound::deviations;
use crate::figure::{Figure, root_mean_square};
use crate::intervals::{EACH, Intervals, percent};
use crate::run::Run;
use crate::spread;
use crate::study::{Study, name};

/// How far from 95 % the share of all intervals that cover may be, percent.
const OFF: f64 = 1.0;
/// The same of weak parameters: errors of up to a third are not small.
const OFF_WEAK: f64 = 3.0;
/// Root-mean-square error over the bound.
const OVER_BOUND: f64 = 1.1;

/// Of one parameter, over the consistent runs that identify it.
struct Parameter {
    name: String,
    /// Errors in standard deviations as reported, and as bounded.
    reported: Vec<f64>,
    bounded: Vec<f64>,
}

pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let (cuts, task) = (study.cuts(), study.task());
    let one = |robot| -> Result<(Run, Vec<f64>)> {
        let run = Run::new(study, &task, &cuts, robot)?;
        let bound = deviations(&run.information)?;
        Ok((run, bound))
    };
    let runs = (0..robots as u64).into_par_iter().map(one).collect::<Result<Vec<_>>>()?;
    let parameters: Vec<Parameter> =
        (0..12 * study.chain.joints().len()).map(|index| Parameter::new(&runs, index)).collect();
    if details {
        runs.iter().enumerate().for_each(|(robot, (run, _))| print_miss(robot, run));
        parameters.iter().for_each(Parameter::print);
    }
    Ok(judge(&runs, &parameters))
}

fn judge(runs: &[(Run, Vec<f64>)], parameters: &[Parameter]) -> Vec<Figure> {
    let consistent = || runs.iter().map(|(run, _)| run).filter(|run| run.found.is_consistent());
    let intervals = |verdict| {
        let mut all = Intervals::default();
        for run in consistent() {
            let (found, errors) = (&run.found, &run.errors);
            let called = (0..errors.len()).filter(|index| found.verdicts[*index] == verdict);
            all.push(called.map(|index| errors[index] / found.deviations[index]));
        }
        all
    };
    let unexplained = runs.len() - consistent().count();
    let mut figures = vec![
        Figure::unexplained("all robots", runs.len(), unexplained),
        intervals(Verdict::Identified).cover("identified parameters", OFF, false),
    ];
    let told: Vec<&Parameter> = parameters.iter().filter(|p| !p.reported.is_empty()).collect();
    // Relative to the range that each has by its own number of runs.
    let lowest = told.iter().min_by(|a, b| a.room()[0].total_cmp(&b.room()[0]));
    let highest = told.iter().min_by(|a, b| a.room()[1].total_cmp(&b.room()[1]));
    for (what, found) in [("least", lowest), ("most", highest)] {
        if let Some(p) = found {
            let what = format!("the same, the parameter that covers {what} by its limits");
            let (count, covered) = (p.reported.len(), percent(&p.reported));
            figures.push(
                Figure::within(what, count, p.limits(), covered, " %")
                    .remark(format_args!("{}, identified in {count}", p.name)),
            );
        }
    }
    let by_excess = |p: &&&Parameter| root_mean_square(&p.bounded) / p.limit();
    if let Some(p) = told.iter().max_by(|a, b| by_excess(a).total_cmp(&by_excess(b))) {
        let what = "root-mean-square error over the bound, worst parameter by its limit";
        let count = p.bounded.len();
        figures.push(
            Figure::at_most(what, count, p.limit(), root_mean_square(&p.bounded), "")
                .remark(format_args!("{}, identified in {count}", p.name)),
        );
    }
    let together: Vec<f64> = consistent().map(Run::distance).collect();
    let what = "the same, all parameters together, weighted by what the records tell of them";
    // Each run counts as one error, though it has many.
    let limit = spread::root_mean_square(together.len(), OVER_BOUND);
    figures.push(Figure::at_most(what, runs.len(), limit, root_mean_square(&together), ""));
    // Few robots may have none.
    let weak = intervals(Verdict::Weak);
    if !weak.is_empty() {
        figures.push(weak.cover("weak parameters", OFF_WEAK, false));
    }
    let others = runs.iter().map(|(run, _)| run).filter(|run| !run.found.is_consistent());
    let claims = others.filter(|run| run.found.identified() > 0).count();
    let what = "runs that the noise does not explain, yet a parameter is called identified";
    figures.push(Figure::count(what, runs.len(), claims == 0, claims, "none"));
    figures
}

/// Says which run is not as it should be.
fn print_miss(robot: usize, run: &Run) {
    let Run { found, errors, .. } = run;
    let scores = errors.iter().zip(&found.deviations).map(|(e, d)| (e / d).abs());
    let identified = scores.enumerate().filter(|(index, _)| found.identifies(*index));
    let (worst, score) = identified.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
    if !found.is_consistent() || score > 4.5 {
        eprintln!(
            "robot {robot}: {:?}, χ²/dof {:.3}, SSP {:.3}, {} starts, {} off by {score:.1} σ, all together {:.2}",
            found.estimate.acceptance,
            found.estimate.consistency,
            found.estimate.ssp_median,
            found.starts,
            name(worst),
            run.distance()
        );
    }
}

impl Parameter {
    fn new(runs: &[(Run, Vec<f64>)], index: usize) -> Self {
        let of =
            runs.iter().filter(|(run, _)| run.found.is_consistent() && run.found.identifies(index));
        Self {
            name: name(index),
            reported: of
                .clone()
                .map(|(run, _)| run.errors[index] / run.found.deviations[index])
                .collect(),
            bounded: of.map(|(run, bound)| run.errors[index] / bound[index]).collect(),
        }
    }

    fn limits(&self) -> [f64; 2] {
        spread::percentages(self.reported.len(), 0.95, EACH)
    }

    /// How far its share is from both limits, as parts of their distance from 95 %.
    fn room(&self) -> [f64; 2] {
        let (covered, [least, most]) = (percent(&self.reported), self.limits());
        [(covered - least) / (95.0 - least), (most - covered) / (most - 95.0)]
    }

    /// Of the error over the bound.
    fn limit(&self) -> f64 {
        spread::root_mean_square(self.bounded.len(), OVER_BOUND)
    }

    fn print(&self) {
        eprintln!(
            "{}: identified in {}, covered {:.1} %, error {:.3} of the bound",
            self.name,
            self.reported.len(),
            percent(&self.reported),
            root_mean_square(&self.bounded)
        );
    }
}
