//! `flexid predict`: what the robot does in a pose.

use std::path::PathBuf;

use anyhow::Result;
use flexid_console::exit::BadArgument;
use flexid_console::output::{self, Output};
use flexid_console::progress;
use flexid_edge::console::print;
use flexid_pipeline::input::BadInput;
use flexid_prediction::document::Found;
use flexid_prediction::receptance::{Grid, MOST};

use super::{pose, range};
use crate::json::Judged;
use crate::numbers::{Numbers, numbers};
use crate::predict::{Format, Prediction, Request, table};
use crate::window;

const AFTER_HELP: &str = "Examples:
  $ flexid predict found.json --force 0,200,0
  $ flexid predict found.json --pose 0.1,-0.5,0.4,0.1,0.2,0.3 --receptance h.csv --json";

#[derive(Debug, clap::Args)]
#[command(
    after_help = AFTER_HELP,
    allow_negative_numbers = true
)]
pub(super) struct Args {
    /// A result, as `identify --json` writes it
    #[arg(value_name = "FOUND.json")]
    found: PathBuf,
    /// Joint angles, base first, rad (m); may be given more than once [default: the poses of the records]
    #[arg(long, value_name = "Q1,Q2,...", value_parser = numbers, allow_hyphen_values = true)]
    pose: Vec<Numbers>,
    /// Force on the tool along the axes of the tool centre point, N, whose deflection is computed
    #[arg(long, value_name = "FX,FY,FZ", value_parser = numbers, allow_hyphen_values = true)]
    force: Option<Numbers>,
    /// Highest natural frequency, Hz [default: the upper edge of the band that was fitted; the model extrapolates beyond]
    #[arg(long, value_name = "HZ")]
    highest: Option<f64>,
    /// Write the receptance along the band: OUT.csv, or OUT.uff (universal file, data set 58)
    #[arg(long, value_name = "OUT.csv|OUT.uff")]
    receptance: Option<PathBuf>,
    /// Number of frequencies of the receptance, equally far apart [default: as many as show the peak of each mode, at least 400; in a CSV
    /// file they stand closer together about the modes]
    #[arg(long, value_name = "N", requires = "receptance", value_parser = clap::value_parser!(u32).range(2..=MOST as i64))]
    points: Option<u32>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let found = Found::load(&args.found)?;
    let force = args.force.as_ref().map(range::force).transpose()?;
    if let Some(highest) = args.highest.filter(|highest| highest.is_nan() || *highest <= 0.0) {
        return Err(BadArgument(format!("--highest is {highest}: must be above 0 Hz")).into());
    }
    for Numbers(pose) in &args.pose {
        pose::check(found.robot.model(), "--pose", pose)?;
    }
    let output = match &args.receptance {
        None => None,
        Some(file) => {
            output::keeps([&*args.found], [&**file])?;
            let format = Format::of(file)?;
            format.holds(&args.found, &found.fit)?;
            Some((file, format, Output::create(file)?))
        }
    };
    let request = Request {
        force,
        highest_hz: args.highest.unwrap_or(found.robot.band_hz()[1]),
        grid: output.as_ref().map(|(_, format, _)| {
            args.points.map_or(format.grid(), |points| Grid::Even(points as usize))
        }),
    };
    let poses: Vec<Vec<f64>> = match args.pose.as_slice() {
        [] => distinct(&found.robot.found().poses),
        given => given.iter().map(|Numbers(pose)| pose.clone()).collect(),
    };
    if poses.is_empty() {
        let message = "rests on static tests alone, and names no pose: give --pose";
        return Err(BadInput::new(&args.found, message).into());
    }
    let bar = progress::parts(poses.len(), "predicting");
    let predictions = poses
        .iter()
        .enumerate()
        .map(|(number, pose)| {
            let done = |part| progress::done(&bar, number, part);
            let prediction = Prediction::new(&found.robot, pose, &request, done);
            progress::done(&bar, number + 1, 0.0);
            prediction
                .map_err(|fault| BadInput::new(&args.found, format!("pose {pose:?}: {fault}")))
        })
        .collect::<Result<Vec<_>, _>>();
    bar.finish_and_clear();
    let predictions = predictions?;
    if let Some((file, format, output)) = output {
        output.finish(&format.text(&predictions, &found.fit)?)?;
        format.warn_of_open(file, &predictions);
    }
    let text = if args.json {
        table::warn_of(&args.found, &found.fit);
        let judged: Vec<_> = predictions.iter().map(|own| Judged::of(&found.fit, own)).collect();
        serde_json::to_string_pretty(&judged)? + "\n"
    } else {
        window::fit(&table::predictions(
            &found,
            &predictions,
            request.highest_hz,
            window::columns(),
        ))
    };
    Ok(print(&text)?)
}

/// Each pose once, in their order.
fn distinct(poses: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut distinct: Vec<Vec<f64>> = Vec::new();
    for pose in poses {
        if !distinct.contains(pose) {
            distinct.push(pose.clone());
        }
    }
    distinct
}
