//! One error of the plant at a time, far beyond its accuracy: whether flexid then says anything wrong.
//!
//! A run _lies_ if fewer than 80 % of the 95 % intervals of its identified parameters cover, or if more than 5 % of them miss by more
//! than 4 standard deviations.

use std::fmt;

use anyhow::{Context as _, Result};
use flexid_core::imperfection::{Accuracies, FoundImperfection};
use flexid_core::refine::Explanation;
use flexid_simulation::plant::Plant;
use rayon::prelude::*;

use crate::figure::{Figure, median};
use crate::find::{Found, find};
use crate::intervals::{Intervals, percent};
use crate::menu::{Error, MENU};
use crate::plants;
use crate::spread;
use crate::study::{Purpose, Study, random};

/// Sizes of an error, in its accuracy or typical size.
const TIMES: [f64; 3] = [3.0, 10.0, 30.0];
/// Least share of the runs that do not lie, percent.
const HONEST: f64 = 95.0;
/// Least share of the runs in which the first explanation is the error, percent.
const NAMED: f64 = 90.0;
/// Limits of the share of the intervals that cover once the explanations are adopted, percent.
const EXPLAINED: [f64; 2] = [90.0, 100.0];
/// Distance in the menu from one run to the next. It has no factor in common with the number of runs of a robot.
const STRIDE: usize = 37;
/// Error of a logarithm up to which a parameter is right.
const RIGHT: f64 = 0.01;
/// Least share of the parameters at the noise limit that are identified where they are right, percent: small errors are no alarms.
const KEPT: f64 = 80.0;

/// The result of one run.
struct Outcome {
    robot: usize,
    error: &'static Error,
    times: f64,
    fit: Fit,
    /// The fit with the explanations of the records adopted.
    adopted: Fit,
}

/// A fit and its errors.
struct Fit {
    found: Found,
    /// Error of each parameter's logarithm.
    errors: Vec<f64>,
}

/// Makes so many runs, the same for the same number: one robot has all errors in all sizes before the next has one.
pub(crate) fn prove(study: &Study, runs: usize, details: bool) -> Result<Vec<Figure>> {
    let cuts = study.cuts();
    let of_robot = MENU.len() * TIMES.len();
    let run = |run: usize| {
        let robot = (run / of_robot) as u64;
        let case = run * STRIDE % of_robot;
        let (error, times) = (&MENU[case / TIMES.len()], TIMES[case % TIMES.len()]);
        let plant = plants::with(|plant| (error.apply)(plant, times));
        let cuts = &cuts[robot as usize % cuts.len()];
        let records = plants::records(study, cuts, &plant, &study.robot(robot), robot)?;
        let (truth, mut found) = plants::found(study, &records, &Accuracies::typical(), robot)?;
        let adopted = found.adopted.take().context("a plant without explanations")?;
        let fit = |found: Found| Fit { errors: found.errors(&truth), found };
        let (robot, adopted) = (robot as usize, fit(*adopted));
        let outcome = Outcome { robot, error, times, fit: fit(found), adopted };
        if details {
            outcome.print();
        }
        Ok(outcome)
    };
    let all = (0..runs).into_par_iter().map(run).collect::<Result<Vec<_>>>()?;
    // A perfect model on a perfect plant.
    let at_noise_limit = |robot: usize| {
        let cuts = &cuts[robot % cuts.len()];
        let records = plants::records(
            study,
            cuts,
            &Plant::default(),
            &study.robot(robot as u64),
            robot as u64,
        )?;
        find(&study.task(), &records, random(Purpose::Search, robot as u64).0)
    };
    let robots = runs.div_ceil(of_robot);
    let at_noise_limit =
        (0..robots).into_par_iter().map(at_noise_limit).collect::<Result<Vec<_>>>()?;
    let (mut right, mut kept) = (0, 0);
    for Outcome { robot, fit, .. } in &all {
        let limit = &at_noise_limit[*robot];
        for index in fit.right().filter(|&index| limit.identifies(index)) {
            right += 1;
            kept += usize::from(fit.found.identifies(index));
        }
    }
    // The parameters of a run are identified together.
    let least = spread::percentages(all.len(), KEPT / 100.0, [KEPT, 100.0])[0];
    let at_least = |what: &str, share: f64, of: usize, count: usize| {
        let least = spread::percentages(of, share / 100.0, [share, 100.0])[0];
        let held = 100.0 * count as f64 >= least * of as f64;
        Figure::count(what, of, held, count, &format!("at least {least:.0} %"))
    };
    let honest = all.iter().filter(|outcome| !outcome.fit.lies()).count();
    let still_honest = all.iter().filter(|outcome| !outcome.adopted.lies()).count();
    let mut explained = Intervals::default();
    for outcome in all.iter().filter(|outcome| outcome.error.is.is_some()) {
        explained.push(outcome.adopted.scores().into_iter());
    }
    let named: Vec<bool> = all.iter().filter_map(Outcome::is_named).collect();
    let named_first = named.iter().filter(|named| **named).count();
    let identified: usize = all.iter().map(|outcome| outcome.fit.identified().count()).sum();
    let widths = all.iter().flat_map(|outcome| outcome.fit.widths());
    let parameters = 12 * study.chain.joints().len() * all.len();
    Ok(vec![
        at_least("one error: runs that do not lie", HONEST, all.len(), honest),
        at_least("one error: runs in which it is named first", NAMED, named.len(), named_first),
        at_least("one error: runs that do not lie, explained", HONEST, all.len(), still_honest),
        explained.cover_within("one error that is on the menu, explained", EXPLAINED),
        Figure::count(
            "one error: parameters right to 1 % that are identified, of those that are at the noise limit",
            right,
            right > 0 && 100.0 * kept as f64 >= least * right as f64,
            kept,
            &format!("at least {least:.0} %"),
        ),
        // This figure shows that the verdict is possible.
        Figure::count(
            "one error: parameters that are identified",
            parameters,
            2 * identified > parameters,
            identified,
            "more than half",
        )
        .remark(format_args!(
            "median standard deviation {:.2} %",
            100.0 * median(widths.collect())
        )),
    ])
}

