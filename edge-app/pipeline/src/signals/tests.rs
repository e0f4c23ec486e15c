//! Frames to readings and back.

use std::path::Path;

use super::*;
use crate::config::Config;

fn mill3() -> SignalTable {
    let file =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-tools/scenario/mill3-edge.toml");
    Config::load(&file).unwrap().signals
}

/// The table of the reference scenario's files, with some lines of `mill3-edge.toml` in another form.
fn of(changes: &[(&str, &str)]) -> SignalTable {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../host-tools/scenario");
    let file = folder.join("mill3-edge.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let text = changes.iter().fold(text, |text, (from, to)| text.replace(from, to));
    Config::parse(&file, &text).unwrap().signals
}

fn standard(id: u16) -> Id {
    embedded_can::StandardId::new(id).unwrap().into()
}

fn decode(table: &SignalTable, frame: &Frame) -> Result<Vec<Reading>, NoReading> {
    let mut readings = Vec::new();
    Decoder::new(table).decode(0.0, frame, |reading| readings.push(reading)).map(|_| readings)
}

#[test]
fn reads_the_frames_of_the_reference_layout() {
    let table = mill3();
    assert_eq!((table.counter_bits, table.force_resolution), (16, 0.1));
    let frame = |id, data: &[u8]| Frame::new(standard(id), FrameKind::Data, data);
    let force = frame(0x101, &[0x03, 0, 0, 0, 0xFE, 0xFF, 0xFE, 0x0E]);
    let value = [0.3, 0.0, -0.2].map(|value: f64| value as f32);
    assert_eq!(decode(&table, &force), Ok(vec![Reading::Force { counter: 0x0EFE, value }]));
    let joint = frame(0x112, &[0x30, 0x22, 0xF9, 0xFF, 0x38, 0xF6]);
    assert_eq!(
        decode(&table, &joint),
        Ok(vec![Reading::Joint { index: 1, value: -450_000.0 * 1e-6 }])
    );
}

#[test]
fn a_sensor_counts_by_its_own_counter_or_its_samples_are_numbered() {
    let table = of(&[("force_counter = \"ForceCounter\"", "")]);
    assert_eq!((table.clocks, table.counter_bits), (Clocks::Own([None, Some(16)]), 32));
    assert_eq!([0, 1].map(|sensor| table.last_counter(sensor)), [u32::MAX, 0xFFFF]);
    let mut decoder = Decoder::new(&table);
    let mut counters = Vec::new();
    for count in [65_534, 7, 8] {
        let value = [1.0; 3];
        let force = Reading::Force { counter: count, value };
        let acceleration = Reading::Acceleration { counter: count, value };
        for frame in table.encode(&[force, force, acceleration]).unwrap() {
            let note = |reading| match reading {
                Reading::Force { counter, .. } => counters.push((0, counter)),
                Reading::Acceleration { counter, .. } => counters.push((1, counter)),
                _ => {}
            };
            decoder.decode(0.0, &frame, note).unwrap();
        }
    }
    assert_eq!(counters, [(0, 0), (1, 65_534), (0, 1), (1, 7), (0, 2), (1, 8)]);

    assert_eq!(
        of(&[("[signals]", "[signals]\nclocks = \"own\"")]).clocks,
        Clocks::Own([Some(16); 2])
    );
    assert_ne!(
        of(&[]).described(),
        of(&[("[signals]", "[signals]\nclocks = \"own\"")]).described()
    );
}

#[test]
fn identifiers_name_what_they_carry() {
    let table = mill3();
    let names: Vec<_> = table.identifiers().into_iter().map(|id| table.names(id)).collect();
    let [q1, q2, q3] = [vec!["q1"], vec!["q2"], vec!["q3"]];
    assert_eq!(names, [vec!["Fx", "Fy", "Fz"], vec!["ax", "ay", "az"], q1, q2, q3]);
    let sampled = [0x101, 0x102, 0x111, 0x100].map(|id| table.is_sampled(standard(id)));
    assert_eq!(sampled, [true, true, false, false]);
    assert!(table.names(standard(0x100)).is_empty() && table.other_angles.is_empty());
}

#[test]
fn what_is_encoded_is_decoded() {
    let table = mill3();
    let readings = [
        Reading::Force { counter: 65_535, value: [1.5, -2.0, 3276.7] },
        Reading::Acceleration { counter: 65_536, value: [0.002, -65.536, 0.0] },
        Reading::Joint { index: 0, value: 1.25 },
        Reading::Joint { index: 2, value: -0.000_001 },
    ];
    let frames = table.encode(&readings).unwrap();
    assert_eq!(frames.len(), 4);
    let read: Vec<_> = frames.iter().flat_map(|frame| decode(&table, frame).unwrap()).collect();
    assert_eq!((read[0], read[2], read[3]), (readings[0], readings[2], readings[3]));
    let wrapped = Reading::Acceleration { counter: 0, value: [0.002, -65.536, 0.0] };
    assert_eq!(read[1], wrapped);
    assert!(table.encode(&[Reading::Joint { index: 0, value: f64::NAN }]).is_err());
}

#[test]
fn values_at_the_limit_of_their_signal_are_marked() {
    let table = mill3();
    assert_eq!(table.axes, ["Fx", "Fy", "Fz", "ax", "ay", "az"]);
    let limits = |reading| {
        let frames = table.encode(&[reading]).unwrap();
        Decoder::new(&table).decode(0.0, &frames[0], |_| {}).unwrap()
    };
    let (t, f) = (true, false);
    let force = Reading::Force { counter: 65_535, value: [5000.0, 3276.6, -5000.0] };
    assert_eq!(limits(force), [t, f, t, f, f, f]);
    let acceleration = Reading::Acceleration { counter: 0, value: [0.0, 0.0, -65.536] };
    assert_eq!(limits(acceleration), [f, f, f, f, f, t]);
    assert_eq!(limits(Reading::Joint { index: 0, value: 1e9 }), [f; 6]);
}

#[test]
fn says_why_a_frame_gives_no_reading() {
    let table = mill3();
    let extended = embedded_can::ExtendedId::new(0x101).unwrap().into();
    let cases = [
        (standard(0x101), FrameKind::Data, 7, NoReading::WrongLength { expected: 8 }),
        (standard(0x111), FrameKind::Data, 8, NoReading::WrongLength { expected: 6 }),
        (standard(0x100), FrameKind::Data, 8, NoReading::UnknownId),
        (extended, FrameKind::Data, 8, NoReading::UnknownId),
        (extended, FrameKind::Error, 8, NoReading::ErrorFrame),
        (standard(0x101), FrameKind::Remote, 0, NoReading::NotData),
        (standard(0x101), FrameKind::Data, 0, NoReading::NotData),
        (standard(0x101), FrameKind::Data, 12, NoReading::WrongLength { expected: 8 }),
    ];
    for (id, kind, length, reason) in cases {
        let frame = Frame::new(id, kind, &[0; 12][..length]);
        assert_eq!(decode(&table, &frame), Err(reason), "{frame:?}");
    }
}
