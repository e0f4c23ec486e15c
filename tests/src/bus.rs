//! A real vcan for a test target: it runs itself again under `with-vcan`, and never skips.

use std::os::unix::process::CommandExt;
use std::process::{Command, ExitCode};

use anyhow::{Context, Result, ensure};
use libtest_mimic::{Arguments, Failed, Trial};

use crate::programs;

/// The interface that `with-vcan` makes.
pub const INTERFACE: &str = "vcan0";

/// Set by `with-vcan` for what it runs.
const INSIDE: &str = "FLEXID_BUS";

/// A named test.
pub fn test(name: &str, run: fn() -> Result<()>) -> Trial {
    Trial::test(name, move || run().map_err(|error| Failed::from(format!("{error:#}"))))
}

/// `main` of a test target whose `tests` share [`INTERFACE`]: one after the other, on a network of their own.
pub fn main(tests: Vec<Trial>) -> ExitCode {
    let mut arguments = Arguments::from_args();
    if arguments.list || std::env::var_os(INSIDE).is_some() {
        arguments.test_threads = Some(1);
        return libtest_mimic::run(&arguments, tests).exit_code();
    }
    match enter() {
        Ok(never) => match never {},
        Err(error) => {
            eprintln!("{error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Replaces this process by itself on a bus.
fn enter() -> Result<std::convert::Infallible> {
    let programs = programs::folder()?;
    let error = Command::new(concat!(env!("CARGO_MANIFEST_DIR"), "/with-vcan"))
        .arg(std::env::current_exe()?)
        .args(std::env::args_os().skip(1))
        .env(programs::FOLDER, programs)
        .exec();
    Err(error).context("tests/with-vcan cannot be run")
}

/// Runs `ip link ARGUMENTS`, such as `set vcan0 down`.
pub fn ip_link(arguments: &str) -> Result<()> {
    let output = Command::new("ip").arg("link").args(arguments.split_whitespace()).output()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "ip link {arguments}: {errors}");
    Ok(())
}

/// Makes [`INTERFACE`] as it was at the start, whatever a test did to it.
pub fn restore() -> Result<()> {
    if ip_link(&format!("show {INTERFACE}")).is_err() {
        ip_link(&format!("add {INTERFACE} type vcan"))?;
    }
    ip_link(&format!("set {INTERFACE} up"))
}

/// Sends one frame in the notation of `cansend`, such as `101#0011`.
pub fn send(frame: &str) -> Result<()> {
    let status = Command::new("cansend").args([INTERFACE, frame]).status();
    let status = status.context("cansend is missing: apt-get install can-utils")?;
    ensure!(status.success(), "cansend {frame}: {status}");
    Ok(())
}
