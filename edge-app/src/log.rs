//! The log on stderr. It never blocks the program: lines that are not read are lost.

use std::io::{Write, stderr};

use anstream::{AutoStream, ColorChoice};
use tracing::Subscriber;
use tracing_appender::non_blocking::{NonBlocking, WorkerGuard};
use tracing_subscriber::EnvFilter;

/// Logs to stderr from here on, as `RUST_LOG` selects. The writer is for a last line. The guard flushes for a second at most.
pub(crate) fn start() -> (NonBlocking, WorkerGuard) {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("info"));
    // Colours are for a terminal, as far as NO_COLOR, CLICOLOR and TERM allow.
    let colours = AutoStream::choice(&stderr()) != ColorChoice::Never;
    let (subscriber, writer, guard) = lossy(stderr(), filter, colours);
    // It fails only if there is a logger already, which never happens in a program that has just begun.
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
    use std::fs::File;
    use std::io::{self, Read as _};
    use std::process::{Command, Stdio};
    use std::sync::mpsc::{Receiver, Sender, channel};
    use std::thread;
    use std::time::Duration;

    use nix::pty::openpty;
    use tracing::info;

    use super::*;

    /// Takes a line and blocks, as a pipe that is not read.
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
        // The test has a thread of its own, which would never end if the log blocked it.
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

    /// Runs the test of the colours by itself with a terminal as its stderr and `variable` set. Returns what it logs there.
    fn logged_with(variable: &str, value: &str) -> String {
        let terminal = openpty(None, None).unwrap();
        let mut child = Command::new(std::env::current_exe().unwrap());
        child.args([
            "--exact",
            "log::tests::colours_are_for_terminals_that_want_them",
            "--nocapture",
        ]);
        for inherited in ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE", "RUST_LOG"] {
            child.env_remove(inherited);
        }
        child.env(LOGS, "yes").env("TERM", "xterm").env(variable, value);
        child.stdout(Stdio::null()).stderr(terminal.slave);
        let status = child.status().unwrap();
        drop(child);
        assert!(status.success());
        let mut said = Vec::new();
        // The other end is closed, so that the read ends with EIO after all that was written.
        let _ = File::from(terminal.master).read_to_end(&mut said);
        String::from_utf8(said).unwrap()
    }

    /// Environment variable that makes a child log a line.
    const LOGS: &str = "FLEXID_TEST_LOGS";

    #[test]
    fn colours_are_for_terminals_that_want_them() {
        if std::env::var_os(LOGS).is_some() {
            let (_writer, guard) = start();
            info!("a line");
            drop(guard);
            return;
        }
        for (variable, value, coloured) in
            [("LANG", "C", true), ("NO_COLOR", "1", false), ("CLICOLOR", "0", false)]
        {
            let said = logged_with(variable, value);
            assert!(said.contains("a line"), "{said:?}");
            assert_eq!(said.contains('\x1b'), coloured, "{variable}={value}: {said:?}");
        }
    }
}
