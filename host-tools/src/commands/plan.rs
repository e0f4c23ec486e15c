//! `flexid plan`: which experiments to do next, and what cuts of the user will tell.

use std::io;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context as _, Result, anyhow};
use clap::value_parser;
use flexid_console::exit::BadArgument;
use flexid_console::output::{self, Output};
use flexid_console::progress;
use flexid_core::chain::Chain;
use flexid_core::spectrum::SpectrumError;
use flexid_edge::console::{complain, print};
use flexid_pipeline::check::Survey;
use flexid_pipeline::config::Config;
use flexid_pipeline::input::BadInput;
use flexid_pipeline::model::Model;
use flexid_pipeline::path;
use flexid_pipeline::text::count;
use flexid_prediction::document::Found;
use flexid_simulation::scenario::{Cutting, Experiment, Scenario, experiments};
use rayon::iter::{IntoParallelRefIterator as _, ParallelIterator as _};
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::pose;
use super::range::LARGEST_FORCE_N;
use crate::check::{self, Finding, Severity};
use crate::numbers::{Numbers, numbers};
use crate::place::{self, Place, ToolBox};
use crate::plan::candidates::Candidates;
use crate::plan::greedy::Criterion;
use crate::plan::own::{Own, too_fast};
use crate::plan::start::Start;
use crate::plan::{self, table};
use crate::window;

/// Room for records, spectra and normal equations of several jobs, of which a thread may take one while it waits for another, bytes.
const STACK: usize = 64 << 20;

/// Range of the number of poses. Chosen: the largest takes a quarter of an hour.
const MOST_POSES: RangeInclusive<usize> = 1..=4096;

const AFTER_HELP: &str = "Poses are in front of the robot. The scenario's experiments, or --near, tell where that is: no joint is more than half a turn from the mean of \
these poses; tool and joints are not below the base plane, the lowest of these poses, or the box; the tool is on their side of the base, and no higher \
than the shoulder, or the highest of these poses. --box stands in for the last two. Heights are against gravity. See for yourself that a pose is clear of walls and workpiece.

Examples:
  $ flexid plan --config mill6-edge.toml
  $ flexid plan --config mill6-edge.toml --from found.json --experiments 2 --force 300
  $ flexid plan --config mill6-edge.toml --box 0.6,1.4,-0.5,0.5,0,0.8
  $ flexid plan --config mill6-edge.toml --poses reachable.csv
  $ flexid plan --config mill3-edge.toml --cuts mill3-feed.toml";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// The daemon's configuration; the scenario of its [simulation] section has cutter, spindle speeds and noise
    #[arg(long, value_name = "EDGE.toml")]
    config: PathBuf,
    /// Result that is known already, as `identify --json` writes it [default: the bounds, and the static tests of [static]]
    ///
    /// A fit that is not consistent has a warning: its standard deviations may be too small. Each parameter counts as known to its standard
    /// deviation whatever the others are: the correlations in the file are left aside.
    #[arg(long, value_name = "FOUND.json")]
    from: Option<PathBuf>,
    /// Number of experiments to plan
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = value_parser!(u64).range(1..=100))]
    experiments: u64,
    /// Largest force of a tooth along the cutting speed, N [default: the scenario's peak_tangential_n]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    force: Option<f64>,
    /// Criterion that makes one experiment better than another
    #[arg(long, value_enum, default_value_t = Criterion::D)]
    criterion: Criterion,
    /// Poses to choose from: so many, spread evenly, or own ones from a table with the columns q1,q2,... (rad, m) or q1_deg,...
    #[arg(long, value_name = "N|FILE.csv", default_value = "64", value_parser = poses)]
    poses: Poses,
    /// Cuts that you mean to mill, along paths or standing, to be compared with the plan: [[experiment]] entries as in a scenario
    #[arg(long, value_name = "CUTS.toml")]
    cuts: Option<PathBuf>,
    /// Box in which the tool is to be, along the axes of the base, m
    #[arg(long = "box", value_name = "X0,X1,Y0,Y1,Z0,Z1", value_parser = numbers, allow_hyphen_values = true)]
    tool_box: Option<Numbers>,
    /// Choose from poses whose tool is near that of this one, or of those of a result
    #[arg(long, value_name = "Q1,Q2,...|FOUND.json", allow_hyphen_values = true)]
    near: Option<String>,
    /// Write the plan as JSON
    #[arg(long, value_name = "OUT.json")]
    json: Option<PathBuf>,
}

