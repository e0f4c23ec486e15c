//! What the end-to-end tests of flexid share: a real CAN bus, the programs under test as processes,
//! a folder to run them in, and the truth to measure them by.
//!
//! The tests are not linked with flexid's own code: the programs are built and run as a user runs them,
//! and what they say is judged from their output alone. Only `reader-load`, a measurement, uses the
//! daemon's library.

pub mod bench;
pub mod bus;
pub mod process;
pub mod programs;
pub mod report;
pub mod truth;
