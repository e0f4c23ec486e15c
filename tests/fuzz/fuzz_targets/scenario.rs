//! Text that calls itself a scenario.
//!
//! A refusal is one line; a scenario that is read holds robots, poses and experiments that can be simulated.
#![no_main]

use std::path::Path;
use std::sync::LazyLock;

use flexid_pipeline::model::Model;
use flexid_simulation::scenario::Scenario;
use libfuzzer_sys::fuzz_target;

static MODEL: LazyLock<Model> = LazyLock::new(|| {
    let text = include_str!("../../../host-tools/scenario/mill3-model.toml");
    Model::parse(Path::new("mill3-model.toml"), text).unwrap()
});

fuzz_target!(|text: &str| {
    match Scenario::parse(Path::new("scenario.toml"), text, &MODEL) {
        Ok(scenario) => {
            assert_eq!(scenario.truth.len(), MODEL.joints.len());
            assert!(scenario.bounds.check().is_ok());
            assert!((256..=2_400_000).contains(&scenario.measurement.samples()));
            assert!(scenario.measurement.acceleration_noise().is_finite());
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});
