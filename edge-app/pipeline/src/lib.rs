//! The way from frames to a report, with the bus and the clock as arguments: the daemon, the offline tool and the demo run the
//! same code.
//!
//! | set-up                                   | the way                                                           |
//! | ---------------------------------------- | ----------------------------------------------------------------- |
//! | [`config`]: the file that names all else | [`source`]: frames from a socket or a log                         |
//! | [`model`]: the robot                     | [`intake`]: frames to records, and what is implausible in them    |
//! | [`signals`]: what frames hold            | [`solver`]: records to an estimate, and what is kept of them      |
//! | [`statics`]: static tests                | [`report`]: an estimate to a finding                              |
//! | [`poses`]: joint angles of tables        | [`clocks`]: instants of sensors without a common counter          |
//! | [`receptance`]: modal tests              |                                                                   |
//! | [`path`]: the tool's path, with forces   | [`check`]: frames to what is right and wrong in them, without a fit |
//! | [`knowledge`]: what experiments say of a robot with imperfections | [`document`]: a finding to JSON               |
#![forbid(unsafe_code)]

// Its tests and those beside it share files.
#[cfg(test)]
extern crate self as flexid_pipeline;

pub mod check;
pub mod clocks;
mod columns;
pub mod config;
pub mod date;
pub mod document;
pub mod dynamics;
pub mod input;
pub mod intake;
pub mod knowledge;
pub mod model;
pub mod names;
mod offline;
mod outcome;
pub mod path;
pub mod poses;
mod posterior;
pub mod receptance;
mod record;
pub mod report;
pub mod robot;
pub mod shared;
pub mod signals;
pub mod solver;
pub mod source;
mod stack;
pub mod statics;
pub mod stop;
pub mod text;
mod units;

pub use intake::{Counts, Intake};
pub use offline::{run_offline, run_statics};
pub use outcome::Outcome;
pub use record::{
    BINS, Experiment, MAX_EXPERIMENTS, MAX_PER_POSE, Record, SAMPLES, goes_on, same_pose,
};
pub use solver::{Format8, Solver, State};

/// Stack of the threads that hold a stream or a solver, bytes. Core keeps some MB in place, and passes them by value when it
/// makes a stream or a solver.
pub const STACK: usize = 64 << 20;

/// Makes the error for a config that was built by hand and not checked. [`Config`](config::Config) checks all that core
/// refuses.
pub(crate) fn unchecked(error: impl std::error::Error) -> std::io::Error {
    std::io::Error::other(format!("the config was not checked: {error}"))
}
