//! The daemon's program with files that are not what they should be. It needs no bus, since it reads them before.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

/// Nothing here takes nearly as long; a test that waits for it has failed.
const PATIENCE: Duration = Duration::from_secs(30);
const EDGE: &str = env!("CARGO_BIN_EXE_flexid-edge");

fn start(command: &mut Command) -> Child {
    let command = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().unwrap_or_else(|error| panic!("{:?}: {error}", command.get_program()))
}

/// Waits for the end.
fn end(mut child: Child) -> Output {
    let begun = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begun.elapsed() > PATIENCE {
            child.kill().unwrap();
            panic!("it still runs: {:?}", child.wait_with_output());
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    child.wait_with_output().unwrap()
}

/// On a pipe the daemon would wait for ever.
#[test]
fn a_pipe_is_no_configuration() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("edge.toml");
    nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).unwrap();
    let output = end(start(Command::new(EDGE).arg("--config").arg(&pipe)));
    assert_eq!(output.status.code(), Some(2));
    let expected =
        format!("flexid-edge: {}: is a pipe or a device: name a regular file\n", pipe.display());
    assert_eq!(String::from_utf8(output.stderr).unwrap(), expected);
}

/// It would have nowhere to leave its findings.
#[test]
fn a_history_needs_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-tools/scenario");
    for name in ["mill3-edge.toml", "mill3-model.toml", "mill3.dbc"] {
        fs::copy(scenario.join(name), folder.path().join(name)).unwrap();
    }
    let config = folder.path().join("mill3-edge.toml");
    let text = fs::read_to_string(&config).unwrap();
    fs::write(&config, text + "\n[history]\nepoch = \"1d\"\n").unwrap();
    let mut edge = Command::new(EDGE);
    let output = end(start(edge.env_remove("STATE_DIRECTORY").arg("--config").arg(&config)));
    assert_eq!(output.status.code(), Some(2));
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(error.contains("mill3-edge.toml: [history] folder is missing"), "{error}");
}

/// A file system hangs while the configuration is read: one SIGTERM ends the daemon all the same.
#[test]
fn sigterm_ends_a_daemon_whose_configuration_hangs() {
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("edge.toml");
    fs::write(&config, "").unwrap();
    // strace stands for the file system: each open of this file is interrupted, and tried again for ever.
    let mut strace = Command::new("strace");
    strace.args(["-f", "-qq", "-o", "/dev/null", "-e", "inject=openat:error=EINTR"]);
    let strace = start(strace.arg("-P").arg(&config).arg(EDGE).arg("--config").arg(&config));
    let begun = Instant::now();
    let daemon = loop {
        assert!(begun.elapsed() < PATIENCE, "the daemon does not read its configuration");
        if let Some(daemon) = reading(strace.id()) {
            break daemon;
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    kill(Pid::from_raw(daemon), Signal::SIGTERM).unwrap();
    let output = end(strace);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
}

/// Returns the child of the process `parent`, once it has a thread that reads a configuration.
fn reading(parent: u32) -> Option<i32> {
    let children = fs::read_to_string(format!("/proc/{parent}/task/{parent}/children")).ok()?;
    let child: i32 = children.split_whitespace().next()?.parse().ok()?;
    let mut tasks = fs::read_dir(Path::new("/proc").join(child.to_string()).join("task")).ok()?;
    let reads = tasks.any(|task| {
        let name = task.ok().and_then(|task| fs::read_to_string(task.path().join("comm")).ok());
        name.is_some_and(|name| name == "flexid-config\n")
    });
    reads.then_some(child)
}
