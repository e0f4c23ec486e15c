//! `flexid check`: what is right and what is wrong, before the identification.

use std::path::PathBuf;

use anyhow::Result;
use flexid_console::exit::{BadArgument, Told};
use flexid_edge::console::{PrintError, print};
use flexid_pipeline::check::survey;
use flexid_pipeline::config::Config;

use crate::check::{Check, json, table};
use crate::recording;
use crate::recording::meter::Meter;
use crate::window;

/// The help text with the exit status and examples.
const AFTER_HELP: &str = "States: wrong prevents identification, or makes its numbers wrong; doubtful costs accuracy, or part of the data; note is to be known; right is right.

Exit status: 0 when the configuration and the recordings are ready; 1 when something is wrong; 2 for bad input: a file that is missing, \
empty or cut off, or a mistake in the configuration.

Examples:
  $ flexid check --config edge.toml
  $ flexid check --config edge.toml cut.log
  not ready: 0x113 (q3) is not in the log (and 2 more)
  ...";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// The daemon's configuration
    #[arg(long, value_name = "EDGE.toml")]
    config: PathBuf,
    /// Recordings: logs of candump -L, tables (CSV, LVM), MF4, TDMS, MAT or MCAP, also packed (.gz, .zst), in their order; - is standard input.
    /// Without any, the configuration and its DBC file are checked
    #[arg(value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// Print the findings as JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let mut config = match args.logs.as_slice() {
        [] => Config::load_statics(&args.config)?,
        _ => Config::load_recorded(&args.config)?,
    };
    let logs = recording::split(&args.logs, &mut config);
    let (config, mut survey) = match logs.as_slice() {
        [] => (config, None),
        logs => {
            let meter = Meter::of_reading();
            let (config, mut source) = recording::open(logs, &config, &meter)?;
            let survey = survey(&config, &mut source, |records| meter.show_records(records))?;
            meter.finish();
            (config, Some(survey))
        }
    };
    let check = Check::new(&config, survey.as_ref());
    let text = if args.json {
        json::text(&check)?
    } else {
        window::fit(&table::text(&check, window::columns()))
    };
    let is_ready = check.is_ready();
    // What was found is printed even if a log breaks off, and the error is reported even if that cannot be printed.
    let printed = print(&text);
    if let Some(error) = survey.as_mut().and_then(|survey| survey.broken.take()) {
        return Err(BadArgument(error.to_string()).into());
    }
    match printed {
        // A reader that closes the pipe does not make it ready.
        Ok(()) | Err(PrintError::Closed) if !is_ready => Err(Told.into()),
        printed => Ok(printed?),
    }
}
