//! Intervals that cover, and errors at the bound, with the scenario's noise.

use anyhow::Result;
use flexid_core::verdict::Verdict;
use rayon::prelude::*;

use crate::bound::deviations;
use crate::figure::{Figure, root_mean_square};
use crate::intervals::{EACH, Intervals, percent};
use crate::run::Run;
use crate::spread::{self, ENOUGH};
use crate::study::{Study, name};

/// Largest distance from 95 % of the share of all intervals that cover, percent.
const OFF: f64 = 1.0;
/// Largest distance from 95 % of the share for weak parameters, percent. Their errors of up to a third are not small.
const OFF_WEAK: f64 = 3.0;
/// Limits of the root-mean-square error over the bound, of each parameter. An error below them shows that the bound
/// is wrong.
const OVER_BOUND: [f64; 2] = [0.9, 1.1];
/// Limits of the root-mean-square error over the bound, of all parameters together.
const ALL_OVER_BOUND: [f64; 2] = [0.95, 1.1];

/// Number of independent errors per parameter that scatter from run to run like all parameters together, as measured
/// over a thousand runs. The errors are independent in the directions of the information matrix, but the weak ones
/// are not normal.
const DIRECTIONS: f64 = 0.54;

/// Errors of one parameter, over the consistent runs that identify it.
struct Parameter {
    name: String,
    /// Errors in the reported standard deviations.
    reported: Vec<f64>,
    /// Errors in the standard deviations of the bound.
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
        print_independence(&runs, parameters.len());
    }
    Ok(judge(&runs, &parameters))
}

fn consistent(runs: &[(Run, Vec<f64>)]) -> impl Iterator<Item = &Run> {
    runs.iter().map(|(run, _)| run).filter(|run| run.found.is_consistent())
}

/// Intervals of the consistent runs that have this verdict.
fn intervals(runs: &[(Run, Vec<f64>)], verdict: Verdict) -> Intervals {
    let mut all = Intervals::default();
    for Run { found, errors, .. } in consistent(runs) {
        let called = (0..errors.len()).filter(|index| found.verdicts[*index] == verdict);
        all.push(called.map(|index| errors[index] / found.deviations[index]));
    }
    all
}

fn judge(runs: &[(Run, Vec<f64>)], parameters: &[Parameter]) -> Vec<Figure> {
    let unexplained = runs.len() - consistent(runs).count();
    let mut figures = vec![
        Figure::unexplained("all robots", runs.len(), unexplained),
        intervals(runs, Verdict::Identified).cover("identified parameters", OFF, false),
    ];
    let determined = parameters.iter().filter(|parameter| !parameter.reported.is_empty());
    let (often, seldom): (Vec<_>, Vec<_>) = determined.partition(|p| p.reported.len() >= ENOUGH);
    figures.extend(each_of_many(&often));
    figures.extend(nearest_of_few(&seldom));
    let together: Vec<f64> = consistent(runs).map(Run::distance).collect();
    let errors = DIRECTIONS * (together.len() * parameters.len()) as f64;
    let limits = spread::root_mean_squares_beyond(errors as usize, ALL_OVER_BOUND);
    let what = "root-mean-square error over the bound, all parameters together, weighted by the records' information";
    figures.push(Figure::within(what, together.len(), limits, root_mean_square(&together), ""));
    // A few robots may have no weak parameter.
    let weak = intervals(runs, Verdict::Weak);
    if !weak.is_empty() {
        figures.push(weak.cover("weak parameters", OFF_WEAK, false));
    }
    let others = runs.iter().map(|(run, _)| run).filter(|run| !run.found.is_consistent());
    let claims = others.filter(|run| run.found.identified() > 0).count();
    let what = "runs that the noise does not explain, yet a parameter is called identified";
    figures.push(Figure::count(what, runs.len(), claims == 0, claims, "none"));
    figures
}

/// The lowest and the highest figure of parameters that are identified often enough for the plain limits.
fn each_of_many(parameters: &[&Parameter]) -> Vec<Figure> {
    let Some(fewest) = parameters.iter().map(|parameter| parameter.reported.len()).min() else {
        return Vec::new();
    };
    let each = |what, limits, of: fn(&Parameter) -> f64, unit| {
        let mut sorted = parameters.to_vec();
        sorted.sort_by(|a, b| of(a).total_cmp(&of(b)));
        let [lowest, highest] = [sorted[0], sorted[sorted.len() - 1]];
        let what = format!("{what}, each parameter identified in {ENOUGH} runs or more");
        Figure::all_within(what, fewest, limits, [of(lowest), of(highest)], unit)
            .made_of(format_args!("{fewest} or more"))
            .remark(format_args!("{} parameters; {}, {}", sorted.len(), lowest.name, highest.name))
    };
    vec![
        each("95 % intervals that cover", EACH, Parameter::covered, " %"),
        each("root-mean-square error over the bound", OVER_BOUND, Parameter::over_bound, ""),
    ]
}

/// The figure that is nearest to its limits, of parameters identified less often. The limits of each widen with its
/// own number of runs.
fn nearest_of_few(parameters: &[&Parameter]) -> Vec<Figure> {
    let nearest =
        |what, right: f64, limits: fn(&Parameter) -> [f64; 2], of: fn(&Parameter) -> f64, unit| {
            let off = |p: &Parameter| spread::off(of(p), right, limits(p));
            let nearest = parameters.iter().max_by(|a, b| off(a).total_cmp(&off(b)))?;
            let what = format!("{what}, of those identified in fewer the nearest to its limits");
            Some(
                Figure::within(what, nearest.reported.len(), limits(nearest), of(nearest), unit)
                    .remark(format_args!("of {} parameters; {}", parameters.len(), nearest.name)),
            )
        };
    let covers =
        nearest("95 % intervals that cover", 95.0, Parameter::covers, Parameter::covered, " %");
    let sizes = nearest(
        "root-mean-square error over the bound",
        1.0,
        Parameter::sizes,
        Parameter::over_bound,
        "",
    );
    covers.into_iter().chain(sizes).collect()
}

/// Prints the independence of the errors, on which the limits' allowance for chance rests.
fn print_independence(runs: &[(Run, Vec<f64>)], parameters: usize) {
    let [share, size] = intervals(runs, Verdict::Identified).independence();
    let off: Vec<f64> = consistent(runs).map(|run| run.distance().powi(2) - 1.0).collect();
    let together = 2.0 / (root_mean_square(&off).powi(2) * parameters as f64);
    eprintln!(
        "independent errors per error: {share:.2} by the share that covers, {size:.2} by the size; all together {together:.2}"
    );
}

/// Prints a run that is not consistent, or has a large error.
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

    /// Share of its intervals that hold the truth, percent.
    fn covered(&self) -> f64 {
        percent(&self.reported)
    }

    /// Limits of the share that covers, percent.
    fn covers(&self) -> [f64; 2] {
        spread::percentages(self.reported.len(), 0.95, EACH)
    }

    fn over_bound(&self) -> f64 {
        root_mean_square(&self.bounded)
    }

    /// Limits of the root-mean-square error over the bound.
    fn sizes(&self) -> [f64; 2] {
        spread::root_mean_squares_beyond(self.bounded.len(), OVER_BOUND)
    }

    fn print(&self) {
        eprintln!(
            "{}: identified in {}, covered {:.1} %, error {:.3} of the bound",
            self.name,
            self.reported.len(),
            self.covered(),
            self.over_bound()
        );
    }
}
