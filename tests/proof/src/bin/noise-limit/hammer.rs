//! Hammer blows in place of cuts: one along each axis of the TCP in each pose, on the plausible plants of `plants`.
//!
//! The hammer is a channel of one axis. It strikes along the axes of the drawn force sensor, whose angle is the error of its direction.

use anyhow::Result;
use flexid_core::imperfection::Accuracies;
use flexid_simulation::experiment::Cut;
use flexid_simulation::force;
use flexid_simulation::plant::Plant;
use flexid_simulation::simulator::BLOW;
use nalgebra::{Rotation3, Vector3};
use rayon::prelude::*;

use crate::figure::Figure;
use crate::find::Found;
use crate::intervals::Intervals;
use crate::plants::{COVER, GROSS, drawn_robot, found, records, records_struck, standing};
use crate::study::{Study, name};

/// Least share of the parameters that as many cuts as poses identify, percent.
const OF_CUTS: f64 = 70.0;

/// The result of one robot.
struct Outcome {
    by_cuts: usize,
    /// Error of each identified parameter in standard deviations.
    scores: Vec<f64>,
}

/// The first robots of this scenario that do not give way.
pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let cuts = study.cuts();
    let numbers = standing(study, robots);
    let one = |robot: &u64| outcome(study, &cuts[*robot as usize % cuts.len()], *robot, details);
    let all = numbers.par_iter().map(one).collect::<Result<Vec<_>>>()?;
    let mut intervals = Intervals::default();
    for Outcome { scores, .. } in &all {
        intervals.push(scores.iter().copied());
    }
    let scores = || all.iter().flat_map(|one| one.scores.iter().map(|score| score.abs()));
    let (identified, by_cuts) = (scores().count(), all.iter().map(|one| one.by_cuts).sum());
    Ok(vec![
        Figure::count(
            "hammer, three blows a pose: parameters that are identified, of those that a cut a pose identifies",
            by_cuts,
            by_cuts > 0 && 100.0 * identified as f64 >= OF_CUTS * by_cuts as f64,
            identified,
            &format!("at least {OF_CUTS:.0} %"),
        )
        .made_of(robots),
        intervals.cover_on_plants("hammer, identified", COVER),
        Figure::at_most(
            "hammer: largest error of an identified parameter",
            robots,
            GROSS,
            scores().fold(0.0, f64::max),
            " σ",
        ),
    ])
}

fn outcome(study: &Study, cuts: &[Cut], robot: u64, details: bool) -> Result<Outcome> {
    let accuracies = Accuracies::typical();
    let (plant, bushings) = drawn_robot(study, &accuracies, robot).unwrap_or_default();
    let of_cuts = records(study, cuts, &plant, &bushings, robot)?;
    let (_, by_cuts) = found(study, &of_cuts, &accuracies, robot)?;
    let blows = blows(study, cuts, &plant);
    let of_blows = records_struck(study, &blows, &plant, &bushings, robot, |blow| Some(blow % 3))?;
    let (truth, by_blows) = found(study, &of_blows, &accuracies, robot)?;
    let errors = by_blows.errors(&truth);
    let identified = (0..errors.len()).filter(|&index| by_blows.identifies(index));
    let score = |index: usize| errors[index] / by_blows.deviations[index];
    if details {
        let worst = identified.clone().max_by(|a, b| score(*a).abs().total_cmp(&score(*b).abs()));
        let worst = worst.map(|index| format!("{} by {:.1} σ", name(index), score(index)));
        let of = |found: &Found| {
            let Found { estimate, starts, .. } = found;
            let (acceptance, consistency) = (estimate.acceptance, estimate.consistency);
            format!(
                "{} ({acceptance:?}, χ²/dof {consistency:.3}, {starts} starts)",
                found.identified()
            )
        };
        eprintln!("robot {robot}: cuts {}, blows {}, worst {worst:?}", of(&by_cuts), of(&by_blows));
    }
    Ok(Outcome { by_cuts: by_cuts.identified(), scores: identified.map(score).collect() })
}

/// Three blows in the pose of each cut.
pub(crate) fn blows(study: &Study, cuts: &[Cut], plant: &Plant) -> Vec<Cut> {
    let turn = Rotation3::new(plant.force_sensor.angle_rad.into());
    let (peak, width) = BLOW;
    let blow = |axis| {
        let direction = turn * Vector3::ith(axis, 1.0);
        force::blow(&direction, peak, width, &study.scenario.measurement)
    };
    let blows = [0, 1, 2].map(blow);
    let of_pose = |cut: &Cut| blows.clone().map(|force| Cut { force, ..cut.clone() });
    cuts.iter().flat_map(of_pose).collect()
}
