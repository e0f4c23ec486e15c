//! `flexid identify`: the daemon's pipeline over recordings.

use std::collections::VecDeque;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Result, anyhow};
use flexid_edge::config::Config;
use flexid_edge::input::BadInput;
use flexid_edge::pipeline::{Outcome, run_offline};
use flexid_edge::source::{Arrival, CandumpLog, Flow, FrameSource, SourceHealth};
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
    /// Logs of candump -L, in the order in which they were recorded
    #[arg(required = true, value_name = "LOG")]
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
    let bar = progress::bar(0, "reading");
    let mut logs = Logs::open(&args.logs, &bar)?;
    let Outcome { report, state, trouble, broken, .. } =
        run_offline(&config, &mut logs, |progress| bar.set_message(doing(progress)))?;
    bar.finish_and_clear();

    let names: Vec<_> = args.logs.iter().map(|log| log.display().to_string()).collect();
    let names = names.join(", ");
    let broken = broken.map(|error| anyhow!("{names}: the recording breaks off: {error}"));
    let Some(report) = report else {
        let trouble = if trouble.is_empty() { trouble } else { format!("; {trouble}") };
        let message = format!("no record to identify from: {state}{trouble}");
        return Err(broken.unwrap_or_else(|| BadInput::new(Path::new(&names), message).into()));
    };
    // A closed terminal does not keep the numbers from the file.
    let printed = print(&table::report(&report, truth.as_deref()));
    if let Some(json) = json {
        json.finish(&(serde_json::to_string_pretty(&report)? + "\n"))?;
    }
    printed?;
    if let Some(truth) = truth {
        let estimate = table::bushings(&report);
        print(&validation::compare(&config, scenario.as_ref(), &truth, &estimate)?)?;
    }
    broken.map_or(Ok(()), Err)
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

/// Several logs, one after the other.
struct Logs {
    open: VecDeque<CandumpLog<ProgressBarIter<File>>>,
    /// What went wrong in those that are read.
    troubles: Vec<String>,
}

impl Logs {
    /// Opens all of them, so that a wrong name is told before the work begins.
    fn open(files: &[PathBuf], bar: &ProgressBar) -> Result<Self, BadInput> {
        let mut open = VecDeque::new();
        for file in files {
            let unreadable = |error| BadInput::new(file, format!("cannot be read: {error}"));
            let log = File::open(file).map_err(unreadable)?;
            let metadata = log.metadata().map_err(unreadable)?;
            if metadata.is_dir() {
                return Err(BadInput::new(file, "is a folder: name the log files in it"));
            }
            bar.inc_length(metadata.len());
            open.push_back(CandumpLog::new(file, bar.wrap_read(log)));
        }
        Ok(Self { open, troubles: Vec::new() })
    }
}

impl FrameSource for Logs {
    fn read(&mut self, batch: &mut Vec<Arrival>, timeout: Duration) -> io::Result<Flow> {
        let Some(log) = self.open.front_mut() else { return Ok(Flow::Ended) };
        let flow = log.read(batch, timeout)?;
        if flow == Flow::Ended {
            let trouble = log.health().trouble;
            if !trouble.is_empty() {
                self.troubles.push(trouble);
            }
            self.open.pop_front();
        }
        Ok(if self.open.is_empty() { Flow::Ended } else { Flow::Open })
    }

    fn health(&self) -> SourceHealth {
        SourceHealth { trouble: self.troubles.join("; "), ..SourceHealth::default() }
    }
}
