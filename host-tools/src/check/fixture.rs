//! Surveys for tests, made by hand.

use std::path::Path;

use flexid_core::imperfection::Accuracies;
use flexid_pipeline::check::{
    Examined, Excitation, Identifier, Octave, Station, Survey, Traffic, Travel,
};
use flexid_pipeline::config::Config;
use flexid_pipeline::intake::Counts;
use flexid_pipeline::signals::OtherAngle;
use flexid_wire::misfits::FrameId;
use flexid_wire::state::State;

/// The configuration of the reference scenario, of a plant that may be off as is typical.
pub(super) fn config() -> Config {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenario/mill3-edge.toml");
    let accuracies = Accuracies::typical();
    Config { accuracies, assumes_perfect: false, ..Config::load(&file).unwrap() }
}

/// A signal in a unit of angles that the configuration does not name.
pub(super) fn other_angle((name, id): (&str, u16)) -> OtherAngle {
    OtherAngle { name: name.to_owned(), id: FrameId::Standard(id) }
}

/// An identifier whose frames came at 2 kHz.
pub(super) fn identifier(id: u16, signals: &[&str], frames: u64) -> Identifier {
    let intervals = frames.saturating_sub(1);
    Identifier {
        id: Some(FrameId::Standard(id)),
        signals: signals.iter().map(|&name| name.to_owned()).collect(),
        is_sampled: id <= 0x102,
        traffic: Traffic {
            frames,
            intervals,
            seconds: intervals as f64 / 2000.0,
            newest_s: intervals as f64 / 2000.0,
            silences: 0,
            again: 0,
        },
    }
}

/// A full record at a pose of its own, with rest before its cut and force all over the band.
pub(super) fn record(number: u64) -> Examined {
    let octave = |from_hz: f64| Octave { band_hz: [from_hz, 2.0 * from_hz], bins: 40, clear: 40 };
    Examined {
        number,
        start_s: 5.0 * number as f64,
        seconds: 4.096,
        rate_hz: 2000.0,
        has_doubtful_rate: false,
        pose: vec![0.1 * number as f64, -0.4, 0.9],
        pose_number: Some(number),
        travel: None,
        repeats: None,
        quiet_samples: 384,
        quiet_s: 0.192,
        starts_at_rest: true,
        excitation: Ok(Excitation {
            rms_force_n: 150.0,
            octaves: [2.0, 4.0, 8.0].map(octave).into(),
        }),
        blows: None,
    }
}

/// The motion of a record along a path: 10 mm/s, and 0.01 rad/s of the first joint, from this place on, m.
fn travel(from_m: f64) -> Travel {
    let (parts, part_s) = (8, 0.512);
    let station = |part: usize| {
        let seconds = (part as f64 + 0.5) * part_s;
        let moves = 0.01 * part_s;
        let pose = vec![from_m + 0.01 * seconds, -0.4, 0.9];
        Station { pose, tool_m: [from_m + 0.01 * seconds, 0.0, 0.0].into(), moves, is_even: true }
    };
    Travel { path: 1, parts: (0..parts).map(station).collect(), part_s }
}

/// A survey of three records along a path.
pub(super) fn feeding() -> Survey {
    let mut survey = good();
    for (number, record) in survey.records.iter_mut().enumerate() {
        record.pose_number = None;
        record.travel = Some(travel(number as f64 * 0.04096));
    }
    survey
}

/// A survey without a record.
pub(super) fn empty() -> Survey {
    Survey {
        clocks: None,
        counts: Counts::default(),
        state: State::AwaitingRecord { seconds: 4.096, faint_force_n: None, implausible: None },
        expected: Vec::new(),
        unexpected: Vec::new(),
        records: Vec::new(),
        shown: None,
        knowledge: None,
        obstacle: None,
        implausible: Vec::new(),
        at_limit: None,
        at_rest: None,
        faint_force_n: None,
        scale: None,
        axes: None,
        rate: None,
        elsewhere: Vec::new(),
        began_s: 0.0,
        silent: Vec::new(),
        troubles: Vec::new(),
        broken: None,
    }
}

/// A survey of three records without a fault.
pub(super) fn good() -> Survey {
    let mut survey = empty();
    survey.state = State::Measuring { implausible: None };
    survey.expected = [
        (0x101, &["Fx", "Fy", "Fz"][..], 24_576),
        (0x102, &["ax", "ay", "az"], 24_576),
        (0x111, &["q1"], 123),
        (0x112, &["q2"], 123),
        (0x113, &["q3"], 123),
    ]
    .map(|(id, signals, frames)| identifier(id, signals, frames))
    .into();
    survey.records = (1..=3).map(record).collect();
    survey.counts.stream.records = 3;
    survey.counts.stream.frames = 49_152;
    survey.counts.all = 49_521;
    survey
}
