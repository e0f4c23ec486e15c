//! The text in the terminal and the lines of `--json`.

use std::thread;

use flexid_edge::latest::Latest;
use flexid_edge::server::{Listener, serve};
use flexid_pipeline::config::Listen;
use flexid_pipeline::stop::Stop;
use flexid_wire::finding::Finding;
use flexid_wire::implausible::{Implausible, SignalFrames};
use flexid_wire::messages::{BusState, FromEdge, Phase};
use flexid_wire::report::Acceptance;
use flexid_wire::spectra::Spectra;
use flexid_wire::state::State;
use flexid_wire::text::clipped;
use flexid_wire::trouble::{BusFault, BusFaultKind, Trouble};
use flexid_wire::warning::Warning;

use super::news::{bus, finding, progress, report, spectra, status};
use super::{flexid, text, watch};

/// Static tests alone are settled from the start: why no record comes is said all the same.
#[test]
fn without_a_record_it_says_what_the_daemon_waits_for() {
    let waiting = "waiting for force frames: none seen";
    let news =
        [status(State::NoForce), progress(Phase::Settled, 0), report(Acceptance::Consistent, 0)];
    let output = watch(&news, "--timeout 1");
    let lines = text(&output.stdout);
    assert!(lines.contains(waiting) && !lines.contains("search ended, 0 records"), "{lines}");
}

#[test]
fn json_speaks_before_the_first_report_and_then_in_reports_alone() {
    let lines = |news: &[FromEdge]| {
        let output = watch(news, "--timeout 1.2 --json");
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let lines = text(&output.stdout);
        let lines = lines.lines().map(|line| serde_json::from_str(line).unwrap());
        lines.collect::<Vec<serde_json::Value>>()
    };
    let early = lines(&[status(State::NoForce), progress(Phase::Searching, 1)]);
    assert_eq!(early.len(), 2, "{early:?}");
    assert_eq!(early[0]["status"]["state"], "waiting for force frames: none seen");
    assert_eq!(early[0]["status"]["state_kind"], "no_force");
    assert_eq!(early[0]["status"]["record_fraction"], 0.25);
    assert_eq!(early[1]["progress"]["phase"], "searching");
    assert_eq!(early[1]["progress"]["fraction"], 0.5);

    let late = lines(&[spectra(3), report(Acceptance::Consistent, 3), status(State::NoForce)]);
    assert_eq!(late.len(), 1, "{late:?}");
    assert_eq!(late[0]["fit"]["records"], 3);
    let FromEdge::Spectra(spectra) = spectra(3) else { unreachable!() };
    let printed: Spectra = serde_json::from_value(late[0]["spectra"].clone()).unwrap();
    assert_eq!(printed, spectra);
    let bare = lines(&[report(Acceptance::Consistent, 3)]);
    assert!(bare[0].get("spectra").is_none(), "{bare:?}");
}

/// A daemon on another machine may send anything.
#[test]
fn no_control_character_reaches_the_terminal() {
    let evil = "\x1b]0;owned\x07\r\n\u{9b}2J\u{202e}";
    let mut finding = finding(Acceptance::ModelSuspect, 3);
    let Finding { report, confidence, .. } = &mut finding;
    report.joints[0].name = clipped(evil);
    let stuck = SignalFrames { signal: clipped(evil), frames: 1 };
    let stuck = Implausible::Stuck([stuck].into_iter().collect());
    let trouble = Warning::Trouble(Trouble::Unreadable(clipped(evil)));
    report.warnings = [Warning::Implausible(stuck), trouble].into_iter().collect();
    confidence.joints[0].name = clipped(evil);
    confidence.correlations.unknowns[0] = clipped(evil);
    let state = State::NoAngles([clipped(evil)].into_iter().collect());
    let FromEdge::Status(mut status) = status(state) else { unreachable!() };
    (status.model, status.interface) = (clipped(evil), clipped(evil));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let listeners = [Listener::bind(&Listen::Unix(path.clone())).unwrap()];
    let (latest, stop) = (Latest::new(), Stop::new());
    latest.publish(FromEdge::Status(status));
    let fault = BusFault { interface: clipped(evil), kind: BusFaultKind::Down };
    latest.publish(bus(BusState::Down, Some(fault)));
    latest.publish(FromEdge::Finding(finding));
    thread::scope(|scope| {
        scope.spawn(|| serve(&listeners, &latest, &stop));
        for arguments in
            ["--timeout 0.7", "--json --timeout 0.7", "--until identified --timeout 0.7"]
        {
            let output = flexid(&path, arguments);
            for said in [text(&output.stdout), text(&output.stderr)] {
                let obeyed = |c: &char| (c.is_control() && *c != '\n') || *c == '\u{202e}';
                assert_eq!(said.chars().find(obeyed), None, "{arguments}: {said:?}");
            }
            assert!(text(&output.stdout).contains("]0;owned"), "{arguments}");
        }
        latest.close();
        stop.request();
    });
}

#[test]
fn a_dead_bus_is_named_first_and_what_went_wrong_on_a_live_one_last() {
    let waiting = || status(State::NoForce);
    let counts = "0 frames/s, 1000 taken, 3 lost, 0 dropped by the kernel, 812 of a wrong length, \
                  2 bridged, 77 discarded, 1 counter restart";
    let fault = BusFault { interface: clipped("vcan0"), kind: BusFaultKind::Down };
    let down = "vcan0 DOWN: the link of vcan0 is down: `ip link set vcan0 up`";
    let cases = [
        (
            bus(BusState::Down, Some(fault)),
            format!("--timeout: {down}; {counts}; waiting for force frames: none seen\n"),
            format!("{down}; waiting for force frames: none seen\n"),
        ),
        (
            bus(BusState::Up, None),
            format!("--timeout: waiting for force frames: none seen; vcan0 up; {counts}\n"),
            format!("vcan0 up; {counts}\n"),
        ),
    ];
    for (health, error, line) in cases {
        let output = watch(&[waiting(), health], "--until identified --timeout 0.7");
        let (lines, errors) = (text(&output.stdout), text(&output.stderr));
        assert!(errors.ends_with(&error), "{errors:?} does not end with {error:?}");
        assert!(lines.contains(&line), "{lines:?} has no {line:?}");
    }
    let output = watch(&[], "--until identified --timeout 0.7");
    assert_eq!(text(&output.stdout), "", "silence is no news");
}
