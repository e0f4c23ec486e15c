//! The daemon and the offline tool on the same frames.

use std::io;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use flexid_core::stream::Reading;
use flexid_edge::config::Config;
use flexid_edge::daemon;
use flexid_edge::pipeline::{Outcome, run_offline};
use flexid_edge::source::{Arrival, Flow, FrameSource, SourceHealth};
use flexid_edge::stop::Stop;
use flexid_wire::report::Report;
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
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-tools/scenario/edge.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let text = text.replace("rate_hz = 2000.0", "rate_hz = 2000.0\nrecord_samples = 256");
    Config::parse(&file, &text.replace("[2.0, 200.0]", "[20.0, 150.0]")).unwrap()
}

/// At each pose a quiet time, then noise that pushes a block of a ton; in every hundredth instant the
/// acceleration is lost.
fn frames(config: &Config, poses: &[[f64; 3]]) -> Vec<Arrival> {
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
        for counter in 0..5 * SAMPLES / 2 {
            let time = start + f64::from(counter) * period;
            if counter % 200 == 0 {
                for (index, &value) in pose.iter().enumerate() {
                    send(time, Reading::Joint { index: index as u8, value });
                }
            }
            let size = if counter < SAMPLES { 0.5 } else { 500.0 };
            let value = [noise(size), noise(size), noise(size)];
            send(time, Reading::Force { counter, value });
            if counter % 100 != 99 {
                let value = value.map(|force| force * 1e-3 + noise(0.02));
                send(time + 0.25 * period, Reading::Acceleration { counter, value });
            }
        }
    }
    frames
}

fn source(config: &Config, breaks: bool) -> Replay {
    let frames = frames(config, &[[0.0, -0.45, 0.95], [0.7, -1.1, 1.9]]);
    Replay { frames: frames.into_iter(), breaks }
}

/// A report without the one field that differs between equal runs.
fn timeless(outcome: Outcome) -> Report {
    let mut report = outcome.report.expect("a report");
    report.fit.seconds = 0.0;
    report
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
    assert!(phases.lock().unwrap().len() >= 3, "search, refinement and end should be told");
    assert!(offline.fit.records >= 2);
    assert_eq!(offline.fit.frames_lost, 12);
    assert_eq!(offline.joints.len(), 3);

    let again = run_offline(&config, &mut source(&config, false), |_| {}).unwrap();
    assert_eq!(timeless(again), offline);

    let stop = Stop::new();
    let daemon = daemon::run(&config, &mut source(&config, false), &[], &stop).unwrap();
    assert_eq!(timeless(daemon), offline);
}

#[test]
fn a_source_that_breaks_costs_nothing_that_was_taken() {
    let config = config();
    let whole = timeless(run_offline(&config, &mut source(&config, false), |_| {}).unwrap());
    let offline = run_offline(&config, &mut source(&config, true), |_| {}).unwrap();
    assert_eq!(offline.broken.as_ref().unwrap().to_string(), "unplugged");
    assert!(offline.trouble.ends_with("unplugged"));
    let report = timeless(offline);
    assert_eq!(report.joints, whole.joints);
    assert!(report.warnings.iter().any(|warning| warning.contains("unplugged")));

    let daemon = daemon::run(&config, &mut source(&config, true), &[], &Stop::new()).unwrap();
    assert_eq!(daemon.broken.as_ref().unwrap().to_string(), "unplugged");
    assert_eq!(timeless(daemon).joints, whole.joints);
}

#[test]
fn nothing_to_tell_from_is_said_in_words() {
    let config = config();
    let mut empty = Replay { frames: Vec::new().into_iter(), breaks: false };
    let outcome = run_offline(&config, &mut empty, |_| {}).unwrap();
    assert!(outcome.report.is_none());
    assert_eq!(outcome.state, "waiting for frames");
    let mut short = frames(&config, &[[0.0; 3]]);
    short.truncate(100);
    let without_joints = short.split_off(3);
    let mut short = Replay { frames: short.into_iter(), breaks: false };
    let outcome = run_offline(&config, &mut short, |_| {}).unwrap();
    assert!(outcome.report.is_none());
    assert_eq!(outcome.state, "waiting for force frames: none seen");
    let mut without_joints = Replay { frames: without_joints.into_iter(), breaks: false };
    let outcome = run_offline(&config, &mut without_joints, |_| {}).unwrap();
    assert!(outcome.report.is_none());
    assert_eq!(outcome.state, "waiting for joint angles: joint_1, joint_2, joint_3 not seen");
}
