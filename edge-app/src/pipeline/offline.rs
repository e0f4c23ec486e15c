//! The daemon's pipeline over a recording: faster than the clock, each record in its turn.

use std::io;
use std::panic::resume_unwind;
use std::thread;
use std::time::Duration;

use flexid_wire::messages::Progress;

use super::{Intake, Outcome, STACK, Solver, unchecked};
use crate::config::Config;
use crate::source::{Flow, FrameSource};
use crate::stop::Stop;

/// Identifies from all that `source` brings. `on_progress` hears of every step of the solver.
///
/// A recording that cannot be read to its end is no error: what was read is used, and the outcome says it.
///
/// # Errors
/// The system gave no thread.
pub fn run_offline(
    config: &Config,
    source: &mut dyn FrameSource,
    on_progress: impl FnMut(&Progress) + Send,
) -> io::Result<Outcome> {
    thread::scope(|scope| {
        let worker = thread::Builder::new().name("flexid-offline".into()).stack_size(STACK);
        let worker = worker.spawn_scoped(scope, || run(config, source, on_progress))?;
        worker.join().unwrap_or_else(|panic| resume_unwind(panic))
    })
}

fn run(
    config: &Config,
    source: &mut dyn FrameSource,
    mut on_progress: impl FnMut(&Progress),
) -> io::Result<Outcome> {
    let mut intake = Intake::new(config).map_err(unchecked)?;
    let mut solver = Solver::new(config)?;
    let go_on = Stop::new();
    let broken = loop {
        let read = intake.read(source, Duration::MAX, |record| {
            solver.take(record, &go_on, &mut on_progress);
        });
        match read {
            Ok(Flow::Open) => {}
            Ok(Flow::Ended) => break None,
            Err(error) => break Some(error),
        }
    };
    intake.finish(|record| solver.take(record, &go_on, &mut on_progress));
    let breaks = broken.iter().map(|error| format!("the recording breaks off: {error}"));
    let other = Some(source.health().trouble).filter(|trouble| !trouble.is_empty());
    let trouble = breaks.chain(other).collect::<Vec<_>>().join("; ");
    let counts = intake.counts();
    Ok(Outcome {
        finding: solver.finding(&counts, &trouble),
        counts,
        state: solver.refusal().unwrap_or_else(|| intake.state(config)),
        trouble,
        broken,
    })
}
