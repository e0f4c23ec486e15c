//! The daemon and the offline tool on the same frames.

mod joining;
mod state;
mod warnings;

use std::io;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use embedded_can::StandardId;
use flexid_core::motion::EquationOfMotion;
use flexid_core::motion::radau::Radau;
use flexid_core::parameters::{Bushing, Ranges};
use flexid_core::stream::Reading;
use flexid_edge::daemon;
use flexid_pipeline::config::Config;
use flexid_pipeline::source::{Arrival, Flow, Frame, FrameKind, FrameSource, SourceHealth};
use flexid_pipeline::stop::Stop;
use flexid_pipeline::{Intake, Outcome, Solver, run_offline};
use flexid_wire::finding::Finding;
use flexid_wire::messages::Progress;
use flexid_wire::report::{Acceptance, Report, Verdict};
use flexid_wire::state::State;
use flexid_wire::text::clipped;
use flexid_wire::trouble::Trouble;
use flexid_wire::unused::Unused;
use flexid_wire::warning::Warning;
use nalgebra::Vector3;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

const SAMPLES: u32 = 256;
const RATE_HZ: f64 = 2000.0;

/// Hands over frames a few at a time, then ends, or breaks.
struct Replay {
    frames: std::vec::IntoIter<Arrival>,
    breaks: bool,
}

impl FrameSource for Replay {
    fn read(&mut self, batch: &mut Vec<Arrival>, _timeout: Duration) -> io::Result<Flow> {
        let before = batch.len();
        batch.extend(self.frames.by_ref().take(50));
        match (batch.len() - before, self.breaks) {
            (0, true) => Err(io::Error::other("unplugged")),
            (0, false) => Ok(Flow::Ended),
            _ => Ok(Flow::Open),
        }
    }

    fn health(&self) -> SourceHealth {
        SourceHealth::default()
    }
}

/// The reference scenario with records of an eighth of a second.
fn config() -> Config {
    config_with("[bus]", "[bus]")
}

/// The same, with `from` replaced by `to`.
fn config_with(from: &str, to: &str) -> Config {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-tools/scenario/mill3-edge.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(text.contains(from), "{from}");
    let text = text.replace(from, to);
    let text =
        text.replace("rate_hz = 2000.0", &format!("rate_hz = 2000.0\nrecord_samples = {SAMPLES}"));
    Config::parse(&file, &text.replace("[2.0, 200.0]", "[20.0, 150.0]")).unwrap()
}

/// What the accelerometer reads at the instants at which a force is measured, one after the other.
type Tool = Box<dyn FnMut([f32; 3]) -> [f32; 3]>;

/// A block of a ton, whatever the pose: no robot.
fn block(_: &[f64; 3]) -> Tool {
    Box::new(|force| force.map(|force| force * 1e-3))
}

/// The robot, every parameter in the middle of its bounds.
fn robot(config: &Config, pose: &[f64; 3]) -> Tool {
    let middle = |[lower, upper]: [f64; 2]| (lower * upper).sqrt();
    let Ranges { stiffness, damping } = config.bounds.joints[0];
    let bushing = Bushing { stiffness: stiffness.map(middle), damping: damping.map(middle) };
    let chain = config.model.chain().unwrap();
    let equation =
        EquationOfMotion::new(&chain, pose, config.gravity.into(), &[bushing; 3]).unwrap();
    let start = equation.rest();
    let mut robot = Radau::new(equation, start, 1.0 / RATE_HZ);
    let (accelerometer, mounting) = (config.accelerometer, config.mounting);
    let mut last = Vector3::zeros();
    Box::new(move |force| {
        let force = Vector3::from(force).cast();
        robot.step(|part| last.lerp(&force, part)).unwrap();
        last = force;
        let reading = robot.equation().reading(robot.state(), &force, accelerometer, &mounting);
        reading.acceleration.cast().into()
    })
}

/// As [`frames_with`], with the acceleration lost in every hundredth instant.
fn frames(
    config: &Config,
    poses: &[[f64; 3]],
    at_pose: impl Fn(&[f64; 3]) -> Tool,
) -> Vec<Arrival> {
    frames_with(config, poses, 100, 0.02, at_pose)
}

