//! `flexid watch` against the daemon's real server, whose news the test makes up.

use std::io::{Read as _, Write as _};
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use flexid_edge::latest::Latest;
use flexid_edge::server::{Listener, serve};
use flexid_pipeline::config::Listen;
use flexid_pipeline::stop::Stop;
use flexid_wire::confidence::{Confidence, JointIntervals};
use flexid_wire::finding::Finding;
use flexid_wire::framing::{FRAME_BUFFER, encode};
use flexid_wire::implausible::{Implausible, SignalFrames};
use flexid_wire::messages::{
    BusErrors, BusHealth, BusState, FromEdge, Hello, Phase, Progress, Refusal, Status,
};
use flexid_wire::report::{Acceptance, Fit, FoundBy, JointReport, Report, Verdict};
use flexid_wire::residuals::{Meaning, Residuals};
use flexid_wire::state::State;
use flexid_wire::text::clipped;
use flexid_wire::trouble::{BusFault, BusFaultKind, Trouble};
use flexid_wire::warning::Warning;

fn progress(phase: Phase, records: u64) -> FromEdge {
    FromEdge::Progress(Progress {
        phase,
        fraction: 0.5,
        starts: 2,
        search_evaluations: 2000,
        refine_iterations: 8,
        search_loss: 0.1,
        records,
    })
}

fn finding(acceptance: Acceptance, records: u64) -> Finding {
    let joint = JointReport {
        name: clipped("joint_1"),
        stiffness: [6.0e7; 6],
        stiffness_std: [Some(1.0e4), None, Some(1.0e4), Some(1.0e4), Some(1.0e4), Some(1.0e4)],
        stiffness_verdict: [Verdict::Identified; 6],
        damping: [2.0e4; 6],
        damping_std: [Some(1.0e2); 6],
        damping_verdict: [Verdict::Weak; 6],
    };
    let fit = Fit {
        records,
        frames: 16_384 * records,
        frames_lost: 3,
        ssp: 1e-3,
        ssp_max: 2e-3,
        consistency: 1.01,
        search_evaluations: 2000,
        refine_iterations: 8,
        starts: 2,
        bridged: 3,
        seconds: 1.5,
        acceptance,
        found_by: FoundBy::Descent,
        random_searches: 0,
        branches: 1,
    };
    let joints = [joint].into_iter().collect();
    let report = Report { joints, fit, warnings: Default::default() };
    Finding { report, confidence: confidence() }
}

fn report(acceptance: Acceptance, records: u64) -> FromEdge {
    FromEdge::Finding(finding(acceptance, records))
}

