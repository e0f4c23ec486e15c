//! Result of a run.

use std::io;

use flexid_wire::finding::Finding;
use flexid_wire::state::State;
use flexid_wire::trouble::Trouble;

use crate::clocks::{FoundClocks, Untold};
use crate::intake::Counts;
use crate::report::StaticReport;
use crate::robot::FoundRobot;
use crate::shared::Shared;
use crate::solver::{CoursePoint, FittedRecord};

/// Results of a run at the end of its frames.
#[derive(Debug)]
pub struct Outcome {
    /// Report and confidence. `None` if there is no estimate.
    pub finding: Option<Finding>,
    /// The robot that was found, which predicts motion, and its covariance. `None` if there is no estimate.
    pub robot: Option<FoundRobot>,
    /// What it shares with other findings of the robot. `None` if there is no estimate, and of a daemon.
    pub shared: Option<Shared>,
    /// Findings of the estimate about each static test. `None` without one of the two.
    pub statics: Option<StaticReport>,
    /// Records that the estimate rests on, bin by bin. Empty if there is none, and of a daemon.
    pub records: Vec<FittedRecord>,
    /// Points at which the refinements stood in the course of the work. Empty of a daemon.
    pub course: Vec<CoursePoint>,
    /// What was told of the clocks, if each sensor has its own.
    pub clocks: Option<Result<FoundClocks, Untold>>,
    /// Counts of what has come in.
    pub counts: Counts,
    /// Cause of a missing record: what the run still waited for, the obstacle to records, or the records that were not used.
    pub state: State,
    /// Troubles of the source. The reason why it broke is the first.
    pub troubles: Vec<Trouble>,
    /// Error with which the source broke. `None` if it ended. The frames before the error have been used.
    pub broken: Option<io::Error>,
}
