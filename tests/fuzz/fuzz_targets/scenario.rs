//! Text that calls itself a scenario, or a file of experiments alone.
//!
//! A refusal is one line; a scenario that is read holds robots, poses and experiments that can be simulated, and the same experiments are read alone.
#![no_main]

use std::path::Path;
use std::sync::LazyLock;

use flexid_pipeline::model::Model;
use flexid_simulation::scenario::{Sampling, Scenario, parse_experiments};
use libfuzzer_sys::fuzz_target;

static MODEL: LazyLock<Model> = LazyLock::new(|| {
    let text = include_str!("../../../host-tools/scenario/mill3-model.toml");
    Model::parse(Path::new("mill3-model.toml"), text).unwrap()
});

static SAMPLING: LazyLock<Sampling> = LazyLock::new(|| {
    let text = include_str!("../../../host-tools/scenario/mill3.toml");
    Scenario::parse(Path::new("mill3.toml"), text, &MODEL).unwrap().measurement
});

fuzz_target!(|text: &str| {
    let file = Path::new("scenario.toml");
    if let Err(error) = parse_experiments(file, text, &MODEL, &SAMPLING) {
        assert!(!error.to_string().contains('\n'), "{error}");
    }
    match Scenario::parse(file, text, &MODEL) {
        Ok(scenario) => {
            let alone = parse_experiments(file, text, &MODEL, &scenario.measurement);
            assert_eq!(alone.ok(), Some(scenario.experiments));
            assert_eq!(scenario.truth.len(), MODEL.joints.len());
            assert!(scenario.bounds.check().is_ok());
            assert!((256..=2_400_000).contains(&scenario.measurement.samples()));
            assert!(scenario.measurement.acceleration_noise().is_finite());
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});
