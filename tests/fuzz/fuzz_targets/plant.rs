//! Text that calls itself a plant.
//!
//! A refusal is one line; a plant that is read has finite joint angles, and a robot or a reason why it has none.
#![no_main]

use std::path::Path;
use std::sync::LazyLock;

use flexid_core::chain::Chain;
use flexid_core::mounting::Mounting;
use flexid_core::parameters::Bushing;
use flexid_pipeline::model::Model;
use flexid_simulation::plant::Plant;
use libfuzzer_sys::fuzz_target;

static MODEL: LazyLock<(Model, Chain)> = LazyLock::new(|| {
    let text = include_str!("../../../host-tools/scenario/mill3-model.toml");
    let model = Model::parse(Path::new("mill3-model.toml"), text).unwrap();
    let chain = model.chain().unwrap();
    (model, chain)
});

fuzz_target!(|text: &str| {
    let (model, chain) = &*MODEL;
    match Plant::parse(Path::new("plant.toml"), text, model) {
        Ok(plant) => {
            let pose = plant.true_pose(&[0.1, 0.2, 0.3], 4.0);
            assert!(pose.iter().all(|angle| angle.is_finite()));
            let bushing = Bushing { stiffness: [1e7; 6], damping: [1e4; 6] };
            if let Ok(robot) = plant.robot(chain, &pose, &[bushing; 3], &Mounting::AT_TCP) {
                assert_eq!(robot.bushings.len(), robot.chain.joints().len());
                assert!(robot.index.iter().all(|&joint| joint < robot.bushings.len()));
            }
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});
