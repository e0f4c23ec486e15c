//! `flexid history`: what changed in a robot.

use std::path::PathBuf;

use anyhow::Result;
use flexid_console::output::{self, Output};
use flexid_pipeline::input::BadInput;
use flexid_prediction::document::Found;
use flexid_prediction::history::history;
use flexid_report::history::{Finding, Page, render};

use super::told::{check_level, tell};
use crate::history::findings::Findings;
use crate::history::{Told, table};
use crate::window;

const AFTER_HELP: &str = "Exit status: 0 when nothing has changed; 1 when something has, or with --new when the newest result brought it to light; 2 for bad input.

Examples:
  $ flexid history findings/ --html history.html
  changed: joint_2 ry stiffness fell by 12.0 % (10.1 to 13.9) since 2026-03-03, in 90 findings, 2026-01-02 to 2026-04-01
  ...
  $ flexid history findings/ --new > history.txt";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Results of one robot from separate cuts, as `identify --json` writes them, and folders of such
    #[arg(value_name = "FOUND.json|DIR", required = true)]
    results: Vec<PathBuf>,
    /// Chance of a false change in the robot's life: of 50 robots 0.001 each, so that 5 % is that of all
    #[arg(long, value_name = "CHANCE", default_value_t = flexid_prediction::comparison::LEVEL)]
    level: f64,
    /// Let the exit status tell of changes alone that the newest result brought to light
    #[arg(long)]
    new: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// The page to write
    #[arg(long, value_name = "PAGE.html")]
    html: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    check_level(args.level)?;
    let findings = Findings::load(&args.results)?;
    let files = findings.used.iter().map(|(file, _)| file.as_path());
    output::keeps(files, args.html.as_deref())?;
    let page = args.html.as_deref().map(Output::create).transpose()?;
    let all: Vec<&Found> = findings.used.iter().map(|(_, found)| found).collect();
    let history = history(&all, &findings.times, args.level)
        .map_err(|(number, error)| BadInput::new(&findings.used[number].0, error))?;
    let told = Told::new(&findings, history, args.level);
    if let Some(page) = page {
        page.finish_and_say(&html(&told, &findings), "history")?;
    }
    let fails = if args.new { told.newly } else { told.changed };
    tell(&told, |told| table::text(told, window::columns()), args.json, fails)
}

fn html(told: &Told, findings: &Findings) -> String {
    let each = told.findings.iter().zip(&findings.times).enumerate();
    let each = each.map(|(number, (label, &time))| Finding {
        name: label.file.clone(),
        when: told.when(number).to_owned(),
        time,
    });
    render(&Page {
        verdict: &told.verdict,
        notes: &told.notes,
        level: told.level,
        per: told.per,
        findings: &each.collect::<Vec<_>>(),
        history: &told.history,
    })
}
