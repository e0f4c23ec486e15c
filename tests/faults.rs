//! What goes wrong on a real bus, and with clients, while the daemon runs: it says so in one line, goes on,
//! and keeps the data already taken.
//!
//! The robot is a recording made by an independent engine, played by canplayer, so that the bus can be
//! broken between two experiments.

use std::cell::RefCell;
use std::fs;
use std::io::{ErrorKind, Read, Write};
use std::net::Shutdown;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Result, ensure};
use flexid_hil::bench::Bench;
use flexid_hil::bus::{self, ip_link, test};
use flexid_hil::report::Report;
use flexid_hil::truth::{Bounds, Truth};

fn main() -> ExitCode {
    bus::main(vec![
        test("link_down_and_up", link_down_and_up),
        test("interface_deleted_and_made_again", interface_deleted_and_made_again),
        test("interface_missing_at_start", interface_missing_at_start),
        test("frames_of_wrong_length", frames_of_wrong_length),
        test("client_sends_rubbish", client_sends_rubbish),
        test("client_reads_nothing", client_reads_nothing),
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

fn interface_deleted_and_made_again() -> Result<()> {
    run_with_fault(|_| {
        ip_link("delete vcan0")?;
        std::thread::sleep(Duration::from_secs(2));
        bus::restore()
    })?;
    Ok(())
}

/// Exit status 2 and one line that names the interface and where it is configured.
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

/// Shorter than the DBC says, empty, a request without data, and identifiers that it does not know.
fn frames_of_wrong_length() -> Result<()> {
    let report = run_with_fault(|_| {
        for frame in ["101#00", "102#", "101#R", "111#0011", "7FF#0011223344556677", "00000101#00"]
        {
            bus::send(frame)?;
        }
        Ok(())
    })?;
    let told = report.warnings.iter().any(|one| one.starts_with("3 frames of another length"));
    ensure!(told, "the report does not warn of wrong lengths: {:?}", report.warnings);
    Ok(())
}

/// Bytes that are no message, a length that would fill the memory, and a hang-up in mid-message.
fn client_sends_rubbish() -> Result<()> {
    run_with_fault(|bench| {
        for rubbish in
            [&[0xFF; 4096][..], b"GET / HTTP/1.1\r\n\r\n", &[0xFF, 0xFF, 0xFF, 0x7F], &[0]]
        {
            let mut client = UnixStream::connect(bench.path("flexid.sock"))?;
            client.set_read_timeout(Some(Duration::from_secs(10)))?;
            // The daemon may hang up before it has read all of it.
            let _ = client.write_all(rubbish);
            client.shutdown(Shutdown::Write)?;
            let ended = client.read_to_end(&mut Vec::new());
            ensure!(
                !matches!(&ended, Err(error) if error.kind() == ErrorKind::WouldBlock),
                "the daemon keeps a client that sent rubbish and is gone"
            );
        }
        Ok(())
    })?;
    Ok(())
}

/// Twenty clients that never read a byte, from the first experiment to the end.
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

/// Three experiments with `fault` after the first: the robot is found from all three, nothing is lost,
/// and the daemon ends cleanly.
fn run_with_fault(fault: impl FnOnce(&Bench) -> Result<()>) -> Result<Report> {
    bus::restore()?;
    let recording = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/recordings/nominal"));
    let bench = Bench::recording(recording)?;
    let mut edge = bench.edge()?;
    bench.play("exp_00.log", "can0")?;
    fault(&bench)?;
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
