//! The readings of tables, for tests of tables in text and in other files.

use std::time::Duration;

use flexid_core::stream::Reading;
use flexid_pipeline::source::{Arrival, Content, Flow, FrameSource, Layout, TableLog};

/// Columns of force and acceleration, and of these joints.
pub(crate) fn layout(rate_hz: Option<f64>, joints: &[&str]) -> Layout {
    let axes = ["Fx", "Fy", "Fz", "ax", "ay", "az"].map(str::to_owned);
    let joints = joints.iter().map(|name| (name.to_string(), false)).collect();
    Layout { axes, joints, rate_hz, base: None, topics: None }
}

/// Everything that comes of a table, and the error behind it.
pub(crate) fn all(mut table: TableLog<'_>) -> (Vec<Arrival>, Option<String>) {
    let mut batch = Vec::new();
    loop {
        match table.read(&mut batch, Duration::ZERO) {
            Ok(Flow::Open) => {}
            Ok(Flow::Ended) => return (batch, None),
            Err(error) => return (batch, Some(error.to_string())),
        }
    }
}

fn readings<T>(arrivals: &[Arrival], of: impl Fn(f64, Reading) -> Option<T>) -> Vec<T> {
    let own = |arrival: &Arrival| match arrival.content {
        Content::Reading(reading) => of(arrival.time_s, reading),
        Content::Frame(_) => panic!("a frame"),
    };
    arrivals.iter().filter_map(own).collect()
}

/// Counters and forces, N.
pub(crate) fn forces(arrivals: &[Arrival]) -> Vec<(u32, [f32; 3])> {
    readings(arrivals, |_, reading| match reading {
        Reading::Force { counter, value } => Some((counter, value)),
        _ => None,
    })
}

/// Accelerations, m/s².
pub(crate) fn accelerations(arrivals: &[Arrival]) -> Vec<[f32; 3]> {
    readings(arrivals, |_, reading| match reading {
        Reading::Acceleration { value, .. } => Some(value),
        _ => None,
    })
}

/// Times, s, and angles, rad (m), of a joint.
pub(crate) fn angles(arrivals: &[Arrival], joint: u8) -> Vec<(f64, f64)> {
    readings(arrivals, |time_s, reading| match reading {
        Reading::Joint { index, value } if index == joint => Some((time_s, value)),
        _ => None,
    })
}
