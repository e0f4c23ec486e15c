//! A month of records. The newest record of each pose is kept, and the information of older ones is kept without a
//! loss.

use anyhow::{Context, Result, ensure};
use fearless_simd::Level;
use flexid_core::identify::{Estimate, Phase};
use flexid_core::parameters::Bushings;
use flexid_core::refine::{Outcome, Problem, Refinement};
use flexid_core::spectrum::Experiment;
use flexid_simulation::experiment::Cut;
use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::bound::{deviations, distance, information};
use crate::figure::{Figure, root_mean_square};
use crate::find::{Found, Task};
use crate::linear::motion;
use crate::records::{BINS, SAMPLES, Sensors, Signals, experiment};
use crate::spread;
use crate::study::{Purpose, Study, logarithms, name, random};

/// Number of records of each pose: one a day.
const DAYS: usize = 30;
/// Limits of the root-mean-square error over the bound of all records. An error below them shows that the bound is
/// wrong.
const OVER_BOUND: [f64; 2] = [0.95, 1.03];
/// Number of robots for which these limits are meant; fewer scatter.
const ENOUGH: usize = 100;
/// Largest mean shift of a parameter by the folding, in standard deviations at the bound.
const SHIFT: f64 = 0.1;
/// Largest difference of an identified parameter's standard deviation from that of a fit that keeps all records,
/// relative.
const DEVIATION: f64 = 0.03;

/// Results of a robot's month.
struct Month {
    /// Errors of the logarithms over their bound.
    scores: Vec<f64>,
    /// Errors of the logarithms over their bound, of a fit that keeps all records.
    whole: Vec<f64>,
    /// Standard deviations of identified parameters, over those of the fit that keeps all records.
    deviations: Vec<f64>,
    /// Error of all parameters together, over that of the bound.
    together: f64,
    /// Error of all parameters together, over that of the bound, of the fit that keeps all records.
    whole_together: f64,
    /// Number of records whose information was not folded.
    lost: usize,
    consistent: bool,
}

pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let cuts = study.cuts();
    let one = |robot| month(study, &cuts, robot);
    let all = (0..robots as u64).into_par_iter().map(one).collect::<Result<Vec<_>>>()?;
    if details {
        print(&all);
    }
    Ok(judge(study, &all))
}

fn judge(study: &Study, all: &[Month]) -> Vec<Figure> {
    let (robots, records) = (all.len(), DAYS * study.scenario.experiments.len());
    let parameters = 12 * study.chain.joints().len();
    let together: Vec<f64> = all.iter().map(|month| month.together).collect();
    // The parameters' errors are independent in the directions of the information matrix.
    let limits = match robots {
        ENOUGH.. => OVER_BOUND,
        few => spread::root_mean_squares_beyond(few * parameters, OVER_BOUND),
    };
    let mean = |of: fn(&Month, usize) -> f64, index| {
        all.iter().map(|month| of(month, index)).sum::<f64>() / robots as f64
    };
    let biases: Vec<f64> = (0..parameters)
        .map(|index| mean(|month, index| month.scores[index], index) * (robots as f64).sqrt())
        .collect();
    let (biased, bias) = largest(&biases);
    let apart: Vec<f64> = all
        .iter()
        .flat_map(|m| m.scores.iter().zip(&m.whole).map(|(own, all)| own - all))
        .collect();
    let shifts: Vec<f64> = (0..parameters)
        .map(|index| mean(|month, index| month.scores[index] - month.whole[index], index))
        .collect();
    let (shifted, shift) = largest(&shifts);
    let whole: Vec<f64> = all.iter().map(|month| month.whole_together).collect();
    let [_, most] = OVER_BOUND;
    // Difference to a fit that keeps all records, if the errors are as much larger than the bound as the limit
    // allows.
    let differing = (most * most - 1.0).sqrt();
    let deviations: Vec<f64> =
        all.iter().flat_map(|month| month.deviations.iter().map(|ratio| ratio - 1.0)).collect();
    let lost: usize = all.iter().map(|month| month.lost).sum();
    let unexplained = all.iter().filter(|month| !month.consistent).count();
    vec![
        Figure::within(
            format!("root-mean-square error after {records} records, over the bound of all"),
            robots,
            limits,
            root_mean_square(&together),
            "",
        )
        .remark("all parameters, weighted by the records' information"),
        // Both have the same noise, so that their ratio hardly scatters.
        Figure::at_most(
            "the same, over that of a fit that keeps all records",
            robots,
            most,
            root_mean_square(&together) / root_mean_square(&whole),
            "",
        ),
        Figure::at_most(
            "bias after the folding, worst parameter, in standard errors of the mean",
            robots,
            spread::DEVIATIONS,
            bias,
            "",
        )
        .remark(format_args!(
            "{}; root mean square of all {:.2}",
            name(biased),
            root_mean_square(&biases)
        )),
        Figure::at_most(
            "difference from a fit that keeps all records, root mean square",
            robots,
            differing,
            root_mean_square(&apart),
            " σ",
        ),
        Figure::at_most(
            "mean of that difference, worst parameter",
            robots,
            SHIFT.max(spread::DEVIATIONS * differing / (robots as f64).sqrt()),
            shift,
            " σ",
        )
        .remark(name(shifted)),
        Figure::at_most(
            "standard deviations of identified parameters against those of that fit, root mean square",
            robots,
            100.0 * DEVIATION,
            100.0 * root_mean_square(&deviations),
            " %",
        )
        .remark(format_args!("worst {:.1} %", 100.0 * largest(&deviations).1)),
        Figure::count(
            "records that were not folded",
            robots * (records - study.scenario.experiments.len()),
            lost == 0 && unexplained == 0,
            lost,
            "none",
        )
        .remark(format_args!("{unexplained} robots not explained by noise")),
    ]
}

