//! The log on stderr. It never blocks the program: lines that are not read are lost.

use std::fmt;
use std::fs::File;
use std::io::{Write, stderr};
use std::os::fd::AsFd;
use std::os::unix::fs::MetadataExt;

use anstream::{AutoStream, ColorChoice};
use tracing::{Event, Level, Subscriber};
use tracing_appender::non_blocking::{NonBlocking, WorkerGuard};
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt::format::{FormatEvent, FormatFields, Writer};
use tracing_subscriber::fmt::{self as layer, FmtContext};
use tracing_subscriber::layer::SubscriberExt as _;
use tracing_subscriber::registry::{LookupSpan, Registry};

/// Environment variable in which systemd names the stream that leads to the journal: `device:inode`.
const JOURNAL: &str = "JOURNAL_STREAM";

/// The log. It is flushed for a second at most when it is dropped.
pub(crate) struct Log {
    writer: NonBlocking,
    style: Style,
    _guard: WorkerGuard,
}

/// Form of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Style {
    /// Priority in front, by which the journal files a line. The journal notes the time.
    Journal,
    /// Time, level and place.
    Plain,
    /// Time, level and place in colour, for a terminal.
    Coloured,
}

impl Log {
    /// Logs to stderr from here on what `RUST_LOG` selects, or else from the level `info` on.
    pub(crate) fn start() -> Self {
        let selected = std::env::var("RUST_LOG").ok().and_then(|targets| targets.parse().ok());
        let filter = selected.unwrap_or_else(|| Targets::new().with_default(Level::INFO));
        // Colours are for a terminal, as far as NO_COLOR, CLICOLOR and TERM allow.
        let style = match AutoStream::choice(&stderr()) {
            _ if is_journal() => Style::Journal,
            ColorChoice::Never => Style::Plain,
            _ => Style::Coloured,
        };
        let (subscriber, writer, guard) = lossy(stderr(), filter, style);
        // It fails only if there is a logger already, which never happens in a program that has just begun.
        let _ = tracing::subscriber::set_global_default(subscriber);
        Self { writer, style, _guard: guard }
    }

    /// Writes the error with which the program ends, on one line.
    pub(crate) fn end(&mut self, line: &str) {
        let priority = if self.style == Style::Journal { priority(Level::ERROR) } else { "" };
        // The writer neither waits nor fails.
        let _ = writeln!(self.writer, "{priority}{line}");
    }
}

/// Returns whether stderr leads to the journal. A program that is started by a service inherits the variable, but may have another
/// stderr.
fn is_journal() -> bool {
    let stream = stderr().as_fd().try_clone_to_owned().map(File::from);
    let Ok(own) = stream.and_then(|stream| stream.metadata()) else { return false };
    std::env::var(JOURNAL).is_ok_and(|named| named == format!("{}:{}", own.dev(), own.ino()))
}

/// Returns the prefix of a line of this level: its priority, sd-daemon(3).
fn priority(level: Level) -> &'static str {
    match level {
        Level::ERROR => "<3>",
        Level::WARN => "<4>",
        Level::INFO => "<6>",
        _ => "<7>",
    }
}

/// Writes events in the style of the journal.
struct Journal;

impl<S, N> FormatEvent<S, N> for Journal
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(
        &self,
        context: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        writer.write_str(priority(*event.metadata().level()))?;
        context.format_fields(writer.by_ref(), event)?;
        writeln!(writer)
    }
}

fn lossy(
    writer: impl Write + Send + 'static,
    filter: Targets,
    style: Style,
) -> (Box<dyn Subscriber + Send + Sync>, NonBlocking, WorkerGuard) {
    let (writer, guard) = tracing_appender::non_blocking(writer);
    let log = layer::layer().with_writer(writer.clone()).with_ansi(style == Style::Coloured);
    let selected = Registry::default().with(filter);
    let log: Box<dyn Subscriber + Send + Sync> = match style {
        Style::Journal => Box::new(selected.with(log.event_format(Journal))),
        _ => Box::new(selected.with(log)),
    };
    (log, writer, guard)
}

#[cfg(test)]
mod tests {
    use std::io::{self, Read as _};
    use std::process::{Command, Stdio};
    use std::sync::mpsc::{Receiver, Sender, channel};
    use std::thread;
    use std::time::Duration;

    use nix::pty::openpty;
    use tracing::{info, warn};

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
            let filter = Targets::new().with_default(Level::INFO);
            let (subscriber, mut last, guard) = lossy(Stuck(stuck, released), filter, Style::Plain);
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

    /// A run of the test `logs` by itself, which logs.
    fn child() -> Command {
        let mut child = Command::new(std::env::current_exe().unwrap());
        child.args(["--exact", "log::tests::logs", "--nocapture"]).env(LOGS, "yes");
        for inherited in ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE", "RUST_LOG", JOURNAL] {
            child.env_remove(inherited);
        }
        child.stdout(Stdio::null());
        child
    }

    /// Runs the child with a terminal as its stderr and `variable` set. Returns what it logs there.
    fn logged_with(variable: &str, value: &str) -> String {
        let terminal = openpty(None, None).unwrap();
        let mut child = child();
        child.env("TERM", "xterm").env(variable, value).stderr(terminal.slave);
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
    fn logs() {
        if std::env::var_os(LOGS).is_some() {
            let mut log = Log::start();
            info!("a line");
            warn!("a {}", "warning");
            log.end("the last word");
        }
    }

    /// The journal gets priorities and no time. A program that inherits the variable, but has another stderr, logs as ever.
    #[test]
    fn lines_for_the_journal_have_a_priority() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let journal = file.as_file().metadata().unwrap();
        let stream = format!("{}:{}", journal.dev(), journal.ino());
        let stderr = file.as_file().try_clone().unwrap();
        assert!(child().env(JOURNAL, stream).stderr(stderr).status().unwrap().success());
        let said = std::fs::read_to_string(file.path()).unwrap();
        assert_eq!(said, "<6>a line\n<4>a warning\n<3>the last word\n");

        let other = child().env(JOURNAL, "1:1").stderr(Stdio::piped()).output().unwrap();
        let said = String::from_utf8(other.stderr).unwrap();
        assert!(said.contains(" INFO flexid_edge::log::tests: a line\n"), "{said:?}");
        assert!(said.ends_with("\nthe last word\n"), "{said:?}");
    }

    #[test]
    fn colours_are_for_terminals_that_want_them() {
        for (variable, value, coloured) in
            [("LANG", "C", true), ("NO_COLOR", "1", false), ("CLICOLOR", "0", false)]
        {
            let said = logged_with(variable, value);
            assert!(said.contains("a line"), "{said:?}");
            assert_eq!(said.contains('\x1b'), coloured, "{variable}={value}: {said:?}");
        }
    }
}
