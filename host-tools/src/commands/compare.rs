//! `flexid compare`: whether two fits of a robot agree.

use std::path::PathBuf;

use anyhow::Result;
use flexid_console::exit::Told;
use flexid_edge::console::{PrintError, print};
use flexid_pipeline::input::BadInput;
use flexid_prediction::comparison::compare;
use flexid_prediction::document::Found;

use crate::compare::{Compared, table};
use crate::window;

const AFTER_HELP: &str = "Exit status: 0 when the fits agree within their intervals; 1 when they differ; 2 for bad input.

Examples:
  $ flexid compare before.json after.json
  differ: joint_2 ry stiffness fell by 15.2 % (13.7 to 16.8)

   parameter              from         to    change           95 %     std
  ─────────────────────────────────────────────────────────────────────────
   joint_1 tx stiffness   60.0  60.1 MN/m     0.2 %    -0.2 to 0.5     1.1
  ...";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// The first result, as `identify --json` writes it
    #[arg(value_name = "BEFORE.json")]
    before: PathBuf,
    /// The second result, of the same robot and from other records
    #[arg(value_name = "AFTER.json")]
    after: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let [before, after] = [Found::load(&args.before)?, Found::load(&args.after)?];
    let comparison = compare(&before, &after).map_err(|error| BadInput::new(&args.after, error))?;
    let agree = comparison.agree;
    let compared = Compared::new(
        [(args.before.as_path(), &before), (args.after.as_path(), &after)],
        comparison,
    );
    let text = if args.json {
        serde_json::to_string_pretty(&compared)? + "\n"
    } else {
        window::fit(&table::text(&compared, window::columns()))
    };
    match print(&text) {
        // A reader that closes the pipe does not make them agree.
        Ok(()) | Err(PrintError::Closed) if !agree => Err(Told.into()),
        printed => Ok(printed?),
    }
}
