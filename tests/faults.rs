//! Faults of a real bus, and of clients, while the daemon runs. The daemon reports each in one line, goes on, and
//! keeps the data already taken.
//!
//! The robot is a recording made by an independent engine, played by canplayer, so that the bus can be
//! broken between two experiments.

use std::cell::RefCell;
use std::fs;
use std::io::{ErrorKind, Read, Write};
use std::net::Shutdown;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixDatagram, UnixStream};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use flexid_hil::bench::{ADDRESS, Bench};
use flexid_hil::bus::{self, ip_link, test};
use flexid_hil::process::{Program, until};
use flexid_hil::report::Report;
use flexid_hil::truth::{Bounds, Truth};
use nix::sys::signal::Signal;

fn main() -> ExitCode {
    bus::main(vec![
        test("link_down_and_up", link_down_and_up),
        test("each_trouble_is_logged_and_its_end", each_trouble_is_logged_and_its_end),
        test("can_fd_frames_are_taken", can_fd_frames_are_taken),
        test("interface_deleted_and_made_again", interface_deleted_and_made_again),
        test("interface_missing_at_start", interface_missing_at_start),
        test("what_may_mend_itself_is_no_bad_input", what_may_mend_itself_is_no_bad_input),
        test("frames_of_wrong_length", frames_of_wrong_length),
        test("client_sends_rubbish", client_sends_rubbish),
        test("client_reads_nothing", client_reads_nothing),
        test("killed_and_started_again", killed_and_started_again),
        test("config_read_again", config_read_again),
        test("client_may_not_connect", client_may_not_connect),
    ])
}

fn link_down_and_up() -> Result<()> {
    run_with_fault(|_| {
        ip_link("set vcan0 down")?;
        std::thread::sleep(Duration::from_secs(2));
        ip_link("set vcan0 up")
    })?;
    Ok(())
}

/// Each trouble is logged the second time as the first. A link that is up without a carrier is that of a bus-off
/// controller.
fn each_trouble_is_logged_and_its_end() -> Result<()> {
    bus::restore()?;
    let bench = Bench::scenario()?;
    let edge = bench.edge()?;
    let logged = |what: &str, times: usize| {
        until(what, Duration::from_secs(20), || Ok(edge.errors()?.matches(what).count() >= times))
    };
    for time in 1..=2 {
        ip_link("set vcan0 down")?;
        logged("the link of vcan0 is down: `ip link set vcan0 up`", time)?;
        ip_link("set vcan0 up")?;
        logged("the link is up again", 2 * time - 1)?;
        ip_link("set vcan0 state dormant")?;
        logged("vcan0 is bus-off: ", time)?;
        ip_link("set vcan0 state up")?;
        logged("the link is up again", 2 * time)?;
    }
    bench.stop(edge)?;
    Ok(())
}

/// Only a socket that enables CAN FD receives these frames. Their payload has the layout of the DBC file.
fn can_fd_frames_are_taken() -> Result<()> {
    bus::restore()?;
    let bench = Bench::recording(&nominal())?;
    let log = fs::read_to_string(bench.path("exp_00.log"))?;
    fs::write(bench.path("fd.log"), log.replace('#', "##1"))?;
    let edge = bench.edge()?;
    bench.play("fd.log", "can0")?;
    let report = bench.identified(1, Duration::from_secs(60))?;
    ensure!(report.fit.frames == 2 * 8192, "{} frames taken", report.fit.frames);
    bench.stop(edge)?;
    Ok(())
}

fn interface_deleted_and_made_again() -> Result<()> {
    run_with_fault(|_| {
        ip_link("delete vcan0")?;
        std::thread::sleep(Duration::from_secs(2));
        bus::restore()
    })?;
    Ok(())
}

/// The exit status is 2. One line names the interface and its place in the configuration.
fn interface_missing_at_start() -> Result<()> {
    let bench = Bench::scenario()?;
    bench.configure("\"vcan0\"", "\"can7\"")?;
    let edge = bench.start("edge", "flexid-edge", ["--config", "edge.toml"])?;
    let ended = edge.wait(Duration::from_secs(10))?;
    ensure!(ended.status.code() == Some(2), "{}: {}", ended.status, ended.errors);
    ensure!(ended.errors.lines().count() == 1, "not one line: {}", ended.errors);
    for part in ["edge.toml", "[bus] interface", "can7"] {
        ensure!(ended.errors.contains(part), "does not name {part}: {}", ended.errors);
    }
    ensure!(!bench.path("flexid.sock").exists(), "a socket of a daemon that did not start");
    Ok(())
}

