//! Bytes that call themselves a bag of ROS, a MAT file, an MF4 or a TDMS.
//!
//! A refusal is one line. What is read has finite values, counters that go on, and times that do not go back.
#![no_main]

mod common;

use std::path::Path;

use common::{is_line, read_all};
use flexid_pipeline::input::Binary;
use flexid_pipeline::poses::Cut;
use flexid_pipeline::source::{Layout, TableLog, Topics, table};
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
    let cut = Cut { pose: vec![0.1, 0.2], ..Cut::default() };
    for (layout, poses) in [(layout, None), (without, Some(vec![cut]))] {
        match TableLog::open_binary(Path::new("log"), format, data, &layout, poses) {
            Ok(mut log) => {
                read_all(&mut log);
            }
            Err(error) => is_line(&error),
        }
    }
});
