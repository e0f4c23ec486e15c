//! What a log gives, of fuzz targets that read one: finite values, counters that go on, times that do not go back, and a refusal in one line.

use std::time::Duration;

use flexid_core::stream::Reading;
use flexid_pipeline::source::{Content, Flow, FrameSource, TableLog};

/// Panics unless an error is one line.
pub(crate) fn is_line(error: &impl ToString) {
    let error = error.to_string();
    assert!(!error.contains('\n'), "{error}");
}

/// Reads a log to its end, and panics where it gives what is wrong. Returns the number of readings.
pub(crate) fn read_all(log: &mut TableLog<'_>) -> usize {
    let mut arrivals = Vec::new();
    let end = loop {
        match log.read(&mut arrivals, Duration::ZERO) {
            Ok(Flow::Open) => {}
            end => break end,
        }
    };
    if let Err(error) = end {
        is_line(&error);
    }
    let mut newest: [Option<u32>; 2] = [None; 2];
    for arrival in &arrivals {
        let Content::Reading(reading) = arrival.content else { panic!("a frame") };
        match reading {
            Reading::Force { counter, value } | Reading::Acceleration { counter, value } => {
                let place = usize::from(matches!(reading, Reading::Acceleration { .. }));
                assert!(value.iter().all(|value| value.is_finite()));
                assert_ne!(newest[place].replace(counter), Some(counter));
            }
            Reading::Joint { value, .. } => assert!(value.is_finite()),
            Reading::Setup(_) => {}
        }
    }
    assert!(arrivals.windows(2).all(|pair| pair[0].time_s <= pair[1].time_s));
    arrivals.len()
}
