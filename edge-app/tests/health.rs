//! `--check` against the daemon's real server, whose news the test makes up.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use std::thread;
use std::time::Duration;

use flexid_edge::latest::Latest;
use flexid_edge::server::{Listener, serve};
use flexid_pipeline::config::Listen;
use flexid_pipeline::stop::Stop;
use flexid_wire::messages::{BusHealth, BusState, FromEdge, Phase, Status};
use flexid_wire::report::Acceptance;
use flexid_wire::state::{Sensor, State};

#[allow(dead_code, reason = "the tests of the client need the rest")]
#[path = "../../host-tools/tests/watch/news.rs"]
mod news;

const EDGE: &str = env!("CARGO_BIN_EXE_flexid-edge");
const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../host-tools/scenario");

/// A folder with the configuration of a daemon, in which `from` is replaced.
fn folder(from: &str, to: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in ["mill3-edge.toml", "mill3-model.toml", "mill3.dbc", "mill3.toml"] {
        fs::copy(Path::new(SCENARIO).join(name), folder.path().join(name)).unwrap();
    }
    let config = folder.path().join("mill3-edge.toml");
    let text = fs::read_to_string(&config).unwrap();
    assert!(text.contains(from), "{text}");
    fs::write(&config, text.replace(from, to)).unwrap();
    folder
}

fn check(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(EDGE);
    command.current_dir(folder).args(["--config", "mill3-edge.toml", "--check"]).args(arguments);
    command.output().unwrap()
}

/// Returns what a check of a daemon with this news says, and its exit status.
fn checked(news: &[FromEdge], arguments: &[&str]) -> (i32, String) {
    let folder = folder("flexid.sock", "flexid.sock");
    let address = Listen::Unix(folder.path().join("flexid.sock"));
    let listeners = [Listener::bind(&address).unwrap()];
    let (latest, stop) = (Latest::new(), Stop::new());
    thread::scope(|scope| {
        scope.spawn(|| serve(&listeners, &latest, &stop));
        // As the daemon does, again and again.
        scope.spawn(|| {
            while !stop.requested() {
                news.iter().for_each(|message| latest.publish(message.clone()));
                thread::sleep(Duration::from_millis(100));
            }
            latest.close();
        });
        let output = check(folder.path(), arguments);
        stop.request();
        said(&output)
    })
}

fn said(output: &Output) -> (i32, String) {
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
    (output.status.code().unwrap(), String::from_utf8(output.stdout.clone()).unwrap())
}

fn status(state: State, newest_record_s: Option<f64>) -> FromEdge {
    let FromEdge::Status(status) = news::status(state) else { unreachable!() };
    FromEdge::Status(Status { uptime_s: 100.0, newest_record_s, ..status })
}

fn bus(state: BusState, frames_per_second: f64) -> FromEdge {
    let FromEdge::BusHealth(bus) = news::bus(state, None) else { unreachable!() };
    FromEdge::BusHealth(BusHealth { frames_per_second, kernel_dropped: 2, ..bus })
}

const MEASURING: State = State::Measuring { implausible: None };
const NUMBERS: &str = "frames_lost=3c kernel_dropped=2c";

#[test]
fn each_trouble_has_its_level() {
    use Acceptance::{Consistent, ModelSuspect, Unsettled};
    let up = || bus(BusState::Up, 4000.4);
    let well = || status(MEASURING, Some(88.0));
    let settled = || news::progress(Phase::Settled, 3);
    let fit = |acceptance| news::report(acceptance, 3);
    let silent = || status(State::SensorSilent(Sensor::Force), Some(88.0));
    let down = || bus(BusState::Down, 0.0);
    let cases = [
        (vec![settled(), fit(Consistent), well(), up()], 0, "newest record 12 s ago, consistent"),
        (vec![fit(Unsettled), well(), up()], 1, "12 s ago, not settled"),
        (vec![fit(ModelSuspect), well(), up()], 1, "12 s ago, MODEL SUSPECT"),
        (
            vec![news::progress(Phase::Searching, 3), fit(Unsettled), well(), up()],
            0,
            "12 s ago, not settled yet",
        ),
        (
            vec![status(MEASURING, None), up()],
            0,
            "no record since the start 100 s ago, nothing identified yet",
        ),
        (vec![silent(), up()], 1, "4000 frames/s, waiting for force frames: they do not come"),
        (vec![well(), bus(BusState::Up, 0.0)], 1, "vcan0 up, 0 frames/s, newest"),
        (vec![settled(), fit(Consistent), well(), down()], 2, "vcan0 down, 0 frames/s"),
        (vec![silent(), bus(BusState::BusOff, 0.0)], 2, "vcan0 bus-off, "),
    ];
    for (news, level, says) in cases {
        let (status, line) = checked(&news, &[]);
        assert_eq!(status, level, "{line}");
        let name = ["OK", "WARNING", "CRITICAL"][level as usize];
        assert!(line.starts_with(&format!("FLEXID {name} - vcan0 ")), "{line}");
        assert!(line.contains(says) && line.contains(NUMBERS), "{says}: {line}");
        assert_eq!((line.matches('\n').count(), line.matches('|').count()), (1, 1), "{line}");
    }
}

#[test]
fn numbers_stand_behind_the_bar() {
    let news = [
        news::progress(Phase::Settled, 3),
        news::report(Acceptance::Consistent, 3),
        status(MEASURING, Some(88.0)),
        bus(BusState::Up, 4000.4),
    ];
    for (arguments, level, limit) in [(&[][..], 0, ""), (&["--max-age", "5"], 1, "5")] {
        let (status, line) = checked(&news, arguments);
        assert_eq!(status, level, "{line}");
        let numbers = format!(
            " | frames_per_second=4000;;;0 {NUMBERS} record_age=12s;{limit};;0 records=3;;;0\n"
        );
        assert!(line.ends_with(&numbers), "{line}");
    }
}

/// A reader that hangs says nothing anew: what it said before is no news.
#[test]
fn old_news_are_none() {
    let folder = folder("flexid.sock", "flexid.sock");
    let listeners = [Listener::bind(&Listen::Unix(folder.path().join("flexid.sock"))).unwrap()];
    let (latest, stop) = (Latest::new(), Stop::new());
    latest.publish(status(MEASURING, None));
    latest.publish(bus(BusState::Up, 4000.0));
    thread::scope(|scope| {
        scope.spawn(|| serve(&listeners, &latest, &stop));
        let (status, line) = said(&check(folder.path(), &[]));
        latest.close();
        stop.request();
        assert_eq!(status, 2, "{line}");
        assert!(line.contains("says nothing"), "{line}");
    });
}

#[test]
fn a_daemon_that_cannot_be_asked_is_critical_or_unknown() {
    let unasked =
        |from: &str, to: &str, arguments: &[&str]| said(&check(folder(from, to).path(), arguments));
    let listen = "listen = [\"unix:flexid.sock\"]";
    for (from, to, level, says) in [
        ("[bus]", "[bus]", 2, "FLEXID CRITICAL - unix:flexid.sock: nobody listens there"),
        ("[bus]", "[buss]", 3, "FLEXID UNKNOWN - mill3-edge.toml:"),
        (listen, "listen = []", 3, "FLEXID UNKNOWN - mill3-edge.toml: "),
    ] {
        let (status, line) = unasked(from, to, &[]);
        assert!(status == level && line.starts_with(says), "{status}: {line}");
        assert_eq!(line.lines().count(), 1, "{line}");
    }
    let output = check(Path::new("/"), &["--max-age", "soon"]);
    assert_eq!(output.status.code(), Some(3), "{output:?}");
}
