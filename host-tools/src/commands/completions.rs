//! `flexid completions`: the script with which a shell completes flexid's command lines.

use anyhow::Result;
use clap_complete::Shell;
use flexid_edge::console::print;

const AFTER_HELP: &str = "Examples:
  $ flexid completions bash > ~/.local/share/bash-completion/completions/flexid";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct Args {
    /// The shell
    shell: Shell,
}

pub(super) fn run(args: &Args, mut command: clap::Command) -> Result<()> {
    let name = command.get_name().to_owned();
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, name, &mut script);
    Ok(print(&String::from_utf8_lossy(&script))?)
}
