//! The common parts of flexid's end-to-end tests: a real CAN bus, the programs under test as processes, a folder to
//! run them in, and the truth to measure them by.
//!
//! The tests are not linked with flexid's own code. They build the programs, run them as a user does, and judge them
//! from their output alone.
#![allow(clippy::missing_errors_doc, clippy::missing_panics_doc, reason = "both fail the test")]

pub mod bench;
pub mod bus;
pub mod process;
pub mod programs;
pub mod report;
pub mod truth;
