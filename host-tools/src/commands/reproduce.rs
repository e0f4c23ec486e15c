//! `flexid reproduce`: starts the program `flexid-reproduce`.

use std::env;
use std::ffi::OsString;
use std::io::ErrorKind;
use std::os::unix::process::CommandExt as _;
use std::process::Command;

use anyhow::{Context as _, Result};
use flexid_console::exit::BadArgument;

const AFTER_HELP: &str = "Examples:
  $ flexid reproduce --out tables --quick";
/// The program. It is one of its own since the optimisers that it compares with take as long to build as all other commands.
const PROGRAM: &str = "flexid-reproduce";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP, disable_help_flag = true)]
pub(super) struct Args {
    /// The program's arguments; --help lists them
    #[arg(value_name = "ARGUMENT", trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

/// Becomes the program that lies beside this one, or that is on the PATH.
pub(super) fn run(args: &Args) -> Result<()> {
    let beside = env::current_exe().context("where this program lies")?.with_file_name(PROGRAM);
    let program = if beside.exists() { beside.into_os_string() } else { PROGRAM.into() };
    let error = Command::new(program).args(&args.arguments).exec();
    if error.kind() == ErrorKind::NotFound {
        let remedy = "build it: cargo install --locked --path host-tools/reproduce";
        return Err(BadArgument(format!("{PROGRAM} is not installed: {remedy}")).into());
    }
    Err(error).context(PROGRAM)
}
