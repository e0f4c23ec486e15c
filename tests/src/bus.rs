//! A real vcan for a test target. The target runs itself again under `with-vcan`, and never skips.

use std::io::Write;
use std::process::{Command, ExitCode, Output};
use std::thread;

use anyhow::{Context, Result, ensure};
use libtest_mimic::{Arguments, Failed, Trial};

use crate::programs;

/// The interface that `with-vcan` makes.
pub const INTERFACE: &str = "vcan0";

/// The variable that `with-vcan` sets for the program that it runs.
const INSIDE: &str = "FLEXID_BUS";

/// The variable with the tests that this process runs: `FIRST/STEP`.
const SHARE: &str = "FLEXID_SHARE";

/// A named test.
pub fn test(name: &str, run: fn() -> Result<()>) -> Trial {
    Trial::test(name, move || run().map_err(|error| Failed::from(format!("{error:#}"))))
}

/// `main` of a test target whose `tests` share [`INTERFACE`]. The tests run one after the other on a network of their
/// own, on as many networks at once as there are processors.
pub fn main(mut tests: Vec<Trial>) -> ExitCode {
    let mut arguments = Arguments::from_args();
    if arguments.list || std::env::var_os(INSIDE).is_some() {
        arguments.test_threads = Some(1);
        if let Ok(share) = std::env::var(SHARE) {
            let (first, step) = share.split_once('/').expect("FIRST/STEP");
            let [first, step] = [first, step].map(|number| number.parse().expect("a number"));
            tests = tests.into_iter().skip(first).step_by(step).collect();
        }
        return libtest_mimic::run(&arguments, tests).exit_code();
    }
    let processors = thread::available_parallelism().map_or(1, usize::from);
    let networks = if arguments.filter.is_some() { 1 } else { processors.min(tests.len()) };
    thread::scope(|scope| {
        let shares: Vec<_> =
            (0..networks).map(|first| scope.spawn(move || enter(first, networks))).collect();
        let ended = shares.into_iter().map(|share| share.join().expect("no panic"));
        let failed = ended.filter(|ended| !shown(ended)).count();
        if failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
    })
}

/// Runs every `step`th test from the `first` on a bus, by this program again under `with-vcan`.
fn enter(first: usize, step: usize) -> Result<Output> {
    let programs = programs::folder()?;
    Command::new(concat!(env!("CARGO_MANIFEST_DIR"), "/with-vcan"))
        .arg(std::env::current_exe()?)
        .args(std::env::args_os().skip(1))
        .env(programs::FOLDER, programs)
        .env(SHARE, format!("{first}/{step}"))
        .output()
        .context("tests/with-vcan cannot be run")
}

/// Prints the output of an `ended` run. Returns whether it succeeded.
fn shown(ended: &Result<Output>) -> bool {
    match ended {
        Ok(output) => {
            // An error only means that the output is closed.
            let _ = std::io::stderr().write_all(&output.stderr);
            let _ = std::io::stdout().write_all(&output.stdout);
            output.status.success()
        }
        Err(error) => {
            eprintln!("{error:#}");
            false
        }
    }
}

/// Runs `ip link ARGUMENTS`, for example `set vcan0 down`.
pub fn ip_link(arguments: &str) -> Result<()> {
    let output = Command::new("ip").arg("link").args(arguments.split_whitespace()).output()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "ip link {arguments}: {errors}");
    Ok(())
}

/// Restores [`INTERFACE`] to its state at the start, whatever a test did to it.
pub fn restore() -> Result<()> {
    if ip_link(&format!("show {INTERFACE}")).is_err() {
        ip_link(&format!("add {INTERFACE} type vcan"))?;
    }
    ip_link(&format!("set {INTERFACE} up"))
}

/// Sends one frame in the notation of `cansend`, for example `101#0011`.
pub fn send(frame: &str) -> Result<()> {
    let status = Command::new("cansend").args([INTERFACE, frame]).status();
    let status = status.context("cansend is missing: apt-get install can-utils")?;
    ensure!(status.success(), "cansend {frame}: {status}");
    Ok(())
}
