//! The log on stderr, which may hold up nobody: lines that nobody reads are lost.

use std::io::{IsTerminal, Write, stderr};

use tracing::Subscriber;
use tracing_appender::non_blocking::{NonBlocking, WorkerGuard};
use tracing_subscriber::EnvFilter;

/// Logs to stderr from here on, as `RUST_LOG` says. The writer is for a last word; the guard flushes, for a second
/// at most.
pub(crate) fn start() -> (NonBlocking, WorkerGuard) {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("info"));
    let (subscriber, writer, guard) = lossy(stderr(), filter, stderr().is_terminal());
    // It fails where there is a logger already: never, in a program that has just begun.
    let _ = tracing::subscriber::set_global_default(subscriber);
    (writer, guard)
}

fn lossy(
    writer: impl Write + Send + 'static,
    filter: EnvFilter,
    colours: bool,
) -> (impl Subscriber + Send + Sync, NonBlocking, WorkerGuard) {
    let (writer, guard) = tracing_appender::non_blocking(writer);
    let subscriber = tracing_subscriber::fmt().with_env_filter(filter).with_ansi(colours);
    (subscriber.with_writer(writer.clone()).finish(), writer, guard)
}

#[cfg(test)]
mod tests {
    use std::io;
    use std::sync::mpsc::{Receiver, Sender, channel};
    use std::thread;
    use std::time::Duration;

    use tracing::info;

    use super::*;

    /// Takes one line, and is stuck with the next, as a pipe is that nobody reads.
    struct Stuck(Sender<()>, Receiver<()>);

    impl Write for Stuck {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let _ = self.0.send(());
            let _ = self.1.recv();
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_log_that_nobody_reads_holds_up_nobody() {
        let ((stuck, is_stuck), (_release, released)) = (channel(), channel());
        let (done, is_done) = channel();
        // A thread of its own: it would never end if it were held up.
        thread::spawn(move || {
            let filter = EnvFilter::new("info");
            let (subscriber, mut last, guard) = lossy(Stuck(stuck, released), filter, false);
            tracing::subscriber::with_default(subscriber, || {
                for line in 0..10_000 {
                    info!("line {line}");
                }
            });
            writeln!(last, "the last word").unwrap();
            drop(guard);
            done.send(()).unwrap();
        });
        is_stuck.recv_timeout(Duration::from_secs(30)).expect("nothing was written");
        is_done.recv_timeout(Duration::from_secs(30)).expect("the program is held up");
    }
}