/// systemd starts the daemon again after exit status 1, and never after 2: that of a file or address that another attempt may get. A
/// state that cannot be read stays.
fn what_may_mend_itself_is_no_bad_input() -> Result<()> {
    bus::restore()?;
    let bench = Bench::scenario()?;
    bench.configure("[bus]", "[state]\nfile = \"flexid.state\"\n\n[bus]")?;
    let ends = |command: &str, arguments: &[&str], why: &[&str]| {
        let ended = bench.start("second", command, arguments)?.wait(Duration::from_secs(20))?;
        ensure!(ended.status.code() == Some(1), "{}: {}", ended.status, ended.errors);
        let last = ended.errors.lines().last().unwrap_or_default();
        for part in why {
            ensure!(last.contains(part), "does not say {part}: {}", ended.errors);
        }
        Ok(())
    };
    let edge = bench.edge()?;
    let second = ["--config", "edge.toml"];
    ends("flexid-edge", &second, &["flexid.sock: somebody listens there already"])?;
    bench.configure("flexid.sock", "other.sock")?;
    ends("flexid-edge", &second, &["flexid.state: another flexid-edge keeps its numbers there"])?;
    bench.stop(edge)?;

    // Too little for the stacks of the reader and the solver.
    let little = ["--as=81920000", "flexid-edge", "--config", "edge.toml"];
    ends("prlimit", &little, &["the thread flexid-", " cannot be started: ", "64 MiB"])?;

    fs::write(bench.path("flexid.state"), "no permission to read it")?;
    fs::set_permissions(bench.path("flexid.state"), fs::Permissions::from_mode(0o000))?;
    // Root without its capabilities is a user like any other.
    let user = ["--bounding-set=-all", "--inh-caps=-all", "flexid-edge", "--config", "edge.toml"];
    ends("setpriv", &user, &["flexid.state: cannot be read: Permission denied"])?;
    ensure!(bench.path("flexid.state").exists(), "the state was put aside");
    Ok(())
}

/// Two frames are shorter than in the DBC file. The others ask for data, with and without the bit of a request, or have
/// unknown identifiers.
fn frames_of_wrong_length() -> Result<()> {
    let report = run_with_fault(|_| {
        for frame in ["101#00", "102#", "101#R", "111#0011", "7FF#0011223344556677", "00000101#00"]
        {
            bus::send(frame)?;
        }
        Ok(())
    })?;
    let warned = report.warning_kinds.iter().any(|kind| kind["wrong_length"]["frames"] == 2);
    ensure!(warned, "the report does not warn of wrong lengths: {:?}", report.warnings);
    Ok(())
}

/// A client sends bytes that are no message, a length that would fill the memory, and the beginning of a message.
fn client_sends_rubbish() -> Result<()> {
    run_with_fault(|bench| {
        for rubbish in
            [&[0xFF; 4096][..], b"GET / HTTP/1.1\r\n\r\n", &[0xFF, 0xFF, 0xFF, 0x7F], &[0]]
        {
            let mut client = UnixStream::connect(bench.path("flexid.sock"))?;
            client.set_read_timeout(Some(Duration::from_secs(10)))?;
            // The daemon may close the connection before it has read all of it.
            let _ = client.write_all(rubbish);
            client.shutdown(Shutdown::Write)?;
            let ended = client.read_to_end(&mut Vec::new());
            ensure!(
                !matches!(&ended, Err(error) if error.kind() == ErrorKind::WouldBlock),
                "the daemon keeps a client that sent rubbish and is gone"
            );
        }
        let log = fs::read_to_string(bench.path("edge.err"))?;
        let lines = log.matches("a client was dropped: ").count();
        ensure!(lines == 1, "{lines} lines of four clients in a minute: {log}");
        Ok(())
    })?;
    Ok(())
}

/// Twenty clients never read a byte, from the first experiment to the end.
fn client_reads_nothing() -> Result<()> {
    let clients = RefCell::new(Vec::new());
    run_with_fault(|bench| {
        for _ in 0..20 {
            clients.borrow_mut().push(UnixStream::connect(bench.path("flexid.sock"))?);
        }
        Ok(())
    })?;
    Ok(())
}

/// SIGKILL ends the daemon after the first experiment. The next daemon reports at once what the first had found, and
/// goes on.
fn killed_and_started_again() -> Result<()> {
    run_with(|bench, edge| {
        bench.identified(1, Duration::from_secs(60))?;
        edge.signal(Signal::SIGKILL)?;
        let ended = edge.wait(Duration::from_secs(10))?;
        ensure!(ended.errors.contains("INFO"), "no log: {}", ended.errors);
        let verdicts = ended.errors.lines().find(|line| line.contains("χ²/dof"));
        ensure!(verdicts.is_some(), "the log has no verdict: {}", ended.errors);
        let edge = bench.edge()?;
        let report = bench.identified(1, Duration::from_secs(10))?;
        ensure!(report.fit.records == 1 && report.fit.frames > 0, "{:?}", report.fit);
        Ok(edge)
    })?;
    Ok(())
}

