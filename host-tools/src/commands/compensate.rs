//! `flexid compensate`: joint offsets that take the deflection along a path back.

use std::path::PathBuf;

use anyhow::Result;
use flexid_console::output::{self, Output};
use flexid_console::progress;
use flexid_edge::console::{complain, print};
use flexid_pipeline::input::BadInput;
use flexid_pipeline::path;
use flexid_prediction::document::Found;
use rayon::prelude::*;

use crate::compensate::{Compensated, csv, text, too_large};
use crate::json::Judged;
use crate::predict::table::{doubt, warn_of};
use crate::window;

const AFTER_HELP: &str = "path.csv has a place in each line, and names its columns in the first: q1,q2,... or q1_deg,... (joint \
angles), fx,fy,fz (N) and, if wanted, mx,my,mz (Nm), on the tool along its axes.

Examples:
  $ flexid compensate found.json path.csv -o offsets.csv
  5 places
   most deflected, line 6, µm: x 162 (±0.02 %), y -445 (±0.01 %), z 110 (±0.02 %)
  ...";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// A result, as `identify --json` writes it
    #[arg(value_name = "FOUND.json")]
    found: PathBuf,
    /// The path: joint angles and forces
    #[arg(value_name = "PATH.csv")]
    path: PathBuf,
    /// File to write: deflections, offsets to be added to the commanded angles, and what they leave
    #[arg(short, long, value_name = "OUT.csv")]
    out: PathBuf,
    /// Print all places as JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<()> {
    output::is_not_stdout([&*args.out])?;
    let found = Found::load(&args.found)?;
    let places = path::load(&args.path, found.robot.model())?;
    output::keeps([&*args.found, &*args.path], [&*args.out])?;
    let output = Output::create(&args.out)?;
    let bar = progress::bar(places.len() as u64, "compensating");
    let compensated = places
        .into_par_iter()
        .map(|place| {
            let line = place.line;
            let compensated = Compensated::new(&found.robot, place);
            bar.inc(1);
            compensated
                .map_err(|fault| BadInput { line: Some(line), ..BadInput::new(&args.path, fault) })
        })
        .collect::<Result<Vec<_>, _>>();
    bar.finish_and_clear();
    let compensated = compensated?;
    output.finish(&csv(&compensated)?)?;
    if let Some((line, offset)) = too_large(&compensated) {
        let warned = BadInput { line: Some(line), ..BadInput::new(&args.path, offset) };
        complain(&format!("warning: {warned}"));
    }
    let text = if args.json {
        warn_of(&args.found, &found.fit);
        let judged: Vec<_> = compensated.iter().map(|own| Judged::of(&found.fit, own)).collect();
        serde_json::to_string_pretty(&judged)? + "\n"
    } else {
        let doubt = doubt(&found.fit).map(|line| format!("{line}\n")).unwrap_or_default();
        window::fit(&(doubt + &text(&compensated)))
    };
    Ok(print(&text)?)
}
