//! Runs the daemon's pipeline over a recording, faster than the clock. All records that there is room for are worked on together.

use std::io;
use std::panic::resume_unwind;
use std::thread;
use std::time::Duration;

use flexid_wire::finding::Finding;
use flexid_wire::messages::Progress;
use flexid_wire::state::State;
use flexid_wire::text::clipped;
use flexid_wire::trouble::Trouble;

use crate::STACK;
use crate::config::Config;
use crate::intake::{Counts, Intake};
use crate::outcome::Outcome;
use crate::record::Record;
use crate::report::StaticReport;
use crate::robot::FoundRobot;
use crate::solver::Solver;
use crate::source::{Flow, FrameSource};
use crate::stop::Stop;

/// Identifies the robot from all frames of `source`. Calls `on_progress` after every step of the solver.
///
/// A recording that cannot be read to its end is no error: the part that was read is used, and the outcome contains the reason.
///
/// # Errors
/// The system cannot start a thread.
pub fn run_offline(
    config: &Config,
    source: &mut dyn FrameSource,
    on_progress: impl FnMut(&Progress) + Send,
) -> io::Result<Outcome> {
    on_a_large_stack(|| run(config, source, on_progress))
}

/// Identifies the stiffnesses from the static tests alone, says how each test goes with the others, and returns what predicts the robot's
/// motion. Returns `None` without static tests.
///
/// # Errors
/// The system cannot start a thread.
pub fn run_statics(config: &Config) -> io::Result<Option<(Finding, StaticReport, FoundRobot)>> {
    on_a_large_stack(|| {
        let solver = Solver::of_statics(config)?;
        let finding = solver.finding(&Counts::default(), &[]);
        let parts = finding.zip(solver.static_report()).zip(solver.robot());
        Ok(parts.map(|((finding, statics), robot)| (finding, statics, robot)))
    })
}

pub(crate) fn on_a_large_stack<T: Send>(
    work: impl FnOnce() -> io::Result<T> + Send,
) -> io::Result<T> {
    thread::scope(|scope| {
        let worker = thread::Builder::new().name("flexid-offline".into()).stack_size(STACK);
        let worker = worker.spawn_scoped(scope, work)?;
        worker.join().unwrap_or_else(|panic| resume_unwind(panic))
    })
}

fn run(
    config: &Config,
    source: &mut dyn FrameSource,
    mut on_progress: impl FnMut(&Progress),
) -> io::Result<Outcome> {
    let mut intake = Intake::new(config)?;
    let mut solver = Solver::new(config)?;
    let go_on = Stop::new();
    let mut take = |record: &Record| solver.admit(record, &go_on, &mut on_progress);
    let broken = loop {
        let read = intake.read(source, Duration::MAX, &mut take);
        match read {
            Ok(Flow::Open) => {}
            Ok(Flow::Ended) => break None,
            Err(error) => break Some(error),
        }
    };
    // Of sensors with clocks of their own no record has come. What is told of the clocks says how wide the accuracies must be.
    let widened = match intake.tell_clocks() {
        Some(Ok(found)) => Some(config.with_clocks(found)),
        _ => None,
    };
    if let Some(config) = &widened {
        solver = Solver::new(config)?;
    }
    intake.finish(|record| solver.admit(record, &go_on, &mut on_progress));
    solver.work(&go_on, || false, &mut on_progress);
    let breaks = broken.iter().map(|error| Trouble::RecordingBroken(clipped(error)));
    let troubles: Vec<_> = breaks.chain(source.health().troubles).collect();
    let counts = intake.counts();
    let state = solver.unused().map_or_else(|| intake.state(config), State::Unused);
    let mut finding = solver.finding(&counts, &troubles);
    if let Some(finding) = &mut finding {
        finding.explain(&state);
    }
    let (robot, statics) = (solver.robot(), solver.static_report());
    let (records, course) = (solver.fitted_records(), solver.course().to_vec());
    let clocks = intake.tell_clocks().cloned();
    Ok(Outcome {
        clocks,
        finding,
        robot,
        statics,
        records,
        course,
        counts,
        state,
        troubles,
        broken,
    })
}
