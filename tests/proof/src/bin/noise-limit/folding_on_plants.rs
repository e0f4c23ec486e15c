//! Days of records on the plausible plants of `plants`. The newest record of each pose is kept; older ones retire with the imperfections that
//! records share.

use anyhow::{Context, Result};
use flexid_core::identify::{Acceptance, Identifier, Phase, PlantEstimate};
use flexid_core::imperfection::Accuracies;
use flexid_core::refine::Plant;
use flexid_core::spectrum::Experiment;
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use crate::figure::{Figure, median};
use crate::find::Found;
use crate::intervals::Intervals;
use crate::plants::{COVER, GROSS, drawn_robot, records, standing};
use crate::records::{BINS, experiment};
use crate::study::{Purpose, Study, random};

/// Number of records of each pose: one a day.
const DAYS: u64 = 15;
/// Numbers of the records of a robot: no two robots share the noise of a day.
const PER_ROBOT: u64 = 1000;

/// Results of a robot.
struct Outcome {
    /// Errors of the identified parameters in standard deviations.
    scores: Vec<f64>,
    /// Standard deviations of the parameters that are identified on the last day, over those of the first.
    narrower: Vec<f64>,
    consistent: bool,
    /// Records that made room without leaving their information.
    lost: usize,
}

/// The first robots of this scenario that do not give way.
pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let numbers = standing(study, robots);
    let one = |robot: &u64| outcome(study, *robot, details);
    let all = numbers.par_iter().map(one).collect::<Result<Vec<_>>>()?;
    let mut intervals = Intervals::default();
    for Outcome { scores, .. } in &all {
        intervals.push(scores.iter().copied());
    }
    let scores = all.iter().flat_map(|one| one.scores.iter().map(|score| score.abs()));
    let consistent = all.iter().filter(|one| one.consistent).count();
    let lost: usize = all.iter().map(|one| one.lost).sum();
    let narrower = median(all.iter().flat_map(|one| one.narrower.iter().copied()).collect());
    Ok(vec![
        Figure::count(
            format!("{DAYS} days on drawn plants: fits that the imperfections explain"),
            robots,
            10 * consistent >= 9 * robots,
            consistent,
            "at least 90 %",
        )
        .remark(format_args!(
            "{lost} records lost; median standard deviation {narrower:.2} of that of the first day"
        )),
        intervals.cover_on_plants("days on drawn plants, identified", COVER),
        Figure::at_most(
            "days on drawn plants: largest error of an identified parameter",
            robots,
            GROSS,
            scores.fold(0.0, f64::max),
            " σ",
        ),
    ])
}

fn outcome(study: &Study, robot: u64, details: bool) -> Result<Outcome> {
    let accuracies = Accuracies::typical();
    let (own, simulated) =
        drawn_robot(study, &accuracies, robot).context("a robot that gives way")?;
    let truth = study.robot(robot);
    let cuts = study.cuts();
    let mut identifier = study.task().identifier(random(Purpose::Search, robot).0)?;
    let mut plant = Box::new(Plant::new(&accuracies, &study.chain));
    let mut kept: Vec<Experiment<BINS>> = Vec::new();
    let (mut first, mut last): (Option<Found>, Option<PlantEstimate>) = (None, None);
    let mut lost = 0;
    for day in 0..DAYS {
        let cuts = &cuts[(robot + day) as usize % cuts.len()];
        let number = PER_ROBOT * (robot + 1) + day;
        let records = records(study, cuts, &own, &simulated, number)?;
        if let Some(found) = &last {
            for record in 0..kept.len() {
                let retired = identifier.retire_on_plant(&kept, record, &mut plant, found);
                lost += usize::from(!retired);
            }
        }
        let made = records.iter().map(|one| experiment(&study.chain, &study.measurement, one));
        kept = made.collect::<Result<Vec<_>>>()?;
        let found = settled(&mut identifier, &mut kept, &mut plant)?;
        first.get_or_insert_with(|| Found::new(&found.estimate, 0));
        last = Some(found);
    }
    let (first, last) = (first.context("no day")?, last.context("no day")?);
    let found = Found::new(&last.estimate, identifier.progress().effort.starts);
    let errors = found.errors(&truth);
    let identified = || (0..errors.len()).filter(|&index| found.identifies(index));
    let scores: Vec<f64> =
        identified().map(|index| errors[index] / found.deviations[index]).collect();
    let narrower = identified().map(|index| found.deviations[index] / first.deviations[index]);
    let outcome = Outcome {
        narrower: narrower.filter(|ratio| *ratio > 0.0).collect(),
        consistent: last.estimate.acceptance == Acceptance::Consistent,
        lost: lost + last.estimate.forgotten as usize,
        scores,
    };
    if details {
        eprintln!(
            "robot {robot}: {:?}, {} retired, {} lost, {} identified, off by {:.1} σ at most, {:.2} of the first day's deviations",
            last.estimate.acceptance,
            last.estimate.retired,
            outcome.lost,
            outcome.scores.len(),
            outcome.scores.iter().fold(0.0_f64, |most, score| most.max(score.abs())),
            median(outcome.narrower.clone())
        );
    }
    Ok(outcome)
}

/// The estimate of a plant from these experiments.
fn settled(
    identifier: &mut Identifier<Xoshiro256PlusPlus>,
    kept: &mut [Experiment<BINS>],
    plant: &mut Plant,
) -> Result<PlantEstimate> {
    identifier.renew(kept);
    while identifier.step_on_plant(kept, plant) != Phase::Settled {}
    let found = identifier.estimate_of_plant(kept, plant, || true);
    found.context("a settled identifier without an estimate")
}
