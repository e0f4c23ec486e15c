//! The end of a program: an error message of one line, and the exit status.

use std::process::ExitCode;

use anyhow::{Error, Result};
use clap::Parser;
use flexid_edge::console::{PrintError, complain};
use flexid_edge::usage;
use flexid_pipeline::input::BadInput;

/// Exit status of work that is done.
const SUCCESS: u8 = 0;
/// Exit status for what is neither done nor bad input.
const FAILURE: u8 = 1;
/// Exit status for bad input or usage.
const BAD_INPUT: u8 = 2;

/// Bad input that is no file, such as an argument, an interface or an address, or a file that the text names already.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct BadArgument(pub String);

/// A failure that standard output has told. Nothing is printed on standard error.
#[derive(Debug, thiserror::Error)]
#[error("standard output says why")]
pub struct Told;

/// Runs this program with the arguments that it was started with.
pub fn main<A: Parser>(run: impl FnOnce(&A) -> Result<()>) -> ExitCode {
    let arguments = match usage::parse::<A>() {
        Ok(arguments) => arguments,
        Err(status) => return status,
    };
    let Err(error) = run(&arguments) else { return ExitCode::SUCCESS };
    let status = status(&error);
    if status != SUCCESS && !error.is::<Told>() {
        complain(&format!("{}: {error:#}", A::command().get_name()));
    }
    status.into()
}

/// The exit status of a program that ends with an error.
pub fn status(error: &Error) -> u8 {
    // A reader that closes the pipe has read all that it needs.
    if matches!(error.downcast_ref(), Some(PrintError::Closed)) {
        return SUCCESS;
    }
    let is_mistake = error.downcast_ref().is_some_and(BadInput::is_mistake);
    if is_mistake || error.is::<BadArgument>() { BAD_INPUT } else { FAILURE }
}