/// Frequencies of the tones of each record, Hz.
fn tones(of_records: &[Vec<(f64, f64)>]) -> String {
    let of_record = |tones: &Vec<(f64, f64)>| {
        tones.iter().map(|(hz, _)| format!("{hz:.3}")).collect::<Vec<_>>().join(" ")
    };
    of_records.iter().map(of_record).collect::<Vec<_>>().join(" | ")
}

/// The error, by how many times its accuracy, its share of the misfit, by how much it raises the evidence, and its rivals.
fn explanation(explanation: &Explanation) -> String {
    let Explanation { largest, share, evidence, rivals, .. } = explanation;
    let one = |it: &FoundImperfection| format!("{:?} {:.1}", it.imperfection, it.value / it.prior);
    let rivals: String = rivals.iter().map(|rival| format!(" or {}", one(rival))).collect();
    format!("{} {:.0} % {evidence:.0}{rivals}", one(largest), 100.0 * share)
}

impl Fit {
    fn identified(&self) -> impl Iterator<Item = usize> {
        (0..self.errors.len()).filter(|&index| self.found.identifies(index))
    }

    /// The parameters that are right.
    fn right(&self) -> impl Iterator<Item = usize> {
        (0..self.errors.len()).filter(|&index| self.errors[index].abs() < RIGHT)
    }

    /// Standard deviations of the identified parameters.
    fn widths(&self) -> impl Iterator<Item = f64> {
        self.identified().map(|index| self.found.deviations[index])
    }

    /// Errors of the identified parameters, in standard deviations.
    fn scores(&self) -> Vec<f64> {
        self.identified().map(|index| self.errors[index] / self.found.deviations[index]).collect()
    }

    fn lies(&self) -> bool {
        let scores = self.scores();
        let gross = scores.iter().filter(|score| score.abs() > 4.0).count();
        !scores.is_empty() && (percent(&scores) < 80.0 || 20 * gross > scores.len())
    }
}

/// In one line: whether it lies, how it was accepted, its residuals, its identified parameters, and how many are right.
impl fmt::Display for Fit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { found, .. } = self;
        let scores = self.scores();
        let worst = scores.iter().fold(0.0, |worst: f64, score| worst.max(score.abs()));
        let right = self.right().count();
        let explanations: Vec<_> = found.explanations.iter().map(explanation).collect();
        write!(
            f,
            "{:4} {:12} χ²/dof {:9.3} structure {:5.3} identified {:2} cover {:5.1} worst {worst:5.1} median {:.2} % right {right:2} {}",
            if self.lies() { "LIE" } else { "" },
            format!("{:?}", found.estimate.acceptance),
            found.estimate.consistency,
            found.estimate.structure.size,
            scores.len(),
            if scores.is_empty() { 100.0 } else { percent(&scores) },
            100.0 * median(self.widths().collect()),
            explanations.join("; "),
        )
    }
}

impl Outcome {
    /// Returns whether the first explanation is the error, if the fit has such an imperfection.
    fn is_named(&self) -> Option<bool> {
        let is = self.error.is?;
        let first = self.fit.found.explanations.first();
        Some(first.is_some_and(|first| is(first.largest.imperfection)))
    }

    fn print(&self) {
        let Self { robot, error, times, fit, adopted } = self;
        let other = if self.is_named() == Some(false) { "OTHER" } else { "" };
        let starts = fit.found.starts;
        eprintln!(
            "{other:6}{robot:2} {:28} {times:3.0} {starts:2} starts {fit} {}\n{:46}explained {adopted}",
            error.name,
            tones(&fit.found.tones),
            "",
        );
    }
}