fn confidence() -> Confidence {
    let joint = JointIntervals {
        name: clipped("joint_1"),
        stiffness_interval: [Some([5.9e7, 6.1e7]); 6],
        damping_interval: [None; 6],
    };
    Confidence {
        joints: [joint].into_iter().collect(),
        nuisances: Default::default(),
        correlations: serde_json::from_str(r#"{"unknowns": ["a", "b"], "percent": [97]}"#).unwrap(),
        weak_directions: Default::default(),
        residuals: Residuals {
            consistency: 1.01,
            whiteness: 0.5,
            size_objects: false,
            whiteness_objects: false,
            meaning: Meaning::Noise,
        },
        held_out: Default::default(),
        retired: 24,
        left_out: 0,
    }
}

/// A report in which nothing is determined.
fn unobserved() -> FromEdge {
    let mut unobserved = finding(Acceptance::Consistent, 3);
    for joint in &mut unobserved.report.joints {
        joint.stiffness_verdict = [Verdict::NotObservable; 6];
    }
    FromEdge::Finding(unobserved)
}

fn bus(state: BusState, fault: Option<BusFault>) -> FromEdge {
    FromEdge::BusHealth(BusHealth {
        state,
        frames: 1000,
        frames_lost: 3,
        bridged: 2,
        restarts: 1,
        repeated: 0,
        frames_wrong_length: 812,
        frames_unknown: 0,
        frames_not_data: 0,
        frames_clipped: 0,
        kernel_dropped: 0,
        receive_buffer_bytes: 0,
        samples_discarded: 77,
        refused: 0,
        wrong_rate: 0,
        measured_rate_hz: 0.0,
        frames_per_second: 0.0,
        fault,
        errors: BusErrors::default(),
        doubtful_rate: 0,
        measured_rate_std_hz: 0.0,
    })
}

fn status(state: State) -> FromEdge {
    FromEdge::Status(Status {
        uptime_s: 1.0,
        model: clipped("mill3"),
        joints: 3,
        interface: clipped("vcan0"),
        state,
        record_fraction: 0.25,
    })
}

/// Watches a server that has published `news`.
fn watch(news: &[FromEdge], arguments: &str) -> Output {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let listeners = [Listener::bind(&Listen::Unix(path.clone())).unwrap()];
    let (latest, stop) = (Latest::new(), Stop::new());
    for message in news {
        latest.publish(message.clone());
    }
    thread::scope(|scope| {
        scope.spawn(|| serve(&listeners, &latest, &stop));
        let output = flexid(&path, arguments);
        latest.close();
        stop.request();
        output
    })
}

fn flexid(path: &Path, arguments: &str) -> Output {
    watch_at(&format!("unix:{}", path.display()), arguments)
}

fn watch_at(address: &str, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flexid"))
        .args(["watch", address])
        .args(arguments.split_whitespace())
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Static tests alone are settled from the start: why no record comes is said all the same.
#[test]
fn without_a_record_it_says_what_the_daemon_waits_for() {
    let waiting = "waiting for force frames: none seen";
    let news =
        [status(State::NoForce), progress(Phase::Settled, 0), report(Acceptance::Consistent, 0)];
    let output = watch(&news, "--timeout 1");
    let lines = text(&output.stdout);
    assert!(lines.contains(waiting) && !lines.contains("settled, 0 records"), "{lines}");
}

#[test]
fn ends_when_the_parameters_are_identified() {
    let news = [progress(Phase::Settled, 3), report(Acceptance::Consistent, 3)];
    let output = watch(&news, "--until identified --timeout 20 --json");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let lines = text(&output.stdout);
    assert_eq!(lines.lines().count(), 1, "{lines}");
    let report: serde_json::Value = serde_json::from_str(&lines).unwrap();
    assert_eq!(report["joints"][0]["stiffness"][0], 6.0e7);
    assert_eq!(report["joints"][0]["stiffness_std"][1], serde_json::Value::Null);
    assert_eq!(report["joints"][0]["damping_verdict"][0], "weak");
    assert_eq!(report["fit"]["frames_lost"], 3);
    let confidence = &report["confidence"];
    assert_eq!(confidence["joints"][0]["stiffness_interval"][0], serde_json::json!([5.9e7, 6.1e7]));
    assert_eq!(confidence["joints"][0]["damping_interval"][5], serde_json::Value::Null);
    assert_eq!(confidence["correlations"]["percent"][0], 97);
    assert_eq!(confidence["residuals"]["whiteness"], 0.5);

    let output = watch(&news, "--until identified --timeout 20");
    let table = text(&output.stdout);
    assert!(
        output.status.success() && table.contains("joint_1") && table.contains("6.0000e7"),
        "{table}"
    );
    for part in [
        "±1.67 %",
        "residuals    noise explains them (χ²/dof 1.01, whiteness 0.5)\n",
        "retired      24 older records, ",
        "correlated   +0.97  a and b\n",
    ] {
        assert!(table.contains(part), "{part:?} is not in {table}");
    }
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

    let late = lines(&[report(Acceptance::Consistent, 3), status(State::NoForce)]);
    assert_eq!(late.len(), 1, "{late:?}");
    assert_eq!(late[0]["fit"]["records"], 3);
}

/// A daemon on another machine may send anything.
#[test]
fn no_control_character_reaches_the_terminal() {
    let evil = "\x1b]0;owned\x07\r\n\u{9b}2J\u{202e}";
    let mut finding = finding(Acceptance::ModelSuspect, 3);
    let Finding { report, confidence } = &mut finding;
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
fn gives_up_at_the_timeout_and_says_where_the_work_stands() {
    let consistent = || report(Acceptance::Consistent, 3);
    for (news, said) in [
        (vec![], "no news from the daemon"),
        (vec![progress(Phase::Searching, 3), consistent()], "searching with record 3, start 2"),
        // The work on a fourth record has ended, and its report is still to come.
        (vec![progress(Phase::Settled, 4), consistent()], "settled, 4 records"),
        (vec![progress(Phase::Settled, 3), report(Acceptance::ModelSuspect, 3)], "settled"),
    ] {
        let output = watch(&news, "--until identified --timeout 0.7");
        let errors = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{errors}");
        assert!(
            errors.contains("not identified within the --timeout") && errors.contains(said),
            "{errors}"
        );
        assert_eq!(errors.lines().count(), 1, "{errors}");
    }
    let output = watch(&[], "--until identified --timeout -3");
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
}

#[test]
fn waits_for_as_many_records_as_asked_and_for_a_parameter_that_is_told() {
    let settled = || progress(Phase::Settled, 3);
    let consistent = || report(Acceptance::Consistent, 3);
    for (news, arguments, status) in [
        ([settled(), consistent()], "--records 3", 0),
        ([settled(), consistent()], "--records 4", 1),
        ([settled(), unobserved()], "", 1),
    ] {
        let output = watch(&news, &format!("--until identified --timeout 0.7 {arguments}"));
        assert_eq!(output.status.code(), Some(status), "{arguments}: {}", text(&output.stderr));
    }
    let news = [progress(Phase::Settled, 1), report(Acceptance::ModelSuspect, 1)];
    let output = watch(&news, "--until identified --timeout 0.7");
    let (lines, errors) = (text(&output.stdout), text(&output.stderr));
    assert!(errors.contains("settled, 1 record"), "{errors}");
    assert!(lines.contains("; 1 record, 16384 frames") && !lines.contains("1 records"), "{lines}");
}

#[test]
fn a_dead_bus_is_told_first_and_what_went_wrong_on_a_live_one_last() {
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

#[test]
fn the_timeout_covers_connecting_and_the_greeting() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let begun = Instant::now();
    let output = flexid(&path, "--until identified --timeout 0.5");
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("nobody listens there"), "{}", text(&output.stderr));
    assert!(begun.elapsed() >= Duration::from_millis(350), "a daemon may still come");

    // Takes clients, and says nothing.
    let _silent = UnixListener::bind(&path).unwrap();
    let begun = Instant::now();
    let output = flexid(&path, "--until identified --timeout 0.5");
    assert!(begun.elapsed() < Duration::from_secs(3), "{:?}", begun.elapsed());
    assert!(text(&output.stderr).contains("says nothing"), "{}", text(&output.stderr));

    // A network for documentation, where nobody is.
    let begun = Instant::now();
    let output = watch_at("tcp:192.0.2.1:1", "--until identified --timeout 0.5");
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    assert!(begun.elapsed() < Duration::from_secs(3), "{:?}", begun.elapsed());
}

#[test]
fn a_daemon_that_comes_later_is_waited_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let (latest, stop) = (Latest::new(), Stop::new());
    latest.publish(progress(Phase::Settled, 3));
    latest.publish(report(Acceptance::Consistent, 3));
    thread::scope(|scope| {
        let watching = scope.spawn(|| flexid(&path, "--until identified --timeout 20"));
        thread::sleep(Duration::from_millis(500));
        let listeners = [Listener::bind(&Listen::Unix(path.clone())).unwrap()];
        let (latest, stop) = (&latest, &stop);
        scope.spawn(move || serve(&listeners, latest, stop));
        let output = watching.join().unwrap();
        latest.close();
        stop.request();
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    });
}

#[test]
fn a_daemon_of_another_version_is_told_apart() {
    let refusal =
        Refusal { reason: clipped("client speaks flexid protocol 1, this daemon speaks 9") };
    let other = Hello { protocol_version: 9, ..Hello::new("flexid-edge 9.0.0") };
    for (answer, said) in [
        (FromEdge::Refused(refusal), "this daemon speaks 9"),
        (
            FromEdge::Hello(other),
            "flexid-edge 9.0.0 is of another version: install matching versions",
        ),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flexid.sock");
        let listener = UnixListener::bind(&path).unwrap();
        let daemon = thread::spawn(move || {
            let (mut client, _) = listener.accept().unwrap();
            let _ = client.read(&mut [0; 256]);
            client.write_all(encode(&answer, &mut [0; FRAME_BUFFER]).unwrap()).unwrap();
        });
        let output = flexid(&path, "--json");
        daemon.join().unwrap();
        let errors = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{errors}");
        assert!(errors.contains(said), "{errors}");
    }
}

#[test]
fn the_daemons_end_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let listeners = [Listener::bind(&Listen::Unix(path.clone())).unwrap()];
    let (latest, stop) = (Latest::new(), Stop::new());
    latest.publish(report(Acceptance::Consistent, 3));
    thread::scope(|scope| {
        scope.spawn(|| serve(&listeners, &latest, &stop));
        let watching = ["--json", ""].map(|form| {
            let path = &path;
            scope.spawn(move || flexid(path, form))
        });
        thread::sleep(Duration::from_millis(700));
        latest.close();
        stop.request();
        let [json, lines] = watching.map(|watching| watching.join().unwrap());
        for output in [&json, &lines] {
            let errors = text(&output.stderr);
            assert_eq!(output.status.code(), Some(1));
            assert!(errors.contains("the daemon hung up"), "{errors}");
        }
        assert_eq!(text(&json.stdout).lines().count(), 1);
        assert_has_the_table_once(&text(&lines.stdout));
    });
}

