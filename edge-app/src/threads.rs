//! Threads that the system may refuse, and threads that the end of the program does not wait for.

use std::io;
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError, bounded};
use flexid_pipeline::STACK;
use tracing::warn;

/// Time after which a line says that work on files is not done yet. Chosen: far longer than any disk that answers takes.
const LATE: Duration = Duration::from_secs(10);

/// Returns a function that says which thread the system cannot start.
pub fn no_thread(name: &'static str) -> impl Fn(io::Error) -> io::Error {
    move |error| {
        let stack = STACK >> 20;
        let limits =
            format!("memory or the number of threads is limited (a stack has up to {stack} MiB)");
        let why = format!("the thread {name} cannot be started: {error}: {limits}");
        io::Error::new(error.kind(), why)
    }
}

/// Work on files by a thread of its own, on a large stack. A file system that hangs may hold it up for ever, and the end of the program does
/// not wait for it.
#[derive(Debug)]
pub struct Detached<T> {
    thread: &'static str,
    /// The work in words.
    work: String,
    result: Receiver<T>,
    begun: Instant,
    is_late: bool,
}

impl<T: Send + 'static> Detached<T> {
    /// Begins work, which is `named` in the log if it is late.
    ///
    /// # Errors
    /// The system cannot start the thread.
    pub fn begin(
        thread: &'static str,
        named: String,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> io::Result<Self> {
        let (sender, result) = bounded(1);
        let builder = thread::Builder::new().name(thread.into()).stack_size(STACK);
        let spawned = builder.spawn(move || {
            // Nobody waits for it any more after the end.
            let _ = sender.send(work());
        });
        spawned.map_err(no_thread(thread))?;
        Ok(Self { thread, work: named, result, begun: Instant::now(), is_late: false })
    }

    /// Waits for the result, at most `longest`. Returns `None` if it is not there yet.
    ///
    /// # Errors
    /// The thread has died.
    pub fn wait(&mut self, longest: Duration) -> io::Result<Option<T>> {
        match self.result.recv_timeout(longest) {
            Ok(result) => Ok(Some(result)),
            Err(RecvTimeoutError::Timeout) => {
                if self.begun.elapsed() >= LATE && !std::mem::replace(&mut self.is_late, true) {
                    warn!("{} takes longer than {} s", self.work, LATE.as_secs());
                }
                Ok(None)
            }
            Err(RecvTimeoutError::Disconnected) => {
                Err(io::Error::other(format!("the thread {} has died", self.thread)))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_that_dies_is_named() {
        let mut work = Detached::begin("flexid-test", "work".into(), || {
            // No message of a panic.
            std::panic::resume_unwind(Box::new(()));
        })
        .unwrap();
        let error = work.wait(Duration::from_secs(30)).unwrap_err();
        assert_eq!(error.to_string(), "the thread flexid-test has died");
    }
}