/// At SIGHUP the daemon names a bad config and keeps the old one, and takes a good one. The service manager gets both
/// messages.
fn config_read_again() -> Result<()> {
    let manager = tempfile::tempdir()?;
    let manager = UnixDatagram::bind(manager.path().join("notify"))?;
    manager.set_read_timeout(Some(Duration::from_secs(10)))?;
    let hears = |wanted: &str| {
        let mut buffer = [0; 256];
        let bytes = manager.recv(&mut buffer).context("the service manager hears nothing")?;
        let heard = String::from_utf8_lossy(&buffer[..bytes]);
        ensure!(heard.starts_with(wanted), "the service manager hears {heard:?}, not {wanted}");
        Ok(())
    };
    run_with(|bench, edge| {
        bench.stop(edge)?;
        let notify = manager.local_addr()?;
        let notify = notify.as_pathname().context("a socket without a name")?;
        let notify = format!("NOTIFY_SOCKET={}", notify.display());
        let edge = bench.start("edge", "env", [&notify, "flexid-edge", "--config", "edge.toml"])?;
        hears("READY=1")?;
        let good = fs::read_to_string(bench.path("edge.toml"))?;
        for (config, log) in [
            ("[model]", "goes on with the old config: edge.toml:"),
            (good.as_str(), "edge.toml: read again"),
        ] {
            fs::write(bench.path("edge.toml"), config)?;
            edge.signal(Signal::SIGHUP)?;
            hears("RELOADING=1\nMONOTONIC_USEC=")?;
            hears("READY=1")?;
            until(log, Duration::from_secs(5), || Ok(edge.errors()?.contains(log)))?;
        }
        Ok(edge)
    })?;
    hears("STOPPING=1")
}

/// A client that may not write to the socket gets a message with the reason and the remedy.
fn client_may_not_connect() -> Result<()> {
    bus::restore()?;
    let bench = Bench::scenario()?;
    let edge = bench.edge()?;
    fs::set_permissions(bench.path("flexid.sock"), fs::Permissions::from_mode(0o000))?;
    // Root without its capabilities is a user like any other.
    let watch = ["--bounding-set=-all", "--inh-caps=-all", "flexid", "watch", ADDRESS];
    let ended = bench.start("watch", "setpriv", watch)?.wait(Duration::from_secs(20))?;
    ensure!(ended.status.code() == Some(1), "{}: {}", ended.status, ended.errors);
    for part in ["may not connect", "socket_group"] {
        ensure!(ended.errors.contains(part), "does not say {part}: {}", ended.errors);
    }
    bench.stop(edge)?;
    Ok(())
}

/// Runs three experiments with `fault` after the first. The robot is found from all three, no frame is lost, and the
/// daemon ends cleanly.
fn run_with_fault(fault: impl FnOnce(&Bench) -> Result<()>) -> Result<Report> {
    run_with(|bench, edge| {
        fault(bench)?;
        Ok(edge)
    })
}

/// Runs three experiments with a fault of the daemon after the first. `fault` returns the daemon that goes on.
fn run_with(fault: impl FnOnce(&Bench, Program) -> Result<Program>) -> Result<Report> {
    bus::restore()?;
    let recording = nominal();
    let bench = Bench::recording(&recording)?;
    bench.configure("[bus]", "[state]\nfile = \"flexid.state\"\n\n[bus]")?;
    let edge = bench.edge()?;
    bench.play("exp_00.log", "can0")?;
    let mut edge = fault(&bench, edge)?;
    // The daemon may take a moment to find the bus again.
    std::thread::sleep(Duration::from_secs(3));
    edge.still_runs()?;
    bench.play("exp_01.log", "can0")?;
    bench.play("exp_02.log", "can0")?;
    let report = bench.identified(3, Duration::from_secs(120))?;
    bench.stop(edge)?;

    let truth = fs::read_to_string(recording.join("truth.json"))?;
    let truth = Truth::of_recording(&serde_json::from_str(&truth)?)?;
    let deviation = truth.parameter_deviation(&report, &Bounds::of(&bench.path("edge.toml"))?)?;
    ensure!(report.fit.records == 3, "{} records of three", report.fit.records);
    ensure!(report.fit.frames == 3 * 2 * 8192, "{} frames taken", report.fit.frames);
    ensure!(report.fit.frames_lost == 0, "{} frames lost", report.fit.frames_lost);
    ensure!(deviation <= 0.005, "parameter deviation {deviation}");
    Ok(report)
}

/// Folder of the recording.
fn nominal() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings/nominal")
}
