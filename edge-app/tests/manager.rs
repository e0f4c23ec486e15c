//! The daemon as the service manager and the kernel see it, in a process of its own.

use std::fs;
use std::io;
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use flexid_edge::daemon::Daemon;
use flexid_edge::manager::Watchdog;
use flexid_pipeline::config::Config;
use flexid_pipeline::source::{Arrival, Flow, FrameSource, SourceHealth};
use flexid_pipeline::stop::Stop;

/// Nothing here takes nearly as long; a test that waits for it has failed.
const PATIENCE: Duration = Duration::from_secs(30);
/// Variable that makes `daemon` one, and says how its bus ends.
const BUS: &str = "FLEXID_TEST_BUS";
/// Period of the watchdog: the shortest at which each of the reader's messages is due.
const PERIOD: Duration = Duration::from_secs(1);

/// A silent bus. After two seconds it hangs or ends.
struct Silent {
    begun: Instant,
    hangs: bool,
}

impl FrameSource for Silent {
    fn read(&mut self, _: &mut Vec<Arrival>, timeout: Duration) -> io::Result<Flow> {
        thread::sleep(timeout);
        if self.begun.elapsed() < Duration::from_secs(2) {
            return Ok(Flow::Open);
        }
        if self.hangs {
            thread::sleep(Duration::MAX);
        }
        Ok(Flow::Ended)
    }

    fn health(&self) -> SourceHealth {
        SourceHealth::default()
    }
}

/// No test, but the daemon that the others start.
#[test]
fn daemon() {
    let Ok(bus) = std::env::var(BUS) else { return };
    tracing_subscriber::fmt().with_writer(io::stderr).init();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-tools/scenario/mill3-edge.toml");
    let (config, stop) = (Config::load(&file).unwrap(), Stop::new());
    let watchdog = Watchdog::of_this_process();
    let daemon = Daemon {
        config: &config,
        listeners: &[],
        stop: &stop,
        reload: None,
        store: None,
        watchdog,
    };
    daemon.run(&mut Silent { begun: Instant::now(), hangs: bus == "hangs" }).unwrap();
}

/// Starts the daemon by `command`, which runs what follows its own arguments.
fn start(mut command: Command, bus: &str) -> Child {
    command.arg(std::env::current_exe().unwrap());
    command.args(["--exact", "daemon", "--nocapture"]).env(BUS, bus);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

/// The watchdog hears of the reader while it reads, and nothing once it hangs, although all other threads run on.
#[test]
fn a_reader_that_hangs_is_not_heard() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("notify");
    let manager = UnixDatagram::bind(&path).unwrap();
    manager.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut command = Command::new("env");
    command.env("NOTIFY_SOCKET", &path).env("WATCHDOG_USEC", PERIOD.as_micros().to_string());
    let mut daemon = start(command, "hangs");
    let mut heard = 0;
    let mut buffer = [0; 64];
    while let Ok(bytes) = manager.recv(&mut buffer) {
        assert_eq!(&buffer[..bytes], b"WATCHDOG=1\n");
        heard += 1;
        manager.set_read_timeout(Some(3 * PERIOD)).unwrap();
    }
    assert_eq!(daemon.try_wait().unwrap(), None, "it still runs");
    daemon.kill().unwrap();
    daemon.wait().unwrap();
    assert!((2..=4).contains(&heard), "{heard}");
}

/// Returns the scheduling policy of the solver in a process, proc(5).
fn policy_of_the_solver(process: u32) -> Option<String> {
    fs::read_dir(format!("/proc/{process}/task")).ok()?.find_map(|task| {
        let stat = fs::read_to_string(task.ok()?.path().join("stat")).ok()?;
        let (_, rest) = stat.split_once("(flexid-solver) ")?;
        rest.split(' ').nth(38).map(str::to_owned)
    })
}

#[test]
fn the_solver_makes_way() {
    let daemon = start(Command::new("env"), "ends");
    let begun = Instant::now();
    // SCHED_IDLE is 5.
    while policy_of_the_solver(daemon.id()).as_deref() != Some("5") {
        assert!(begun.elapsed() < PATIENCE, "{:?}", policy_of_the_solver(daemon.id()));
        thread::sleep(Duration::from_millis(20));
    }
    let log = log_of(daemon);
    assert!(!log.contains("SCHED_IDLE"), "{log}");
}

/// strace stands for a filter of system calls.
#[test]
fn a_solver_that_may_not_make_way_says_so() {
    let mut command = Command::new("strace");
    command.args(["-f", "-qq", "-o", "/dev/null", "-e", "inject=sched_setscheduler:error=EPERM"]);
    let log = log_of(start(command, "ends"));
    let line = "the solver has the priority of the other threads: SCHED_IDLE is refused: ";
    assert!(log.contains(line), "{log}");
}

/// Waits for the end of a daemon. Returns its log.
fn log_of(daemon: Child) -> String {
    let output = daemon.wait_with_output().unwrap();
    let log = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{log}");
    log
}