fn assert_has_the_table_once(lines: &str) {
    assert_eq!(lines.matches(" N/m and Ns/m along").count(), 1, "{lines}");
    assert!(lines.contains("6.0000e7"), "{lines}");
}

#[test]
fn a_timeout_alone_ends_the_watch_with_the_table() {
    let news = [progress(Phase::Searching, 4), report(Acceptance::Consistent, 3)];
    let begun = Instant::now();
    let output = watch(&news, "--timeout 0.7");
    assert!(begun.elapsed() >= Duration::from_millis(600), "{:?}", begun.elapsed());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert_eq!(text(&output.stderr), "");
    assert_has_the_table_once(&text(&output.stdout));
    let output = watch(&news, "--timeout 0");
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
}

#[test]
fn who_is_interrupted_leaves_the_table() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("flexid.sock");
    let listeners = [Listener::bind(&Listen::Unix(path.clone())).unwrap()];
    let (latest, stop) = (Latest::new(), Stop::new());
    latest.publish(report(Acceptance::ModelSuspect, 3));
    thread::scope(|scope| {
        scope.spawn(|| serve(&listeners, &latest, &stop));
        for (signal, arguments, status) in
            [("-INT", "", 0), ("-TERM", "", 0), ("-TERM", "--until identified", 1)]
        {
            let watching = Command::new(env!("CARGO_BIN_EXE_flexid"))
                .args(["watch", &format!("unix:{}", path.display())])
                .args(arguments.split_whitespace())
                .stdout(Stdio::piped())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
            thread::sleep(Duration::from_millis(700));
            let kill = Command::new("kill").args([signal, &watching.id().to_string()]).status();
            assert!(kill.unwrap().success());
            let output = watching.wait_with_output().unwrap();
            assert_eq!(output.status.code(), Some(status), "{}", text(&output.stderr));
            assert_has_the_table_once(&text(&output.stdout));
        }
        latest.close();
        stop.request();
    });
}
