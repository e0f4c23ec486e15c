//! What the user can ask for: one file a command.

mod identify;
mod model;
mod simulate;
mod watch;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use flexid_edge::input::BadInput;

/// Exit status for bad input or usage.
const BAD_INPUT: u8 = 2;

/// Finds the joint stiffness and damping of robots while they mill.
#[derive(Debug, Parser)]
#[command(name = "flexid", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Works on robot models
    #[command(subcommand)]
    Model(model::Command),
    /// Simulates a milling robot that sends frames, onto a CAN bus or into a log
    Simulate(simulate::Args),
    /// Identifies the joints from candump logs, as the daemon would
    Identify(identify::Args),
    /// Shows what a running daemon finds
    Watch(watch::Args),
}

/// Bad input that is no file: an argument, an interface, an address.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct BadArgument(String);

/// The command line's `main`.
pub fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Model(command) => model::run(&command),
        Command::Simulate(args) => simulate::run(&args),
        Command::Identify(args) => identify::run(&args),
        Command::Watch(args) => watch::run(&args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("flexid: {error:#}");
            let bad_input = error.is::<BadInput>() || error.is::<BadArgument>();
            if bad_input { BAD_INPUT.into() } else { ExitCode::FAILURE }
        }
    }
}
