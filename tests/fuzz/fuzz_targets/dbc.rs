//! Bytes that call themselves a DBC file.
//!
//! A refusal is one line. A table that is made of them decodes any frame, and what it encodes it decodes.
#![no_main]

use std::path::Path;
use std::sync::LazyLock;

use flexid_core::stream::Reading;
use flexid_pipeline::config::SignalsSection;
use flexid_pipeline::model::Model;
use flexid_pipeline::signals::{Decoder, SignalTable};
use flexid_pipeline::source::{Frame, FrameKind};
use libfuzzer_sys::fuzz_target;

static MODEL: LazyLock<Model> = LazyLock::new(|| {
    let text = include_str!("../../../host-tools/scenario/mill3-model.toml");
    Model::parse(Path::new("model.toml"), text).unwrap()
});

/// The names in the scenario's `mill3-edge.toml`.
static NAMES: LazyLock<SignalsSection> = LazyLock::new(|| SignalsSection {
    force: ["Fx", "Fy", "Fz"].map(String::from).into(),
    force_counter: Some("ForceCounter".into()),
    acceleration: ["ax", "ay", "az"].map(String::from).into(),
    acceleration_counter: Some("AccelerationCounter".into()),
    joints: Some(["q1", "q2", "q3"].map(String::from).into()),
    ..SignalsSection::default()
});

fuzz_target!(|data: &[u8]| {
    let (config, file) = (Path::new("edge.toml"), Path::new("robot.dbc"));
    let table = match SignalTable::parse(config, file, data.to_vec(), &NAMES, &MODEL) {
        Ok(table) => table,
        Err(error) => {
            let error = error.to_string();
            assert!(!error.contains('\n'), "{error}");
            assert!(
                error.starts_with("edge.toml: ") || error.starts_with("robot.dbc: "),
                "{error}"
            );
            return;
        }
    };
    assert!(table.force_resolution > 0.0 && table.acceleration_resolution > 0.0);
    let mask = (1_u64 << table.counter_bits) - 1;
    let force = Reading::Force { counter: u32::MAX, value: [1.0, -2.0, 1e30] };
    let acceleration = Reading::Acceleration { counter: 5, value: [0.0, -1e30, 9.0] };
    let joints = (0..3).map(|index| Reading::Joint { index, value: 0.1 });
    let mut decoder = Decoder::new(&table);
    for reading in [force, acceleration].into_iter().chain(joints) {
        let frames = table.encode(&[reading]).unwrap();
        // Some tens of samples show the order of several frames.
        let samples = if frames.len() == 1 { 1 } else { 80 };
        let mut found = 0;
        for (at, frame) in (0..samples).flat_map(|_| &frames).enumerate() {
            let time_s = (at / frames.len()) as f64 + 0.01 * (at % frames.len()) as f64;
            let note = |read| found += u32::from(is_of(read, reading, mask));
            decoder.decode(time_s, frame, note).unwrap();
        }
        assert!((1..=samples).contains(&found), "{reading:?}");
        for size in 0..=8 {
            let tail = &data[data.len().saturating_sub(size)..];
            let _ = decoder.decode(0.0, &Frame::new(frames[0].id, FrameKind::Data, tail), |_| {});
        }
    }
});

/// Returns whether it is the same signal's, and of the same instant.
fn is_of(read: Reading, sent: Reading, mask: u64) -> bool {
    let same = |read: u32, sent: u32| u64::from(read) == u64::from(sent) & mask;
    match (read, sent) {
        (Reading::Force { counter, .. }, Reading::Force { counter: sent, .. })
        | (Reading::Acceleration { counter, .. }, Reading::Acceleration { counter: sent, .. }) => {
            same(counter, sent)
        }
        (Reading::Joint { index, .. }, Reading::Joint { index: sent, .. }) => index == sent,
        _ => false,
    }
}
