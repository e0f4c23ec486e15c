//! The main job on a real CAN bus: the simulated robot, the daemon and the readout are three processes,
//! and a candump listens beside them.

use std::fs;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use flexid_hil::bench::Bench;
use flexid_hil::bus::{self, INTERFACE, test};
use flexid_hil::process::until;
use flexid_hil::truth::{Bounds, Truth};

fn main() -> ExitCode {
    bus::main(vec![
        test("frames_cross_the_bus", frames_cross_the_bus),
        test("robot_daemon_readout", robot_daemon_readout),
        test("test_bench_of_the_manual", test_bench_of_the_manual),
        test("simulated_log_replays", simulated_log_replays),
        test("nothing_is_sent_where_a_robot_may_listen", nothing_is_sent_where_a_robot_may_listen),
    ])
}

/// Frames cross the bus without flexid. Otherwise the other tests prove nothing.
fn frames_cross_the_bus() -> Result<()> {
    let bench = Bench::empty()?;
    let listener = bench.candump(INTERFACE)?;
    bus::send("101#00112233AABBCCDD")?;
    bus::send("7FF#")?;
    until("both frames arrive", Duration::from_secs(5), || {
        let log = listener.output()?;
        Ok(log.contains(" vcan0 101#00112233AABBCCDD\n") && log.contains(" vcan0 7FF#\n"))
    })
}

/// At the real rate and with the solver running, the truth is found, no frame is lost, and the end is clean.
fn robot_daemon_readout() -> Result<()> {
    let bench = Bench::scenario()?;
    let listener = bench.candump(INTERFACE)?;
    let edge = bench.edge()?;
    let robot = bench.flexid("robot", ["simulate", "--config", "edge.toml", "--can", INTERFACE])?;
    let report = bench.identified(3, Duration::from_secs(180))?;
    robot.succeed(Duration::from_secs(20))?;
    bench.stop(edge)?;

    let scenario = bench.path("mill3.toml");
    let truth = Truth::of_scenario(&scenario)?;
    let deviation = truth.parameter_deviation(&report, &Bounds::of(&scenario)?)?;
    let heard =
        || Ok::<_, anyhow::Error>(listener.output()?.lines().filter(is_measurement).count());
    until("candump writes what it heard", Duration::from_secs(5), || Ok(heard()? >= 3 * 2 * 8192))?;
    let heard = heard()? as u64;
    println!("parameter deviation {deviation:.5}; {heard} frames heard, {:?}", report.fit);
    ensure!(deviation <= 0.005, "parameter deviation {deviation}");
    let log = listener.output()? + &listener.errors()?;
    ensure!(!log.contains("DROPCOUNT"), "candump missed frames");
    ensure!(heard == 3 * 2 * 8192, "the robot sent {heard} frames");
    ensure!(report.fit.frames == heard, "{} frames taken, {heard} heard", report.fit.frames);
    ensure!(report.fit.frames_lost == 0, "{} frames lost", report.fit.frames_lost);
    ensure!(report.fit.records == 3, "{} records", report.fit.records);
    Ok(())
}

/// The test runs the commands that the manual gives for a test bench, word for word.
fn test_bench_of_the_manual() -> Result<()> {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../host-tools/docs/simulate.md");
    let recipe = fs::read_to_string(page).context(page)?;
    let (_, recipe) = recipe.split_once("## On a test bench\n").context("no test bench")?;
    let (_, recipe) = recipe.split_once("```sh\n").context("no commands")?;
    let (recipe, _) = recipe.split_once("```").context("commands without end")?;
    ensure!(recipe.contains("candump") && recipe.contains("flexid watch"), "{recipe}");
    let bench = Bench::scenario()?;
    bench
        .start("recipe", "bash", ["-euo", "pipefail", "-c", recipe])?
        .succeed(Duration::from_secs(240))?;
    Ok(())
}

/// canplayer sends every frame of a log that `simulate --candump` writes.
fn simulated_log_replays() -> Result<()> {
    let bench = Bench::scenario()?;
    // The test has one experiment: candump writes 5,000 frames a second in a guest kernel, canplayer sends 4,000.
    let simulate =
        ["simulate", "--config", "edge.toml", "--experiments", "1", "--candump", "robot.log"];
    bench.flexid("simulate", simulate)?.succeed(Duration::from_secs(120))?;
    let listener = bench.candump(INTERFACE)?;
    bench.play("robot.log", INTERFACE)?;
    let written = fs::read_to_string(bench.path("robot.log"))?;
    let written = frames(&written);
    let heard = || Ok::<_, anyhow::Error>(frames(&listener.output()?).len());
    until("the last frame arrives", Duration::from_secs(5), || Ok(heard()? >= written.len()))
        .with_context(|| format!("{:?} of {} frames heard", heard(), written.len()))?;
    ensure!(frames(&listener.output()?) == written, "canplayer sent other frames");
    Ok(())
}

/// A vxcan leads out of this network. As with a robot's bus, it is unknown who listens at the other end.
fn nothing_is_sent_where_a_robot_may_listen() -> Result<()> {
    let bench = Bench::scenario()?;
    let link =
        "ip link add can7 type vxcan peer name can8 && ip link set can7 up && ip link set can8 up";
    bench.start("link", "sh", ["-c", link])?.succeed(Duration::from_secs(10))?;
    let listener = bench.candump("can8")?;
    let simulate = ["simulate", "--config", "edge.toml", "--experiments", "1", "--can", "can7"];
    let refused = bench.flexid("refused", simulate)?.wait(Duration::from_secs(20))?;
    ensure!(refused.status.code() == Some(2), "{:?}", refused);
    for part in ["--can can7: ", "of kind \"vxcan\"", "--onto-real-bus"] {
        ensure!(refused.errors.contains(part), "{:?} does not say {part:?}", refused.errors);
    }
    ensure!(refused.errors.lines().count() == 1, "{}", refused.errors);
    std::thread::sleep(Duration::from_millis(200)); // candump receives the frames under way
    ensure!(listener.output()?.is_empty(), "sent: {}", listener.output()?);

    let allowed = simulate.into_iter().chain(["--onto-real-bus"]);
    bench.flexid("allowed", allowed)?.succeed(Duration::from_secs(60))?;
    until("the frames arrive", Duration::from_secs(5), || {
        Ok(listener.output()?.lines().count() >= 2 * 8192)
    })?;
    let unlink = bench.start("unlink", "ip", ["link", "del", "can7"])?;
    unlink.succeed(Duration::from_secs(10))?;
    Ok(())
}

/// Identifier and data of every frame of a log.
fn frames(log: &str) -> Vec<&str> {
    log.lines().filter_map(|line| line.split_whitespace().nth(2)).collect()
}

/// Returns whether a line of a log is a force or an acceleration.
fn is_measurement(line: &&str) -> bool {
    [" 101#", " 102#"].iter().any(|identifier| line.contains(identifier))
}
