//! `flexid report`: one page on a fit.

use std::path::PathBuf;

use anyhow::Result;
use flexid_console::output::{self, Output};
use flexid_report::document::Document;
use flexid_report::evidence::{self, OriginFile};
use flexid_report::render;

const AFTER_HELP: &str = "Examples:
  $ flexid report found.json --out report.html";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// A result, as `identify --json` writes it
    #[arg(value_name = "FOUND.json")]
    found: PathBuf,
    /// The page to write [default: FOUND.html]
    #[arg(short, long, value_name = "REPORT.html")]
    out: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let document = Document::load(&args.found)?;
    let page = args.out.clone().unwrap_or_else(|| args.found.with_extension("html"));
    output::keeps([&*args.found], [&*page])?;
    let output = Output::create(&page)?;
    let OriginFile { name, sha256 } = evidence::file(&args.found);
    output.finish_and_say(&render(&document, &name, sha256.as_deref()), "report")
}
