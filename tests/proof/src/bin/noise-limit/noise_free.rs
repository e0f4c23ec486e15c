//! Without noise, neither the basin nor the ends of the records cause an error.

use anyhow::Result;
use flexid_core::verdict::{Trust, Verdict};
use rayon::prelude::*;

use crate::bound::{deviations, information};
use crate::figure::{Figure, median};
use crate::find::find;
use crate::linear::motion;
use crate::records::{SAMPLES, Signals};
use crate::study::{Purpose, Study, name, random};

/// Largest error, in standard deviations that the noise would give.
const LIMIT: f64 = 0.1;

/// Relative standard deviation at the bound, up to which a parameter must be called identified: half the limit.
const DETERMINED: f64 = 0.025;
/// Relative standard deviation at the bound, from which a parameter must not be called identified: twice the limit.
const UNDETERMINED: f64 = 0.1;

/// One robot, and its parameter with the largest error, in standard deviations.
struct Worst {
    robot: u64,
    parameter: usize,
    score: f64,
    consistency: f64,
    /// True if the noise is called too loud, and each verdict agrees with the bound if the noise is left aside.
    right: bool,
    starts: u32,
}

pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let cuts = study.cuts();
    let one = |robot: u64| -> Result<Worst> {
        let truth = study.robot(robot);
        let mut records = Vec::new();
        let mut informations = Vec::new();
        for cut in &cuts[robot as usize % cuts.len()] {
            let motion = motion(&study.chain, &truth, cut);
            records.push(Signals::new(&cut.pose, &motion).exact(study));
            informations.push(information(study, &study.chain, &truth, cut, &motion, 0..SAMPLES)?);
        }
        let deviations = deviations(&informations.into_iter().sum())?;
        let found = find(&study.task(), &records, random(Purpose::Search, robot).0)?;
        let trust = Trust::new(1.0, true);
        let identifies = |deviation: f64| trust.verdict(1.0, deviation).0 == Verdict::Identified;
        let right = found.estimate.noise_too_loud
            && found.deviations.iter().zip(&deviations).all(|(own, deviation)| match *deviation {
                deviation if deviation <= DETERMINED => identifies(*own),
                deviation if deviation >= UNDETERMINED => !identifies(*own),
                _ => true,
            });
        let scores = found.errors(&truth).into_iter().zip(deviations).map(|(e, d)| (e / d).abs());
        let (parameter, score) =
            scores.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::NAN));
        let (consistency, starts) = (found.estimate.consistency, found.starts);
        Ok(Worst { robot, parameter, score, consistency, right, starts })
    };
    let mut all = (0..robots as u64).into_par_iter().map(one).collect::<Result<Vec<_>>>()?;
    all.sort_by(|a, b| a.score.total_cmp(&b.score));
    if details {
        for worst in all.iter().rev().take(10) {
            eprintln!(
                "robot {}: {} off by {:.4} σ, χ²/dof {:.2e}, {} verdicts, {} starts",
                worst.robot,
                name(worst.parameter),
                worst.score,
                worst.consistency,
                if worst.right { "right" } else { "wrong" },
                worst.starts
            );
        }
    }
    let found = all.iter().filter(|worst| worst.right).count();
    let first = all.iter().filter(|worst| worst.starts == 1).count();
    let largest = all.last();
    Ok(vec![
        Figure::count(
            "robots found without noise, each verdict that of the bound",
            robots,
            found == robots,
            found,
            "all",
        )
        .remark(format_args!("{first} at the first start")),
        Figure::at_most(
            "largest error of a parameter",
            robots,
            LIMIT,
            largest.map_or(f64::NAN, |worst| worst.score),
            " σ",
        )
        .remark(format_args!(
            "median of the robots {:.4} σ; worst is robot {}, {}",
            median(all.iter().map(|worst| worst.score).collect()),
            largest.map_or(0, |worst| worst.robot),
            name(largest.map_or(0, |worst| worst.parameter))
        )),
    ])
}