/// At each pose a quiet time, then smooth noise that pushes the tool. Of `every` so many accelerations the last is lost.
fn frames_with(
    config: &Config,
    poses: &[[f64; 3]],
    every: u32,
    acceleration_noise: f32,
    at_pose: impl Fn(&[f64; 3]) -> Tool,
) -> Vec<Arrival> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut noise = |size: f32| size * ((rng.next_u32() >> 8) as f32 / (1 << 23) as f32 - 1.0);
    let mut frames = Vec::new();
    let mut send = |time_s: f64, reading: Reading| {
        let encoded = config.signals.encode(&[reading]).unwrap();
        frames.extend(encoded.into_iter().map(|frame| Arrival { time_s, frame }));
    };
    let period = 1.0 / RATE_HZ;
    for (place, pose) in poses.iter().enumerate() {
        let start = 1.0e9 + 10.0 * place as f64;
        let mut tool = at_pose(pose);
        let mut cutting = [(0.0, 0.0); 3];
        let samples = config.record_samples as u32;
        for counter in 0..5 * samples / 2 {
            let time = start + f64::from(counter) * period;
            if counter % 200 == 0 {
                for (index, &value) in pose.iter().enumerate() {
                    send(time, Reading::Joint { index: index as u8, value });
                }
            }
            // White force counts as noise of the sensor: cutting is smooth.
            let size = if counter < samples { 0.0 } else { 100.0 };
            for (smooth, force) in &mut cutting {
                *smooth = 0.8 * *smooth + noise(size);
                *force = 0.8 * *force + *smooth;
            }
            let value = cutting.map(|(_, force)| force + noise(0.5));
            send(time, Reading::Force { counter, value });
            let acceleration = tool(value);
            if counter % every != every - 1 {
                let value =
                    acceleration.map(|acceleration| acceleration + noise(acceleration_noise));
                send(time + 0.25 * period, Reading::Acceleration { counter, value });
            }
        }
    }
    frames
}

const POSES: [[f64; 3]; 2] = [[0.0, -0.45, 0.95], [0.7, -1.1, 1.9]];

fn source(config: &Config, breaks: bool) -> Replay {
    let frames = frames(config, &POSES, block);
    Replay { frames: frames.into_iter(), breaks }
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
    let phases = Arc::new(Mutex::new(Vec::new()));
    let offline = run_offline(&config, &mut source(&config, false), |progress| {
        let mut phases = phases.lock().unwrap();
        phases.push(progress.phase);
        phases.dedup();
    });
    let offline = timeless(offline.unwrap());
    assert!(phases.lock().unwrap().len() >= 3, "search, refinement and end should be reported");
    assert!(offline.report.fit.records >= 2);
    assert_eq!(offline.report.fit.frames_lost, 12);
    assert_eq!(offline.report.joints.len(), 3);

    let again = run_offline(&config, &mut source(&config, false), |_| {}).unwrap();
    assert_eq!(timeless(again), offline);

    let stop = Stop::new();
    let daemon = daemon::run(&config, &mut source(&config, false), &[], &stop).unwrap();
    assert_agree(&timeless(daemon), &offline);
}

#[test]
fn the_work_on_a_record_goes_forward_only() {
    let config = config();
    let mut steps: Vec<(u64, f32)> = Vec::new();
    let note = |progress: &Progress| steps.push((progress.records, progress.fraction));
    run_offline(&config, &mut source(&config, false), note).unwrap();
    let fractions = |of: u64| steps.iter().filter(move |(records, _)| *records == of);
    let records = steps.last().expect("no step at all").0;
    for record in 1..=records {
        let fractions: Vec<f32> = fractions(record).map(|(_, fraction)| *fraction).collect();
        assert!(fractions.is_sorted(), "record {record}");
        assert!(fractions[0] < 0.5, "{fractions:?}");
    }
    assert!(records >= 2);
    // The next one may join before the work on a record is done.
    assert_eq!(steps.last(), Some(&(records, 1.0)));
}

/// A robot has intervals; a block of a ton, which is no robot, has none.
#[test]
fn a_confidence_goes_with_its_report() {
    let config = config();
    let intervals = |frames: Vec<Arrival>| {
        let mut source = Replay { frames: frames.into_iter(), breaks: false };
        counted_intervals(&timeless(run_offline(&config, &mut source, |_| {}).unwrap()))
    };
    assert_eq!(intervals(frames(&config, &POSES, block)), 0);
    let of_robot = intervals(frames(&config, &POSES, |pose| robot(&config, pose)));
    assert!(of_robot > 0, "a robot has no interval");
}

