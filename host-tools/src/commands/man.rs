//! `flexid man`: the manual pages, made from the text of `--help`.

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use flexid_console::output;

const AFTER_HELP: &str = "Examples:
  $ flexid man ~/.local/share/man/man1";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// Folder for flexid.1 and a page for each command; made if it is not there
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

pub(super) fn run(args: &Args, command: clap::Command) -> Result<()> {
    output::folder(&args.folder)?;
    clap_mangen::generate_to(command, &args.folder)
        .with_context(|| format!("{}: cannot be written", args.folder.display()))
}
