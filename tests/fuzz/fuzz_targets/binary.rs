//! Bytes that call themselves a bag of ROS, a MAT file, an MF4 or a TDMS.
//!
//! A refusal is one line. What is read has finite values, counters that go on, and times that do not go back.
#![no_main]

use std::path::Path;
use std::time::Duration;

use flexid_core::stream::Reading;
use flexid_pipeline::input::Binary;
use flexid_pipeline::poses::Cut;
use flexid_pipeline::source::{Content, Flow, FrameSource, Layout, TableLog, Topics, table};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Some(format) = Binary::of(data).filter(|format| table::is_read(*format)) else { return };
    let topics = Topics {
        wrench: "/ft/wrench".into(),
        acceleration: "/imu".into(),
        joints: Some("/joint_states".into()),
    };
    let is_bag = format == Binary::Mcap;
    let joints = if is_bag { ["joint_1", "joint_2"] } else { ["q(1)", "q(2)"] };
    let layout = Layout {
        axes: ["Fx", "Fy", "Fz", "ax", "ay", "az"].map(String::from),
        joints: joints.map(|name| (name.to_owned(), false)).into(),
        rate_hz: None,
        base: None,
        topics: Some(topics),
    };
    let without = Layout { joints: Vec::new(), rate_hz: Some(1000.0), ..layout.clone() };
    let is_line = |error: &str| assert!(!error.contains('\n'), "{error}");
    let cut = Cut { pose: vec![0.1, 0.2], ..Cut::default() };
    for (layout, poses) in [(layout, None), (without, Some(vec![cut]))] {
        let mut log = match TableLog::open_binary(Path::new("log"), format, data, &layout, poses) {
            Ok(log) => log,
            Err(error) => {
                is_line(&error.to_string());
                continue;
            }
        };
        let mut arrivals = Vec::new();
        let end = loop {
            match log.read(&mut arrivals, Duration::ZERO) {
                Ok(Flow::Open) => {}
                end => break end,
            }
        };
        if let Err(error) = end {
            is_line(&error.to_string());
        }
        let mut newest: [Option<u32>; 2] = [None; 2];
        for arrival in &arrivals {
            let Content::Reading(reading) = arrival.content else { panic!("a frame") };
            match reading {
                Reading::Force { counter, value } | Reading::Acceleration { counter, value } => {
                    let place = usize::from(matches!(reading, Reading::Acceleration { .. }));
                    assert_ne!(newest[place].replace(counter), Some(counter));
                    assert!(value.iter().all(|value| value.is_finite()));
                }
                Reading::Joint { value, .. } => assert!(value.is_finite()),
                _ => {}
            }
        }
        assert!(arrivals.windows(2).all(|pair| pair[0].time_s <= pair[1].time_s));
    }
});
