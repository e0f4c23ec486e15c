//! The command line as its users meet it: what it says, where it says it, and its exit status.

mod accuracy;
mod bad_input;
mod check;
#[path = "../common/mod.rs"]
mod common;
mod compare;
mod compensate;
mod demo;
mod faults;
mod files;
mod fleet;
mod history;
mod identify;
mod import;
mod lobes;
mod map;
mod new;
mod paths;
mod pedestal;
mod pipes;
mod plan;
mod predict;
#[path = "../common/python.rs"]
mod python;
mod receptances;
mod recordings;
mod report;
mod sensors;
mod setup;
mod shell;
mod simulate;
mod statics;
mod tables;
mod uff;
mod watch;
mod window;
