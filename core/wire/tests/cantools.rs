//! The signal codec against cantools, an independent implementation of DBC.
//!
//! `cantools_vectors.py` wrote the vectors and says how to write them again.

use std::collections::BTreeSet;

use flexid_wire::bits::{ByteOrder, Number, Signal};
use serde::Deserialize;

#[derive(Deserialize)]
struct Vector {
    message: String,
    payload: String,
    encoded: String,
    signals: Vec<Row>,
}

#[derive(Deserialize)]
struct Row {
    name: String,
    start_bit: u16,
    length: u8,
    intel: bool,
    signed: bool,
    scale: f64,
    offset: f64,
    raw: i128,
    physical: f64,
    set: f64,
}

impl Row {
    fn signal(&self) -> Signal {
        Signal {
            start_bit: self.start_bit,
            length: self.length,
            byte_order: if self.intel { ByteOrder::Intel } else { ByteOrder::Motorola },
            number: if self.signed { Number::Signed } else { Number::Unsigned },
            scale: self.scale,
            offset: self.offset,
        }
    }
}

fn vectors() -> Vec<Vector> {
    include_str!("cantools_vectors.jsonl")
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

fn bytes(hexadecimal: &str) -> Vec<u8> {
    (0..hexadecimal.len() / 2)
        .map(|i| u8::from_str_radix(&hexadecimal[2 * i..2 * i + 2], 16).unwrap())
        .collect()
}

#[test]
fn reads_what_cantools_reads() {
    for vector in vectors() {
        let payload = bytes(&vector.payload);
        for row in &vector.signals {
            let place = format!("{} {} in {}", vector.message, row.name, vector.payload);
            assert_eq!(row.signal().decode_raw(&payload), Ok(row.raw), "{place}");
            let physical = row.signal().decode(&payload).unwrap();
            let error = (physical - row.physical).abs();
            assert!(error <= 1e-12 * row.physical.abs(), "{place}: {physical}, {}", row.physical);
        }
    }
}

#[test]
fn writes_what_cantools_writes() {
    for vector in vectors() {
        let mut payload = vec![0; vector.encoded.len() / 2];
        for row in &vector.signals {
            row.signal().encode(row.set, &mut payload).unwrap();
        }
        assert_eq!(payload, bytes(&vector.encoded), "{}", vector.message);
    }
}

/// The vectors reach what they are there for.
#[test]
fn the_vectors_cover_the_layouts() {
    let vectors = vectors();
    for message in ["FORCE", "ACCELERATION", "JOINT_1", "JOINT_2", "JOINT_3"] {
        assert!(vectors.iter().any(|vector| vector.message == message), "{message}");
    }
    let random = vectors.iter().filter(|vector| vector.message.starts_with("random"));
    let layouts: BTreeSet<_> = random
        .flat_map(|vector| &vector.signals)
        .map(|row| (row.intel, row.signed, row.length))
        .collect();
    assert_eq!(layouts.len(), 2 * 2 * 64);
}
