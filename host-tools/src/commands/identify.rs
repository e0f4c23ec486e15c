//! `flexid identify`: the daemon's pipeline over recordings, or static tests alone.

use std::fs::File;
use std::iter;
use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow};
use flexid_edge::config::Config;
use flexid_edge::finding::Finding;
use flexid_edge::input::BadInput;
use flexid_edge::pipeline::{Outcome, run_offline, run_statics};
use flexid_edge::source::{CandumpLog, Logs};
use flexid_wire::messages::{Phase, Progress};
use indicatif::{ProgressBar, ProgressBarIter};

use crate::console::print;
use crate::output::Output;
use crate::simulation::scenario::Scenario;
use crate::{progress, table, truth, validation};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The daemon's configuration
    #[arg(long, value_name = "EDGE.toml")]
    config: PathBuf,
    /// Logs of candump -L, in the order in which they were recorded; none where [static] tests are enough
    #[arg(value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// Write the result as JSON
    #[arg(long, value_name = "OUT.json")]
    json: Option<PathBuf>,
    /// Compare with the true parameters, as `simulate --truth-json` writes them
    #[arg(long, value_name = "TRUTH.json")]
    truth: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    // All that can be wrong is found before the work, of which then nothing is lost.
    let config = Config::load(&args.config)?;
    let truth = args.truth.as_deref().map(|file| truth::load(file, &config)).transpose()?;
    let scenario = match (&truth, &config.scenario) {
        (Some(_), Some(file)) => Some(Scenario::load(file, &config.model)?),
        _ => None,
    };
    let json = args.json.as_deref().map(Output::create).transpose()?;
    let (finding, broken) = match args.logs.as_slice() {
        [] => {
            let nothing = "nothing to identify from: name a LOG of candump -L, or give static tests in [static]";
            let finding = run_statics(&config)?;
            (finding.ok_or_else(|| BadInput::new(&args.config, nothing))?, None)
        }
        [first, others @ ..] => from_logs(&config, first, others)?,
    };
    // A closed terminal does not keep the numbers from the file.
    let printed = print(&table::finding(&finding, truth.as_deref()));
    if let Some(json) = json {
        json.finish(&(serde_json::to_string_pretty(&finding)? + "\n"))?;
    }
    printed?;
    if let Some(truth) = truth {
        let estimate = table::bushings(&finding.report);
        print(&validation::compare(&config, scenario.as_ref(), &truth, &estimate)?)?;
    }
    broken.map_or(Ok(()), Err)
}

/// What the logs tell, and why they cannot be read to their end, if so.
fn from_logs(
    config: &Config,
    first: &Path,
    others: &[PathBuf],
) -> Result<(Finding, Option<anyhow::Error>)> {
    let bar = progress::bar(0, "reading");
    let files = iter::once(first).chain(others.iter().map(PathBuf::as_path));
    let mut logs = open(files, &config.interface, &bar)?;
    let Outcome { finding, state, trouble, broken, .. } =
        run_offline(config, &mut logs, |progress| bar.set_message(doing(progress)))?;
    bar.finish_and_clear();

    let broken = broken.map(|error| anyhow!("the recording breaks off: {error}"));
    if let Some(finding) = finding {
        return Ok((finding, broken));
    }
    let others = match others.len() {
        0 => String::new(),
        others => format!(" in it and {others} more"),
    };
    let trouble = if trouble.is_empty() { trouble } else { format!("; {trouble}") };
    let message = format!("no record to identify from{others}: {state}{trouble}");
    Err(broken.unwrap_or_else(|| BadInput::new(first, message).into()))
}

/// In words, for the progress bar.
fn doing(progress: &Progress) -> String {
    let percent = 100.0 * progress.fraction;
    match progress.phase {
        Phase::Waiting => "reading".into(),
        Phase::Searching => format!("record {}: searching, {percent:.0} %", progress.records),
        Phase::Refining => format!("record {}: refining, {percent:.0} %", progress.records),
        Phase::Settled => format!("record {}: settled", progress.records),
    }
}

/// Opens all logs, so that a wrong name is told before the work begins.
fn open<'a>(
    files: impl Iterator<Item = &'a Path>,
    interface: &str,
    bar: &ProgressBar,
) -> Result<Logs<ProgressBarIter<File>>, BadInput> {
    let mut logs = Vec::new();
    for file in files {
        let unreadable = |error| BadInput::new(file, format!("cannot be read: {error}"));
        let log = File::open(file).map_err(unreadable)?;
        let metadata = log.metadata().map_err(unreadable)?;
        if metadata.is_dir() {
            return Err(BadInput::new(file, "is a folder: name the log files in it"));
        }
        bar.inc_length(metadata.len());
        logs.push(CandumpLog::new(file, bar.wrap_read(log)).on_bus(interface)?);
    }
    Ok(Logs::new(logs))
}
