//! The file for node_exporter, which `promtool` of Prometheus must like.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};

use flexid_wire::messages::{BusState, FromEdge, Phase};
use flexid_wire::report::Acceptance;
use flexid_wire::state::State;

use super::news::{bus, finding, progress, status};
use super::{text, watch, watch_at};

fn news() -> Vec<FromEdge> {
    let mut finding = finding(Acceptance::ModelSuspect, 3);
    // Quotation marks and the like are escaped.
    finding.report.joints[0].name = flexid_wire::text::clipped("joint \"1\\");
    vec![
        status(State::Measuring { implausible: None }),
        bus(BusState::Up, None),
        progress(Phase::Settled, 3),
        FromEdge::Finding(finding),
    ]
}

/// Writes the file for this news, until the timeout.
fn metrics(news: &[FromEdge], file: &Path) -> String {
    let output = watch(news, &format!("--metrics {} --timeout 0.7", file.display()));
    assert!(output.status.success(), "{}", text(&output.stderr));
    fs::read_to_string(file).unwrap()
}

#[test]
fn promtool_finds_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("flexid.prom");
    let written = metrics(&news(), &file);
    let promtool = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/promtool");
    let check = |file: &Path| {
        let file = File::open(file).unwrap();
        let mut command = Command::new(promtool);
        command.args(["check", "metrics"]).stdin(Stdio::from(file)).output().unwrap()
    };
    let output = check(&file);
    let complaints = text(&[output.stdout, output.stderr].concat());
    assert!(output.status.success() && complaints.is_empty(), "{complaints}\n{written}");
    fs::write(&file, written.replace("# HELP flexid_up ", "# ")).unwrap();
    assert!(!check(&file).status.success(), "promtool checks nothing");
}

#[test]
fn numbers_have_their_labels_and_what_is_not_shown_has_none() {
    let folder = tempfile::tempdir().unwrap();
    let written = metrics(&news(), &folder.path().join("flexid.prom"));
    for line in [
        "flexid_up 1",
        "flexid_info{model=\"mill3\",interface=\"vcan0\"} 1",
        "flexid_link_up 1",
        "flexid_frames_lost_total 3",
        "flexid_frames_wrong_length_total 812",
        "flexid_bus_errors_total{class=\"bus_off\"} 0",
        "flexid_acceptance{acceptance=\"model_suspect\"} 1",
        "flexid_acceptance{acceptance=\"consistent\"} 0",
        "flexid_estimate{joint=\"joint \\\"1\\\\\",axis=\"tx\",kind=\"stiffness\"} 60000000",
        "flexid_estimate_std{joint=\"joint \\\"1\\\\\",axis=\"rz\",kind=\"damping\"} 100",
    ] {
        assert!(written.lines().any(|own| own == line), "{line} is not in\n{written}");
    }
    // The stiffness along y has no standard deviation.
    assert!(!written.contains("axis=\"ty\",kind=\"stiffness\""), "{written}");
    assert!(!written.contains("newest_record"), "{written}");
}

#[test]
fn a_daemon_that_is_lost_is_down() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("flexid.prom");
    metrics(&news(), &file);
    let gone = format!("unix:{}/gone.sock", folder.path().display());
    let output = watch_at(&gone, &format!("--metrics {}", file.display()));
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    let written = fs::read_to_string(&file).unwrap();
    assert_eq!(written.lines().last(), Some("flexid_up 0"), "{written}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing else is left");

    let output = watch_at(&gone, "--metrics /nowhere/flexid.prom");
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
}
