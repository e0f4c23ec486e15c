//! How a program ends: its complaint of one line, and its exit status.

use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;
use flexid_edge::console::{PrintError, complain};
use flexid_edge::input::BadInput;
use flexid_edge::usage;

/// Exit status for bad input or usage.
const BAD_INPUT: u8 = 2;

/// Bad input that is no file: an argument, an interface, an address.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct BadArgument(pub(crate) String);

/// Runs this program with the arguments that it was started with.
pub(crate) fn main<A: Parser>(run: impl FnOnce(&A) -> Result<()>) -> ExitCode {
    let arguments = match usage::parse::<A>() {
        Ok(arguments) => arguments,
        Err(status) => return status,
    };
    let Err(error) = run(&arguments) else { return ExitCode::SUCCESS };
    // Who reads no further has what he wanted.
    if matches!(error.downcast_ref(), Some(PrintError::Closed)) {
        return ExitCode::SUCCESS;
    }
    complain(&format!("{}: {error:#}", A::command().get_name()));
    let bad_input = error.is::<BadInput>() || error.is::<BadArgument>();
    if bad_input { BAD_INPUT.into() } else { ExitCode::FAILURE }
}
