//! Frames that are changed or missing.

use std::time::Duration;

use crossbeam_channel::bounded;
use embedded_can::StandardId;
use flexid_pipeline::config::Config;
use flexid_pipeline::source::{Arrival, Flow, Frame, FrameKind};
use flexid_pipeline::{Intake, Outcome, run_offline};
use flexid_wire::finding::Finding;
use flexid_wire::report::Acceptance;
use flexid_wire::state::State;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::frames::{RATE_HZ, Replay, block, frames};
use super::state::on_a_large_stack;
use super::{config, lines};

/// Returns the outcome of frames that have been changed by `spoil`.
fn spoilt(spoil: impl FnMut(Arrival) -> Arrival) -> Outcome {
    let config = config();
    let frames: Vec<_> =
        frames(&config, &[[0.0, -0.45, 0.95]], block).into_iter().map(spoil).collect();
    let mut source = Replay { frames: frames.into_iter(), breaks: false };
    run_offline(&config, &mut source, |_| {}, |_| {}).unwrap()
}

/// The frame with other data, if it is of this identifier.
fn change(arrival: Arrival, id: u16, change: impl FnOnce(&Frame) -> Frame) -> Arrival {
    let frame = arrival.frame().unwrap();
    let same = frame.id == StandardId::new(id).unwrap().into();
    Arrival::of_frame(arrival.time_s, if same { change(&frame) } else { frame })
}

fn with_counter(frame: &Frame, counter: impl FnOnce(u16) -> u16) -> Frame {
    let mut data: [u8; 8] = frame.data().try_into().unwrap();
    let old = u16::from_le_bytes([data[6], data[7]]);
    data[6..].copy_from_slice(&counter(old).to_le_bytes());
    Frame::new(frame.id, frame.kind, &data)
}

/// Frames are too short for as long as 20 records, and then are right.
#[test]
fn a_misfit_that_is_over_is_no_obstacle() {
    let config = config();
    let resting = Config { record_samples: 8000, ..config.clone() };
    let short = |arrival: Arrival| {
        let short = |frame: &Frame| Frame::new(frame.id, frame.kind, &frame.data()[1..]);
        let is_short = (0.25..3.25).contains(&(arrival.time_s - 1.0e9));
        if is_short { change(arrival, 0x101, short) } else { arrival }
    };
    let frames = frames(&resting, &[[0.0, -0.45, 0.95]], block).into_iter();
    let rest: Vec<_> = frames.take_while(|frame| frame.time_s < 1.0e9 + 4.0).map(short).collect();
    // At the end of a recording a record might come.
    let state = |frames: Vec<Arrival>| {
        let (config, (sender, found)) = (config.clone(), bounded(1));
        on_a_large_stack(move || {
            let mut intake = Intake::new(&config).unwrap();
            let mut source = Replay { frames: frames.into_iter(), breaks: false };
            while intake.read(&mut source, Duration::ZERO, |_| {}).unwrap() == Flow::Open {}
            sender.send(intake.state(&config)).unwrap();
        });
        found.recv().unwrap()
    };
    let during = state(rest[..rest.len() / 2].to_vec()).to_string();
    assert!(during.starts_with("frames 0x101 have 7 bytes"), "{during}");
    let after = state(rest);
    assert!(matches!(after, State::AwaitingRecord { .. }), "{after}");
}

#[test]
fn what_keeps_frames_from_becoming_records_is_named() {
    let cut = |frame: &Frame| Frame::new(frame.id, frame.kind, &frame.data()[1..]);
    let kind = |kind| move |frame: &Frame| Frame::new(frame.id, kind, frame.data());
    let start = 1.0e9;
    let states = [
        spoilt(|arrival| change(arrival, 0x101, cut)),
        spoilt(|arrival| change(arrival, 0x112, cut)),
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

/// Arrivals determine the rate: what is certain is used, what is not makes the fit no better than unsettled.
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
        let Finding { report, confidence, .. } = outcome.finding.expect("a finding");
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
        frames.retain(|arrival| arrival.frame().unwrap().id != third || arrival.time_s < first_s);
        let mut source = Replay { frames: frames.into_iter(), breaks: false };
        let outcome = run_offline(&config, &mut source, |_| {}, |_| {}).unwrap();
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
            100 | 101 => {
                change(arrival, 0x101, |frame| Frame::new(frame.id, frame.kind, &frame.data()[..7]))
            }
            900..=905 => change(arrival, 0x101, fx_at_its_limit),
            _ => arrival,
        }
    });
    assert_eq!((outcome.counts.clipped, outcome.counts.at_limit), (3, [3, 0, 0, 0, 0, 0]));
    let warnings = lines(&outcome.finding.expect("a finding").report);
    for warning in [
        "at the limit: Fx in 3 frames: widen the range of the sensor or the signal",
        "1 frame of another length than [bus] dbc says: frames 0x101 have 7 bytes, by [bus] dbc 8: mend the DBC file or the sender (1 so far)",
    ] {
        assert!(warnings.iter().any(|text| text == warning), "{warning}\n  is not in {warnings:?}");
    }
}
