//! The daemon on the controller-side Linux box, as a library: it takes its bus, its listeners and its stop
//! signal as arguments, so that the offline tool and the tests run the daemon's very lines.
#![forbid(unsafe_code)]

pub mod board;
pub mod config;
pub mod console;
pub mod daemon;
pub mod finding;
pub mod input;
pub mod model;
pub mod pipeline;
pub mod reload;
pub mod server;
pub mod signals;
pub mod source;
pub mod statics;
pub mod stop;
pub mod store;
pub mod summary;
pub mod usage;
