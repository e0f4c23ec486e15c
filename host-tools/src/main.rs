//! The command line `flexid`.

use std::process::ExitCode;

fn main() -> ExitCode {
    flexid::commands::main()
}