/// What is asked of the shape of a confidence, whatever it says; counts the intervals.
fn counted_intervals(Finding { report, confidence }: &Finding) -> usize {
    let mut intervals = 0;
    for (joint, own) in report.joints.iter().zip(&confidence.joints) {
        assert_eq!(joint.name, own.name);
        let stiffness = joint.stiffness.iter().zip(&joint.stiffness_std);
        let damping = joint.damping.iter().zip(&joint.damping_std);
        let ends = own.stiffness_interval.iter().chain(&own.damping_interval);
        for ((value, std), ends) in stiffness.chain(damping).zip(ends) {
            let Some([lower, upper]) = ends else { continue };
            let relative = std.expect("an interval without a standard deviation") / value;
            assert!(lower < value && value < upper, "{value} is not in {lower} to {upper}");
            assert!(((upper / lower).ln() / (2.0 * 1.959_964 * relative) - 1.0).abs() < 1e-9);
            intervals += 1;
        }
    }
    println!("{intervals} intervals of 36, χ²/dof {}", report.fit.consistency);
    let verdicts = report
        .joints
        .iter()
        .flat_map(|joint| joint.stiffness_verdict.iter().chain(&joint.damping_verdict).copied());
    let observable = verdicts.filter(|verdict| *verdict != Verdict::NotObservable).count();
    assert_eq!(intervals, if report.fit.consistency <= 10.0 { observable } else { 0 });

    let correlations = &confidence.correlations;
    assert_eq!((correlations.unknowns.len(), correlations.percent.len()), (36, 36 * 35 / 2));
    assert_eq!(correlations.unknowns[0], "joint_1 tx stiffness");
    assert_eq!(correlations.unknowns[35], "joint_3 rz damping");
    assert!(correlations.percent.iter().all(|percent| (-100..=100).contains(percent)));
    assert!(!confidence.weak_directions.is_empty(), "an eighth of a second tells all of a robot");
    for direction in &confidence.weak_directions {
        assert!(direction.relative_std.is_none_or(|std| std > 0.3), "{direction:?}");
        assert!(direction.to_string().contains(direction.shares[0].name.as_str()), "{direction:?}");
        for share in &direction.shares {
            assert!(correlations.unknowns.contains(&share.name), "{direction:?}");
        }
    }
    assert_eq!(confidence.held_out.len() as u64, report.fit.records);
    for held_out in &confidence.held_out {
        let near =
            |pose: &[f64; 3]| pose.iter().zip(&held_out.pose).all(|(a, b)| (a - b).abs() < 1e-3);
        assert!(POSES.iter().any(near), "{held_out:?}");
    }
    assert!(confidence.nuisances.is_empty(), "none is asked for");
    intervals
}

/// Seven records at one pose, of which four are kept, and a model so wrong that none of the others is folded in.
#[test]
fn records_that_are_lost_are_counted() {
    let config = config();
    let frames = frames(&config, &[[0.0, -0.45, 0.95]; 7], block);
    let mut source = Replay { frames: frames.into_iter(), breaks: false };
    let outcome = run_offline(&config, &mut source, |_| {}).unwrap();
    let taken = outcome.counts.stream.records;
    let Finding { report, confidence } = outcome.finding.expect("a finding");
    assert!(taken >= 7 && !report.warnings.is_empty(), "{taken} records");
    assert_eq!((report.fit.records, confidence.retired, confidence.left_out), (4, 0, taken - 4));
    let lost = |warning: &Warning| matches!(warning, Warning::MadeRoom { .. });
    assert!(report.warnings.iter().any(lost), "{:?}", report.warnings);
}

/// The frames of one log twice: the numbers and their deviations are those of once, and a warning says why.
#[test]
fn a_log_that_is_given_twice_counts_once() {
    let config = config();
    let run = |frames: Vec<Arrival>| {
        let mut source = Replay { frames: frames.into_iter(), breaks: false };
        let outcome = run_offline(&config, &mut source, |_| {}).unwrap();
        let records = outcome.counts.stream.records;
        (timeless(outcome), records)
    };
    let log = frames(&config, &POSES, |pose| robot(&config, pose));
    let (once, records) = run(log.clone());
    let (twice, all) = run([log.clone(), log].concat());
    assert!(records >= 2 && all == 2 * records, "{records} and {all} records");
    assert_eq!(twice.report.fit.records, once.report.fit.records);
    assert_eq!(twice.report.joints, once.report.joints);
    let again = |finding: &Finding| {
        let repeated = |warning: &&Warning| matches!(warning, Warning::Repeated { .. });
        finding.report.warnings.iter().find(repeated).cloned()
    };
    assert_eq!(again(&twice), Some(Warning::Repeated { records, again: records + 1, original: 1 }));
    assert_eq!(again(&once), None);
}

