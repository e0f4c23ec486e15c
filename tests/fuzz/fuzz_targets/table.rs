//! Bytes that call themselves a table, and bytes that call themselves the poses of tables.
//!
//! A refusal is one line. What is read has finite values, counters that go on, and times that do not go back.
#![no_main]

mod common;

use std::path::Path;
use std::sync::LazyLock;

use common::{is_line, read_all};
use flexid_pipeline::model::Model;
use flexid_pipeline::poses::{self, Cut};
use flexid_pipeline::source::{Layout, TableLog, table};
use libfuzzer_sys::fuzz_target;

static MODEL: LazyLock<Model> = LazyLock::new(|| {
    let text = include_str!("../../../host-tools/scenario/mill3-model.toml");
    Model::parse(Path::new("model.toml"), text).unwrap()
});

/// The columns of the seeds, of a config that states no rate.
static LAYOUT: LazyLock<Layout> = LazyLock::new(|| Layout {
    axes: ["Fx", "Fy", "Fz", "ax", "ay", "az"].map(String::from),
    joints: vec![("q1".into(), false), ("q2".into(), true)],
    rate_hz: None,
    base: None,
    topics: None,
});

fuzz_target!(|data: &[u8]| {
    if let Ok(text) = str::from_utf8(data)
        && let Err(error) = poses::parse(Path::new("poses.csv"), text, &MODEL)
    {
        is_line(&error);
    }
    let _ = table::is_like(data);
    let without = Layout { joints: Vec::new(), rate_hz: Some(1000.0), ..LAYOUT.clone() };
    let of_base = Layout { base: Some(MODEL.chain().unwrap()), ..without.clone() };
    let cut = Cut { pose: vec![0.1, 0.2, 0.3], ..Cut::default() };
    let poses = vec![cut; 2];
    for (layout, poses) in
        [(&*LAYOUT, None), (&without, Some(poses.clone())), (&of_base, Some(poses))]
    {
        let has_names = table::has_names(data, layout);
        let mut log = match TableLog::open(Path::new("log"), data, layout, poses) {
            Ok(log) => log,
            Err(error) => {
                is_line(&error);
                continue;
            }
        };
        assert!(has_names);
        assert!(log.shown().rate_hz.is_none_or(|rate_hz| rate_hz > 0.0));
        let (readings, lines) = (read_all(&mut log), data.split(|&byte| byte == b'\n').count());
        assert!(readings <= 10 * lines, "{readings} of {lines} lines");
    }
});
