//! Threads with room for a stream or a solver.

use std::io;
use std::panic::resume_unwind;
use std::thread;

use crate::STACK;

/// Does `work` in a thread with a stack of [`STACK`].
///
/// # Errors
/// The system cannot start a thread, or the error of `work`.
pub(crate) fn on_a_large_stack<T: Send>(
    work: impl FnOnce() -> io::Result<T> + Send,
) -> io::Result<T> {
    thread::scope(|scope| {
        let worker = thread::Builder::new().name("flexid-offline".into()).stack_size(STACK);
        let worker = worker.spawn_scoped(scope, work)?;
        worker.join().unwrap_or_else(|panic| resume_unwind(panic))
    })
}