/// The origin of the poses.
#[derive(Clone, Debug)]
enum Poses {
    /// So many are spread.
    Spread(usize),
    /// They are in a table.
    Table(PathBuf),
}

fn poses(text: &str) -> Result<Poses, String> {
    match text.parse() {
        Ok(count) if MOST_POSES.contains(&count) => Ok(Poses::Spread(count)),
        Ok(_) => Err(format!("{text} is not in 1..={}", MOST_POSES.end())),
        Err(_) => Ok(Poses::Table(text.into())),
    }
}

pub(super) fn run(args: &Args) -> Result<()> {
    let started = Instant::now();
    let config = Config::load_recorded(&args.config)?;
    if !config.knows_rate {
        let message = "[measurement] rate_hz is missing: a plan is made for a rate";
        return Err(BadInput::new(&config.file, message).into());
    }
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
    if let (Some(file), Some(doubt)) = (&args.from, start.doubt) {
        let file = file.display();
        complain(&format!(
            "warning: {file}: its fit is {doubt}: its standard deviations may be too small, and the plan takes them as they are"
        ));
    }
    let chain = config.model.chain().map_err(|error| BadInput::new(&config.file, error))?;
    let poses = in_place(args, &config, &scenario, &chain)?;
    let table = match &args.poses {
        Poses::Table(file) => Some(file.as_path()),
        Poses::Spread(_) => None,
    };
    let near = args.near.as_deref().map(Path::new);
    let cuts = args.cuts.as_deref();
    let read = config.files().chain(args.from.as_deref()).chain(table).chain(near).chain(cuts);
    output::is_not_stdout(args.json.as_deref())?;
    output::keeps(read, args.json.as_deref())?;
    let json = args.json.as_deref().map(Output::create).transpose()?;
    let candidates = Candidates {
        config: &config,
        chain: &chain,
        scenario: &scenario,
        cutting,
        bushings: &start.bushings,
        sought,
    };
    let threads =
        ThreadPoolBuilder::new().stack_size(STACK).build().context("no threads can be started")?;
    let own = cuts.map(|file| own(file, &candidates, &threads)).transpose()?.unwrap_or_default();
    let possible = (poses.len() * candidates.cuts_per_pose()) as u64;
    let bar = progress::bar(possible, "weighing");
    let (criterion, wanted) = (args.criterion, args.experiments as usize);
    let planned = threads.install(|| {
        let all = candidates.evaluate(&poses, || bar.inc(1))?;
        let lost = possible - all.len() as u64;
        bar.finish_and_clear();
        let bar = progress::bar(args.experiments, "choosing");
        let planned = plan::plan(&candidates, &start, &all, &own, criterion, wanted, || bar.inc(1));
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
    let text = table::plan(&planned, window::columns());
    Ok(print(&window::fit(&format!("{text}{experiments} planned, {seconds:.1} s\n")))?)
}

/// The cuts of the file of `--cuts`, with their records. Warns of what is doubtful in them.
///
/// # Errors
/// The file is wrong; or the robot does not withstand a cut, or it gives no record.
fn own(file: &Path, candidates: &Candidates<'_>, threads: &ThreadPool) -> Result<Vec<Own>> {
    let config = candidates.config;
    let cuts = experiments(file, &config.model, &candidates.scenario.measurement)?;
    let bar = progress::bar(cuts.len() as u64, "milling");
    let mill = |cut| {
        let survey = candidates.mill(cut);
        bar.inc(1);
        survey
    };
    let surveys: Vec<_> = threads.install(|| cuts.par_iter().map(mill).collect());
    bar.finish_and_clear();
    let judged = |(experiment, survey): (Experiment, io::Result<Option<Survey>>)| {
        let of_cut = |what: String| {
            BadInput::new(file, format!("[[experiment]] \"{}\": {what}", experiment.name))
        };
        let Some(survey) = survey? else {
            return Err(of_cut("makes the robot give way: allow less force".into()).into());
        };
        if let Some(why) =
            too_fast(config, &experiment).filter(|_| survey.usable().next().is_none())
        {
            return Err(of_cut(why).into());
        }
        let findings = check::of_cut(config, &survey);
        let is = |severity| move |own: &&Finding| own.severity == severity;
        if let Some(wrong) = findings.iter().find(is(Severity::Wrong)) {
            return Err(of_cut(wrong.to_string()).into());
        }
        let doubts = findings.iter().filter(is(Severity::Doubtful));
        doubts.for_each(|doubt| complain(&format!("warning: {}", of_cut(doubt.to_string()))));
        let path = check::path(&survey);
        Ok(Own { experiment, survey, path })
    };
    cuts.into_iter().zip(surveys).map(judged).collect()
}

/// The poses to choose from.
///
/// # Errors
/// An argument or a file is wrong, or no pose has its tool in the place.
fn in_place(
    args: &Args,
    config: &Config,
    scenario: &Scenario,
    chain: &Chain,
) -> Result<Vec<Vec<f64>>> {
    let model = &config.model;
    let tool_box = args.tool_box.as_ref().map(tool_box).transpose()?;
    let references = match &args.near {
        None => scenario.poses(),
        Some(near) => references(near, model)?,
    };
    let place =
        Place::about(model, chain, config.gravity, &references, tool_box, args.near.is_some());
    let count = match &args.poses {
        Poses::Spread(count) => *count,
        Poses::Table(_) if args.near.is_some() => {
            let message =
                "--near chooses from poses that are spread: leave it or --poses FILE.csv out";
            return Err(BadArgument(message.into()).into());
        }
        Poses::Table(file) => {
            let kept = place.keep(path::poses(file, model)?);
            if kept.is_empty() {
                let message = "none of its poses has the tool in --box: make the box larger";
                return Err(BadInput::new(file, message).into());
            }
            return Ok(kept);
        }
    };
    let place::Poses { poses, reached } = place.poses(count);
    if poses.is_empty() {
        let why = match (reached, args.tool_box.is_some()) {
            (Some([x, y, z]), true) => {
                let range = |[least, most]: [f64; 2]| format!("{least:.2} to {most:.2}");
                let [x, y, z] = [x, y, z].map(range);
                format!("--box holds no tool: the robot reaches x {x}, y {y}, z {z} m")
            }
            _ => "no pose is in front of the robot and above its base: give --box, or --poses FILE.csv".into(),
        };
        return Err(BadArgument(why).into());
    }
    if poses.len() < count {
        complain(&format!(
            "note: the place has {} of {count} poses: the robot hardly reaches it",
            poses.len()
        ));
    }
    Ok(poses)
}

/// The box of `--box`.
///
/// # Errors
/// It has not six numbers, or an end that is not above its beginning.
fn tool_box(given: &Numbers) -> Result<ToolBox, BadArgument> {
    let [x0, x1, y0, y1, z0, z1] = given.exactly("--box")?;
    let own = [[x0, x1], [y0, y1], [z0, z1]];
    match own.iter().zip(["X", "Y", "Z"]).find(|([least, most], _)| least >= most) {
        None => Ok(own),
        Some(([least, most], axis)) => Err(BadArgument(format!(
            "--box has {axis} from {least} to {most}: give the lower end first"
        ))),
    }
}

/// The poses of `--near`.
///
/// # Errors
/// It is neither a pose of this robot nor a result of it.
fn references(near: &str, model: &Model) -> Result<Vec<Vec<f64>>> {
    if let Ok(Numbers(pose)) = numbers(near) {
        pose::check(model, "--near", &pose)?;
        return Ok(vec![pose]);
    }
    let joints = model.driven().count();
    let file = Path::new(near);
    let poses = Found::load(file)?.robot.found().poses.clone();
    let bad = |message| Err(BadInput::new(file, message).into());
    match poses.first() {
        None => bad("rests on static tests alone, and names no pose: give --near Q1,Q2,...".into()),
        Some(first) if first.len() != joints => bad(format!(
            "is of a robot with {} driven joints, and this one has {joints}: name the result of this robot",
            first.len()
        )),
        Some(_) => Ok(poses),
    }
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
