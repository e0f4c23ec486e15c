//! From frames to a report: intake (frames to records) and solver (records to parameters).
//!
//! The daemon runs the two on threads of their own ([`crate::daemon`]), the offline tool in turn
//! ([`run_offline`]); the lines are the same, and so is the report.

mod confidence;
mod directions;
mod intake;
mod names;
mod obstacle;
mod offline;
mod plausibility;
mod repeats;
mod report;
mod residuals;
mod retention;
mod solver;
mod state;
mod strangers;
mod warnings;
mod work;

use std::io;

use flexid_core::MAX_JOINTS;

use crate::finding::Finding;

pub use intake::{Counts, Intake};
pub use names::{DOF_NAMES, name};
pub use obstacle::{Misfit, MisfitKind};
pub use offline::{run_offline, run_statics};
pub use plausibility::{Excess, Oddness};
pub use solver::Solver;
pub use state::State;

/// Most samples of a record.
pub const SAMPLES: usize = 32_768;
/// Most bins of a band.
pub const BINS: usize = 4096;
/// Most records that are kept, and most of one pose; the newest are.
pub const MAX_EXPERIMENTS: usize = 16;
/// See [`MAX_EXPERIMENTS`].
pub const MAX_PER_POSE: usize = 4;

/// Stack of the threads that hold a stream or a solver, bytes: core keeps everything in place, some MB of it,
/// and passes it on by value when it is made.
pub(crate) const STACK: usize = 64 << 20;

/// A record of this pipeline.
pub type Record = flexid_core::stream::Record<SAMPLES>;
/// An experiment of this pipeline.
pub type Experiment = flexid_core::spectrum::Experiment<BINS>;
/// Joint angles, rad (m).
type Pose = heapless::Vec<f64, MAX_JOINTS>;

/// What was known when the frames ended.
#[derive(Debug)]
pub struct Outcome {
    /// The parameters; `None` when there was no record to tell them.
    pub finding: Option<Finding>,
    /// What had come in.
    pub counts: Counts,
    /// What was still awaited, what stood in the way, or why the records told nothing, in words.
    pub state: String,
    /// What went wrong at the source, in words; empty when nothing did. Why it broke is in it, too.
    pub trouble: String,
    /// Why the source ended, if it broke. What it had brought has been used.
    pub broken: Option<io::Error>,
}

/// [`Config`](crate::config::Config) checks all that core refuses; who builds one by hand hears of it here.
pub(crate) fn unchecked(error: impl std::fmt::Debug) -> io::Error {
    io::Error::other(format!("the config was not checked: {error:?}"))
}