#[test]
fn a_source_that_breaks_costs_nothing_that_was_taken() {
    let config = config();
    let whole = timeless(run_offline(&config, &mut source(&config, false), |_| {}).unwrap());
    let offline = run_offline(&config, &mut source(&config, true), |_| {}).unwrap();
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
fn nothing_to_tell_from_is_said_in_words() {
    let config = config();
    let mut empty = Replay { frames: Vec::new().into_iter(), breaks: false };
    let outcome = run_offline(&config, &mut empty, |_| {}).unwrap();
    assert!(outcome.finding.is_none());
    assert_eq!(outcome.state, State::NoFrames);
    let mut short = frames(&config, &[[0.0; 3]], block);
    short.truncate(100);
    let without_joints = short.split_off(3);
    let mut short = Replay { frames: short.into_iter(), breaks: false };
    let outcome = run_offline(&config, &mut short, |_| {}).unwrap();
    assert!(outcome.finding.is_none());
    assert_eq!(outcome.state, State::NoForce);
    let mut without_joints = Replay { frames: without_joints.into_iter(), breaks: false };
    let outcome = run_offline(&config, &mut without_joints, |_| {}).unwrap();
    assert!(outcome.finding.is_none());
    let joints = ["joint_1", "joint_2", "joint_3"].map(clipped);
    assert_eq!(outcome.state, State::NoAngles(joints.into_iter().collect()));
}

/// What is said of frames that have been changed by `spoil`.
fn spoilt(spoil: impl FnMut(Arrival) -> Arrival) -> Outcome {
    let config = config();
    let frames: Vec<_> =
        frames(&config, &[[0.0, -0.45, 0.95]], block).into_iter().map(spoil).collect();
    let mut source = Replay { frames: frames.into_iter(), breaks: false };
    run_offline(&config, &mut source, |_| {}).unwrap()
}

/// The frame with other data, if it is of this identifier.
fn change(arrival: Arrival, id: u16, change: impl FnOnce(&Frame) -> Frame) -> Arrival {
    let same = arrival.frame.id == StandardId::new(id).unwrap().into();
    Arrival { frame: if same { change(&arrival.frame) } else { arrival.frame }, ..arrival }
}

fn with_counter(frame: &Frame, counter: impl FnOnce(u16) -> u16) -> Frame {
    let mut data: [u8; 8] = frame.data().try_into().unwrap();
    let old = u16::from_le_bytes([data[6], data[7]]);
    data[6..].copy_from_slice(&counter(old).to_le_bytes());
    Frame::new(frame.id, frame.kind, &data)
}

#[test]
fn what_keeps_frames_from_becoming_records_is_named() {
    let cut = |frame: &Frame| Frame::new(frame.id, frame.kind, &frame.data()[1..]);
    let kind = |kind| move |frame: &Frame| Frame::new(frame.id, kind, frame.data());
    let start = 1.0e9;
    let states = [
        spoilt(|arrival| change(arrival, 0x101, cut)),
        spoilt(|arrival| change(arrival, 0x112, cut)),
        spoilt(|arrival| change(arrival, 0x102, kind(FrameKind::Fd))),
        spoilt(|arrival| change(arrival, 0x101, kind(FrameKind::Remote))),
        spoilt(|arrival| change(arrival, 0x101, |frame| with_counter(frame, |_| 7))),
        spoilt(|arrival| change(arrival, 0x102, |frame| with_counter(frame, |_| 7))),
        spoilt(|arrival| change(arrival, 0x102, |frame| with_counter(frame, |count| count + 1000))),
        spoilt(|arrival| {
            change(arrival, 0x102, |frame| with_counter(frame, |count| count + 30_000))
        }),
        spoilt(|arrival| Arrival { time_s: start + (arrival.time_s - start) / 2.0, ..arrival }),
    ];
    let expected = [
        "frames 0x101 have 7 bytes, by [bus] dbc 8: mend the DBC file or the sender (640 so far)",
        "frames 0x112 have 5 bytes, by [bus] dbc 6: mend the DBC file or the sender (4 so far)",
        "frames 0x102 are CAN FD: set the sender to classical CAN (634 so far)",
        "frames 0x101 are remote requests: does the sensor answer? (640 so far)",
        "[signals] force_counter stands still (639 frames): it must count the instants",
        "[signals] acceleration_counter stands still (633 frames): it must count the instants",
        "the counters of force and acceleration do not go together (",
        "the counters of force and acceleration do not go together (",
        "mill3-edge.toml: [measurement] rate_hz is 2000, but frames come at 4000/s",
    ];
    for (outcome, expected) in states.iter().zip(expected) {
        let state = outcome.state.to_string();
        assert!(state.starts_with(expected), "{state}\n  is not\n{expected}");
        assert!(outcome.finding.is_none());
    }
}

/// Arrivals tell the rate: what is certain is used, what is not makes the fit no better than unsettled.
#[test]
fn a_wrong_rate_is_warned_of_with_what_was_done() {
    let start = 1.0e9;
    let at = |rate_hz: f64, jitter_s: f64| {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        move |arrival: Arrival| {
            let late_s = jitter_s * f64::from(rng.next_u32()) / 2_f64.powi(32);
            let time_s = start + (arrival.time_s - start) * RATE_HZ / rate_hz + late_s;
            Arrival { time_s, ..arrival }
        }
    };
    for (rate_hz, jitter_s, said) in [
        (2000.0, 0.0, None),
        (2000.0, 3e-4, None),
        (2004.0, 0.0, Some("but frames come at 2004.00/s, that is used")),
        (2020.0, 1e-3, Some(": too uncertain to be used, so nothing is identified")),
    ] {
        let outcome = spoilt(at(rate_hz, jitter_s));
        let Finding { report, confidence } = outcome.finding.expect("a finding");
        let warning = lines(&report).into_iter().find(|warning| warning.contains("rate_hz"));
        println!("{rate_hz} Hz: {warning:?}");
        assert_eq!(warning.is_some(), said.is_some(), "{:?}", report.warnings);
        let says = |said| warning.as_ref().is_some_and(|warning| warning.ends_with(said));
        assert!(said.is_none_or(says), "{warning:?}");
        let doubtful = outcome.counts.stream.doubtful_rate > 0;
        assert_eq!(doubtful, rate_hz == 2020.0);
        if doubtful {
            assert_eq!(report.fit.acceptance, Acceptance::Unsettled);
            let sure = |joint: &flexid_wire::confidence::JointIntervals| {
                joint.stiffness_interval.iter().chain(&joint.damping_interval).any(Option::is_some)
            };
            assert!(!confidence.joints.iter().any(sure));
        }
    }
}

/// An angle that used to be repeated is awaited, one that never was holds.
#[test]
fn a_joint_that_falls_silent_is_named() {
    let config = config();
    let third = StandardId::new(0x113).unwrap().into();
    for (first_s, expected) in [
        (1.0e9 + 5.0, "waiting for joint angles: joint_3 does not come any more"),
        (1.0e9 + 0.05, "measuring"),
    ] {
        let mut frames = frames(&config, &[[0.0, -0.45, 0.95]; 2], block);
        frames.retain(|arrival| arrival.frame.id != third || arrival.time_s < first_s);
        let mut source = Replay { frames: frames.into_iter(), breaks: false };
        let outcome = run_offline(&config, &mut source, |_| {}).unwrap();
        assert_eq!(outcome.state.to_string(), expected);
    }
}

#[test]
fn some_odd_frames_are_warned_of_and_keep_nobody_from_recording() {
    let mut number = 0;
    let outcome = spoilt(|arrival| {
        number += 1;
        let fx_at_its_limit = |frame: &Frame| {
            let mut data: [u8; 8] = frame.data().try_into().unwrap();
            data[..2].copy_from_slice(&i16::MIN.to_le_bytes());
            Frame::new(frame.id, frame.kind, &data)
        };
        match number {
            100 | 101 => change(arrival, 0x101, |frame| Frame::new(frame.id, frame.kind, &[])),
            900..=905 => change(arrival, 0x101, fx_at_its_limit),
            _ => arrival,
        }
    });
    assert_eq!((outcome.counts.clipped, outcome.counts.at_limit), (3, [3, 0, 0, 0, 0, 0]));
    let warnings = lines(&outcome.finding.expect("a finding").report);
    for warning in [
        "at the limit: Fx in 3 frames: widen the range of the sensor or the signal",
        "1 frame of another length than [bus] dbc says: frames 0x101 have 0 bytes, by [bus] dbc 8: mend the DBC file or the sender (1 so far)",
    ] {
        assert!(warnings.iter().any(|text| text == warning), "{warning}\n  is not in {warnings:?}");
    }
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
        let stop = Stop::new();
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
