//! The daemon and the offline tool on the same frames.

mod epochs;
mod finding;
mod frames;
mod joining;
mod spoilt;
mod state;
mod state_file;
mod warnings;

use std::io;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use flexid_edge::daemon::{self, Daemon};
use flexid_edge::store::Store;
use flexid_pipeline::config::Config;
use flexid_pipeline::source::{Arrival, Flow, FrameSource, SourceHealth};
use flexid_pipeline::stop::Stop;
use flexid_pipeline::{Intake, Outcome, Solver, run_offline};
use flexid_wire::finding::Finding;
use flexid_wire::messages::Progress;
use flexid_wire::report::Report;
use flexid_wire::state::State;
use flexid_wire::text::clipped;
use flexid_wire::trouble::Trouble;
use flexid_wire::unused::Unused;
use flexid_wire::warning::Warning;

use frames::{POSES, Replay, block, frames, robot, source};

const SAMPLES: u32 = 256;

/// A daemon that keeps its state. Nobody is served, no other config comes, and no watchdog watches it.
fn keeping<'a>(config: &'a Config, stop: &'a Stop, store: &'a Store) -> Daemon<'a> {
    Daemon { config, listeners: &[], stop, reload: None, store: Some(store), watchdog: None }
}

/// The reference scenario with records of an eighth of a second.
fn config() -> Config {
    config_with("[bus]", "[bus]")
}

/// The reference scenario, with `from` replaced by `to`.
fn config_with(from: &str, to: &str) -> Config {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-tools/scenario/mill3-edge.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(text.contains(from), "{from}");
    let text = text.replace(from, to);
    let text =
        text.replace("rate_hz = 2000.0", &format!("rate_hz = 2000.0\nrecord_samples = {SAMPLES}"));
    Config::parse(&file, &text.replace("[2.0, 200.0]", "[20.0, 150.0]")).unwrap()
}

/// Two findings rest on the same frames and say the same of every parameter, to a tenth of its standard deviation. How many starts
/// it took depends on which records were at hand when one had failed.
fn assert_agree(one: &Finding, other: &Finding) {
    let counts = |finding: &Finding| {
        let fit = &finding.report.fit;
        (fit.records, fit.frames, fit.frames_lost, fit.bridged, fit.acceptance)
    };
    assert_eq!(counts(one), counts(other));
    let mut intervals = 0;
    for (one, other) in one.report.joints.iter().zip(&other.report.joints) {
        let stiffness = one.stiffness.iter().zip(&one.stiffness_std).zip(&other.stiffness);
        let damping = one.damping.iter().zip(&one.damping_std).zip(&other.damping);
        for ((own, deviation), other) in stiffness.chain(damping) {
            let Some(deviation) = deviation else { continue };
            assert!((own - other).abs() < 0.1 * deviation, "{own} ± {deviation} is not {other}");
            intervals += 1;
        }
    }
    assert!(intervals >= 5, "{intervals} of 36 parameters are determined");
}

/// The warnings of a report, as people read them.
fn lines(report: &Report) -> Vec<String> {
    report.warnings.iter().map(ToString::to_string).collect()
}

/// A finding without the one field that differs between equal runs.
fn timeless(outcome: Outcome) -> Finding {
    let mut finding = outcome.finding.expect("a finding");
    finding.report.fit.seconds = 0.0;
    finding
}

#[test]
fn the_daemon_and_the_offline_tool_say_the_same() {
    let config = config();
    let frames = || Replay {
        frames: frames::frames(&config, &POSES, |pose| robot(&config, pose)).into_iter(),
        breaks: false,
    };
    let phases = Arc::new(Mutex::new(Vec::new()));
    let offline = run_offline(
        &config,
        &mut frames(),
        |_| {},
        |progress| {
            let mut phases = phases.lock().unwrap();
            phases.push(progress.phase);
            phases.dedup();
        },
    );
    let offline = timeless(offline.unwrap());
    assert!(phases.lock().unwrap().len() >= 3, "search, refinement and end should be reported");
    assert!(offline.report.fit.records >= 2);
    assert_eq!(offline.report.fit.frames_lost, 12);
    assert_eq!(offline.report.joints.len(), 3);

    let again = run_offline(&config, &mut frames(), |_| {}, |_| {}).unwrap();
    assert_eq!(timeless(again), offline);

    let stop = Stop::new();
    let daemon = daemon::run(&config, &mut frames(), &[], &stop).unwrap();
    assert_agree(&timeless(daemon), &offline);
}

#[test]
fn the_work_on_a_record_goes_forward_only() {
    let config = config();
    let mut steps: Vec<(u64, f32)> = Vec::new();
    let note = |progress: &Progress| steps.push((progress.records, progress.fraction));
    run_offline(&config, &mut source(&config, false), |_| {}, note).unwrap();
    let fractions = |of: u64| steps.iter().filter(move |(records, _)| *records == of);
    let records = steps.last().expect("no step at all").0;
    for record in 1..=records {
        let fractions: Vec<f32> = fractions(record).map(|(_, fraction)| *fraction).collect();
        assert!(fractions.is_sorted(), "record {record}");
        // Records that are at hand join before the work begins.
        assert!(fractions.first().is_none_or(|first| *first < 0.5), "{fractions:?}");
    }
    assert!(records >= 2);
    // The next one may join before the work on a record is done.
    assert_eq!(steps.last(), Some(&(records, 1.0)));
}

