//! The program `flexid-reproduce`, which `flexid reproduce` starts.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context as _, Result};
use clap::{Parser, value_parser};
use fearless_simd::Level;
use flexid_console::output::{self, Output};
use flexid_console::{exit, progress};
use flexid_edge::console::print;
use flexid_pipeline::config::Config;
use flexid_reproduce::robot::Study;
use flexid_reproduce::tables::Tables;
use flexid_reproduce::{self as reproduce, Effort, report};
use flexid_simulation::shipped::MILL3;
use rayon::ThreadPoolBuilder;

const AFTER_HELP: &str = "Examples:
  $ flexid reproduce --out tables --quick";

/// Reproduces the paper's tables and figures.
#[derive(Debug, Parser)]
#[command(name = "flexid reproduce", version, after_help = AFTER_HELP)]
struct Args {
    /// Folder for tables.json and report.html; made if it is not there
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    /// Another robot and scenario than the reference: the model and the scenario that it names are used, with the
    /// scenario's bounds and without gravity
    #[arg(long, value_name = "EDGE.toml")]
    config: Option<PathBuf>,
    /// Robots that every method meets, drawn uniformly from the bounds [default: each method as many as its
    /// comparisons need, up to 130]
    #[arg(long, value_name = "N", value_parser = value_parser!(u64).range(2..=10_000))]
    robots: Option<u64>,
    /// Iterations of the random search [default: 500]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1_000_000))]
    iterations: Option<u32>,
    /// Seed of robots, forces, noise and searches
    #[arg(long, value_name = "SEED", default_value_t = 2)]
    seed: u64,
    /// The report from 3 robots and 50 iterations, in less than a minute
    #[arg(long)]
    quick: bool,
}

fn main() -> ExitCode {
    exit::main(run)
}

fn run(args: &Args) -> Result<()> {
    let effort = args.effort();
    let study = study(args.config.as_deref())?;
    output::folder(&args.out)?;
    let json = Output::create(&args.out.join("tables.json"))?;
    let html = Output::create(&args.out.join("report.html"))?;
    let threads = ThreadPoolBuilder::new()
        .stack_size(reproduce::STACK)
        .build()
        .context("no threads to work with")?;
    let bar = progress::bar(effort.trials() as u64, "reproducing");
    let tables = threads.install(|| reproduce::run(&study, &effort, Level::new(), || bar.inc(1)));
    bar.finish_and_clear();
    let tables = tables?;
    json.finish(&(serde_json::to_string_pretty(&tables)? + "\n"))?;
    html.finish(&report::render(&tables))?;
    Ok(print(&summary(&tables, &args.out))?)
}

impl Args {
    fn effort(&self) -> Effort {
        let usual = if self.quick { Effort::QUICK } else { Effort::FULL };
        Effort {
            seed: self.seed,
            robots: self.robots.map(|robots| robots as usize).or(usual.robots),
            iterations: self.iterations.unwrap_or(usual.iterations),
            ..usual
        }
    }
}

/// The robot and scenario of `config`, or the reference.
fn study(config: Option<&Path>) -> Result<Study> {
    let Some(file) = config else {
        let folder = tempfile::tempdir().context("no temporary folder")?;
        let file = MILL3.write(folder.path()).context("temporary folder")?;
        return Ok(Study::new(&Config::load(&file)?, true)?);
    };
    Ok(Study::new(&Config::load(file)?, false)?)
}

fn summary(tables: &Tables, out: &Path) -> String {
    let mut text =
        format!("{:<36}{:>15}{:>9}\n", "parameter deviation, %", "here (95 % CI)", "paper");
    for row in &tables.methods {
        let half = 50.0 * (row.deviation.interval[1] - row.deviation.interval[0]);
        let paper = row.paper_deviation.map_or("".into(), |paper| format!("{:.2}", 100.0 * paper));
        let ours = format!("{:.2} ± {half:.2}", 100.0 * row.deviation.mean);
        let line = format!("{:<36}{ours:>15}{paper:>9}", row.name);
        text += &format!("{}\n", line.trim_end());
    }
    let html = out.join("report.html");
    text + &format!("{} and tables.json are written, {:.1} s\n", html.display(), tables.seconds)
}
