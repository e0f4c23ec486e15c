//! Bytes that call themselves a universal file or a table of frequency responses.
//!
//! A refusal is one line. What is read has finite values, errors that are not negative, and is taken by core or refused by it.
#![no_main]

use std::path::Path;
use std::sync::LazyLock;

use flexid_core::chain::Chain;
use flexid_core::sensors::Accelerometer;
use flexid_core::spectrum::{Experiment, Measurement};
use flexid_pipeline::model::Model;
use flexid_pipeline::poses::Cut;
use flexid_pipeline::receptance::{self, Settings};
use libfuzzer_sys::fuzz_target;

static CHAIN: LazyLock<Chain> = LazyLock::new(|| {
    let text = include_str!("../../../host-tools/scenario/mill3-model.toml");
    Model::parse(Path::new("model.toml"), text).unwrap().chain().unwrap()
});

const MEASUREMENT: Measurement = Measurement {
    band_hz: [1.0, 100.0],
    gravity: [0.0; 3],
    accelerometer: Accelerometer::Inertial,
    mounting: flexid_core::mounting::Mounting::AT_TCP,
};

fuzz_target!(|data: &[u8]| {
    let settings = Settings {
        averages: Some(5.0),
        relative_floor: 0.01,
        axes: [(0, 1.0), (1, 1.0), (2, -1.0)],
        ..Settings::default()
    };
    let cut = Cut { pose: vec![0.1, 0.2, 0.3], ..Cut::default() };
    match receptance::parse(Path::new("a.uff"), data, &cut, &settings, MEASUREMENT.band_hz) {
        Ok(all) => {
            assert!(!all.is_empty());
            for own in &all {
                for bin in own.axes.iter().flatten() {
                    assert!(
                        bin.accelerance.iter().all(|part| part.is_finite()) && bin.variance > 0.0
                    );
                }
                let _ = Experiment::<256>::of_receptance(&CHAIN, &MEASUREMENT, &own.measured());
            }
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});