#[test]
fn a_source_that_breaks_costs_nothing_that_was_taken() {
    let config = config();
    let whole =
        timeless(run_offline(&config, &mut source(&config, false), |_| {}, |_| {}).unwrap());
    let offline = run_offline(&config, &mut source(&config, true), |_| {}, |_| {}).unwrap();
    assert_eq!(offline.broken.as_ref().unwrap().to_string(), "unplugged");
    let broken = Trouble::RecordingBroken(clipped("unplugged"));
    assert_eq!(offline.troubles, std::slice::from_ref(&broken));
    let report = timeless(offline).report;
    assert_eq!(report.joints, whole.report.joints);
    assert!(report.warnings.contains(&Warning::Trouble(broken)), "{:?}", report.warnings);

    let daemon = daemon::run(&config, &mut source(&config, true), &[], &Stop::new()).unwrap();
    assert_eq!(daemon.broken.as_ref().unwrap().to_string(), "unplugged");
    assert_eq!(daemon.troubles, [Trouble::BusBroken(clipped("unplugged"))]);
    assert_eq!(timeless(daemon).report.joints, whole.report.joints);
}

#[test]
fn without_a_finding_the_state_says_what_is_missing() {
    let config = config();
    let mut empty = Replay { frames: Vec::new().into_iter(), breaks: false };
    let outcome = run_offline(&config, &mut empty, |_| {}, |_| {}).unwrap();
    assert!(outcome.finding.is_none());
    assert_eq!(outcome.state, State::NoFrames);
    let mut short = frames(&config, &[[0.0; 3]], block);
    short.truncate(100);
    let without_joints = short.split_off(3);
    let mut short = Replay { frames: short.into_iter(), breaks: false };
    let outcome = run_offline(&config, &mut short, |_| {}, |_| {}).unwrap();
    assert!(outcome.finding.is_none());
    assert_eq!(outcome.state, State::NoForce);
    let mut without_joints = Replay { frames: without_joints.into_iter(), breaks: false };
    let outcome = run_offline(&config, &mut without_joints, |_| {}, |_| {}).unwrap();
    assert!(outcome.finding.is_none());
    let joints = ["joint_1", "joint_2", "joint_3"].map(clipped);
    assert_eq!(outcome.state, State::NoAngles(joints.into_iter().collect()));
}

#[test]
fn a_record_at_hand_is_worked_through_after_the_end_is_asked_for() {
    let big = std::thread::Builder::new().stack_size(64 << 20);
    let test = big.spawn(|| {
        let config = config();
        let mut intake = Intake::new(&config).unwrap();
        let mut records = Vec::new();
        let mut source = source(&config, false);
        while intake
            .read(&mut source, Duration::ZERO, |record| records.push(record.clone()))
            .unwrap()
            == Flow::Open
        {}
        // The grace is long, so that the test does not depend on the speed of the machine.
        let stop = Stop::with_grace(Duration::from_secs(86_400));
        stop.request();
        let mut solver = Solver::new(&config).unwrap();
        assert!(solver.finding(&intake.counts(), &[]).is_none());
        solver.admit(&records[0], &stop, |_| {});
        solver.work(&stop, || false, |_| {});
        let finding =
            solver.finding(&intake.counts(), &[]).expect("the record is not worked through");
        assert_eq!(finding.report.fit.records, 1);
        assert!(finding.confidence.held_out.is_empty(), "there is no other to predict it from");
        solver.leave(2);
        let report = solver.finding(&intake.counts(), &[]).unwrap().report;
        assert_eq!(report.fit.records, 1);
        let warning = Warning::Unused(Unused::Unfinished { records: 2 });
        assert!(report.warnings.contains(&warning), "{:?}", report.warnings);
    });
    test.unwrap().join().unwrap();
}

#[test]
fn a_solver_that_dies_ends_the_daemon_with_an_error() {
    /// A bus on which nothing happens, for ever.
    struct Silent;

    impl FrameSource for Silent {
        fn read(&mut self, _: &mut Vec<Arrival>, timeout: Duration) -> io::Result<Flow> {
            std::thread::sleep(timeout.min(Duration::from_millis(10)));
            Ok(Flow::Open)
        }

        fn health(&self) -> SourceHealth {
            SourceHealth::default()
        }
    }

    let mut config = config();
    config.model.joints[0].mass_kg = -1.0;
    let (done, is_done) = std::sync::mpsc::channel();
    // A thread of its own: it would never end if the reader did not hear of it.
    std::thread::spawn(move || {
        let outcome = daemon::run(&config, &mut Silent, &[], &Stop::new());
        done.send(outcome.map(|_| ())).unwrap();
    });
    let outcome = is_done.recv_timeout(Duration::from_secs(60)).expect("the daemon reads on");
    assert!(outcome.unwrap_err().to_string().starts_with("the config was not checked"));
}
