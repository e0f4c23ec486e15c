//! `flexid plan`: which experiments to do next.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context as _, Result, anyhow};
use clap::value_parser;
use flexid_console::exit::BadArgument;
use flexid_console::output::{self, Output};
use flexid_console::progress;
use flexid_core::spectrum::SpectrumError;
use flexid_edge::console::{complain, print};
use flexid_pipeline::config::Config;
use flexid_pipeline::input::BadInput;
use flexid_pipeline::text::count;
use flexid_simulation::scenario::{Cutting, Scenario};
use rayon::ThreadPoolBuilder;

use super::range::LARGEST_FORCE_N;
use crate::plan::candidates::Candidates;
use crate::plan::greedy::Criterion;
use crate::plan::start::Start;
use crate::plan::{self, table};

/// Room for records, spectra and normal equations of several jobs, of which a thread may take one while it waits for another, bytes.
const STACK: usize = 64 << 20;

const AFTER_HELP: &str = "Examples:
  $ flexid plan --config mill6-edge.toml
  $ flexid plan --config mill6-edge.toml --from found.json --experiments 2 --force 300";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// The daemon's configuration; the scenario of its [simulation] section has cutter, spindle speeds and noise
    #[arg(long, value_name = "EDGE.toml")]
    config: PathBuf,
    /// What is known already, as `identify --json` writes it [default: the bounds, and the static tests of [static]]
    ///
    /// Its fit must be consistent. Each parameter counts as known to its standard deviation whatever the others are: the
    /// correlations in the file are left aside.
    #[arg(long, value_name = "FOUND.json")]
    from: Option<PathBuf>,
    /// Number of experiments to plan
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = value_parser!(u64).range(1..=100))]
    experiments: u64,
    /// Largest force of a tooth along the cutting speed, N [default: the scenario's peak_tangential_n]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    force: Option<f64>,
    /// What makes one experiment better than another
    #[arg(long, value_enum, default_value_t = Criterion::D)]
    criterion: Criterion,
    /// Poses to choose from, spread evenly between the joints' limits
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = value_parser!(u64).range(1..=4096))]
    poses: u64,
    /// Write the plan as JSON
    #[arg(long, value_name = "OUT.json")]
    json: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let started = Instant::now();
    let config = Config::load(&args.config)?;
    let scenario = Scenario::of(&config)?;
    let cutting = cutting(args, &scenario)?;
    // A record has the noise in single precision.
    if !(scenario.measurement.acceleration_noise() as f32).is_normal() {
        let message = "[measurement] acceleration_noise_g_per_sqrt_hz is 0: give the sensor's";
        return Err(BadInput::new(scenario_file(&config), message).into());
    }
    let sought = &config.sought;
    if plan::parameters(sought) == 0 {
        let message = "[parameters] fixed names every parameter: leave one to plan for";
        return Err(BadInput::new(&config.file, message).into());
    }
    let start = match &args.from {
        Some(file) => Start::load(file, &config, sought)?,
        None => Start::unknown(&config, sought),
    };
    let read = config.files().chain(args.from.as_deref());
    output::is_not_stdout(args.json.as_deref())?;
    output::keeps(read, args.json.as_deref())?;
    let json = args.json.as_deref().map(Output::create).transpose()?;
    let chain = config.model.chain().map_err(|error| BadInput::new(&config.file, error))?;
    let candidates = Candidates {
        config: &config,
        chain: &chain,
        scenario: &scenario,
        cutting,
        bushings: &start.bushings,
        sought,
    };
    let possible = args.poses * candidates.cuts_per_pose() as u64;
    let bar = progress::bar(possible, "weighing");
    let threads =
        ThreadPoolBuilder::new().stack_size(STACK).build().context("no threads can be started")?;
    let (criterion, wanted) = (args.criterion, args.experiments as usize);
    let planned = threads.install(|| {
        let all = candidates.evaluate(&candidates.poses(args.poses as usize), || bar.inc(1))?;
        let lost = possible - all.len() as u64;
        bar.finish_and_clear();
        let bar = progress::bar(args.experiments, "choosing");
        let planned = plan::plan(&candidates, &start, &all, criterion, wanted, || bar.inc(1));
        bar.finish_and_clear();
        Ok((lost, planned))
    });
    let (lost, planned) =
        planned.map_err(|error: SpectrumError| anyhow!("the config was not checked: {error}"))?;
    let unusable = |fault| Err(unusable(args, &config, &cutting, fault));
    if lost == possible {
        return unusable("is lost in the force sensor's noise in every cut: allow more");
    }
    if planned.steps.is_empty() {
        return unusable("makes the robot give way in every cut: allow less");
    }
    if lost > 0 {
        complain(&format!(
            "warning: the force is lost in the force sensor's noise in {lost} of {possible} experiments: they are left out"
        ));
    }
    let experiments = count(planned.steps.len() as u64, "experiment");
    let seconds = started.elapsed().as_secs_f64();
    if let Some(json) = json {
        json.finish(&(serde_json::to_string_pretty(&planned)? + "\n"))?;
    }
    let text = table::plan(&planned, config.accuracies.are_perfect());
    Ok(print(&format!("{text}{experiments} planned, {seconds:.1} s\n"))?)
}

/// The scenario's cutter, its force within the budget.
fn cutting(args: &Args, scenario: &Scenario) -> Result<Cutting, BadArgument> {
    let Some(force) = args.force else { return Ok(scenario.cutting) };
    if !(force > 0.0 && force <= LARGEST_FORCE_N) {
        return Err(BadArgument(format!(
            "--force {force}: must be above 0 N and at most {LARGEST_FORCE_N} N"
        )));
    }
    Ok(Cutting { peak_tangential_n: force, ..scenario.cutting })
}

/// The error for a force with which no plan can be made. It names the place of the force.
fn unusable(args: &Args, config: &Config, cutting: &Cutting, fault: &str) -> anyhow::Error {
    let force = cutting.peak_tangential_n;
    if args.force.is_some() {
        return BadArgument(format!("--force {force}: {fault}")).into();
    }
    let message = format!("[force] peak_tangential_n is {force}: {fault}");
    BadInput::new(scenario_file(config), message).into()
}

fn scenario_file(config: &Config) -> &Path {
    config.scenario.as_deref().unwrap_or(&config.file)
}
