//! Runs the daemon's pipeline over a recording, faster than the clock. All records that there is room for are worked on together.

use std::io;

use flexid_wire::finding::Finding;
use flexid_wire::messages::Progress;
use flexid_wire::state::State;

use crate::check::{Survey, Surveyor};
use crate::config::Config;
use crate::intake::Counts;
use crate::outcome::Outcome;
use crate::report::StaticReport;
use crate::robot::FoundRobot;
use crate::solver::Solver;
use crate::source::FrameSource;
use crate::stack::on_a_large_stack;
use crate::stop::Stop;

/// Identifies the robot from the measured receptances of the config, and from all frames of `source`. Calls `on_survey` once they have been read, and `on_progress` after every step of the solver. The
/// work begins behind the survey, unless there are more records than there is room for: then it begins while the others are read.
///
/// A recording that cannot be read to its end is no error: the part that was read is used, and the outcome contains the reason.
///
/// # Errors
/// The system cannot start a thread.
pub fn run_offline(
    config: &Config,
    source: &mut dyn FrameSource,
    on_survey: impl FnOnce(&Survey) + Send,
    on_progress: impl FnMut(&Progress) + Send,
) -> io::Result<Outcome> {
    on_a_large_stack(|| run(config, source, on_survey, on_progress))
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

fn run(
    config: &Config,
    source: &mut dyn FrameSource,
    on_survey: impl FnOnce(&Survey),
    mut on_progress: impl FnMut(&Progress),
) -> io::Result<Outcome> {
    let mut surveyor = Surveyor::new(config, source)?;
    let mut solver = Solver::new(config)?;
    let go_on = Stop::new();
    surveyor.read(|candidate| solver.admit_examined(candidate, &go_on, &mut on_progress));
    // Of sensors with clocks of their own no record has come. What is told of the clocks says how wide the accuracies must be.
    if let Some(Ok(found)) = surveyor.tell_clocks() {
        solver = Solver::new(&config.with_clocks(found))?;
    }
    surveyor.finish(|candidate| solver.admit_examined(candidate, &go_on, &mut on_progress));
    let survey = surveyor.survey();
    on_survey(&survey);
    solver.work(&go_on, || false, &mut on_progress);
    let Survey { clocks, counts, state, troubles, broken, .. } = survey;
    let state = solver.unused().map_or(state, State::Unused);
    let mut finding = solver.finding(&counts, &troubles);
    if let Some(finding) = &mut finding {
        finding.explain(&state);
    }
    let (robot, shared, statics) = (solver.robot(), solver.shared(), solver.static_report());
    let (records, course) = (solver.fitted_records(), solver.course().to_vec());
    Ok(Outcome {
        clocks,
        finding,
        robot,
        shared,
        statics,
        records,
        course,
        counts,
        state,
        troubles,
        broken,
    })
}
