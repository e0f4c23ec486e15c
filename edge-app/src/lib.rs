//! The daemon on the Linux machine beside the controller, as a library. It takes its bus, its listeners and its stop switch as
//! arguments, so that the demo and the tests run the code of the daemon.
#![forbid(unsafe_code)]

pub mod client;
pub mod console;
pub mod daemon;
pub mod health;
pub mod history;
pub mod latest;
pub mod manager;
pub mod reload;
pub mod server;
pub mod store;
mod tally;
pub mod threads;
pub mod usage;