/// Index and size of the value furthest from zero.
fn largest(values: &[f64]) -> (usize, f64) {
    let sizes = values.iter().map(|value| value.abs()).enumerate();
    sizes.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::NAN))
}

/// The month of one robot, identified anew with every record.
fn month(study: &Study, cuts: &[Vec<Cut>], robot: u64) -> Result<Month> {
    let truth = study.robot(robot);
    let poses = study.scenario.experiments.len();
    let moves = |cut: &Cut| motion(&study.chain, &truth, cut);
    let motions: Vec<Vec<_>> = cuts.iter().map(|day| day.iter().map(moves).collect()).collect();
    let mut informations = Vec::new();
    for (day, motions) in cuts.iter().zip(&motions) {
        let mut sum = DMatrix::zeros(12 * truth.len(), 12 * truth.len());
        for (cut, motion) in day.iter().zip(motions) {
            sum += information(study, &study.chain, &truth, cut, motion, 0..SAMPLES)?;
        }
        informations.push(sum);
    }
    let task = study.task();
    let mut identifier = task.identifier(random(Purpose::Search, robot).0)?;
    let mut sensors = Sensors::new(study, random(Purpose::Noise, robot))?;
    let (mut kept, mut all) = (Vec::new(), Vec::new());
    let mut lost = 0;
    let mut information: DMatrix<f64> = DMatrix::zeros(12 * truth.len(), 12 * truth.len());
    for day in 0..DAYS {
        let draw = (robot as usize + day) % cuts.len();
        information += &informations[draw];
        for (pose, (cut, motion)) in cuts[draw].iter().zip(&motions[draw]).enumerate() {
            let record = sensors.measure(&Signals::new(&cut.pose, motion))?;
            let newest = experiment(&study.chain, &study.measurement, &record)?;
            all.push(newest.clone());
            if day == 0 {
                kept.push(newest);
            } else {
                lost += usize::from(!identifier.retire(&kept[pose]));
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
    let found = Found::new(estimate, identifier.progress().effort.starts);
    let (errors, bound) = (found.errors(&truth), deviations(&information)?);
    let over = |errors: &[f64]| errors.iter().zip(&bound).map(|(e, bound)| e / bound).collect();
    let (whole, own) = keep_all(&task, &found.estimate.bushings, &all)?;
    let whole_errors: Vec<f64> = logarithms(&whole)
        .iter()
        .zip(logarithms(&truth))
        .map(|(whole, truth)| whole - truth)
        .collect();
    let identified = (0..own.len()).filter(|index| found.identifies(*index));
    Ok(Month {
        together: distance(&information, &errors),
        scores: over(&errors),
        whole: over(&whole_errors),
        whole_together: distance(&information, &whole_errors),
        deviations: identified.map(|i| estimate.covariance.deviation(i) / own[i]).collect(),
        lost,
        consistent: found.is_consistent(),
    })
}

/// A fit from `guess` that keeps all records.
fn keep_all(
    task: &Task,
    guess: &Bushings,
    records: &[Experiment<BINS>],
) -> Result<(Bushings, Vec<f64>)> {
    let sought = &task.sought()?;
    let Task { chain, bounds, measurement, .. } = task;
    let problem = Problem { chain, measurement, bounds, sought, statics: &[], level: Level::new() };
    let mut refinement = Box::new(Refinement::new(sought, guess));
    while refinement.step(&problem, records) == Outcome::Improving {}
    let covariance = refinement.fit(&problem, records).covariance;
    let deviations = (0..covariance.unknowns()).map(|index| covariance.deviation(index)).collect();
    Ok((refinement.bushings(sought), deviations))
}

fn print(all: &[Month]) {
    for (robot, month) in all.iter().enumerate() {
        let furthest = month.deviations.iter().map(|ratio| (ratio - 1.0).abs()).fold(0.0, f64::max);
        let apart: Vec<f64> = month.scores.iter().zip(&month.whole).map(|(a, b)| a - b).collect();
        let (worst, most) = largest(&apart);
        eprintln!(
            "robot {robot}: error {:.3} of the bound, {} off by {most:.2} σ from a fit of all, deviations by {furthest:.3}, {} records lost",
            month.together,
            name(worst),
            month.lost
        );
    }
}
