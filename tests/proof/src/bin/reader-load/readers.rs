//! Those who read what the daemon finds: a terminal with `flexid watch`, and a page of `flexid web`.

use std::fmt;
use std::fs::{self, File};
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::os::fd::OwnedFd;
use std::process::{Child, Command, Stdio};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, ensure};
use flexid_pipeline::config::Listen;
use nix::pty::{Winsize, openpty};

/// Size of the terminal.
const TERMINAL: Winsize = Winsize { ws_row: 24, ws_col: 80, ws_xpixel: 0, ws_ypixel: 0 };
/// Silence that parts two changes of the page: the parts of one come at once, and changes at least 200 ms apart.
const APART: Duration = Duration::from_millis(50);

/// Programs that read from the daemon.
pub(crate) struct Readers {
    watch: Program,
    web: Program,
    changes: JoinHandle<Vec<Instant>>,
    begun: Instant,
}

/// A program that is ended at the latest when nobody has it any more.
struct Program(Child);

/// The cost of reading.
pub(crate) struct Read {
    seconds: f64,
    watch_seconds: f64,
    web_seconds: f64,
    /// Changes of the page.
    changes: Vec<Instant>,
}

impl Readers {
    /// Starts both. The daemon at `address` need not serve yet.
    pub(crate) fn start(address: &Listen) -> Result<Self> {
        let program = std::env::current_exe()?.with_file_name("flexid");
        ensure!(
            program.exists(),
            "{}: build it first: cargo build --release --bin flexid",
            program.display()
        );
        let address = address.to_string();
        let watch = Program(on_terminal(Command::new(&program).args(["watch", &address]))?);
        let web = Command::new(&program)
            .args(["web", &address, "--listen", "127.0.0.1:0"])
            .stdout(Stdio::piped())
            .spawn()?;
        let mut web = Program(web);
        let mut page = String::new();
        let output = web.0.stdout.take().context("flexid web has no output")?;
        BufReader::new(output).read_line(&mut page)?;
        let host = page.trim().trim_start_matches("http://").trim_end_matches('/').to_owned();
        let mut events = TcpStream::connect(&host)?;
        write!(events, "GET /events HTTP/1.1\r\nHost: {host}\r\n\r\n")?;
        let changes = thread::spawn(move || changes(events));
        Ok(Self { watch, web, changes, begun: Instant::now() })
    }

    /// Ends both.
    pub(crate) fn end(self) -> Result<Read> {
        let Self { mut watch, mut web, changes, begun } = self;
        let seconds = begun.elapsed().as_secs_f64();
        let [watch_seconds, web_seconds] = [watch.cpu_seconds()?, web.cpu_seconds()?];
        drop((watch, web));
        let changes = changes.join().ok().context("the events broke")?;
        Ok(Read { seconds, watch_seconds, web_seconds, changes })
    }
}

impl Program {
    /// CPU time of its threads, s.
    fn cpu_seconds(&mut self) -> Result<f64> {
        ensure!(self.0.try_wait()?.is_none(), "a reader has ended before the daemon");
        let mut on_cpu_ns = 0.0;
        for task in fs::read_dir(format!("/proc/{}/task", self.0.id()))? {
            // A thread may end while it is examined.
            if let Ok(times) = fs::read_to_string(task?.path().join("schedstat")) {
                on_cpu_ns += times.split(' ').next().unwrap_or_default().parse::<f64>()?;
            }
        }
        Ok(on_cpu_ns * 1e-9)
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts a program on a terminal of its own, whose output is read and dropped.
fn on_terminal(command: &mut Command) -> Result<Child> {
    let terminal = openpty(&TERMINAL, None)?;
    let end = || -> Result<Stdio> { Ok(OwnedFd::try_clone(&terminal.slave)?.into()) };
    let child = command
        .env("TERM", "xterm-256color")
        .stdin(end()?)
        .stdout(end()?)
        .stderr(end()?)
        .spawn()?;
    let mut screen = File::from(terminal.master);
    // Reading fails once the program has ended.
    thread::spawn(move || while screen.read(&mut [0; 4096]).is_ok_and(|count| count > 0) {});
    Ok(child)
}

/// When the page has changed, until the events end.
fn changes(mut events: TcpStream) -> Vec<Instant> {
    let (mut changes, mut last) = (Vec::new(), None);
    while events.read(&mut [0; 65536]).is_ok_and(|count| count > 0) {
        let now = Instant::now();
        if last.is_none_or(|last: Instant| now - last > APART) {
            changes.push(now);
        }
        last = Some(now);
    }
    changes
}

impl Read {
    /// Most changes of the page within a second.
    fn most_a_second(&self) -> usize {
        let within = |first: &Instant| {
            let rest = self.changes.iter().filter(|change| *change >= first);
            rest.take_while(|change| **change - *first < Duration::from_secs(1)).count()
        };
        self.changes.iter().map(within).max().unwrap_or_default()
    }
}

impl fmt::Display for Read {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seconds, watch_seconds, web_seconds, changes } = self;
        let [watch, web] = [watch_seconds, web_seconds].map(|cpu| 100.0 * cpu / seconds);
        let (count, most) = (changes.len(), self.most_a_second());
        write!(
            f,
            "flexid watch {watch:.1} % of a core, flexid web {web:.1} %; the page changed {count} times in {seconds:.0} s, up to {most} a second",
        )
    }
}
