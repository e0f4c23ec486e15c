//! Errors of threads that cannot be started.

use std::io;

/// Returns a function that says which thread the system cannot start.
pub fn no_thread(name: &'static str) -> impl Fn(io::Error) -> io::Error {
    move |error| {
        let needs = "it needs memory for its stack, of 64 MiB for the reader and the solver each";
        let why = format!("the thread {name} cannot be started: {error}: {needs}");
        io::Error::new(error.kind(), why)
    }
}
