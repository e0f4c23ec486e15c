//! `flexid fleet`: robots of one type as a population.

use std::path::PathBuf;

use anyhow::Result;
use flexid_pipeline::input::BadInput;
use flexid_prediction::document::Found;
use flexid_prediction::fleet::fleet;
use flexid_prediction::parameter::IncomparableError;

use super::told::{check_level, tell};
use crate::fleet::robots::Robots;
use crate::fleet::{Told, table};
use crate::window;

const AFTER_HELP: &str = "Each path is a robot: a result, or a folder with its results, of which the newest counts. One folder alone stands for what is in it.

Exit status: 0 when no robot is outside; 1 when one is; 2 for bad input.

Examples:
  $ flexid fleet robots/
  outside: R7: joint_2 ry stiffness 12.0 % (10.1 to 13.9) below the other 29, of 30 robots
  ...
  $ flexid fleet R1/ R2/ R3/ R4/ R5.json --json > fleet.json";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Results of robots of one type, as `identify --json` writes them, and folders of such
    #[arg(value_name = "FOUND.json|DIR", required = true)]
    results: Vec<PathBuf>,
    /// Chance that a fleet without a robot outside has one called so
    #[arg(long, value_name = "CHANCE", default_value_t = flexid_prediction::comparison::LEVEL)]
    level: f64,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<()> {
    check_level(args.level)?;
    let robots = Robots::load(&args.results)?;
    let all: Vec<&Found> = robots.used.iter().map(|own| &own.found).collect();
    let fleet = fleet(&all, args.level).map_err(|(number, error)| {
        let why = match error {
            IncomparableError::Joints { before, after } => format!(
                "is of another type than {}: it has {after}, that {before}: name results of robots of one type",
                robots.used[0].file.display()
            ),
            IncomparableError::Nothing => {
                "no result determines a parameter: identify from other cuts".to_owned()
            }
        };
        BadInput::new(&robots.used[number].file, why)
    })?;
    let told = Told::new(&robots, fleet, args.level);
    tell(&told, |told| table::text(told, window::columns()), args.json, told.outside)
}
