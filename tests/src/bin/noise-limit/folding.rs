//! A month of records: the newest of each pose is kept, older ones are folded into what is known, and nothing is lost.

use anyhow::{Context, Result, ensure};
use flexid::simulation::experiment::Cut;
use flexid_core::identify::{Estimate, Phase};
use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::bound::{deviations, distance, information};
use crate::figure::{Figure, median, root_mean_square};
use crate::find::Found;
use crate::linear::motion;
use crate::records::{SAMPLES, Sensors, Signals, experiment};
use crate::spread;
use crate::study::{Purpose, Study, name, random};

/// Records of each pose: one a day.
const DAYS: usize = 30;
/// Root-mean-square error, and standard deviation, over the bound of all records.
const OVER_BOUND: f64 = 1.03;

/// What is left of a robot's month.
struct Month {
    /// Errors of the logarithms over their bound.
    scores: Vec<f64>,
    /// Standard deviations as reported, over their bound.
    reported: Vec<f64>,
    /// Errors of all parameters together, over what the bound makes of them.
    together: f64,
    /// Records whose information was not folded.
    lost: usize,
    consistent: bool,
}

pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let cuts = study.cuts();
    let one = |robot| month(study, &cuts, robot);
    let all = (0..robots as u64).into_par_iter().map(one).collect::<Result<Vec<_>>>()?;
    let records = DAYS * study.scenario.experiments.len();
    if details {
        print(&all);
    }
    let parameters = 12 * study.chain.joints().len();
    let together: Vec<f64> = all.iter().map(|month| month.together).collect();
    // The parameters' errors are independent in the directions of the information matrix.
    let limit = spread::root_mean_square(robots * parameters, OVER_BOUND);
    let biases: Vec<f64> = (0..parameters).map(|index| bias(&all, index)).collect();
    let worst = (0..parameters).max_by(|&a, &b| biases[a].abs().total_cmp(&biases[b].abs()));
    let worst = worst.unwrap_or(0);
    let reported: Vec<f64> = all.iter().flat_map(|month| month.reported.clone()).collect();
    let furthest =
        reported.iter().copied().max_by(|a, b| (a - 1.0).abs().total_cmp(&(b - 1.0).abs()));
    let lost: usize = all.iter().map(|month| month.lost).sum();
    let unsettled = all.iter().filter(|month| !month.consistent).count();
    Ok(vec![
        Figure::at_most(
            format!("root-mean-square error after {records} records, over the bound of all"),
            robots,
            limit,
            root_mean_square(&together),
            "",
        )
        .remark(format_args!("all parameters, weighted by what the records tell of them")),
        Figure::at_most(
            "its bias, worst parameter, in standard errors of the mean",
            robots,
            spread::DEVIATIONS,
            biases[worst].abs(),
            "",
        )
        .remark(format_args!(
            "{}; root mean square of all {:.2}",
            name(worst),
            root_mean_square(&biases)
        )),
        Figure::at_most(
            "standard deviation reported over the bound, the furthest off",
            robots,
            OVER_BOUND - 1.0,
            furthest.map_or(f64::NAN, |ratio| (ratio - 1.0).abs()),
            "",
        )
        .remark(format_args!("median ratio {:.3}", median(reported))),
        Figure::count(
            "records that were not folded",
            robots * (records - study.scenario.experiments.len()),
            lost == 0 && unsettled == 0,
            lost,
            "none",
        )
        .remark(format_args!("{unsettled} robots not explained by noise")),
    ])
}

/// One robot, identified anew with every record.
fn month(study: &Study, cuts: &[Vec<Cut>], robot: u64) -> Result<Month> {
    let truth = study.robot(robot);
    let poses = study.scenario.experiments.len();
    let moves = |cut: &Cut| motion(&study.chain, &truth, cut);
    let motions: Vec<Vec<_>> = cuts.iter().map(|day| day.iter().map(moves).collect()).collect();
    let mut told = Vec::new();
    for (day, motions) in cuts.iter().zip(&motions) {
        let mut sum = DMatrix::zeros(12 * truth.len(), 12 * truth.len());
        for (cut, motion) in day.iter().zip(motions) {
            sum += information(study, &study.chain, &truth, cut, motion, 0..SAMPLES)?;
        }
        told.push(sum);
    }
    let task = study.task();
    let mut identifier = task.identifier(random(Purpose::Search, robot).0);
    let mut sensors = Sensors::new(study, random(Purpose::Noise, robot))?;
    let mut kept = Vec::new();
    let mut lost = 0;
    let mut information: DMatrix<f64> = DMatrix::zeros(12 * truth.len(), 12 * truth.len());
    for day in 0..DAYS {
        let draw = (robot as usize + day) % cuts.len();
        information += &told[draw];
        for (pose, (cut, motion)) in cuts[draw].iter().zip(&motions[draw]).enumerate() {
            let record = sensors.measure(&Signals::new(&cut.pose, motion))?;
            let newest = experiment(&study.chain, &study.measurement, &record)?;
            if day == 0 {
                kept.push(newest);
            } else {
                lost += usize::from(!identifier.retire(&mut kept[pose]));
                kept[pose] = newest;
            }
            if kept.len() == poses {
                identifier.renew(&kept);
                while identifier.step(&mut kept) != Phase::Settled {}
            }
        }
    }
    let estimate: &Estimate = identifier.estimate().context("settled without an estimate")?;
    ensure!(estimate.covariance.unknowns() == 12 * truth.len(), "other unknowns than parameters");
    lost += estimate.forgotten as usize;
    let found = Found::new(estimate, identifier.progress().starts);
    let (errors, bound) = (found.errors(&truth), deviations(&information)?);
    let over = |values: &[f64]| values.iter().zip(&bound).map(|(v, bound)| v / bound).collect();
    let reported: Vec<f64> =
        (0..bound.len()).map(|index| estimate.covariance.deviation(index)).collect();
    Ok(Month {
        together: distance(&information, &errors),
        scores: over(&errors),
        reported: over(&reported),
        lost,
        consistent: found.is_consistent(),
    })
}

/// Mean score of a parameter, in its standard errors: those at the bound.
fn bias(all: &[Month], index: usize) -> f64 {
    let sum: f64 = all.iter().map(|month| month.scores[index]).sum();
    sum / (all.len() as f64).sqrt()
}

fn print(all: &[Month]) {
    for (robot, month) in all.iter().enumerate() {
        let furthest = month.reported.iter().map(|ratio| (ratio - 1.0).abs()).fold(0.0, f64::max);
        eprintln!(
            "robot {robot}: error {:.3} of the bound, deviations off by {furthest:.3}, {} records lost",
            month.together, month.lost
        );
    }
}
