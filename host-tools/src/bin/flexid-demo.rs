//! The main job in one command.

use std::process::ExitCode;

fn main() -> ExitCode {
    flexid::demo::main()
}
