//! When a watch ends: at its goal, at the timeout, by a signal.

use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use flexid_edge::latest::Latest;
use flexid_edge::server::{Listener, serve};
use flexid_pipeline::config::Listen;
use flexid_pipeline::stop::Stop;
use flexid_wire::messages::Phase;
use flexid_wire::report::Acceptance;

use super::news::{progress, report, unobserved};
use super::{assert_has_the_table_once, text, watch};

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
    assert_eq!(confidence["residuals"]["structure"], 0.05);

    let output = watch(&news, "--until identified --timeout 20");
    let table = text(&output.stdout);
    assert!(
        output.status.success() && table.contains("joint_1") && table.contains("60.0 MN/m"),
        "{table}"
    );
    for part in [
        "±1.7 %",
        "residuals    noise explains them (χ²/dof 1.01)\n",
        "retired      24 older records, ",
        "correlated   +0.97  a and b\n",
    ] {
        assert!(table.contains(part), "{part:?} is not in {table}");
    }
}

#[test]
fn gives_up_at_the_timeout_and_says_where_the_work_stands() {
    let consistent = || report(Acceptance::Consistent, 3);
    for (news, said) in [
        (vec![], "no news from the daemon"),
        (
            vec![progress(Phase::Searching, 3), consistent()],
            "searching for a robot that explains 3 records (attempt 2)",
        ),
        // The work on a fourth record has ended, and its report is still to come.
        (vec![progress(Phase::Settled, 4), consistent()], "search ended, 4 records"),
        (
            vec![progress(Phase::Settled, 3), report(Acceptance::ModelSuspect, 3)],
            "search ended, 3 records",
        ),
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
fn waits_for_as_many_records_as_asked_and_for_a_parameter_that_is_determined() {
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
    assert!(errors.contains("search ended, 1 record"), "{errors}");
    assert!(lines.contains("; 1 record, 16384 frames") && !lines.contains("1 records"), "{lines}");
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
