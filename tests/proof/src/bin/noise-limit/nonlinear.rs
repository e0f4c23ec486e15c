//! The error of the linear model on exact data of the nonlinear one, with gravity, and an accelerometer that turns
//! with the tool and reads gravity.

use anyhow::Result;
use flexid_core::sensors::Accelerometer;
use flexid_core::spectrum::Measurement;
use flexid_simulation::experiment::Cut;
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::bound::{deviations, information};
use crate::figure::{Figure, median};
use crate::find::{Task, find};
use crate::linear::motion;
use crate::records::{SAMPLES, Signals};
use crate::study::{Purpose, Study, name, random};

/// Largest bias of a parameter, in standard deviations.
const LIMIT: f64 = 0.5;
/// Gravity, base axes, m/s².
const GRAVITY: [f64; 3] = [0.0, 0.0, -9.80665];

pub(crate) fn prove(study: &Study, robots: usize, details: bool) -> Result<Vec<Figure>> {
    let cuts = study.cuts();
    let accelerometer = Accelerometer::Strapdown;
    let measurement = Measurement { gravity: GRAVITY, accelerometer, ..study.measurement };
    let one = |robot: u64| -> Result<Vec<f64>> {
        let truth = study.robot(robot);
        let (mut records, mut informations) = (Vec::new(), Vec::new());
        for cut in &cuts[robot as usize % cuts.len()] {
            let cut = Cut { gravity: Vector3::from(GRAVITY), accelerometer, ..cut.clone() };
            let response = cut.response(&study.chain, &truth);
            let (force, acceleration) = (&response.force, &response.acceleration);
            records
                .push(Signals { pose: &cut.pose, force, acceleration, struck: None }.exact(study));
            let motion = motion(&study.chain, &truth, &cut);
            informations.push(information(study, &study.chain, &truth, &cut, &motion, 0..SAMPLES)?);
        }
        let deviations = deviations(&informations.into_iter().sum())?;
        let task = Task { measurement, ..study.task() };
        let found = find(&task, &records, random(Purpose::Search, robot).0)?;
        let scores: Vec<f64> =
            found.errors(&truth).iter().zip(&deviations).map(|(e, d)| (e / d).abs()).collect();
        if details {
            for (index, score) in scores.iter().enumerate().filter(|(_, score)| **score > 0.2) {
                eprintln!(
                    "robot {robot}: {} off by {score:.3} σ (σ is {:.2} %), χ²/dof {:.2e}",
                    name(index),
                    100.0 * deviations[index],
                    found.estimate.consistency
                );
            }
        }
        Ok(scores)
    };
    let scores = (0..robots as u64).into_par_iter().map(one).collect::<Result<Vec<_>>>()?;
    let all: Vec<f64> = scores.concat();
    let largest = (0..all.len()).max_by(|&a, &b| all[a].total_cmp(&all[b])).unwrap_or(0);
    let worst = all.get(largest).copied().unwrap_or(f64::NAN);
    let per_robot = 12 * study.chain.joints().len();
    Ok(vec![
        Figure::at_most(
            "largest bias of a parameter from nonlinear data",
            robots,
            LIMIT,
            worst,
            " σ",
        )
        .remark(format_args!(
            "median {:.3} σ; worst is robot {}, {}",
            median(all.clone()),
            largest / per_robot,
            name(largest % per_robot)
        )),
    ])
}
