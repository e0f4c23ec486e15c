//! Text that calls itself a path of `flexid compensate`.
//!
//! A refusal is one line; a place that is read has the angles of all driven joints, within their limits, and a bounded load.
#![no_main]

use std::path::Path;
use std::sync::LazyLock;

use flexid_pipeline::model::Model;
use flexid_pipeline::path;
use libfuzzer_sys::fuzz_target;

static MODEL: LazyLock<Model> = LazyLock::new(|| {
    let text = include_str!("../../../host-tools/scenario/mill3-model.toml");
    Model::parse(Path::new("model.toml"), text).unwrap()
});

fuzz_target!(|text: &str| {
    match path::parse(Path::new("path.csv"), text, &MODEL) {
        Ok(places) => {
            assert!(!places.is_empty());
            for place in places {
                assert_eq!(place.pose.len(), MODEL.driven().count());
                let limits = MODEL.driven().map(|joint| joint.limits);
                for (angle, [least, most]) in place.pose.iter().zip(limits) {
                    // An angle in degrees is rounded.
                    assert!((least - 1e-9..=most + 1e-9).contains(angle), "{angle}");
                }
                assert!(place.wrench.iter().all(|load| load.abs() <= 1e6));
                assert!((1..=1 + text.matches('\n').count()).contains(&place.line));
            }
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});
